"""Tables keep what they promise, over random scenes at random loads; the figures are those of docs/table.md."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from synth.response.table_error import QUANTITIES
from tests.synth.engine_cases import Real
from tests.synth.response.table_study import WITHIN, Found, measured, random_scene, table_of

SCENES = [
    pytest.param(range(8), id="8 scenes"),
    pytest.param(range(200), id="200 scenes", marks=[pytest.mark.thorough, pytest.mark.timeout(900)]),
]


@cache
def study(scenes: range) -> tuple[Found, ...]:
    return tuple(measured(seed) for seed in scenes)


def displacement_errors(scenes: range) -> Real:
    """Return the largest error of displacement over the levels, at each load of the scenes."""
    return np.asarray(np.concatenate([one.errors[0] for one in study(scenes)], axis=1).max(axis=0))


@pytest.mark.parametrize("scenes", SCENES)
def test_displacement_is_within_its_limit_at_99_of_100_loads(scenes: range) -> None:
    assert np.quantile(displacement_errors(scenes), 0.99) <= 1e-3


MISSED = "the rows that 4 MB hold are too few for scene 73, whose motion nearly cancels; its table tells so"


@pytest.mark.parametrize(
    "scenes",
    [
        pytest.param(range(8), id="8 scenes"),
        pytest.param(
            range(60, 80),
            id="20 scenes",
            marks=[pytest.mark.thorough, pytest.mark.xfail(strict=True, reason=MISSED)],
        ),
    ],
)
def test_displacement_is_within_twice_that_everywhere(scenes: range) -> None:
    assert displacement_errors(scenes).max() <= 2e-3


@pytest.mark.parametrize("scenes", SCENES)
@pytest.mark.parametrize(("quantity", "limit"), [("velocity", 3e-3), ("acceleration", 1e-2)])
def test_rates_are_within_their_limits_up_to_32_harmonics(scenes: range, quantity: str, limit: float) -> None:
    order = QUANTITIES.index(quantity)
    errors = [one.errors[order, np.array(one.harmonics) <= WITHIN] for one in study(scenes)]
    assert np.quantile(np.concatenate(errors, axis=1).max(axis=0), 0.99) <= limit


@pytest.mark.parametrize("scenes", SCENES)
def test_the_told_error_is_a_bound(scenes: range) -> None:
    errors = np.concatenate([one.errors.ravel() for one in study(scenes)])
    told = np.concatenate([one.told.ravel() for one in study(scenes)])
    assert np.mean(errors > told) <= 2e-3
    assert np.max(errors / told) <= 1.5


@pytest.mark.parametrize("scenes", SCENES)
def test_tables_are_bounded(scenes: range) -> None:
    assert max(one.nbytes for one in study(scenes)) <= 4_000_000


def test_what_is_left_out_beyond_the_highest_level_is_told() -> None:
    scene = random_scene(0)
    error = table_of(scene).error
    told = [error.at(0.3, "acceleration", harmonics) for harmonics in (64, 128, 256)]
    assert told[0] < told[1] < told[2]
    assert error.at(0.3, "displacement", 1000) < 0.1


def test_the_same_contact_has_the_same_table() -> None:
    scene = random_scene(3)
    assert table_of(scene).hash == table_of(scene).hash
    assert table_of(scene).hash != table_of(random_scene(4)).hash
