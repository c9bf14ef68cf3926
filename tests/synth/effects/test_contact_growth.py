"""A contact that grows with the load, as whole renders: steady, and where speed and load vary."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from synth import open_voice, parse_scene
from tests.reference.shaped_contact_oracle import growing_contact
from tests.reference.stiffness_oracle import Touch
from tests.synth.effects.shaped_renders import PHASES, Approach, check_moving, check_steady
from tests.synth.effects.whole_renders import named, scene_of
from tests.synth.engine_cases import physical, touch_of

GROWING: dict[str, Any] = {"contact_growth": {"exponent": 0.25}}


def approach_of(touch: Touch) -> Approach:
    """Return the oracle of a contact of the nominal length at 1 N, the default reference load."""
    return lambda theta, load: growing_contact(touch, theta, load, 0.25).approach


@pytest.mark.parametrize("name", named("default"))
def test_a_steady_render_errs_by_no_more_than_the_plan_says(name: str) -> None:
    scene = scene_of(name, GROWING, output={"channels": ["displacement", "velocity"], "bandwidth": 1000})
    check_steady(scene, approach_of(touch_of(scene)), 4 * PHASES if name == "wide" else PHASES)


@pytest.mark.thorough
def test_where_speed_and_load_vary_it_is_the_oracle_too() -> None:
    check_moving(GROWING, approach_of(Touch()))


def test_at_the_reference_load_it_is_the_scene_without_it() -> None:
    """L = L0 (w / w0)^p: at w0 nothing changes but the segments, whatever p is."""
    output = {"quantity": "displacement", "sample_rate": 8000}
    plain = physical(open_voice(parse_scene({"output": output})), 800)
    for exponent in (0.0, 1 / 3, 1.0):
        effects = {"contact_growth": {"exponent": exponent, "reference_load": 0.3}}
        grown = physical(open_voice(parse_scene({"output": output, "effects": effects})), 800)
        assert np.max(np.abs(grown - plain)) <= 2e-4 * np.ptp(plain)


def test_in_full_contact_the_amplitude_is_the_sinc_of_the_grown_length() -> None:
    scene = scene_of("default", {"contact_growth": {"exponent": 0.5}}, scan={"load": "50 N"},
                     finger={"contact_length": "1.43 mm"}, output={"channels": ["displacement"]})  # fmt: skip
    block = physical(open_voice(scene), 800)[:, 0]
    wanted = 20e-6 * abs(np.sinc(1.43 * math.sqrt(50) / 0.8))
    assert np.ptp(block) == pytest.approx(2 * wanted, rel=1e-3)
