"""A finger of viscous skin, simulated step by step: a foundation of elements that remember, perhaps with a mass.

Model   sum of p dx = w (or m z'' + c z' = sum of p dx - w), p = kappa A max(g - z, 0) with g of `skin_profile` and
        kappa = k / L: `skin_balance` finds z. A step h that moves z by s has (2 m / h^2 + c / h) s - 2 m v0 / h + w =
        sum of p dx and v1 = 2 s / h - v0. Pressure meets load, and the texture its slope, where the pressure of the
        step belongs (`StepCoefficients.when`): for Kelvin-Voigt at half the step, as long as h is well below tau; for
        relaxing skin, and without memory, at its end. There, with a mass, it is the means of both ends that meet.
        HEIGHT and STATIC are those at the end of the step, REACTION and SLOPE_FORCE of the pressure of the step.
Source  Fagiani & Barbieri (2016), eqs 1, 4, 5.
Limits  second order in h on moving surfaces (tests/synth/simulation/test_skin_physics.py): 240 steps a period of the
        texture leave 7e-4 of the peak-to-peak of z, 120 leave 3e-3 (Kelvin-Voigt, 4 ms, 80 mm/s). First order: a damper
        without a mass on relaxing skin, and a mass on Kelvin-Voigt with h beyond tau (it swings as if damped by k h / 2
        more). Skin does not bend sideways.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from synth.arrays import Array
from synth.contact.balance import Contact
from synth.effects.simulation.skin import LoadLaw, SkinLaw, StepCoefficients
from synth.effects.simulation.skin_balance import NUMBERS, TURNS, elastic_heights, run_steps
from synth.effects.simulation.skin_points import SkinPoints
from synth.effects.simulation.skin_surface import heights_at
from synth.effects.simulation.steps import ROWS, Phases


@dataclass(slots=True)
class SkinState:
    """Where a finger of viscous skin stands: after every run, at its last step.

    phase: uint64 [1]. numbers: float64 [11], see `skin_balance`; heights relative to a1 + a2, the rest in SI units.
    elements: float64 [2, 1 + memories, points], the two states of every point, relative to a1 + a2.
    """

    coefficients: StepCoefficients
    phase: Phases
    numbers: Array
    elements: Array

    def copied(self) -> SkinState:
        """Return a state that goes on from here by itself."""
        return SkinState(self.coefficients, self.phase.copy(), self.numbers.copy(), self.elements.copy())

    @property
    def nbytes(self) -> int:
        """Bytes that it holds."""
        return self.phase.nbytes + self.numbers.nbytes + self.elements.nbytes


@dataclass(frozen=True, slots=True)
class SkinStepper:
    """Simulates one contact of viscous skin; see `Stepper`.

    mass: kg. damping: N s/m. with_static, with_force: whether STATIC and SLOPE_FORCE are computed (0 else), for 0.6 and
    0.25 of the time of a step of Kelvin-Voigt.
    """

    points: SkinPoints
    law: SkinLaw
    load_law: LoadLaw
    mass: float = 0.0
    damping: float = 0.0
    with_static: bool = False
    with_force: bool = False

    @classmethod
    def of_contact(
        cls, contact: Contact, load: float, law: SkinLaw, points: int, lightest: float, *,
        mass: float = 0.0, damping: float = 0.0, with_static: bool = False, with_force: bool = False,
    ) -> SkinStepper:  # fmt: skip
        """Return the stepper of `contact`, its length and its law of stiffness taken round `load` (N).

        points: how many (`points_for`). lightest: N, the load below which every load counts as this.
        """
        load = max(load, lightest)
        low, high = contact.stiffness_at(0.5 * load), contact.stiffness_at(2.0 * load)
        power = 0.5 * math.log2(high / low)
        load_law = LoadLaw(contact.stiffness_at(load) / load**power, power, lightest)
        skin_points = SkinPoints.of_contact(contact, load, points)
        return cls(skin_points, law, load_law, mass, damping, with_static, with_force)

    def __post_init__(self) -> None:
        assert self.mass >= 0.0 and self.damping >= 0.0, f"mass {self.mass} kg, damping {self.damping} N s/m"

    @property
    def nbytes(self) -> int:
        """Bytes that it holds."""
        return self.points.nbytes

    @property
    def state_bytes(self) -> int:
        """Bytes of one state."""
        return 8 * (1 + NUMBERS + 2 * (1 + self.law.memories) * self.points.count)

    def start(self, phase: int, load: float, turns: float, step: float) -> SkinState:
        """Return relaxed skin in the elastic contact at `phase` and `load` (N); see `Stepper`."""
        load = max(load, self.load_law.lightest)
        scale = self.points.height_scale
        half = round(math.ldexp(0.5 * turns * step, 64))
        ways = np.array([(phase + move) % 2**64 for move in (0, -half, half)], dtype=np.uint64)
        heights = np.empty(3)
        elastic_heights(self.points.tables, ways, load / (scale * self.load_law.stiffness(load)), heights)
        z, before, after = heights
        elements = np.zeros((2, 1 + self.law.memories, self.points.count))
        heights_at(self.points.tables, TURNS * float(ways[0].astype(np.int64)), elements[0, 0])
        elements[0, 0] -= z
        numbers = np.array([z] * 8 + [scale * (after - before) / step, load, load])
        return SkinState(self.law.coefficients(step), ways[:1].copy(), numbers, elements)

    def resumed(self, state: SkinState, step: float) -> SkinState:
        """See `Stepper`."""
        state = state.copied()
        state.coefficients = self.law.coefficients(step)
        return state

    def run(self, state: SkinState, phases: Phases, loads: Array, out: Array) -> None:
        """Go on to each of `phases` and `loads` (N); see `Stepper`."""
        assert out.shape == (ROWS, len(phases)) and len(loads) == len(phases), f"{out.shape} for {len(phases)} phases"
        step = state.coefficients
        contact = (self.points.height_scale, self.points.texture_period, self.mass, self.damping)
        law = (self.load_law.coefficient, self.load_law.power, self.load_law.lightest)
        run_steps(
            self.points.tables, contact, law, (step.step, step.when), step.head, step.terms,
            (self.with_static, self.with_force), state.phase, state.numbers, state.elements, phases, loads, out,
        )  # fmt: skip
