"""How a scene is simulated step by step, and what that changes: planned by pilots at its own speed and load.

Stage   2, used by `preparation`; `simulation.running` runs it, in the place of the response.
Model   A spring, with or without adhesion, has a pressure that only depends on where things stand: all of it fits into
        a table of its energy. A viscous skin has a memory at every place, and is followed there.
        A pilot is whole texture periods of the steady scan; a stroke or a recording is also run along its own motion.
        Skin is first followed at few points, then at twice as many, until half as many change little. Then a pilot is
        run with n and with 2 n steps a frame; n doubles until they agree within SETTLED of the tolerance. A pilot of
        the same contact without mass, memory and adhesion tells what the effects change.
        `errors` adds what twice the steps change (second order: a third more than the difference); of skin, what half
        the points change, and of a table, what half as many phases and heights change; what has not settled where the
        scan begins; and what the filter lets through.
Source  design, section 4: below 0.40 of the rate kept and above 0.45 removed; 0.35 and 0.49 where the speed changes.
Limits  estimates, held against independent solutions by tests/synth/effects. Where more would take longer than BUSY of
        a second's sound live, or BUSY_FILE in a file, or the pilot than PATIENCE, doubling ends, and `errors` tells
        what is left. So slow scans of coarse textures, whose periods are long, are planned within some seconds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from synth.arrays import Array
from synth.contact.load_balance import Contact
from synth.effects.simulation.decimation import Decimator
from synth.effects.simulation.periodic import FEWEST_STEPS as FEWEST_OF_PERIOD
from synth.effects.simulation.periodic import LONGEST, steady_of
from synth.effects.simulation.running import RESPONSE, Running, Signal, Simulation
from synth.effects.simulation.steps import Stepper, StiffnessLaw
from synth.effects.simulation.terms import Terms
from synth.errors import CannotRender
from synth.motion.scan_motion import LIFT_TIME, ScanMotion
from synth.plan.effect_choice import (
    MEAN_PHASES,
    OF_ONE_SHAPE,
    SimulationCase,
    outputs_of,
    relative_change,
    stiffness_round,
)
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
FORGOTTEN, AHEAD = 16.0, 0.05  # of a memory, which leaves 1e-7 of a start; s of it that a stream has time for
SETTLING = 0.5  # s that is simulated before a frame from which a run begins in the middle of its motion
HEAVIEST_HAND = 5.0  # N: a hand is prepared for at least; heavier, the contact is linear, which it is once all touches
HAND_MEAN = 0.1  # the tolerance to which the mean of z follows a hand's load, which a hand does not repeat
LIGHTEST = 0.01  # N: of a load that varies, what the table is made for at least
TABLE_SHARE = 0.2  # of the tolerance: the error of the table
LOOSEST_TABLE, TIGHTEST_TABLE = 1e-3, 1e-5  # of z: derivatives ask for more than displacement; tighter takes seconds
BUSY, BUSY_FILE = 0.14, 8.0  # s of work a second of sound, as predicted: more would not run beside others; takes hours
PATIENCE, PATIENCE_FILE = 0.2, 1.0  # s of work that the next finer pilot may take, as predicted, live and of a file
SHARED = 1.5  # times as long as predicted: a processor whose caches others share was seen to take 1 to 2 times
FEWEST_POINTS, MOST_POINTS = 65, 16385  # of skin: fewer save less than a call costs; 30 us a step
SETTLED = 0.4  # of the tolerance: what twice the steps may change of a quantity
POINTS_SHARE = 0.5  # of the tolerance: the error of the skin's points
LEFT_BY_POINTS = 0.55  # of what half as fine a contact changes: order 1.5, by kinks where surfaces begin to touch


@dataclass(frozen=True, slots=True)
class Pilot:
    """A simulation in the state in which it begins, and a run of it at the scan's speed and load.

    moved: z, float64 [orders, frames]. offset: of displacement (m). own: the same along the first part of a stroke or a
    recording, no frames otherwise.
    """

    simulation: Simulation
    moved: Array
    offset: float
    own: Array

    @property
    def repeats(self) -> bool:
        """False where the motion does not repeat: in other steps it would begin elsewhere, which says nothing."""
        return self.simulation.steady is None or self.simulation.steady.repeats

    @property
    def work(self) -> float:
        """How long (s) its steps take, as predicted."""
        return float(_work(self.simulation) * self.moved.shape[1] / self.simulation.scene.output.sample_rate)

    def differs_from(self, other: Pilot) -> tuple[float, ...]:
        """Return the largest difference of each order from another pilot, relative to the peak-to-peak."""
        steady = map(relative_change, self.moved, other.moved)
        if not self.own.size:
            return tuple(steady)
        return tuple(map(max, steady, map(relative_change, self.own, other.own)))


def started(simulation: Simulation, case: SimulationCase) -> Pilot:
    """Return the pilot of `simulation` in its periodic state, searched for from the one that it has, if any.

    Where nothing moves a start is that state. None, too, where a period is too long to be run several times. Skin that
    forgets within a small part of a period is run for so long ahead instead.
    """
    memory = FORGOTTEN * simulation.stepper.memory
    if simulation.stepper.mass == 0.0 and 0.0 < memory <= min(AHEAD, 0.5 / max(abs(case.turns), 1e-9)):
        simulation = replace(simulation, settling=memory)
    elif case.turns != 0.0 and simulation.rate <= LONGEST * abs(case.turns):
        crossings = case.scene.texture.period / case.scene.finger.ridge_period
        asked = (case.turns, case.nominal.scan.load, steps_of_period(simulation, case), crossings, case.tolerance)
        simulation = replace(simulation, steady=steady_of(simulation.stepper, *asked, simulation.steady))
    return run_pilot(simulation, case)


def steps_of_period(simulation: Simulation, case: SimulationCase) -> int:
    """Return the whole number of steps nearest to a texture period."""
    return max(FEWEST_OF_PERIOD, round(simulation.rate / abs(case.turns)))


@dataclass(frozen=True, slots=True)
class SimulationPlan:
    """How a scene is simulated.

    simulation: ready to run. change, errors, peaks: of each order asked for: what the effects change, relative; the
    error, relative to the peak-to-peak; the peak (SI) at the scan's speed and load, or along a recording. pilot: the
    run that showed it. finer: the same in steps of half the length.
    """

    simulation: Simulation
    orders: tuple[int, ...]
    change: tuple[float, ...]
    errors: tuple[float, ...]
    peaks: tuple[float, ...]
    pilot: Pilot
    finer: Simulation

    @property
    def nominal(self) -> Simulation:
        """What the pilot ran."""
        return self.pilot.simulation

    @property
    def extents(self) -> tuple[float, ...]:
        """Peak-to-peak (SI) of each order at the scan's speed and load."""
        return tuple(np.ptp(self.pilot.moved, axis=1).tolist())

    @property
    def signals(self) -> tuple[Signal, ...]:
        """What a voice asks of the simulation: z about its mean, of every order."""
        return tuple(Signal(RESPONSE, order) for order in self.orders)

    @property
    def let_go(self) -> bool:
        """True where nothing holds the finger at the scan's own load."""
        return self.simulation.held and not any(self.extents)

    def change_from(self, other: SimulationPlan) -> tuple[float, ...]:
        """Return by how much each order differs from another simulation of the same scan, relative to that one."""
        return tuple(map(relative_change, other.pilot.moved, self.pilot.moved))

    @property
    def work(self) -> float:
        """Processor seconds that a second of sound takes, as predicted."""
        return SHARED * _work(self.simulation)


def plan_simulation(case: SimulationCase, terms: Terms) -> SimulationPlan:
    """Return how `case` is simulated with `terms`; CannotRender where the contact changes its shape with the load."""
    if not case.contact.of_one_shape and case.load_varies:
        raise CannotRender(OF_ONE_SHAPE)
    busy, patience = (BUSY, PATIENCE) if case.live else (BUSY_FILE, PATIENCE_FILE)
    counts = _points(case, terms, busy)
    tried = started(_first_simulation(case, terms, counts[0]), case)
    of_points = _table_errors(case, tried)
    for count in counts[1:]:
        before = tried
        tried = started(replace(tried.simulation, stepper=_stepper_of(case, terms, count)), case)
        of_points = tuple(LEFT_BY_POINTS * one for one in tried.differs_from(before))
        enough = not tried.repeats or max(of_points) <= POINTS_SHARE * case.tolerance
        if enough or 2.0 * tried.work > patience:
            break
    while True:
        steps = 2 * tried.simulation.steps
        finer = started(replace(tried.simulation, steps=steps, filters=_filters_of(case, terms, steps)), case)
        of_steps = finer.differs_from(tried)
        dear = _work(finer.simulation) > busy or 2.0 * finer.work > patience
        if not tried.repeats or max(of_steps) <= SETTLED * case.tolerance or dear:
            break
        tried = finer
    change, peaks = _change_and_peaks(case, tried)
    filtered = 10.0 ** (-_attenuation_of(case) / 20.0)
    parts = zip(of_steps, of_points, _start_errors(case, tried), strict=True)
    errors = tuple(4.0 / 3.0 * steps + sum(others) + filtered for steps, *others in parts)
    ready = replace(tried.simulation, scene=case.scene, offset=tried.offset)
    return SimulationPlan(ready, case.orders, change, errors, peaks, tried, finer.simulation)


def _points(case: SimulationCase, terms: Terms, busy: float) -> list[int]:
    """Return the numbers of points to try, each half of the next; the last is what steps leave time for."""
    if terms.skin is None:
        return [0]
    steps = max(2.0 * case.scene.output.sample_rate, FEWEST_STEPS)
    counts = [min(max(FEWEST_POINTS, int(busy / steps / terms.skin.point_time)), MOST_POINTS)]
    while counts[0] > 2 * FEWEST_POINTS or len(counts) == 1:
        counts.insert(0, (counts[0] + 1) // 2)
    return counts


def _table_errors(case: SimulationCase, tried: Pilot) -> tuple[float, ...]:
    """Return what the error of a table makes of each order, from what half as fine a one changes; 0 without one."""
    coarser = tried.simulation.stepper.coarser()
    if coarser is None or not tried.repeats:
        return (0.0,) * len(case.orders)
    other = started(replace(tried.simulation, stepper=coarser), case)
    return tuple(LEFT_BY_POINTS * one for one in other.differs_from(tried))


def _start_errors(case: SimulationCase, tried: Pilot) -> tuple[float, ...]:
    """Return by how much a constant scan may differ from what it settles to, or comes to later, of each order."""
    simulation, steady = tried.simulation, tried.simulation.steady
    if steady is not None:
        later, factor = steady.later(simulation.stepper, steps_of_period(simulation, case))
        others = [replace(simulation, steady=other) for other in later]
    else:
        memory = simulation.stepper.memory
        others = [replace(simulation, settling=2.0 * simulation.settling)]
        factor = 1.0 / -math.expm1(-simulation.settling / memory) if memory > 0.0 else 1.0
    differences = [run_pilot(other, case).differs_from(tried) for other in others]
    return tuple(factor * max(each) for each in zip(*differences, strict=True))


def _work(simulation: Simulation) -> float:
    """Return how long (s) the steps of a second of sound take, as predicted."""
    return simulation.rate * simulation.stepper.step_time


def _run(simulation: Simulation, case: SimulationCase, frames: int) -> Array:
    """Return the first frames of a run: float64 [orders, frames]."""
    signals = tuple(Signal(RESPONSE, order) for order in case.orders)
    return Running(simulation, signals).along(0, frames)


def run_pilot(simulation: Simulation, case: SimulationCase) -> Pilot:
    """Return a run of whole periods; only a run of one that is too long may hold a part of it."""
    rate = case.scene.output.sample_rate
    period = 1.0 / abs(case.turns) if case.turns else PILOT
    whole = rate * min(period * max(1.0, math.ceil(PILOT / period)), LONGEST_PILOT)
    moved = _run(simulation, case, max(64, math.ceil(whole) + 1))
    offset = 0.0
    if case.orders[0] == 0:
        times = np.append(np.arange(math.ceil(whole)), whole)
        risen = np.interp(times, np.arange(moved.shape[1]), moved[0] - moved[0, 0])
        offset = float(moved[0, 0] + np.trapezoid(risen, times) / whole)
        moved[0] -= offset
    own = np.empty((len(case.orders), 0))
    if case.moving and not case.by_hand:
        own = _run_own(replace(simulation, offset=offset), case, OWN)
    return Pilot(simulation, moved, offset, own)


def _run_own(simulation: Simulation, case: SimulationCase, longest: float) -> Array:
    """Return the scan's own motion, `longest` seconds of it at most: float64 [orders, frames]."""
    output = case.scene.output
    seconds = min(output.duration, longest, ScanMotion(case.scene).duration + LIFT_TIME)
    return _run(replace(simulation, scene=case.scene), case, max(1, round(seconds * output.sample_rate)))


def _change_and_peaks(case: SimulationCase, tried: Pilot) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return what the effects change of each order, relative to the elastic peak-to-peak, and its peak (SI): at the
    scan's speed and load, or, where they change more there, along a recording, whose peak it always is.
    """
    simulation, moved = tried.simulation, tried.moved
    elastic = replace(simulation, stepper=simulation.stepper.elastic, steady=None, settling=0.0)
    still = run_pilot(elastic, case)
    change = tuple(map(relative_change, still.moved, moved))
    if case.scene.scan.trajectory is not None and not case.by_hand:
        moved = _run_own(replace(simulation, offset=tried.offset), case, LONGEST_OWN)
        still_own = _run_own(replace(elastic, offset=still.offset), case, LONGEST_OWN)
        change = tuple(map(max, change, map(relative_change, still_own, moved)))
    return change, tuple(np.max(np.abs(moved), axis=1).tolist())


def _first_simulation(case: SimulationCase, terms: Terms, points: int) -> Simulation:
    """Return the simulation of `case` with `terms` in as few steps as may do, and skin at so many points."""
    steps = max(2, math.ceil(FEWEST_STEPS / case.scene.output.sample_rate))
    low, high = case.loads
    between = (max(low, 0.0), max(high, case.pressed)) if case.load_varies else (case.pressed, case.pressed)
    return Simulation(
        stepper=_stepper_of(case, terms, points),
        scene=case.nominal,
        steps=steps,
        filters=_filters_of(case, terms, steps),
        reference=mean_curve(case.contact, between, case.pressed, max(case.tolerance, HAND_MEAN * case.by_hand)),
        offset=0.0,
        held=terms.adhesion is not None,
        settling=SETTLING,
    )


def _stepper_of(case: SimulationCase, terms: Terms, points: int) -> Stepper:
    """Return what simulates `case` with `terms`, skin at so many points."""
    contact, load, forces = case.contact, case.pressed, bool(outputs_of(case.scene))
    stiffness = StiffnessLaw.of(contact, load, case.scene.scan.lift_load)
    if terms.skin is not None:  # what a scene has no use for is not loaded
        from synth.effects.simulation.skin_points import SkinPoints
        from synth.effects.simulation.skin_steps import SkinStepper

        found = SkinPoints.of_contact(contact, load, points)
        return SkinStepper(found, terms.skin, stiffness, terms.mass, terms.damping, forces)
    from synth.effects.simulation.energy_table import EnergyTable
    from synth.effects.simulation.table_steps import TableStepper

    # a finger only passes lighter loads than these
    low, high = (LIGHTEST, max(HEAVIEST_HAND, 4.0 * load)) if case.by_hand else case.loads
    lightest, heaviest = min(max(low, LIGHTEST), load), max(high, load)
    reach = pull = sunk = 0.0
    if terms.adhesion is not None:
        reach = terms.adhesion.reach
        pull = terms.adhesion.stress * contact.width_at(load) * contact.geometry_at(load).contact_length
        sunk = reach + _sunk(contact, load, heaviest, pull)
    exact = LOOSEST_TABLE if case.by_hand else min(max(TABLE_SHARE * case.tolerance, TIGHTEST_TABLE), LOOSEST_TABLE)
    table = EnergyTable.of(contact, load, lightest, heaviest, below=sunk, above=reach, tolerance=exact)
    period = contact.geometry.texture_period
    return TableStepper(table, stiffness, terms.mass, terms.damping, pull, reach, period, forces)


def _sunk(contact: Contact, load: float, heaviest: float, pull: float) -> float:
    """Return how much deeper (m) the contact of `load` (N) sinks at most where all of `pull` (N) adds to `heaviest`.

    Its first part sinks it far more than the mean indentation says: only a part of the length touches.
    """
    phases, stiffness = np.arange(MEAN_PHASES) / MEAN_PHASES, contact.stiffness_at(heaviest)
    solver = contact.solver(load)
    pressed, pulled = (solver.solve(phases, force / stiffness).height for force in (heaviest, heaviest + pull))
    return float(np.max(pressed - pulled))


def _attenuation_of(case: SimulationCase) -> float:
    """Return by how much (dB) what is removed is removed: to a tenth of the tolerance."""
    return min(max(-20.0 * math.log10(0.1 * case.tolerance), LEAST_ATTENUATION), MOST_ATTENUATION)


def _filters_of(case: SimulationCase, terms: Terms, steps: int) -> Decimator:
    """Return what makes frames of `steps` steps; a mass that the band shows has made up what its steps lose."""
    orders = tuple(sorted({0, *case.orders}))
    rate = case.scene.output.sample_rate
    kept, removed = MOVING_BAND if case.moving else STEADY_BAND  # parts of the rate
    narrow = case.scene.output.bandwidth_hz / rate
    if narrow < kept:
        widening = WIDENING_AFTER_HAND if case.by_hand else WIDENING
        kept, removed = narrow, min(widening * narrow, MOVING_BAND[1])
    heavy = terms.mass * (math.pi * kept * rate) ** 2 > stiffness_round(case.contact, case.pressed)
    return Decimator.of(orders, rate, steps, (kept, removed), _attenuation_of(case), of_mass=heavy)
