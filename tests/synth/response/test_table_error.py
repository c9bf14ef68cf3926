"""Tables keep their promised errors over random scenes and kinds of texture; the figures are in docs/table.md."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from synth.contact.load_balance import FINEST
from synth.contact.profile_solver import SegmentGrid
from synth.contact.scene_contact import contact_of
from synth.plan.usual_hand import prepare_hand
from synth.response.table_error import QUANTITIES, TableError
from synth.response.table_making import HARMONICS
from synth.scene.scene import parse_scene
from tests.few import few, paired, thorough
from tests.synth.engine_cases import Real
from tests.synth.response.table_study import WITHIN, Found, measured, measured_scene, random_scene, table_of


def walk() -> list[float]:
    """Return 4,096 heights (m) of a closed random walk."""
    steps = np.random.default_rng(1).normal(size=4096)
    return [float(height) for height in np.round(6e-9 * (np.cumsum(steps) - np.arange(1, 4097) * steps.mean()), 12)]


TEXTURES: dict[str, dict[str, Any]] = {
    "harmonics": {"kind": "harmonics", "period": "2 mm", "amplitudes": ["20 um", "5 um", "3 um"]},
    "grating": {"kind": "grating", "period": "1 mm", "height": "40 um"},
    "rough": {"kind": "rough", "period": "20 mm"},
    "profile of 4,096 points": {"kind": "profile", "heights": walk(), "spacing": "2 um"},
}
SCENES = [
    pytest.param(range(5), id="5 scenes"),
    pytest.param(range(100), id="100 scenes", marks=[pytest.mark.thorough, pytest.mark.timeout(900)]),
]
LIMITS = {"displacement": 1e-3, "velocity": 3e-3, "acceleration": 1e-2}
"""At 99 of 100 loads of random sinusoids: displacement at every level, velocity and acceleration up to 32 harmonics."""


@cache
def study(scenes: range) -> tuple[Found, ...]:
    return tuple(measured(seed) for seed in scenes)


@cache
def found_of(name: str) -> Found:
    return measured_scene(parse_scene({"texture": TEXTURES[name]}), 3, loads=6)


def largest(found: tuple[Found, ...], quantity: str, highest: float = np.inf) -> Real:
    """Return the largest error over the levels up to `highest` harmonics, at each load."""
    order = QUANTITIES.index(quantity)
    errors = [one.errors[order, np.array(one.harmonics) <= highest] for one in found]
    return np.asarray(np.concatenate(errors, axis=1).max(axis=0))


@pytest.mark.parametrize("scenes", SCENES)
@pytest.mark.parametrize("quantity", LIMITS)
def test_errors_are_within_their_limits_at_99_of_100_loads(scenes: range, quantity: str) -> None:
    highest = np.inf if quantity == "displacement" else WITHIN
    assert np.quantile(largest(study(scenes), quantity, highest), 0.99) <= LIMITS[quantity]


@pytest.mark.parametrize("scenes", [*SCENES, pytest.param(range(73, 74), id="a motion that nearly cancels")])
def test_displacement_is_within_twice_that_everywhere(scenes: range) -> None:
    assert largest(study(scenes), "displacement").max() <= 2e-3


@pytest.mark.parametrize("scenes", SCENES)
def test_the_told_error_is_a_bound_and_tables_are_bounded(scenes: range) -> None:
    errors = np.concatenate([one.errors.ravel() for one in study(scenes)])
    told = np.concatenate([one.told.ravel() for one in study(scenes)])
    assert np.max(errors / told) <= 1.0
    assert max(one.nbytes for one in study(scenes)) <= 4_000_000


@pytest.mark.parametrize("name", [thorough("harmonics"), "grating", "rough", "profile of 4,096 points"])
def test_tables_of_profiles_keep_their_limits_up_to_32_harmonics_and_tell_a_bound(name: str) -> None:
    found = found_of(name)
    for quantity, limit in {"displacement": 2e-3, "velocity": 1e-2, "acceleration": 2e-2}.items():
        assert largest((found,), quantity, WITHIN).max() <= limit
    assert np.max(found.errors / found.told) <= 1.0


def test_the_told_error_is_a_bound_where_lines_fold() -> None:
    """The ridges lock with every 25th order. The folding of these was once reported a thousand times too small."""
    finger = {"ridge_period": 0.5e-3, "ridge_amplitude": 36e-6, "contact_length": 12.6e-3}
    texture = {"kind": "rough", "period": 12.5e-3, "longest": 3.1e-3, "shortest": 0.2e-3, "rms_height": 6e-6}
    found = measured_scene(parse_scene({"finger": finger, "texture": texture}), 4, loads=6)
    assert np.max(found.errors / found.told) <= 1.0


@pytest.mark.parametrize(("kind", "depth"), paired(["sinusoid", "grating"], ["5 um", "1 um", "0.2 um"]))
def test_a_contact_that_is_full_at_the_lightest_loads_has_a_table(kind: str, depth: str) -> None:
    finger = {"ridge_amplitude": depth, "contact_length": "1.7 mm"}
    texture = {"kind": kind, "amplitude" if kind == "sinusoid" else "height": depth}
    found = measured_scene(parse_scene({"finger": finger, "texture": texture}), 5, loads=6)
    assert np.max(found.errors / found.told) <= 1.0
    assert largest((found,), "displacement").max() <= 2e-3


@pytest.mark.parametrize("name", few(TEXTURES, 2))
def test_a_hand_is_not_prepared_for_loads_under_which_nothing_moves(name: str) -> None:
    """In full contact whole periods in the contact cancel, and no discretisation resolves the rest."""
    solved = prepare_hand(parse_scene({"texture": TEXTURES[name]}), (None,))
    assert solved.contact is not None
    assert isinstance(solved.contact.grid, SegmentGrid)
    assert solved.contact.grid.segments <= 256 * HARMONICS


def test_refinement_ends_where_a_contact_has_segments_enough() -> None:
    """For a fine texture the segments are counted over the contact, which spans forty of its periods here."""
    scene = parse_scene({"texture": {"kind": "grating", "period": "0.25 mm", "height": "20 um"}})
    contact, finer, times = contact_of(scene), contact_of(scene).refined(), 0
    while finer is not None:
        contact, finer, times = finer, finer.refined(), times + 1
    assert isinstance(contact.grid, SegmentGrid)
    assert 1 <= times <= 8
    assert contact.grid.segments * 40 <= 2 * FINEST


def test_what_is_left_out_beyond_the_highest_level_is_told() -> None:
    error = table_of(random_scene(0)).error
    told = [error.at(0.3, "acceleration", harmonics) for harmonics in (64, 128, 256)]
    assert told[0] < told[1] < told[2]
    assert error.at(0.3, "displacement", 1000) < 0.1


def test_a_load_is_told_the_error_of_its_own_interval() -> None:
    largest = np.arange(1, 28, dtype=np.float32).reshape(3, 3, 3)[..., ::-1]  # [quantity, harmonics, interval]
    told = TableError(np.array([0.0, 0.1, 0.4, 2.0]), (1, 2, 4), largest, np.ones((3, 3), np.float32))
    for order, quantity in enumerate(QUANTITIES):
        for interval, load in ((0, 0.05), (1, 0.1), (1, 0.39), (2, 0.4), (2, 2.0), (2, 50.0)):
            assert told.at(load, quantity, 2) == largest[order, 1, interval]
            assert told.at(load, quantity, 3) == largest[order, 1:, interval].max()
        assert told.over((0.2, 0.5), quantity, 1) == largest[order, 0, 1:].max()
    assert told.at(0.2, "displacement", 8) == largest[0, 2, 1] + 1.0  # plus the octave above the highest
