"""A finger at rest under effects: it stands where its forces balance, found here by bisection on a fine trapezoid."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

import ridgewave as rw

PHASES, POINTS = 400, 20_001
COMB = {"ridge_period": 0.5e-3, "ridge_amplitude": 40e-6, "contact_length": 10e-3}
LOAD, PERIOD, AMPLITUDE, PHASE = 0.3, 0.8e-3, 20e-6, math.sqrt(2.0)


SHORT = {"contact_length": "3 mm"}


def scene_of(effects: Any, **sections: Any) -> dict[str, Any]:
    """Return the paper's scene at rest, with a displacement, an approach, a velocity and an acceleration."""
    channels = [
        {"quantity": one, "full_scale": 1.0} for one in ("displacement", "approach", "velocity", "acceleration")
    ]
    output = {"duration": 0.01, "channels": channels}
    return {"scan": {"speed": 0}, "effects": effects, "output": output} | sections


def indentation(turns: float) -> Callable[[float], float]:
    """Return the mean over the length of max(h - z, 0) (m) as a function of z (m)."""
    x = np.linspace(0.0, COMB["contact_length"], POINTS)
    h = AMPLITUDE * np.cos(2.0 * math.pi * (x / PERIOD - turns) + PHASE)
    h -= COMB["ridge_amplitude"] * np.cos(2.0 * math.pi * x / COMB["ridge_period"])
    return lambda z: float(np.trapezoid(np.maximum(h - z, 0.0), x) / COMB["contact_length"])


def balanced(excess: Callable[[Callable[[float], float], float], float]) -> np.ndarray:
    """Return the z (m) at which `excess` of the indentation and z is 0, at PHASES equal steps from phase 0 on."""
    wells = (indentation(n / PHASES) for n in range(PHASES))
    return np.array([brentq(lambda z, well=well: excess(well, z), -4e-4, 6e-5, xtol=1e-14) for well in wells])


@pytest.fixture(scope="module")
def elastic() -> tuple[float, np.ndarray]:
    """Return the stiffness (N/m) of the contact, and z of a finger without effects."""
    stiffness = rw.explain(scene_of({})).document()["response"]["stiffness"]
    return stiffness, balanced(lambda well, z: stiffness * well(z) - LOAD)


def rendered(scene: dict[str, Any]) -> np.ndarray:
    """Return the only value of each channel, SI, of a sound without a warning."""
    sound = rw.render(scene)
    assert sound.plan is not None and not sound.plan.warnings
    assert np.all(sound.values == sound.values[0]) and not np.any(sound.values[:, 2:])
    return np.asarray(sound.values[0, :2], float)


@pytest.mark.parametrize("effects", [{}, {"viscous_skin": {}}, {"viscous_skin": {"model": "three_time_constants"}}])
def test_relaxed_skin_stands_as_without_effects(elastic: tuple[float, np.ndarray], effects: Any) -> None:
    _stiffness, z = elastic
    tolerance = 1e-3 * np.ptp(z)
    assert rendered(scene_of(effects)) == pytest.approx([z[0] - np.mean(z), z[0]], abs=tolerance)


def test_a_mass_stands_where_pulp_and_contact_balance(elastic: tuple[float, np.ndarray]) -> None:
    stiffness, free = elastic
    rest = float(np.mean(free))
    z = balanced(lambda well, z: stiffness * well(z) - LOAD - 2e4 * (z - rest))
    assert abs(z[0] - free[0]) > 0.1 * np.ptp(free)
    found = rendered(scene_of({"inertia": {"stiffness": 2e4, "mass": 0.02}}))
    assert found == pytest.approx([z[0] - np.mean(z), z[0]], abs=1e-3 * np.ptp(free))


def test_attraction_pulls_a_finger_in_that_has_not_come_off(elastic: tuple[float, np.ndarray]) -> None:
    stiffness, free = elastic
    stress, reach, width = 1e3, 20e-6, 10e-3
    k2 = stress * COMB["contact_length"] * width / reach
    z = balanced(lambda well, z: (stiffness + k2) * well(z) - k2 * well(z - reach) - LOAD)
    assert abs(z[0] - free[0]) > 0.1 * np.ptp(free)
    effects = {"adhesion": {"stress": stress, "reach": reach}}
    found = rendered(scene_of(effects))
    assert found == pytest.approx([z[0] - np.mean(z), z[0]], abs=1e-3 * np.ptp(free))


def test_auto_says_that_nothing_changes_at_rest() -> None:
    plan = rw.explain(scene_of({"viscous_skin": "auto"})).document()
    reasons = {one["name"]: one["reason"] for one in plan["left_out"]}
    assert reasons["viscous_skin"] == "The finger rests, so it changes nothing."


@pytest.mark.parametrize("finger", [SHORT, {"kind": "fingertip"} | SHORT, {"kind": "probe"}], ids=str)
def test_over_dots_and_on_every_finger_nothing_is_told_of_what_does_not_move(finger: Any) -> None:
    """The error by the cells was that of a swing at no speed: 1.5 to 27 of the peak-to-peak."""
    for texture in ({}, {"kind": "dots"}):
        plan = rw.explain(scene_of({"viscous_skin": {}}, finger=finger, texture=texture)).document()
        told = plan["estimated_error"]
        assert told["velocity"] == told["acceleration"] == 0.0 and 0.0 < told["approach"] < 0.02
        assert not any("u / lambda2" in text for text in plan["warnings"])
