"""Many heights of one phase at once, against one height each, for every solver."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from synth.contact.scene_contact import contact_of
from synth.scene.scene import parse_scene

DOTS = {"kind": "dots", "period": "2 mm", "dot_height": "0.4 mm", "dot_diameter": "0.7 mm", "dot_top": "0.5 mm"}
GRATING = {"kind": "grating", "period": "1 mm", "height": "50 um", "duty": 0.5, "ramp": "0.1 mm"}
SCENES: list[dict[str, Any]] = [
    {},
    {"texture": GRATING},
    {"finger": {"kind": "fingertip"}, "texture": GRATING},
    {"finger": {"kind": "probe"}},
    {"finger": {"kind": "fingertip"}, "texture": DOTS},
]


@pytest.mark.parametrize("document", SCENES)
def test_many_heights_of_a_phase_are_measured_as_one_each(document: dict[str, Any]) -> None:
    contact = contact_of(parse_scene(document))
    phases = np.random.default_rng(5).random(7)
    z, _slope = contact.approach(phases, 0.3)
    heights = z[:, np.newaxis] + np.linspace(-60e-6, 60e-6, 9)
    measured = contact.measure(phases, heights, 0.3)
    for level in range(9):
        for found, one in zip(measured, contact.measure(phases, heights[:, level].copy(), 0.3), strict=True):
            assert np.array_equal(found[:, level], one)
    ordered = contact.measure(phases, np.asfortranarray(heights), 0.3)
    assert np.array_equal(ordered[0], measured[0])


@pytest.mark.parametrize("document", SCENES)
def test_the_depth_at_the_approach_is_the_indentation(document: dict[str, Any]) -> None:
    contact = contact_of(parse_scene(document))
    phases = np.arange(5) / 5
    z, _slope = contact.approach(phases, 0.3)
    depth, _touching = contact.measure(phases, np.stack([z, z], axis=1), 0.3)
    assert depth == pytest.approx(contact.indentation(0.3), rel=1e-6)
