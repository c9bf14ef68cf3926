"""How a scene is simulated step by step, and what that changes: planned by a pilot run at its own speed and load.

Stage   2, used by `preparation`; `simulation.running` runs it.
Model   A pilot of whole texture periods at the scan's speed and load is run with n and with 2 n steps a frame; n
        doubles until they agree within SETTLED of the tolerance. Its steps also hold the elastic contact's z, read from
        the same table: the difference of the two is what the effects change. Up to SMALL of the peak-to-peak it is
        added to the response, so that a small effect leaves the response as exact as it is; beyond, the simulation
        takes the place of the response. A recording is also tried along its own motion.
Limits  `errors` adds what halving the steps changed (second order: a third more than the difference), and what the
        table's error makes of the quantity through the linear motion round the load; of a viscous skin, what half as
        many points changed. Where more steps would take more than BUSY of a second's sound, or the pilot more than
        PATIENCE, doubling ends, and `errors` tells what is left.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from synth.contact.exact import Array
from synth.contact.mean import mean_curve
from synth.effect_choice import relative_change
from synth.errors import CannotRender
from synth.simulation.running import CHANGE, RESPONSE, Signal, Simulation
from synth.simulation.skin_steps import SkinStepper
from synth.simulation.steppers import Asked, asking, step_time, stepper_of, stiffness_round
from synth.simulation.table_steps import TableStepper
from synth.simulation.terms import Terms
from synth.simulation_error import elastic_gap, point_errors, table_errors
from synth.simulation_pilot import SMALL, Case, Pilot, attenuation_of, filters_of, own_change, run_pilot

FEWEST_STEPS = 96e3  # steps a second at least: contacts change within tens of microseconds
BUSY = 0.14  # s of work a second of sound that steps may take, as predicted: more would not run live beside others
PATIENCE = 4e6  # steps of a pilot at most that are halved once more: slow textures would take minutes
SETTLED = 0.4  # of the tolerance: what halving the steps may change of a quantity
HEAVIEST_HAND = 5.0  # N: a hand is prepared for at least; heavier, the contact is linear, which it is once all touches


@dataclass(frozen=True, slots=True)
class SimulationPlan:
    """How a scene is simulated.

    simulation: ready to run. added: its change is added to the response; otherwise it is in the place of it. change,
    errors, extents, peaks: of each order asked for: what the effects change, relative; the error, relative to the
    peak-to-peak; peak-to-peak and peak (SI) at the scan's speed and load. pilot: the run that showed it; nominal,
    finer: what it ran, and the same in steps of half the length.
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
    room = BUSY / (steps * case.scene.output.sample_rate)
    stepper = stepper_of(case.contact, terms, case.pressed, _loads(case), lift_load, case.tolerance, asked, room)
    simulation = Simulation(
        stepper=stepper,
        scene=case.nominal,
        steps=steps,
        filters=filters_of(case, terms, steps),
        reference=_reference(case, stepper),
        offset=0.0,
        held=terms.adhesion is not None,
        settling=terms.settling(stiffness_round(case.contact, case.pressed)),
    )
    coarse = run_pilot(simulation, case)
    while True:
        finer = replace(simulation, steps=2 * simulation.steps, filters=filters_of(case, terms, 2 * simulation.steps))
        fine = run_pilot(finer, case)
        unsettled = fine.differs_from(coarse)
        fastest = 2 * case.scene.output.sample_rate * simulation.steps > _most_steps(simulation)
        fastest = fastest or 4 * fine.moved.shape[1] * simulation.steps > PATIENCE
        if fastest or max(unsettled) <= SETTLED * case.tolerance:
            return _planned(case, terms, (simulation, finer), coarse, unsettled)
        simulation, coarse = finer, fine


def _planned(
    case: Case, terms: Terms, tried: tuple[Simulation, Simulation], pilot: Pilot, unsettled: tuple[float, ...]
) -> SimulationPlan:
    """Return the plan: the stepper without what only the pilot wanted, and the errors added up."""
    simulation = tried[0]
    change = own_change(case, simulation, pilot)
    added = pilot.added and max(change) <= SMALL
    if isinstance(simulation.stepper, SkinStepper):
        of_contact = point_errors(case, simulation.stepper, simulation, pilot)
    else:
        of_contact = table_errors(case, terms, simulation, pilot, added=added)
    filtered = 10.0 ** (-attenuation_of(case) / 20.0)
    share = max(change) if added else 1.0  # what the filter's error is of
    errors = tuple(4.0 / 3.0 * one + other + share * filtered for one, other in zip(unsettled, of_contact, strict=True))
    stepper = asking(simulation.stepper, Asked(static=added, forces=case.forces))
    return SimulationPlan(
        simulation=replace(simulation, scene=case.scene, stepper=stepper, offset=pilot.offset),
        added=added,
        orders=case.orders,
        change=change,
        errors=errors,
        extents=tuple(float(extent) for extent in np.ptp(pilot.moved, axis=1)),
        peaks=tuple(float(peak) for peak in np.max(np.abs(pilot.moved), axis=1)),
        pilot=pilot,
        nominal=tried[0],
        finer=tried[1],
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


def _most_steps(simulation: Simulation) -> float:
    """Return how many steps a second BUSY allows."""
    return BUSY / step_time(simulation.stepper)


def _mean_loads(case: Case) -> tuple[float, float]:
    low, high = case.loads
    return (case.pressed, case.pressed) if low == high else (max(low, 0.0), max(high, case.pressed))
