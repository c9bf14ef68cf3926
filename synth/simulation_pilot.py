"""A scene's case for a simulation, and its pilot: a run at the scan's own speed and load, with and without the effects.

Stage   2, used by `simulation_plan` and `simulation_error`.
Model   whole texture periods of the steady scan; a recording is also run along its own motion. Frames come out of the
        steps through the filters that a voice takes: what is kept and what is removed is said here.
Source  design, section 4: below 0.40 of the rate kept and above 0.45 removed; 0.35 and 0.49 where the speed changes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from synth.contact.balance import Contact
from synth.contact.exact import Array
from synth.effect_choice import relative_change
from synth.motion import LIFT_TIME, ScanMotion
from synth.scene import Scene
from synth.simulation.decimation import Decimator
from synth.simulation.running import RESPONSE, STATIC_RESPONSE, Running, Signal, Simulation
from synth.simulation.steppers import stiffness_round
from synth.simulation.terms import Terms

SMALL = 0.1  # of the peak-to-peak: a smaller change is added to the response, a larger one takes its place
PILOT, LONGEST_PILOT = 0.05, 20.0  # s: of whole periods at least, and where a period takes longer than that
LONGEST_OWN = 10.0  # s of a recording that are tried, to see what the effects change along it
STEADY_BAND, MOVING_BAND = (0.40, 0.45), (0.35, 0.49)  # of the rate: kept and removed
# times the bandwidth, of a scan and after a hand: where a narrower band is gone. Steeper filters look further ahead,
# and are later behind a hand: 2.6 ms at 1 kHz
WIDENING, WIDENING_AFTER_HAND = 1.5, 2.0
LEAST_ATTENUATION, MOST_ATTENUATION = 70.0, 140.0  # dB


@dataclass(frozen=True, slots=True)
class Case:
    """What is to be simulated: the scene, its contact, and what is wanted of it.

    orders: time derivatives of z, rising. tolerance: as a number. loads: smallest and largest (N). moving: its speed or
    load changes. forces: the horizontal forces are wanted too.
    """

    scene: Scene
    contact: Contact
    orders: tuple[int, ...]
    tolerance: float
    loads: tuple[float, float]
    moving: bool
    by_hand: bool
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
    displacement (m). alone: nothing may be added to the response, as it has none for loads below 0, and what follows a
    hand is later than it."""

    moved: Array
    static: Array
    offset: float
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
        gaps = self.moved - other.moved
        if self.added:
            gaps -= self.static - other.static
        extents = np.ptp(self.moved, axis=1)
        return tuple(
            float(np.max(np.abs(gap))) / extent if extent > 0.0 else 0.0
            for gap, extent in zip(gaps, extents, strict=True)
        )


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
    return Pilot(moved, static, offset, case.by_hand or min(case.loads) < 0.0)


def own_change(case: Case, simulation: Simulation, pilot: Pilot) -> tuple[float, ...]:
    """Return what the effects change of each order: at the scan's speed and load, or, if more, along a recording."""
    if case.scene.scan.trajectory is None or case.by_hand:
        return pilot.change
    output = case.scene.output
    frames = round(min(output.duration, ScanMotion(case.scene).duration + LIFT_TIME, LONGEST_OWN) * output.sample_rate)
    own = replace(simulation, scene=case.scene, offset=pilot.offset)
    rows = Running(own, _both(case)).along(0, max(frames, 1))
    moved, static = rows[: len(case.orders)], rows[len(case.orders) :]
    pairs = zip(static, moved, pilot.change, strict=True)
    return tuple(max(relative_change(before, after), steady) for before, after, steady in pairs)


def _both(case: Case) -> tuple[Signal, ...]:
    """Return the signals of every order with and without the effects."""
    return tuple(Signal(kind, order) for kind in (RESPONSE, STATIC_RESPONSE) for order in case.orders)


def band_of(case: Case) -> tuple[float, float]:
    """Return the ends of what is kept and of what is removed, as parts of the rate."""
    passing, stopping = MOVING_BAND if case.moving else STEADY_BAND
    bandwidth = case.scene.output.bandwidth
    part = math.inf if bandwidth is None else bandwidth / case.scene.output.sample_rate
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
