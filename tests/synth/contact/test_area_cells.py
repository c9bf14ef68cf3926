"""How far z of a finger over an area is from that of smaller cells: docs/scene.md tells it, and no plan counts it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from synth.contact.scene_contact import contact_of
from synth.scene.scene import parse_scene

PLACES = 24
SCENES: dict[str, tuple[dict[str, Any], float, float]] = {
    "lattice": ({"period": "1.7 mm", "row_distance": "1.3 mm", "dot_diameter": "0.7 mm"}, 0.0, 0.4),
    "turned": ({"period": "2.9 mm", "row_distance": "2.1 mm", "dot_diameter": "1.4 mm"}, 1.2, 0.2),
    "dimples": (
        {"period": "2.3 mm", "row_distance": "1.9 mm", "dot_diameter": "1 mm", "dot_height": "-50 um"},
        0.7,
        0.6,
    ),
}
"""Dots, the direction of the finger (rad), and the load (N)."""
MOST = {"fingertip": 3e-3, "comb": 3e-2}


@pytest.mark.parametrize("kind", MOST)
@pytest.mark.parametrize("name", SCENES)
def test_cells_half_as_large_change_z_little(kind: str, name: str) -> None:
    dots, direction, load = SCENES[name]
    finger, scan = {"kind": kind, "contact_length": "3.7 mm"}, {"direction": direction, "load": load}
    scene = parse_scene({"finger": finger, "texture": {"kind": "dots", **dots}, "scan": scan})
    phases, loads = np.arange(PLACES) / PLACES, np.full(PLACES, load)
    coarse, fine = (contact_of(scene, None, coarser).heights(phases, loads) for coarser in (1.0, 0.5))
    change = coarse - fine
    found = float(np.max(np.abs(change - np.mean(change))) / np.ptp(fine))
    assert found <= MOST[kind]
