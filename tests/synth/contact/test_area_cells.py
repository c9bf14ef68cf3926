"""The error of the cells of a finger over an area: files tell it, and make the cells smaller until they keep it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from synth.contact import area_contact
from synth.contact.area_contact import CombOnArea, beside_edge
from synth.contact.area_path import coarsened
from synth.contact.fingertip import FingertipContact
from synth.contact.scene_contact import contact_of
from synth.plan import contact_choice, own_motion
from synth.plan.prepare import prepare
from synth.response.demand import Demand, curves, harmonics_of, points_for
from synth.response.spectrum import solve_spectrum
from synth.response.table_error import QUANTITIES
from synth.response.table_making import TableBounds, refined_making
from synth.response_cache import ResponseCache
from synth.scene.scene import Scene, parse_scene
from tests.few import thorough

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
CLOSE = {"period": "1.3 mm", "row_distance": "1.3 mm", "dot_diameter": "0.5 mm"}
HIGHEST = 10  # harmonics
ORDERS = (0, 1, 2)
MOST = {"fingertip": 3e-3, "comb": 1e-2}


def scene_of(kind: str, name: str) -> tuple[Scene, float]:
    """Return a scene of dots and its load (N)."""
    dots, direction, load = SCENES[name]
    finger, scan = {"kind": kind, "contact_length": "3.7 mm"}, {"direction": direction, "load": load}
    return parse_scene({"finger": finger, "texture": {"kind": "dots", **dots}, "scan": scan}), load


def random_scene(kind: str, seed: int) -> tuple[Scene, float]:
    """Return a random scene of dots and its load (N)."""
    random = np.random.default_rng([41, seed])
    period, rows = random.uniform(1e-3, 3e-3, 2).tolist()
    height = float(random.choice([-1.0, 1.0]) * random.uniform(15e-6, 60e-6))
    sizes = {"dot_diameter": float(random.uniform(0.5, 0.9)) * min(period, rows), "dot_height": height}
    load = float(10.0 ** random.uniform(-1.3, 0.3))
    finger = {"kind": kind, "contact_length": float(random.uniform(2e-3, 4e-3))}
    scan = {"direction": float(random.uniform(-3.0, 3.0)), "y": float(random.uniform(-1e-3, 1e-3)), "load": load}
    texture = {"kind": "dots", "period": period, "row_distance": rows, **sizes}
    return parse_scene({"finger": finger, "texture": texture, "scan": scan}), load


def check_series(scene: Scene, load: float, tolerance: float, smallest: float) -> None:
    """Compare the series of a file with that of cells of the size `smallest`."""
    found = solve_spectrum(contact_of(scene, refines=True), load, Demand(HIGHEST, ORDERS, tolerance))
    phases = np.arange(found.phases) / found.phases
    exact = harmonics_of(contact_of(scene, coarser=smallest).approach(phases, load)[0], HIGHEST)
    points = points_for(HIGHEST)
    for order, told in zip(ORDERS, found.errors, strict=True):
        gap, moved = (curves(one, order, points) for one in (found.harmonics - exact, exact))
        assert np.max(np.abs(gap)) <= told * np.ptp(moved)
        assert told <= tolerance


@pytest.mark.parametrize(
    ("kind", "name"),
    [
        ("fingertip", "lattice"),
        ("comb", "turned"),
        *(thorough(*pair) for pair in [("fingertip", "turned"), ("comb", "lattice")]),
        *(thorough(kind, "dimples") for kind in MOST),
    ],
)
def test_a_file_keeps_its_tolerance_and_its_told_error(kind: str, name: str) -> None:
    check_series(*scene_of(kind, name), 1e-2, 0.125)


@pytest.mark.parametrize("kind", MOST)
@pytest.mark.parametrize("seed", [thorough(seed) for seed in range(4)])
def test_random_files_keep_their_tolerance_and_their_told_error(kind: str, seed: int) -> None:
    check_series(*random_scene(kind, seed), 1e-2, 0.125)


@pytest.mark.parametrize("kind", MOST)
@pytest.mark.parametrize("name", SCENES)
def test_cells_half_as_large_change_z_little(kind: str, name: str) -> None:
    scene, load = scene_of(kind, name)
    contact = contact_of(scene)
    assert isinstance(contact, FingertipContact | CombOnArea)
    smaller, phases = contact.halved(), np.arange(24) / 24
    assert smaller is not None
    coarse, fine = (one.heights(phases, np.full(24, load)) for one in (contact, smaller))
    change = coarse - fine
    found = float(np.max(np.abs(change - np.mean(change))) / np.ptp(fine))
    assert found <= MOST[kind]


@pytest.mark.parametrize(
    ("length", "dots", "band", "coarser"), [("2.3 mm", {}, {}, 0.25), ("12.3 mm", CLOSE, {"bandwidth": 500}, 1.0)]
)
def test_a_file_along_a_path_tells_the_error_of_its_cells(
    length: str, dots: dict[str, str], band: dict[str, float], coarser: float
) -> None:
    """On a small finger the cells become smaller. Those of a large one are too many."""
    path = [[0.05 * n, 4e-3 * n, 1e-3 * n, 0.0, 0.3] for n in range(5)]
    scan, finger = {"trajectory": path}, {"contact_length": length}
    scene = {"finger": finger, "texture": {"kind": "dots", **dots}, "scan": scan, "accuracy": {"tolerance": 0.03}}
    solved = prepare(parse_scene({**scene, "output": {"sample_rate": 8000, **band}}), ResponseCache())
    assert solved.frames is not None and isinstance(solved.contact, CombOnArea)
    error = max(solved.frames.errors)
    assert solved.contact.coarser == coarser
    assert error <= 0.03 if coarser < 1.0 else 0.01 < error < 0.3


@pytest.mark.parametrize("kind", MOST)
@pytest.mark.parametrize("seed", [2, *(thorough(seed) for seed in (0, 1, 3, 4, 5, 6, 7, 20))])
def test_a_stream_along_a_line_tells_the_error_of_its_cells(kind: str, seed: int) -> None:
    """Its cells are those of a hand; cells twice as large tell 1.1 to 12 times their error."""
    assert min(told_and_found(random_scene(kind, seed)[0], paced=True)) >= 0.05


@pytest.mark.parametrize("paced", [False, True])
@pytest.mark.parametrize("kind", MOST)
@pytest.mark.parametrize("seed", [2, *(thorough(seed) for seed in range(3, 7))])
def test_cells_that_cannot_be_halved_tell_their_error(
    kind: str, seed: int, paced: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Those of a large surface: their error is the change from cells twice as large."""
    monkeypatch.setattr(area_contact, "MOST_SMALLER", 0)
    assert min(told_and_found(random_scene(kind, seed)[0], paced)) >= 0.03


def test_a_table_counts_cells_that_cannot_be_halved(monkeypatch: pytest.MonkeyPatch) -> None:
    scene, bounds = random_scene("comb", 2)[0], TableBounds(harmonics=HIGHEST)
    halved = refined_making(contact_of(scene), bounds, 2.0).discrete
    monkeypatch.setattr(area_contact, "MOST_SMALLER", 0)
    doubled = refined_making(contact_of(scene), bounds, 2.0).discrete
    assert np.all(halved > 0.0) and np.all(doubled >= halved) and np.all(doubled < 12.0 * halved)


def told_and_found(scene: Scene, paced: bool) -> list[float]:
    """Return the error of each quantity against cells a quarter as large, over the one that is told, at most 1."""
    scene = parse_scene(scene.model_dump(exclude_unset=True) | {"output": {"channels": list(QUANTITIES)}})
    solved = prepare(scene, ResponseCache(), paced=paced)
    assert solved.spectrum is not None and not solved.moving
    kept, phases = solved.highest + 1, np.arange(solved.spectrum.phases) / solved.spectrum.phases
    exact = harmonics_of(contact_of(scene, coarser=0.25).approach(phases, scene.scan.load)[0], solved.highest)
    parts = []
    for channel in solved.channels:
        both = solved.spectrum.harmonics[:kept] - exact[:kept], exact[:kept]
        gap, moved = (curves(one, channel.order, points_for(solved.highest)) for one in both)
        parts.append(float(np.max(np.abs(gap)) / np.ptp(moved) / channel.error))
    assert max(parts) <= 1.0
    return parts


def test_the_share_of_a_cell_inside_an_edge_is_that_of_its_places() -> None:
    random = np.random.default_rng(2)
    parts = (np.arange(400) + 0.5) / 400 - 0.5
    for _ in range(40):
        along, across, distance = random.uniform(-1.0, 1.0, 3).tolist()
        inside = distance + along * parts[:, np.newaxis] + across * parts > 0.0
        assert beside_edge(np.array([distance]), along, across)[0] == pytest.approx(np.mean(inside), abs=3e-3)
    assert beside_edge(np.array([-1.0, 0.0, 0.1, 1.0]), 0.4, 0.0).tolist() == pytest.approx(
        [0.0, 0.5, 0.75, 1.0], abs=1e-3
    )


def test_a_recording_whose_load_varies_is_prepared_along_a_line_of_an_area() -> None:
    points = [[0.0, 0.0, 0.1], [0.02, 1e-3, 0.3], [0.04, 3e-3, 0.5], [0.06, 5e-3, 0.2]]
    finger = {"kind": "fingertip", "contact_length": "2.3 mm"}
    scene = {"finger": finger, "texture": {"kind": "dots"}, "scan": {"trajectory": points}}
    solved = prepare(parse_scene({**scene, "accuracy": {"tolerance": 0.02}}), ResponseCache())
    assert solved.frames is not None and solved.mean is not None
    assert max(solved.frames.errors) <= 0.02
    loads = np.geomspace(0.1, 0.5, 50)
    assert np.all(np.diff(solved.mean(np.cbrt(loads))) < 0.0), "a heavier load presses deeper"


def large_cells(_asked: Any, contact: Any, _tolerance: float) -> tuple[Any, Any]:
    """Return `contact` in cells four times as large, and a large error, in place of `cells_along_path`."""
    return coarsened(contact, 4.0), np.full(3, 0.5)


@pytest.mark.parametrize("effects", [{}, {"inertia": {}}])
def test_an_error_of_cells_beyond_the_tolerance_is_warned_of(
    effects: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is measured along the motion, or added after the simulation, whose own error may be within the tolerance."""
    points = [[0.0, 0.0, 0.2], [0.02, 1e-3, 0.3], [0.04, 2e-3, 0.2], [0.06, 3e-3, 0.3]]
    scan, finger = {"trajectory": points}, {"contact_length": "2.3 mm"}
    document = {"finger": finger, "texture": {"kind": "dots"}, "scan": scan, "effects": effects}
    monkeypatch.setattr(contact_choice, "cells_along_path", large_cells)
    monkeypatch.setattr(own_motion, "MOST_WORK", 0)
    solved = prepare(parse_scene({**document, "accuracy": {"tolerance": 0.004}}), ResponseCache())
    assert solved.simulated == bool(effects) and solved.channels[0].error >= (0.5 if effects else 0.005)
    text = f"The error of the acceleration of the moving scan may be {solved.channels[0].error:.2g}"
    assert any(one.startswith(text if not effects else "The error of the acceleration") for one in solved.warnings)
