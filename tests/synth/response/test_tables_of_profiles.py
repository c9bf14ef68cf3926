"""Tables of profiles keep what those of two cosines keep, and are made in the time of a touch."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from synth.contact.profile_solver import SegmentGrid
from synth.contact.solvers import FINEST
from synth.plan.usual_hand import prepare_hand
from synth.response.table_error import QUANTITIES
from synth.response.table_making import HARMONICS
from synth.scene.scene import parse_scene
from tests.synth.engine_cases import contact_of
from tests.synth.response.table_study import WITHIN, Found, measured_scene


def walk() -> list[float]:
    """Return 4,096 heights (m) of a random walk that closes."""
    steps = np.random.default_rng(1).normal(size=4096)
    return [float(height) for height in np.round(6e-9 * (np.cumsum(steps) - np.arange(1, 4097) * steps.mean()), 12)]


TEXTURES: dict[str, dict[str, Any]] = {
    "harmonics": {"kind": "harmonics", "period": "2 mm", "amplitudes": ["20 um", "5 um", "3 um"]},
    "grating": {"kind": "grating", "period": "1 mm", "height": "40 um"},
    "rough": {"kind": "rough", "period": "20 mm"},
    "profile of 4,096 points": {"kind": "profile", "heights": walk(), "spacing": "2 um"},
}


@cache
def found(name: str) -> Found:
    return measured_scene(parse_scene({"texture": TEXTURES[name]}), 3)


@pytest.mark.parametrize("name", TEXTURES)
@pytest.mark.parametrize(("quantity", "limit"), [("displacement", 2e-3), ("velocity", 1e-2), ("acceleration", 2e-2)])
def test_a_table_keeps_its_limits_up_to_32_harmonics(name: str, quantity: str, limit: float) -> None:
    one = found(name)
    assert one.errors[QUANTITIES.index(quantity), np.array(one.harmonics) <= WITHIN].max() <= limit


@pytest.mark.parametrize("name", TEXTURES)
def test_the_told_error_is_a_bound(name: str) -> None:
    assert np.mean(found(name).errors > found(name).told) <= 0.01
    assert np.max(found(name).errors / found(name).told) <= 1.5


@pytest.mark.parametrize("name", TEXTURES)
def test_a_hand_is_not_prepared_for_loads_under_which_nothing_moves(name: str) -> None:
    """Whole periods in the contact cancel where all of it touches: no discretisation shows what is left there."""
    scene = parse_scene({"texture": TEXTURES[name]})
    solved = prepare_hand(scene, (None,))
    assert solved.contact is not None
    assert isinstance(solved.contact.grid, SegmentGrid)
    assert solved.contact.grid.segments <= 256 * HARMONICS


def test_refinement_ends_where_a_contact_has_segments_enough() -> None:
    """The segments of a fine texture are counted over the contact, which spans forty of its periods here."""
    scene = parse_scene({"texture": {"kind": "grating", "period": "0.25 mm", "height": "20 um"}})
    contact, finer, times = contact_of(scene), contact_of(scene).refined(), 0
    while finer is not None:
        contact, finer, times = finer, finer.refined(), times + 1
    assert isinstance(contact.grid, SegmentGrid)
    assert 1 <= times <= 8
    assert contact.grid.segments * 40 <= 2 * FINEST
