"""How a scene is simulated step by step, and what that changes: planned by a pilot run at its own speed and load.

Stage   2, used by `preparation`; `simulation.running` runs it.
Model   A pilot of whole texture periods at the scan's speed and load is run with n and with 2 n steps a frame; n
        doubles until they agree within SETTLED of the tolerance. Its steps also hold the elastic contact's z, read from
        the same table: the difference of the two is what the effects change. Up to SMALL of the peak-to-peak it is
        added to the response, so that a small effect leaves the response as exact as it is; beyond, the simulation
        takes the place of the response. A recording is also tried along its own motion.
Limits  `errors` adds what halving the steps changed (second order: a third more than the difference), and what the
        table's error makes of the quantity through the linear motion round the load; of a viscous skin, what half as
        many points changed. Where more steps would take more than BUSY of a second's sound live, or BUSY_FILE in a
        file, or the pilot more than PATIENCE, doubling ends, and `errors` tells what is left.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from synth.arrays import Array
from synth.effects.simulation.periodic import Found
from synth.effects.simulation.running import CHANGE, RESPONSE, Signal, Simulation
from synth.effects.simulation.skin_steps import SkinStepper
from synth.effects.simulation.steppers import POINTS_SHARE, Asked, asking, step_time, stepper_of, stiffness_round
from synth.effects.simulation.table_steps import TableStepper
from synth.effects.simulation.terms import Terms
from synth.errors import CannotRender
from synth.plan.effect_choice import relative_change
from synth.plan.simulation_error import elastic_gap, of_points, point_errors, start_errors, table_errors
from synth.plan.simulation_pilot import SMALL, Case, Pilot, attenuation_of, begun, filters_of, own_change, run_pilot
from synth.response.mean_approach import mean_curve

FEWEST_STEPS = 96e3  # steps a second at least: contacts change within tens of microseconds
BUSY = 0.14  # s of work a second of sound that steps may take live, as predicted: more would not run beside others
BUSY_FILE = 8.0  # the same of a file: more would make a file of a minute a matter of hours
SHARED = 1.5  # times as long as predicted: a processor whose caches others share was seen to take 1 to 2 times
PATIENCE, PATIENCE_FILE = 0.6, 2.0  # s of work that the next finer pilot may take, as predicted, live and of a file
MOST_FILE_POINTS = 16385  # of skin in a file: 30 us a step
SETTLED = 0.4  # of the tolerance: what halving the steps may change of a quantity
HEAVIEST_HAND = 5.0  # N: a hand is prepared for at least; heavier, the contact is linear, which it is once all touches


@dataclass(frozen=True, slots=True)
class SimulationPlan:
    """How a scene is simulated.

    simulation: ready to run. added: its change is added to the response; otherwise it is in the place of it. change,
    errors, extents, peaks: of each order asked for: what the effects change, relative; the error, relative to the
    peak-to-peak; peak-to-peak and peak (SI) at the scan's speed and load, the peak of a recording along it. pilot: the
    run that showed it; nominal, finer: what it ran, and the same in steps of half the length. repeats: the motion
    repeats with the texture.
    """

    simulation: Simulation
    added: bool
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
        return tuple(Signal(CHANGE if self.added else RESPONSE, order) for order in self.orders)

    @property
    def let_go(self) -> bool:
        """True where nothing holds the finger at the scan's own load."""
        return self.simulation.held and not any(self.extents)

    def change_from(self, other: SimulationPlan) -> tuple[float, ...]:
        """Return by how much each order differs from another simulation of the same scan, relative to that one."""
        pairs = zip(other.pilot.moved, self.pilot.moved, strict=True)
        return tuple(relative_change(before, after) for before, after in pairs)

    @property
    def work(self) -> float:
        """Processor seconds that a second of sound takes, as predicted."""
        return SHARED * _work(self.simulation)

    @property
    def memory_bytes(self) -> int:
        """Bytes that it holds."""
        return self.simulation.nbytes


def plan_simulation(case: Case, terms: Terms) -> SimulationPlan:
    """Return how `case` is simulated with `terms`; CannotRender where the contact changes its shape with the load."""
    if not case.contact.of_one_shape and case.loads[0] != case.loads[1]:
        raise CannotRender(
            "An effect that shapes the contact (contact_growth, curvature) and one that moves it (inertia, "
            "viscous_skin, adhesion) go together at a load that does not change: the simulation reads a contact of one "
            "shape. Leave one of them out, or keep the load constant."
        )
    asked, lift_load = Asked(static=True, forces=case.forces), case.scene.scan.lift_load
    steps = max(2, math.ceil(FEWEST_STEPS / case.scene.output.sample_rate))
    room = _busy(case) / (steps * case.scene.output.sample_rate)
    stepper = stepper_of(case.contact, terms, case.pressed, _loads(case), lift_load, case.tolerance, asked, room)
    first = Simulation(
        stepper=stepper,
        scene=case.nominal,
        steps=steps,
        filters=filters_of(case, terms, steps),
        reference=_reference(case, stepper),
        offset=0.0,
        held=terms.adhesion is not None,
        settling=terms.settling(stiffness_round(case.contact, case.pressed)),
    )
    simulation, found = begun(case, first)
    coarse = run_pilot(simulation, case)
    of_contact: tuple[float, ...] | None = None
    if isinstance(stepper, SkinStepper):
        simulation, found, coarse, of_contact = _with_points(case, simulation, found, coarse)
    while True:
        finer = replace(simulation, steps=2 * simulation.steps, filters=filters_of(case, terms, 2 * simulation.steps))
        finer, found_finer = begun(case, finer)
        fine = run_pilot(finer, case)
        unsettled = fine.differs_from(coarse)
        fastest = 2.0 * _work(simulation) > _busy(case) or 4.0 * _pilot_work(simulation, fine) > _patience(case)
        unlike = found is not None and not found.repeats  # shorter steps would begin elsewhere, and say nothing
        if fastest or unlike or max(unsettled) <= SETTLED * case.tolerance:
            return _planned(case, terms, (simulation, finer), coarse, unsettled, found, of_contact)
        simulation, coarse, found = finer, fine, found_finer


def _planned(
    case: Case,
    terms: Terms,
    tried: tuple[Simulation, Simulation],
    pilot: Pilot,
    unsettled: tuple[float, ...],
    found: Found | None,
    of_contact: tuple[float, ...] | None,
) -> SimulationPlan:
    """Return the plan: the stepper without what only the pilot wanted, and the errors added up.

    of_contact: errors of the skin's points, None for a table.
    """
    simulation = tried[0]
    change, peaks = own_change(case, simulation, pilot)
    added = pilot.added and max(change) <= SMALL
    if of_contact is None:
        of_contact = table_errors(case, terms, simulation, pilot, added=added)
    filtered = 10.0 ** (-attenuation_of(case) / 20.0)
    share = max(change) if added else 1.0  # what the filter's error is of
    of_start = start_errors(case, terms, simulation, pilot, found)
    errors = tuple(
        4.0 / 3.0 * one + other + start + share * filtered
        for one, other, start in zip(unsettled, of_contact, of_start, strict=True)
    )
    stepper = asking(simulation.stepper, Asked(static=added, forces=case.forces))
    return SimulationPlan(
        simulation=replace(simulation, scene=case.scene, stepper=stepper, offset=pilot.offset),
        added=added,
        orders=case.orders,
        change=change,
        errors=errors,
        extents=tuple(float(extent) for extent in np.ptp(pilot.moved, axis=1)),
        peaks=peaks,
        pilot=pilot,
        nominal=tried[0],
        finer=tried[1],
        repeats=found is None or found.repeats,
    )


def _reference(case: Case, stepper: TableStepper | SkinStepper) -> Callable[[Array], Array]:
    """Return z (m) that displacement is about; points of skin stand about another mean than the contact itself."""
    mean = mean_curve(case.contact, _mean_loads(case), case.pressed, case.tolerance)
    if isinstance(stepper, TableStepper):
        return mean
    raised = float(np.mean(elastic_gap(case, stepper)))
    return lambda roots: mean(roots) + raised


def _loads(case: Case) -> tuple[float, float]:
    """Return between which loads (N) the stepper's contact must be right."""
    low, high = case.loads
    if case.by_hand:
        return case.scene.scan.lift_load, max(4.0 * case.pressed, HEAVIEST_HAND)
    return max(min(low, case.pressed), case.scene.scan.lift_load), max(high, case.pressed)


def _with_points(
    case: Case, simulation: Simulation, found: Found | None, pilot: Pilot
) -> tuple[Simulation, Found | None, Pilot, tuple[float, ...]]:
    """Return a simulation of skin with as many points as the tolerance takes, its pilot, and what the points leave.

    Live there are as many as steps leave time for, of a file twice as many until half as many change little.
    """
    assert isinstance(simulation.stepper, SkinStepper)
    halved = run_pilot(begun(case, of_points(case, simulation, (simulation.stepper.points.count + 1) // 2))[0], case)
    while True:
        left = point_errors(halved, pilot)
        finer = 2 * simulation.stepper.points.count - 1
        unlike = found is not None and not found.repeats  # other points would begin elsewhere, and say nothing
        fine_enough = case.live or unlike or max(left) <= POINTS_SHARE * case.tolerance or finer > MOST_FILE_POINTS
        dearer = 2.0 * _work(simulation) > _busy(case) or 2.0 * _pilot_work(simulation, pilot) > _patience(case)
        if fine_enough or dearer:
            return simulation, found, pilot, left
        halved = pilot
        denser = of_points(case, simulation, finer)
        simulation, found = begun(case, replace(denser, reference=_reference(case, denser.stepper)))
        assert isinstance(simulation.stepper, SkinStepper)
        pilot = run_pilot(simulation, case)


def _work(simulation: Simulation) -> float:
    """Return how long (s) the steps of a second of sound take, as predicted."""
    return float(simulation.rate * step_time(simulation.stepper))


def _pilot_work(simulation: Simulation, pilot: Pilot) -> float:
    """Return how long (s) the steps of a pilot take, as predicted."""
    return float(pilot.moved.shape[1] * simulation.steps * step_time(simulation.stepper))


def _busy(case: Case) -> float:
    return BUSY if case.live else BUSY_FILE


def _patience(case: Case) -> float:
    return PATIENCE if case.live else PATIENCE_FILE


def _mean_loads(case: Case) -> tuple[float, float]:
    low, high = case.loads
    return (case.pressed, case.pressed) if low == high else (max(low, 0.0), max(high, case.pressed))
