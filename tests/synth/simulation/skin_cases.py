"""What the tests of viscous skin share: the default scene as a stepper and as its twin, and scans of it."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from synth.contact.balance import Contact
from synth.effects.simulation.skin import KelvinVoigt, LoadLaw, Relaxation, SkinLaw
from synth.effects.simulation.skin_points import SkinPoints
from synth.effects.simulation.skin_steps import SkinState, SkinStepper
from synth.effects.simulation.steps import ROWS, Phases
from tests.reference import skin_oracle as twin
from tests.synth.engine_cases import contact_of, scene_of

Real = npt.NDArray[np.float64]

LOAD, PERIOD, LIGHTEST = 0.3, 0.8e-3, 1e-6  # of the default scene: N, m, N
LAWS: tuple[SkinLaw, ...] = (KelvinVoigt(), Relaxation())


def contact(**sections: Any) -> Contact:
    return contact_of(scene_of(**sections))


def stepper_of(law: SkinLaw, points: int, load: float = LOAD, **settings: Any) -> SkinStepper:
    """Return the stepper of the default scene."""
    return SkinStepper.of_contact(contact(), load, law, points, LIGHTEST, **settings)


def stepper_of_stiffness(law: SkinLaw, points: int, stiffness: float, **settings: Any) -> SkinStepper:
    """Return the stepper of the default scene with a stiffness (N/m) that no load changes."""
    return SkinStepper(
        SkinPoints.of_contact(contact(), LOAD, points), law, LoadLaw(stiffness, 0.0, LIGHTEST), **settings
    )


def twin_of(stepper: SkinStepper, step: float) -> twin.Foundation:
    """Return the twin of a stepper of the default scene."""
    geometry, law = contact().geometry, stepper.law
    skin = twin.Skin(None, law.times, law.weights) if isinstance(law, Relaxation) else twin.Skin()
    if isinstance(law, KelvinVoigt):
        skin = twin.Skin(law.time)
    return twin.Foundation(
        geometry.ridge_amplitude, geometry.ridge_period, geometry.texture_amplitude, geometry.texture_period,
        geometry.texture_phase, geometry.contact_length, stepper.points.count, stepper.load_law.coefficient,
        stepper.load_law.power, skin, step, stepper.mass, stepper.damping,
    )  # fmt: skip


def turned(turns: Real) -> Phases:
    """Return phases (turns) as 64-bit fractions of a turn."""
    rest = turns - np.floor(turns)
    return np.asarray((rest * 2.0**63).astype(np.uint64) << np.uint64(1))


def scanned(
    stepper: SkinStepper, turns: Real, loads: float | Real, step: float, first: float = 0.0
) -> tuple[SkinState, Real]:
    """Return state and rows of a finger that starts at `first` turns, relaxed, and goes through `turns`."""
    loads = np.broadcast_to(np.asarray(loads, dtype=float), turns.shape)
    speed = float(turns[0] - first) / step
    state = stepper.start(int(turned(np.array([first]))[0]), float(loads[0]), speed, step)
    out = np.full((ROWS, len(turns)), np.nan)
    stepper.run(state, turned(turns), np.ascontiguousarray(loads), out)
    return state, out


def steady(speed: float, step: float, count: int) -> Real:
    """Return the turns at `count` steps of `step` (s) at `speed` (m/s), from the first step on."""
    return np.asarray(speed / PERIOD * step * np.arange(1, count + 1))


def indentations(state: SkinState) -> Real:
    """Return what every element is pressed in by, relative to a1 + a2."""
    return np.asarray(np.max(state.elements[:, 0], axis=0))
