"""A scene's case for a simulation, and its pilot: a run at the scan's own speed and load, with and without the effects.

Stage   2, used by `simulation_plan` and `simulation_error`.
Model   whole texture periods of the steady scan; a stroke or a recording is also run along its own motion. Frames come
        out of the steps through the filters that a voice takes: what is kept and what is removed is said here.
Source  design, section 4: below 0.40 of the rate kept and above 0.45 removed; 0.35 and 0.49 where the speed changes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from synth.arrays import Array
from synth.contact.balance import Contact
from synth.effects.simulation.decimation import Decimator
from synth.effects.simulation.periodic import LONGEST, Found, steady_of_table
from synth.effects.simulation.running import RESPONSE, STATIC_RESPONSE, Running, Signal, Simulation
from synth.effects.simulation.skin_settling import steady_of_skin
from synth.effects.simulation.skin_steps import SkinStepper
from synth.effects.simulation.steppers import stiffness_round
from synth.effects.simulation.terms import Terms
from synth.motion.motion import LIFT_TIME, ScanMotion
from synth.plan.effect_choice import relative_change
from synth.scene.scene import Scene

SMALL = 0.1  # of the peak-to-peak: a smaller change is added to the response, a larger one takes its place
PILOT, LONGEST_PILOT = 0.05, 20.0  # s: of whole periods at least, and where a period takes longer than that
LONGEST_OWN = 10.0  # s of a recording that are tried, to see what the effects change along it
OWN = 1.0  # s of a stroke or a recording along which steps are judged too
STEADY_BAND, MOVING_BAND = (0.40, 0.45), (0.35, 0.49)  # of the rate: kept and removed
# times the bandwidth, of a scan and after a hand: where a narrower band is gone. Steeper filters look further ahead,
# and are later behind a hand: 2.6 ms at 1 kHz
WIDENING, WIDENING_AFTER_HAND = 1.5, 2.0
LEAST_ATTENUATION, MOST_ATTENUATION = 70.0, 140.0  # dB


@dataclass(frozen=True, slots=True)
class Case:
    """What is to be simulated: the scene, its contact, and what is wanted of it.

    orders: time derivatives of z, rising. tolerance: as a number. loads: smallest and largest (N). moving: its speed or
    load changes. live: its blocks have deadlines. forces: the horizontal forces are wanted too.
    """

    scene: Scene
    contact: Contact
    orders: tuple[int, ...]
    tolerance: float
    loads: tuple[float, float]
    moving: bool
    by_hand: bool
    live: bool
    forces: bool

    @property
    def nominal(self) -> Scene:
        """The steady scan at the scene's own speed and load."""
        scan = self.scene.scan.model_copy(update={"stroke": None, "trajectory": None, "load": self.load})
        return self.scene.model_copy(update={"scan": scan})

    @property
    def load(self) -> float:
        """The scan's load (N), a pull too; or the lift load where it presses less."""
        load = self.scene.scan.load
        return load if load < 0.0 else max(load, self.scene.scan.lift_load)

    @property
    def pressed(self) -> float:
        """The load (N) at which the contact is pressed."""
        return max(self.load, self.scene.scan.lift_load)

    @property
    def turns(self) -> float:
        """Texture periods a second, signed."""
        return self.scene.scan.speed / self.scene.texture.period


@dataclass(frozen=True, slots=True)
class Pilot:
    """A run at the scan's speed and load: float64 [orders, frames] of z and of the elastic z; the offset of
    displacement (m). own, own_static: the same along the first part of a stroke or a recording, no frames otherwise.
    alone: nothing may be added to the response, as it has none for loads below 0, and what follows a
    hand is later than it."""

    moved: Array
    static: Array
    offset: float
    own: Array
    own_static: Array
    alone: bool

    @property
    def change(self) -> tuple[float, ...]:
        """What the effects change of each order, relative to the elastic peak-to-peak."""
        pairs = zip(self.static, self.moved, strict=True)
        return tuple(relative_change(before, after) for before, after in pairs)

    @property
    def added(self) -> bool:
        """True where the change is small enough to be added to the response."""
        return max(self.change) <= SMALL and not self.alone

    def differs_from(self, other: Pilot) -> tuple[float, ...]:
        """Return the largest difference of each order from another pilot, relative to the peak-to-peak."""
        steady = _relative(self.moved, self.moved - other.moved, self.static - other.static if self.added else 0.0)
        if not self.own.size:
            return steady
        own = _relative(self.own, self.own - other.own, self.own_static - other.own_static if self.added else 0.0)
        return tuple(max(pair) for pair in zip(steady, own, strict=True))


def _relative(moved: Array, gaps: Array, taken_off: Array | float) -> tuple[float, ...]:
    """Return the largest of each of `gaps`, less what is taken off, relative to the peak-to-peak of each of `moved`."""
    extents, largest = np.ptp(moved, axis=1), np.max(np.abs(gaps - taken_off), axis=1)
    return tuple(float(gap / extent) if extent > 0.0 else 0.0 for gap, extent in zip(largest, extents, strict=True))


def run_pilot(simulation: Simulation, case: Case) -> Pilot:
    """Return a run of whole periods; only a run of one that is too long may hold a part of it."""
    rate = case.scene.output.sample_rate
    period = 1.0 / abs(case.turns) if case.turns else PILOT
    seconds = min(period * max(1.0, math.ceil(PILOT / period)), max(LONGEST_PILOT, PILOT))
    frames = max(64, round(seconds * rate))
    rows = Running(simulation, _both(case)).along(0, frames)
    moved, static = rows[: len(case.orders)], rows[len(case.orders) :]
    offset = 0.0
    if case.orders[0] == 0:
        offset = float(np.mean(moved[0] - static[0]))
        moved[0] -= offset
    own = np.empty((2 * len(case.orders), 0))
    scan, output = case.scene.scan, case.scene.output
    if not case.by_hand and (scan.stroke is not None or scan.trajectory is not None):
        frames = max(1, round(min(output.duration, OWN) * rate))
        own = Running(replace(simulation, scene=case.scene), _both(case)).along(0, frames)
    alone = case.by_hand or min(case.loads) < 0.0
    return Pilot(moved, static, offset, own[: len(case.orders)], own[len(case.orders) :], alone)


def begun(case: Case, simulation: Simulation) -> tuple[Simulation, Found | None]:
    """Return the simulation with the periodic state in which it begins, and how well that is known.

    The search begins at the one that it has, if any. Where nothing moves a start is that state. None, too, where a
    period is too long to be run several times.
    """
    turns, load = case.turns, case.nominal.scan.load
    if turns == 0.0 or simulation.rate > LONGEST * abs(turns):
        return replace(simulation, steady=None), None
    stiffness, stepper = stiffness_round(case.contact, case.pressed), simulation.stepper
    if isinstance(stepper, SkinStepper):
        geometry = case.contact.geometry
        crossings = geometry.texture_period / geometry.ridge_period
        asked = (turns, load, simulation.rate, stiffness, crossings, case.tolerance)
        found = steady_of_skin(stepper, *asked, near=simulation.steady)
    else:
        found = steady_of_table(stepper, turns, load, simulation.rate, stiffness)
    return replace(simulation, steady=found.steady), found


def own_change(case: Case, simulation: Simulation, pilot: Pilot) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return what the effects change of each order, and its peak (SI): at the scan's speed and load, or, where they
    change more there, along a recording, whose peak it always is.
    """
    if case.scene.scan.trajectory is None or case.by_hand:
        return pilot.change, tuple(np.max(np.abs(pilot.moved), axis=1).tolist())
    output = case.scene.output
    frames = round(min(output.duration, ScanMotion(case.scene).duration + LIFT_TIME, LONGEST_OWN) * output.sample_rate)
    own = replace(simulation, scene=case.scene, offset=pilot.offset)
    rows = Running(own, _both(case)).along(0, max(frames, 1))
    moved, static = rows[: len(case.orders)], rows[len(case.orders) :]
    pairs = zip(static, moved, pilot.change, strict=True)
    change = tuple(max(relative_change(before, after), steady) for before, after, steady in pairs)
    return change, tuple(np.max(np.abs(moved), axis=1).tolist())


def _both(case: Case) -> tuple[Signal, ...]:
    """Return the signals of every order with and without the effects."""
    return tuple(Signal(kind, order) for kind in (RESPONSE, STATIC_RESPONSE) for order in case.orders)


def band_of(case: Case) -> tuple[float, float]:
    """Return the ends of what is kept and of what is removed, as parts of the rate."""
    passing, stopping = MOVING_BAND if case.moving else STEADY_BAND
    part = case.scene.output.bandwidth_hz / case.scene.output.sample_rate
    widening = WIDENING_AFTER_HAND if case.by_hand else WIDENING
    return (part, min(widening * part, MOVING_BAND[1])) if part < passing else (passing, stopping)


def attenuation_of(case: Case) -> float:
    """Return by how much (dB) what is removed is removed: to a tenth of the tolerance."""
    return min(max(-20.0 * math.log10(0.1 * case.tolerance), LEAST_ATTENUATION), MOST_ATTENUATION)


def filters_of(case: Case, terms: Terms, steps: int) -> Decimator:
    """Return what makes frames of `steps` steps; a mass that the band shows has made up what its steps lose."""
    orders = tuple(sorted({0, *case.orders}))
    rate, band = case.scene.output.sample_rate, band_of(case)
    heavy = terms.mass * (math.pi * band[0] * rate) ** 2 > stiffness_round(case.contact, case.pressed)
    return Decimator.of(orders, rate, steps, band, attenuation_of(case), of_mass=heavy)
