"""What the tests of viscous skin share: the default scene as a stepper and as its twin, and scans of it."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from synth.contact.load_balance import Contact
from synth.effects.simulation.skin_points import SkinPoints
from synth.effects.simulation.skin_steps import SkinStepper
from synth.effects.simulation.steps import HEIGHT, ROWS, Phases, State, StiffnessLaw
from synth.effects.simulation.terms import Skin
from tests.reference import skin_oracle as twin
from tests.synth.engine_cases import contact_of, scene_of

Real = npt.NDArray[np.float64]

LOAD, PERIOD, LIGHTEST = 0.3, 0.8e-3, 1e-6  # of the default scene: N, m, N
VOIGT, RELAXING = Skin((0.004,)), Skin((0.004, 0.070, 1.4), (0.25, 0.25, 0.25))
LAWS = (VOIGT, RELAXING)


def contact(**sections: Any) -> Contact:
    return contact_of(scene_of(**sections))


def stepper_of(law: Skin, points: int, load: float = LOAD, **settings: Any) -> SkinStepper:
    """Return the stepper of the default scene."""
    stiffness = StiffnessLaw.of(contact(), load, LIGHTEST)
    return SkinStepper(SkinPoints.of_contact(contact(), load, points), law, stiffness, **settings)


def stepper_of_stiffness(law: Skin, points: int, stiffness: float, **settings: Any) -> SkinStepper:
    """Return the stepper of the default scene with a stiffness (N/m) that no load changes."""
    found = SkinPoints.of_contact(contact(), LOAD, points)
    return SkinStepper(found, law, StiffnessLaw(stiffness, 0.0, LIGHTEST), **settings)


def elastic(stepper: SkinStepper, turns: Real, loads: float | Real, first: float | None = None) -> Real:
    """Return z (m) of the same finger without memory or mass."""
    begin = float(turns[0]) if first is None else first
    return np.asarray(scanned(stepper.elastic, turns, loads, 1e-4, begin)[1][HEIGHT])


def twin_of(stepper: SkinStepper, step: float) -> twin.Foundation:
    """Return the twin of a stepper of the default scene."""
    geometry, law = contact().geometry, stepper.law
    skin = twin.Skin(None, law.times, law.weights) if law.weights else twin.Skin(law.times[0])
    return twin.Foundation(
        geometry.ridge_amplitude, geometry.ridge_period, geometry.texture_amplitude, geometry.texture_period,
        geometry.texture_phase, geometry.contact_length, stepper.points.count, stepper.stiffness.coefficient,
        stepper.stiffness.power, skin, step, stepper.mass, stepper.damping,
    )  # fmt: skip


def turned(turns: Real) -> Phases:
    """Return phases (turns) as 64-bit fractions of a turn."""
    rest = turns - np.floor(turns)
    return np.asarray((rest * 2.0**63).astype(np.uint64) << np.uint64(1))


def scanned(
    stepper: SkinStepper, turns: Real, loads: float | Real, step: float, first: float = 0.0
) -> tuple[State, Real]:
    """Return state and rows of a finger that starts at `first` turns, relaxed, and goes through `turns`."""
    loads = np.broadcast_to(np.asarray(loads, dtype=float), turns.shape).copy()
    speed = float(turns[0] - first) / step
    state = stepper.start(int(turned(np.array([first]))[0]), float(loads[0]), speed, step)
    out = np.full((ROWS, len(turns)), np.nan)
    stepper.run(state, turned(turns), loads, out)
    return state, out


def steady(speed: float, step: float, count: int) -> Real:
    """Return the turns at `count` steps of `step` (s) at `speed` (m/s), from the first step on."""
    return np.asarray(speed / PERIOD * step * np.arange(1, count + 1))


def indentations(state: State) -> Real:
    """Return what every element is pressed in by, relative to a1 + a2."""
    return np.asarray(np.max(state.elements[:, 0], axis=0))
