"""F of a finger on a height field at all places and levels, against a sum over its points."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest

from synth.contact.area_grid import AreaGrid
from synth.contact.area_layers import BATCH, AreaLayers, LayerPlan
from synth.contact.layer_sums import lay_texture
from synth.contact.scene_contact import contact_of
from synth.scene.scene import parse_scene
from tests.reference import layered_oracle

SIZE = 90, 72  # places of the lattice


def grid_and_layers(steps: float, kind: str = "fingertip") -> tuple[AreaGrid, AreaLayers, float]:
    """Return the points of a finger on dots, their layers so many to the height of a dot, and the lowest level."""
    finger = {"kind": kind, "contact_length": "1.5 mm"}
    contact = contact_of(parse_scene({"finger": finger, "texture": {"kind": "dots", "period": "1.3 mm"}}))
    grid = contact.grid
    assert isinstance(grid, AreaGrid)
    step = (grid.texture.highest - float(grid.texture.heights.min())) / steps
    lowest = float(grid.tops[0]) - 3.0
    return grid, AreaLayers.of(grid, LayerPlan.of(grid, SIZE, step, 1, lowest)), lowest


def sums(grid: AreaGrid, places: Any, z: float) -> Any:
    """Return F (m) at the level `z` (m), at each of `places` (column, row), by a sum over the points."""
    found = []
    for column, row in places:
        heights, shares = layered_oracle.heights_at(grid, column / SIZE[0], row / SIZE[1])
        found.append(0.25 * grid.cell * float(np.sum(shares * np.maximum(heights - z, 0.0))))
    return np.array(found)


@pytest.mark.parametrize("kind", ["fingertip", "comb"])
def test_f_is_that_of_the_points_and_never_much_below(kind: str) -> None:
    """F is too large by at most half of its second difference; the lattice errs by some thousandths of F's change."""
    grid, layers, _lowest = grid_and_layers(10.0, kind)
    random = np.random.default_rng(1)
    places = list(zip(random.integers(0, SIZE[0], 20), random.integers(0, SIZE[1], 20), strict=True))
    columns, rows = np.transpose(places)
    levels, found = [], []
    for numbers, batch in itertools.islice(layers.batches(), 14):
        levels += numbers.tolist()
        found += [one[rows, columns].astype(float) for one in batch]
    for number in range(8, 40, 4):
        exact = sums(grid, places, levels[number] * layers.plan.step * grid.height_scale)
        below = (found[number + 1] - found[number]) / (levels[number] - levels[number + 1])
        above = (found[number] - found[number - 1]) / (levels[number - 1] - levels[number])
        lattice = 5e-3 * np.ptp(exact) + 2e-3 * np.mean(exact)
        assert np.all(found[number] > exact - lattice)
        assert np.all(found[number] - 0.5 * (below - above) < exact + lattice)


def test_levels_are_wider_apart_the_deeper_they_are_and_reach_any_depth() -> None:
    _grid, layers, _lowest = grid_and_layers(20.0)
    plan = layers.plan
    numbers = np.concatenate(plan.batches_down_to(-1000.0))
    gaps = -np.diff(numbers)
    assert gaps[0] == plan.stride and np.all(np.diff(gaps) >= 0) and gaps[-1] > 10
    assert numbers[-1] * plan.step <= -1000.0 < numbers[-1 - BATCH] * plan.step


def test_below_all_points_f_falls_in_a_straight_line() -> None:
    grid, layers, _lowest = grid_and_layers(8.0)
    deep = float(grid.texture.heights.min()) + float(grid.finger[:, 0][grid.finger[:, 0] > -1e20].min()) - 1.0
    line = []
    for numbers, batch in layers.batches():
        if numbers[0] * layers.plan.step < deep:
            line.append((numbers, batch[:, 3, 5].astype(float)))
        if len(line) == 2:
            break
    numbers, found = (np.concatenate(one).astype(float) for one in zip(*line, strict=True))
    points = float(np.sum(grid.shares))
    wanted = points * grid.cell * layers.plan.step * grid.height_scale
    assert np.diff(found) / -np.diff(numbers) == pytest.approx(wanted, rel=1e-3)


def test_each_place_of_the_texture_is_in_the_layers_once_and_nowhere_else() -> None:
    """Also where the highest place is rounded up to the next layer."""
    grid, _layers, _lowest = grid_and_layers(8.0)
    texture = grid.texture
    for count in range(1, 80):
        step = float(np.nextafter(texture.highest / count, 1.0))  # it is just below a whole number of steps
        plan = LayerPlan.of(grid, SIZE, step, 1, -10.0)
        space = np.zeros((plan.layers + 1, SIZE[1], SIZE[0]), np.float32)
        lay_texture(
            texture.heights, texture.shape, texture.columns, 2, 2, plan.step, plan.first, space[:-1], 0, SIZE[1]
        )
        assert not space[-1].any()
        assert np.allclose(space.sum(axis=0), 1.0, atol=1e-5)
