"""How a case is simulated: what moves it on, its filters, and its pilot, a run at the scan's own speed and load.

Stage   2, used by `simulation_plan`.
Model   A spring, with or without adhesion, has a pressure that only depends on where things stand: all of it fits into
        a table of its energy. A viscous skin has a memory at every place, and is followed there.
        The pilot is whole texture periods of the steady scan; a stroke or a recording is also run along its own motion.
        Frames come out of the steps through the filters that a voice takes: what is kept and what is removed is said
        here.
Source  design, section 4: below 0.40 of the rate kept and above 0.45 removed; 0.35 and 0.49 where the speed changes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from synth.arrays import Array
from synth.contact.load_balance import Contact
from synth.effects.simulation.decimation import Decimator
from synth.effects.simulation.periodic import LONGEST, Found, steady_of
from synth.effects.simulation.running import RESPONSE, Running, Signal, Simulation
from synth.effects.simulation.steps import Stepper, Stiffness
from synth.effects.simulation.terms import Terms
from synth.motion.scan_motion import LIFT_TIME, ScanMotion
from synth.plan.effect_choice import MEAN_PHASES, Case, relative_change
from synth.response.mean_approach import mean_curve

PILOT, LONGEST_PILOT = 0.05, 20.0  # s: of whole periods at least, and where a period takes longer than that
LONGEST_OWN = 10.0  # s of a recording that are tried, to see what the effects change along it
OWN = 1.0  # s of a stroke or a recording along which steps are judged too
STEADY_BAND, MOVING_BAND = (0.40, 0.45), (0.35, 0.49)  # of the rate: kept and removed
# times the bandwidth, of a scan and after a hand: where a narrower band is gone. Steeper filters look further ahead,
# and are later behind a hand: 2.6 ms at 1 kHz
WIDENING, WIDENING_AFTER_HAND = 1.5, 2.0
LEAST_ATTENUATION, MOST_ATTENUATION = 70.0, 140.0  # dB
FEWEST_STEPS = 96e3  # steps a second at least: contacts change within tens of microseconds
SETTLING = 0.5  # s that is simulated before a frame from which a run begins in the middle of its motion
HEAVIEST_HAND = 5.0  # N: a hand is prepared for at least; heavier, the contact is linear, which it is once all touches
LIGHTEST = 0.01  # N: of a load that varies, what the table is made for at least
TABLE_SHARE = 0.2  # of the tolerance: the error of the table
LOOSEST_TABLE, TIGHTEST_TABLE = 1e-3, 1e-5  # of z: derivatives ask for more than displacement; tighter takes seconds


@dataclass(frozen=True, slots=True)
class Pilot:
    """A run at the scan's speed and load: float64 [orders, frames] of z; the offset of displacement (m). own: the same
    along the first part of a stroke or a recording, no frames otherwise.
    """

    moved: Array
    offset: float
    own: Array

    def differs_from(self, other: Pilot) -> tuple[float, ...]:
        """Return the largest difference of each order from another pilot, relative to the peak-to-peak."""
        steady = map(relative_change, self.moved, other.moved)
        if not self.own.size:
            return tuple(steady)
        return tuple(map(max, steady, map(relative_change, self.own, other.own)))


@dataclass(frozen=True, slots=True)
class Tried:
    """A simulation in the state in which it begins, how well that is known, and its pilot."""

    simulation: Simulation
    found: Found | None
    pilot: Pilot

    @classmethod
    def of(cls, case: Case, simulation: Simulation) -> Tried:
        """Return the simulation in its periodic state, searched for from the one that it has, if any.

        Where nothing moves a start is that state. None, too, where a period is too long to be run several times.
        """
        found = None
        if case.turns != 0.0 and simulation.rate <= LONGEST * abs(case.turns):
            crossings = case.scene.texture.period / case.scene.finger.ridge_period
            asked = (case.turns, case.nominal.scan.load, simulation.rate, crossings, case.tolerance)
            found = steady_of(simulation.stepper, *asked, simulation.steady)
        simulation = replace(simulation, steady=None if found is None else found.steady)
        return cls(simulation, found, run_pilot(simulation, case))

    @property
    def settled(self) -> bool:
        """False where the motion does not repeat: in other steps it would begin elsewhere, which says nothing."""
        return self.found is None or self.found.repeats


def signals_of(orders: tuple[int, ...]) -> tuple[Signal, ...]:
    """Return z about its mean, of every order."""
    return tuple(Signal(RESPONSE, order) for order in orders)


def run_pilot(simulation: Simulation, case: Case) -> Pilot:
    """Return a run of whole periods; only a run of one that is too long may hold a part of it."""
    rate = case.scene.output.sample_rate
    period = 1.0 / abs(case.turns) if case.turns else PILOT
    whole = rate * min(period * max(1.0, math.ceil(PILOT / period)), LONGEST_PILOT)
    moved = Running(simulation, signals_of(case.orders)).along(0, max(64, math.ceil(whole) + 1))
    offset = 0.0
    if case.orders[0] == 0:
        times = np.append(np.arange(math.ceil(whole)), whole)
        risen = np.interp(times, np.arange(moved.shape[1]), moved[0] - moved[0, 0])
        offset = float(moved[0, 0] + np.trapezoid(risen, times) / whole)
        moved[0] -= offset
    own = np.empty((len(case.orders), 0))
    scan = case.scene.scan
    if not case.by_hand and (scan.stroke is not None or scan.trajectory is not None):
        own = run_own(replace(simulation, offset=offset), case, OWN)
    return Pilot(moved, offset, own)


def run_own(simulation: Simulation, case: Case, longest: float) -> Array:
    """Return the scan's own motion, `longest` seconds of it at most: float64 [orders, frames]."""
    output = case.scene.output
    seconds = min(output.duration, longest)
    if case.scene.scan.trajectory is not None:
        seconds = min(seconds, ScanMotion(case.scene).duration + LIFT_TIME)
    run = Running(replace(simulation, scene=case.scene), signals_of(case.orders))
    return run.along(0, max(1, round(seconds * output.sample_rate)))


def change_and_peaks(case: Case, tried: Tried) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return what the effects change of each order, relative to the elastic peak-to-peak, and its peak (SI): at the
    scan's speed and load, or, where they change more there, along a recording, whose peak it always is.
    """
    simulation, moved = tried.simulation, tried.pilot.moved
    elastic = replace(simulation, stepper=simulation.stepper.elastic, steady=None, settling=0.0)
    still = run_pilot(elastic, case)
    change = [relative_change(*pair) for pair in zip(still.moved, moved, strict=True)]
    if case.scene.scan.trajectory is not None and not case.by_hand:
        moved = run_own(replace(simulation, offset=tried.pilot.offset), case, LONGEST_OWN)
        still_own = run_own(replace(elastic, offset=still.offset), case, LONGEST_OWN)
        pairs = zip(change, still_own, moved, strict=True)
        change = [max(steady, relative_change(before, after)) for steady, before, after in pairs]
    return tuple(change), tuple(np.max(np.abs(moved), axis=1).tolist())


def first_simulation(case: Case, terms: Terms, points: int) -> Simulation:
    """Return the simulation of `case` with `terms` in as few steps as may do, and skin at so many points."""
    steps = max(2, math.ceil(FEWEST_STEPS / case.scene.output.sample_rate))
    low, high = case.loads
    between = (case.pressed, case.pressed) if low == high else (max(low, 0.0), max(high, case.pressed))
    return Simulation(
        stepper=stepper_of(case, terms, points),
        scene=case.nominal,
        steps=steps,
        filters=filters_of(case, terms, steps),
        reference=mean_curve(case.contact, between, case.pressed, case.tolerance),
        offset=0.0,
        held=terms.adhesion is not None,
        settling=SETTLING,
    )


def stepper_of(case: Case, terms: Terms, points: int) -> Stepper:
    """Return what simulates `case` with `terms`, skin at so many points."""
    contact, load = case.contact, case.pressed
    stiffness = Stiffness.of(contact, load, case.scene.scan.lift_load)
    if terms.skin is not None:  # what a scene has no use for is not loaded
        from synth.effects.simulation.skin_points import SkinPoints
        from synth.effects.simulation.skin_steps import SkinStepper

        found = SkinPoints.of_contact(contact, load, points)
        return SkinStepper(found, terms.skin, stiffness, terms.mass, terms.damping, case.forces)
    from synth.effects.simulation.energy_table import EnergyTable
    from synth.effects.simulation.table_steps import TableStepper

    lightest, heaviest = _loads(case)
    length = contact.geometry_at(load).contact_length
    reach = 0.0 if terms.adhesion is None else terms.adhesion.reach
    # a ridge is as long across the scan as the contact is along it (eq. 4)
    pull = 0.0 if terms.adhesion is None else terms.adhesion.stress * contact.geometry.contact_length * length
    sunk = 0.0 if terms.adhesion is None else reach + _sunk(contact, load, heaviest, pull)
    exact = min(max(TABLE_SHARE * case.tolerance, TIGHTEST_TABLE), LOOSEST_TABLE)
    table = EnergyTable.of(contact, load, lightest, heaviest, below=sunk, above=reach, tolerance=exact)
    period = contact.geometry.texture_period
    return TableStepper(table, stiffness, terms.mass, terms.damping, pull, reach, period, case.forces)


def _loads(case: Case) -> tuple[float, float]:
    """Return between which loads (N) the stepper's contact must be right: a finger only passes lighter ones."""
    low, high = (LIGHTEST, HEAVIEST_HAND) if case.by_hand else case.loads
    return min(max(low, LIGHTEST), case.pressed), max(high, 4.0 * case.pressed if case.by_hand else case.pressed)


def _sunk(contact: Contact, load: float, heaviest: float, pull: float) -> float:
    """Return how much deeper (m) the contact of `load` (N) sinks at most where all of `pull` (N) adds to `heaviest`.

    Its first part sinks it far more than the mean indentation says: only a part of the length touches.
    """
    phases, stiffness = np.arange(MEAN_PHASES) / MEAN_PHASES, contact.stiffness_at(heaviest)
    solver = contact.solver(load)
    pressed, pulled = (solver.solve(phases, force / stiffness).height for force in (heaviest, heaviest + pull))
    return float(np.max(pressed - pulled))


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
    heavy = terms.mass * (math.pi * band[0] * rate) ** 2 > case.stiffness
    return Decimator.of(orders, rate, steps, band, attenuation_of(case), of_mass=heavy)
