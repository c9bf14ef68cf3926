"""Which sizes of the baseline are measured, and that its errors are those of `brentq`."""

from __future__ import annotations

import numpy as np
import pytest

from synth.accuracy.ladders import Ladders
from synth.contact.baseline import BrentqGrid
from synth.contact.trapezoid import trapezoid_heights
from tests.synth.engine_cases import contact_of, scene_of


def climbed(ladders: Ladders, ladder: str, errors: dict[int, float], below: str = "") -> list[int]:
    """Return the points that are measured of a ladder with these errors."""
    taken = []
    for points, error in errors.items():
        if not ladders.skips(ladder, points, below):
            ladders.take(ladder, points, error)
            taken.append(points)
    return taken


def test_a_ladder_ends_where_it_meets_the_tolerance() -> None:
    assert climbed(Ladders(1e-3), "a", {25: 0.1, 50: 0.02, 100: 9e-4, 200: 1e-4}) == [25, 50, 100]


def test_a_ladder_ends_where_twice_the_points_twice_gained_nothing() -> None:
    errors = {25: 0.3, 50: 0.051, 100: 0.05, 200: 0.049, 400: 0.0489}
    assert climbed(Ladders(1e-3), "a", errors) == [25, 50, 100, 200]


def test_one_unlucky_size_ends_nothing() -> None:
    errors = {25: 0.3, 50: 0.4, 100: 0.05, 200: 0.01, 400: 1e-4}
    assert climbed(Ladders(1e-3), "a", errors) == [25, 50, 100, 200, 400]


def test_the_next_ladder_begins_where_points_stopped_to_gain() -> None:
    ladders = Ladders(1e-3)
    climbed(ladders, "a", {25: 0.3, 50: 0.051, 100: 0.05, 200: 0.049})
    assert climbed(ladders, "b", {25: 0.3, 50: 0.02, 100: 5e-4, 200: 1e-4}, "a") == [50, 100]
    assert climbed(ladders, "c", {25: 0.3, 50: 0.02, 100: 4e-4, 200: 1e-4}, "b") == [100]


@pytest.mark.parametrize(
    "sections", [{}, {"scan": {"load": 5}}, {"scan": {"load": 1e-3}}, {"texture": {"period": "20 mm"}}]
)
def test_the_errors_of_the_baseline_are_those_of_brentq(sections: dict[str, dict[str, float]]) -> None:
    scene = scene_of(**sections)
    contact = contact_of(scene)
    grid = BrentqGrid.of_geometry(contact.geometry, 50)
    phases = np.linspace(-1.0, 2.0, 60)
    indentation = contact.indentation(scene.scan.load)
    slow = grid.solve(phases, indentation).height
    fast = trapezoid_heights(grid, phases, indentation)
    assert np.max(np.abs(fast - slow)) <= 4e-15 * contact.geometry.height_scale
