"""The stepper of a scene: the mean about which displacement is measured is that of the simulated contact."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from synth.effects.simulation.running import Simulation
from synth.effects.simulation.table_steps import TableStepper
from synth.plan.prepare import prepare
from synth.plan.usual_hand import prepare_hand
from synth.scene.scene import parse_scene

COMB: dict[str, Any] = {"finger": {"contact_length": "3 mm"}, "effects": {"inertia": {}}}
TIP: dict[str, Any] = {"finger": {"kind": "fingertip", "contact_length": "4 mm"}, "effects": {"inertia": {}}}
SCENES = {"comb": COMB, "fingertip": TIP}
THETA = np.arange(512) / 512


@cache
def of_hand(name: str) -> Simulation:
    """Return the simulation of a scene that follows a hand."""
    effects = prepare_hand(parse_scene(SCENES[name]), (None,)).effects
    assert effects is not None and effects.simulation is not None
    return effects.simulation.simulation


@pytest.mark.parametrize("finger", SCENES)
@pytest.mark.parametrize("load", [1e-3, 0.07, 0.3, 2.0, 9.0, 300.0])
def test_the_mean_of_a_hand_is_that_of_the_simulated_contact_at_every_load(finger: str, load: float) -> None:
    """Also above the loads of the table, where the contact goes on as a straight line."""
    simulation = of_hand(finger)
    stepper = simulation.stepper
    assert isinstance(stepper, TableStepper)
    z = stepper.heights(THETA, load)
    motion = float(np.ptp(stepper.heights(THETA, 0.3)))
    assert float(simulation.reference(np.cbrt([load]))[0]) == pytest.approx(float(np.mean(z)), abs=2e-4 * motion)


def test_below_the_lift_load_the_mean_stays() -> None:
    simulation = of_hand("fingertip")
    lift = simulation.scene.scan.lift_load
    means = simulation.reference(np.cbrt([0.0, 0.5 * lift, lift]))
    assert means[0] == means[1] == means[2]


@pytest.mark.parametrize("load", [0.05, 0.3, 2.0])
def test_the_still_heights_of_a_hand_are_those_of_the_contact_within_the_error_of_the_table(load: float) -> None:
    solved = prepare_hand(parse_scene(TIP), (None,))
    stepper = of_hand("fingertip").stepper
    assert isinstance(stepper, TableStepper) and solved.contact is not None
    exact, _slope = solved.contact.approach(THETA, load)
    assert np.max(np.abs(stepper.heights(THETA, load) - exact)) <= stepper.table.error * stepper.table.motion


def test_a_scan_at_one_load_has_one_mean() -> None:
    effects = prepare(parse_scene(TIP)).effects
    assert effects is not None and effects.simulation is not None
    means = effects.simulation.simulation.reference(np.array([0.1, 0.5, 1.0]))
    assert means[0] == means[1] == means[2]
