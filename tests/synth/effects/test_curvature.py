"""A round fingertip, as whole renders: steady, and where speed and load vary."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from synth import open_voice
from tests.reference.shaped_contact_oracle import fitting_radius, round_contact
from tests.reference.stiffness_oracle import Touch
from tests.synth.effects.shaped_renders import PHASES, Approach, check_moving, check_steady
from tests.synth.effects.whole_renders import named, scene_of
from tests.synth.engine_cases import physical, touch_of


@functools.cache
def radius_of(touch: Touch) -> float:
    """Return R (m) of the default reference load, 1 N."""
    return fitting_radius(touch)


def approach_of(touch: Touch) -> Approach:
    """Return the oracle of a fingertip that touches, smooth, the nominal length at 1 N."""
    return lambda theta, load: round_contact(touch, theta, load, radius_of(touch)).approach


@pytest.mark.parametrize("name", named("default"))
def test_a_steady_render_errs_by_no_more_than_the_plan_says(name: str) -> None:
    scene = scene_of(name, {"curvature": {}}, output={"channels": ["displacement", "velocity"], "bandwidth": 1000})
    check_steady(scene, approach_of(touch_of(scene)), 4 * PHASES if name == "wide" else PHASES)


@pytest.mark.thorough
def test_where_speed_and_load_vary_it_is_the_oracle_too() -> None:
    check_moving({"curvature": {}}, approach_of(Touch()))


def test_a_nearly_flat_fingertip_is_about_as_loud_as_a_flat_one_where_ridges_lock() -> None:
    """Softer ends change a locked texture little: all ridges rise together."""
    round_one = scene_of("locked", {"curvature": {}}, output={"channels": ["displacement"]})
    flat_one = scene_of("locked", {}, output={"channels": ["displacement"]})
    moved = [float(np.ptp(physical(open_voice(one), 800))) for one in (round_one, flat_one)]
    assert moved[0] == pytest.approx(moved[1], rel=0.5)
