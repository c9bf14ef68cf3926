"""What a simulation errs by beside its steps: by its table of the contact, or by the points of its skin.

Stage   2, used by `simulation_plan`.
Model   Table: its own equilibrium is compared with the exact one over a period, and carried through the linear motion
        round the load. Skin: what half as many points change. Start: the pilot, begun in
        another state that a further correction or a later period makes.
Limits  estimates, held against independent solutions by tests/synth/effects.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from synth.arrays import Array
from synth.effects.simulation.periodic import Found
from synth.effects.simulation.running import Simulation
from synth.effects.simulation.skin_points import SkinPoints
from synth.effects.simulation.skin_steps import SkinStepper
from synth.effects.simulation.steppers import stiffness_round
from synth.effects.simulation.steps import ATTACHED, HEIGHT, ROWS, STATIC, Stepper
from synth.effects.simulation.table_steps import TableStepper
from synth.effects.simulation.terms import Terms
from synth.plan.simulation_pilot import Case, Pilot, band_of, run_pilot
from synth.response.spectrum import curves, points_for

STIFFER = 2.0  # times its mean that a contact's stiffness is where the table's error counts most (seen: up to 2)
LEFT_BY_POINTS = 0.55  # of what half the points change: order 1.5, by kinks where the surface comes down on the skin
PHASES = 1024  # at which the table is compared with the exact contact


def of_points(case: Case, simulation: Simulation, count: int) -> Simulation:
    """Return a simulation of skin with another number of points, before it has begun."""
    stepper = simulation.stepper
    assert isinstance(stepper, SkinStepper)
    points = SkinPoints.of_contact(case.contact, max(case.pressed, stepper.load_law.lightest), count)
    return replace(simulation, stepper=replace(stepper, points=points))


def point_errors(halved: Pilot, pilot: Pilot) -> tuple[float, ...]:
    """Return what the points of skin leave of each order, relative to its peak-to-peak; halved: with half of them."""
    moved = halved.moved - np.mean(halved.moved - pilot.moved, axis=1)[:, np.newaxis]
    return tuple(LEFT_BY_POINTS * one for one in replace(halved, moved=moved).differs_from(pilot))


def table_errors(case: Case, terms: Terms, simulation: Simulation, pilot: Pilot, *, added: bool) -> tuple[float, ...]:
    """Return what the error of the stepper's own contact makes of each order, relative to its peak-to-peak.

    The stepper's own equilibrium is compared with the exact one over a period; how much of that comes through at each
    harmonic is the linear motion's: K / (K - m w^2 + i c w), less 1 where the elastic z is taken off again.
    """
    stepper = simulation.stepper
    assert isinstance(stepper, TableStepper)
    sticks = stepper.pull > 0.0
    gap = np.fft.rfft(_adhesive_gap(case, stepper) if sticks else elastic_gap(case, stepper)) / PHASES
    limit = harmonics_within(case)
    frequency = 2.0 * math.pi * abs(case.turns) * np.arange(len(gap))
    stiffness = stiffness_round(case.contact, case.pressed)
    through = 1.0 / (1.0 + (1j * terms.damping * frequency - terms.mass * frequency**2) / stiffness)
    seen = gap * (through - 1.0 if added and not sticks else through)
    seen[limit + 1 :] = 0.0
    errors = []
    for order, extent in zip(case.orders, np.ptp(pilot.moved, axis=1), strict=True):
        curve = curves(seen, order, points_for(len(seen) - 1)) * abs(case.turns) ** order
        errors.append(STIFFER * float(np.max(np.abs(curve))) / extent if extent > 0.0 else 0.0)
    return tuple(errors)


def start_errors(
    case: Case, terms: Terms, simulation: Simulation, pilot: Pilot, found: Found | None
) -> tuple[float, ...]:
    """Return by how much a constant scan may differ from what it settles to, or comes to later, of each order."""
    if found is not None:
        others = [replace(simulation, steady=other) for other in found.others]
        factor = found.factor
    else:
        others = [replace(simulation, settling=2.0 * simulation.settling)] if simulation.settling > 0.0 else []
        slowest = terms.slowest(stiffness_round(case.contact, case.pressed))
        factor = 1.0 / -math.expm1(-simulation.settling / slowest) if others else 1.0
    differences = [run_pilot(other, case).differs_from(pilot) for other in others]
    return tuple(factor * max(each) for each in zip(*differences, strict=True)) or (0.0,) * len(case.orders)


def elastic_gap(case: Case, stepper: Stepper) -> Array:
    """Return by how much (m) the stepper's elastic z lies above the exact one, over a period."""
    phases = np.arange(PHASES) / PHASES
    whole = (np.arange(PHASES, dtype=np.uint64)) << np.uint64(64 - int(math.log2(PHASES)))
    rows = np.empty((ROWS, PHASES))
    state = stepper.start(0, case.pressed, 0.0, 1.0 / case.scene.output.sample_rate)
    stepper.run(state, whole, np.full(PHASES, case.pressed), rows)
    return np.asarray(rows[STATIC] - case.contact.approach(phases, case.pressed)[0])


def _adhesive_gap(case: Case, stepper: TableStepper) -> Array:
    """Return by how much (m) a finger that adhesion holds, at rest, lies above the exact equilibrium, over a period."""
    still = replace(stepper, mass=0.0, damping=0.0)
    phases = np.arange(PHASES) / PHASES
    whole = (np.arange(PHASES, dtype=np.uint64)) << np.uint64(64 - int(math.log2(PHASES)))
    rows = np.empty((ROWS, PHASES))
    load = case.load
    still.run(still.start(0, load, 0.0, 1.0), whole, np.full(PHASES, load), rows)
    depth, touching = case.contact.measure(phases, rows[HEIGHT], case.pressed)
    far, wide = case.contact.measure(phases, rows[HEIGHT] - stepper.reach, case.pressed)
    stiffness, pulling = case.contact.stiffness_at(case.pressed), stepper.pull / stepper.reach
    excess = (stiffness + pulling) * depth - pulling * far - load
    slope = (stiffness + pulling) * touching - pulling * wide
    held = (rows[ATTACHED] > 0.0) & (slope > 0.0)
    return np.where(held, -excess / np.where(held, slope, 1.0), 0.0)


def harmonics_within(case: Case) -> int:
    """Return how many harmonics of the scan's fundamental lie in the pass band."""
    passing = band_of(case)[0] * case.scene.output.sample_rate
    return int(min(PHASES // 2 - 1, passing / abs(case.turns) if case.turns else PHASES // 2 - 1))
