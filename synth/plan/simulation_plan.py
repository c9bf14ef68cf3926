"""How a scene is simulated step by step, and what that changes: planned by a pilot run at its own speed and load.

Stage   2, used by `preparation`; `simulation.running` runs it, in the place of the response.
Model   Skin is first followed at few points, then at twice as many, until half as many change little. Then a pilot is
        run with n and with 2 n steps a frame; n doubles until they agree within SETTLED of the tolerance. A pilot of
        the same contact without mass, memory and adhesion tells what the effects change.
        `errors` adds what twice the steps change (second order: a third more than the difference); of skin, what half
        the points change; of a table, what its error makes of the quantity through the linear motion round the load;
        what has not settled where the scan begins; and what the filter lets through.
Limits  estimates, held against independent solutions by tests/synth/effects. Where more would take longer than BUSY of
        a second's sound live, or BUSY_FILE in a file, or the pilot than PATIENCE, doubling ends, and `errors` tells
        what is left.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from synth.effects.simulation.running import Signal, Simulation
from synth.effects.simulation.terms import Terms
from synth.errors import CannotRender
from synth.plan.effect_choice import Case, relative_change
from synth.plan.simulation_pilot import (
    FEWEST_STEPS,
    Pilot,
    Tried,
    attenuation_of,
    band_of,
    change_and_peaks,
    filters_of,
    first_simulation,
    run_pilot,
    signals_of,
    stepper_of,
)
from synth.response.spectrum import curves, points_for

BUSY, BUSY_FILE = 0.14, 8.0  # s of work a second of sound, as predicted: more would not run beside others; takes hours
PATIENCE, PATIENCE_FILE = 0.6, 2.0  # s of work that the next finer pilot may take, as predicted, live and of a file
SHARED = 1.5  # times as long as predicted: a processor whose caches others share was seen to take 1 to 2 times
FEWEST_POINTS, MOST_POINTS = 65, 16385  # of skin: fewer save less than a call costs; 30 us a step
SETTLED = 0.4  # of the tolerance: what twice the steps may change of a quantity
POINTS_SHARE = 0.5  # of the tolerance: the error of the skin's points
LEFT_BY_POINTS = 0.55  # of what half the points change: order 1.5, by kinks where the surface comes down on the skin
STIFFER = 2.0  # times its mean that a contact's stiffness is where the table's error counts most (seen: up to 2)
PHASES = 1024  # at which the table is compared with the exact contact


@dataclass(frozen=True, slots=True)
class SimulationPlan:
    """How a scene is simulated.

    simulation: ready to run. change, errors, extents, peaks: of each order asked for: what the effects change,
    relative; the error, relative to the peak-to-peak; peak-to-peak and peak (SI) at the scan's speed and load, the peak
    of a recording along it. pilot: the run that showed it; nominal, finer: what it ran, and the same in steps of half
    the length. repeats: the motion repeats with the texture.
    """

    simulation: Simulation
    orders: tuple[int, ...]
    change: tuple[float, ...]
    errors: tuple[float, ...]
    extents: tuple[float, ...]
    peaks: tuple[float, ...]
    pilot: Pilot
    nominal: Simulation
    finer: Simulation
    repeats: bool

    @property
    def signals(self) -> tuple[Signal, ...]:
        """What a voice asks of the simulation: a signal for each order."""
        return signals_of(self.orders)

    @property
    def let_go(self) -> bool:
        """True where nothing holds the finger at the scan's own load."""
        return self.simulation.held and not any(self.extents)

    def change_from(self, other: SimulationPlan) -> tuple[float, ...]:
        """Return by how much each order differs from another simulation of the same scan, relative to that one."""
        return tuple(relative_change(*pair) for pair in zip(other.pilot.moved, self.pilot.moved, strict=True))

    @property
    def work(self) -> float:
        """Processor seconds that a second of sound takes, as predicted."""
        return SHARED * _work(self.simulation)


def plan_simulation(case: Case, terms: Terms) -> SimulationPlan:
    """Return how `case` is simulated with `terms`; CannotRender where the contact changes its shape with the load."""
    if not case.contact.of_one_shape and case.loads[0] != case.loads[1]:
        raise CannotRender(
            "An effect that shapes the contact (contact_growth, curvature) and one that moves it (inertia, "
            "viscous_skin, adhesion) go together at a load that does not change: the simulation reads a contact of one "
            "shape. Leave one of them out, or keep the load constant."
        )
    counts = _points(case, terms)
    tried = Tried.of(case, first_simulation(case, terms, counts[0]))
    of_points = (0.0,) * len(case.orders)
    for count in counts[1:]:
        before = tried
        tried = Tried.of(case, replace(tried.simulation, stepper=stepper_of(case, terms, count)))
        of_points = tuple(LEFT_BY_POINTS * one for one in tried.pilot.differs_from(before.pilot))
        enough = not tried.settled or max(of_points) <= POINTS_SHARE * case.tolerance
        if enough or 2.0 * _pilot_work(tried) > (PATIENCE if case.live else PATIENCE_FILE):
            break
    while True:
        filters = filters_of(case, terms, 2 * tried.simulation.steps)
        finer = Tried.of(case, replace(tried.simulation, steps=2 * tried.simulation.steps, filters=filters))
        of_steps = finer.pilot.differs_from(tried.pilot)
        if not tried.settled or max(of_steps) <= SETTLED * case.tolerance or _dear(case, finer):
            return _planned(case, terms, tried, finer.simulation, of_steps, of_points)
        tried = finer


def _points(case: Case, terms: Terms) -> list[int]:
    """Return the numbers of points to try, each half of the next; the last is what steps leave time for."""
    if terms.skin is None:
        return [0]
    steps = max(2.0 * case.scene.output.sample_rate, FEWEST_STEPS)
    room = (BUSY if case.live else BUSY_FILE) / steps / terms.skin.point_time
    counts = [min(max(FEWEST_POINTS, int(room)), MOST_POINTS)]
    while counts[0] > 2 * FEWEST_POINTS or len(counts) == 1:
        counts.insert(0, (counts[0] + 1) // 2)
    return counts


def _planned(
    case: Case,
    terms: Terms,
    tried: Tried,
    finer: Simulation,
    of_steps: tuple[float, ...],
    of_points: tuple[float, ...],
) -> SimulationPlan:
    """Return the plan, its errors added up."""
    simulation, pilot = tried.simulation, tried.pilot
    change, peaks = change_and_peaks(case, tried)
    filtered = 10.0 ** (-attenuation_of(case) / 20.0)
    parts = zip(of_steps, of_points, _gap_errors(case, terms, tried), _start_errors(case, tried), strict=True)
    return SimulationPlan(
        simulation=replace(simulation, scene=case.scene, offset=pilot.offset),
        orders=case.orders,
        change=change,
        errors=tuple(4.0 / 3.0 * steps + sum(others) + filtered for steps, *others in parts),
        extents=tuple(np.ptp(pilot.moved, axis=1).tolist()),
        peaks=peaks,
        pilot=pilot,
        nominal=simulation,
        finer=finer,
        repeats=tried.settled,
    )


def _gap_errors(case: Case, terms: Terms, tried: Tried) -> tuple[float, ...]:
    """Return what the error of the stepper's own contact makes of each order, relative to its peak-to-peak.

    How much of a finger's error at rest comes through at each harmonic is the linear motion's: K / (K - m w^2 + i c w).
    """
    gap = np.fft.rfft(tried.simulation.stepper.gap(case.contact, case.load, PHASES)) / PHASES
    limit = PHASES // 2 - 1
    if case.turns:
        limit = int(min(limit, band_of(case)[0] * case.scene.output.sample_rate / abs(case.turns)))
    frequency = 2.0 * math.pi * abs(case.turns) * np.arange(len(gap))
    gap /= 1.0 + (1j * terms.damping * frequency - terms.mass * frequency**2) / case.stiffness
    gap[limit + 1 :] = 0.0
    errors = []
    for order, extent in zip(case.orders, np.ptp(tried.pilot.moved, axis=1), strict=True):
        curve = curves(gap, order, points_for(len(gap) - 1)) * abs(case.turns) ** order
        errors.append(STIFFER * float(np.max(np.abs(curve))) / extent if extent > 0.0 else 0.0)
    return tuple(errors)


def _start_errors(case: Case, tried: Tried) -> tuple[float, ...]:
    """Return by how much a constant scan may differ from what it settles to, or comes to later, of each order."""
    simulation, found = tried.simulation, tried.found
    if found is not None:
        others, factor = [replace(simulation, steady=other) for other in found.others], found.factor
    else:
        memory = simulation.stepper.memory
        others = [replace(simulation, settling=2.0 * simulation.settling)]
        factor = 1.0 / -math.expm1(-simulation.settling / memory) if memory > 0.0 else 1.0
    differences = [run_pilot(other, case).differs_from(tried.pilot) for other in others]
    return tuple(factor * max(each) for each in zip(*differences, strict=True))


def _work(simulation: Simulation) -> float:
    """Return how long (s) the steps of a second of sound take, as predicted."""
    return simulation.rate * simulation.stepper.step_time


def _pilot_work(tried: Tried) -> float:
    """Return how long (s) the steps of a pilot take, as predicted."""
    frames = tried.pilot.moved.shape[1]
    return float(_work(tried.simulation) * frames / tried.simulation.scene.output.sample_rate)


def _dear(case: Case, finer: Tried) -> bool:
    """Return whether the steps of `finer` take too long, or the pilot of half of them."""
    busy, patience = (BUSY, PATIENCE) if case.live else (BUSY_FILE, PATIENCE_FILE)
    return _work(finer.simulation) > busy or 2.0 * _pilot_work(finer) > patience
