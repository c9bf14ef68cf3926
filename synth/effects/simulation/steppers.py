"""Which stepper simulates a contact: one that reads a table of it, or one that follows every place of the skin.

Model   A spring, with or without adhesion, has a pressure that only depends on where things stand: all of it fits into
        a table of its energy. A viscous skin has a memory at every place, and is followed there.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from synth.contact.balance import Contact
from synth.effects.simulation.potential import PotentialTable
from synth.effects.simulation.skin import KelvinVoigt, Relaxation, SkinLaw
from synth.effects.simulation.skin_points import FEWEST_POINTS, MOST_POINTS, points_for
from synth.effects.simulation.skin_steps import SkinStepper
from synth.effects.simulation.table_steps import TableStepper
from synth.effects.simulation.terms import Skin, Terms

POINTS_SHARE = 0.5  # of the tolerance: the error of the skin's points
TABLE_SHARE = 0.2  # of the tolerance: the error of the table
LOOSEST_TABLE, TIGHTEST_TABLE = 1e-3, 1e-5  # of z: derivatives ask for more than displacement; tighter takes seconds
MEAN_PHASES = 64

# s of a step, as predicted: of a table, of a point of skin, and of what the point remembers (`tests.bench effects`)
TABLE_STEP, SKIN_POINT, SKIN_MEMORY = 150e-9, 2.0e-9, 0.6e-9


@dataclass(frozen=True, slots=True)
class Asked:
    """Which rows are wanted beside z: that of the elastic contact, the forces."""

    static: bool
    forces: bool


def stepper_of(
    contact: Contact,
    terms: Terms,
    load: float,
    loads: tuple[float, float],
    lift_load: float,
    tolerance: float,
    asked: Asked,
    room: float,
) -> TableStepper | SkinStepper:
    """Return what simulates `contact` with `terms`.

    load: N, the scan's. loads: between which the contact must be right. lift_load: below it loads count as it.
    tolerance: of each quantity, relative to its peak-to-peak. room: s that a step may take.
    """
    if terms.skin is not None:
        law = law_of(terms.skin)
        most = max(FEWEST_POINTS, int(room / _point_time(law)))
        points, _error = points_for(contact, load, POINTS_SHARE * tolerance, min(most, MOST_POINTS))
        return SkinStepper.of_contact(
            contact, load, law, points, lift_load,
            mass=terms.mass, damping=terms.damping, with_static=asked.static, with_force=asked.forces,
        )  # fmt: skip
    length = contact.geometry_at(load).contact_length
    reach = 0.0 if terms.adhesion is None else terms.adhesion.reach
    # a ridge is as long across the scan as the contact is along it (eq. 4)
    pull = 0.0 if terms.adhesion is None else terms.adhesion.stress * contact.geometry.contact_length * length
    sunk = 0.0 if terms.adhesion is None else reach + _sunk(contact, load, loads[1], pull)
    exact = min(max(TABLE_SHARE * tolerance, TIGHTEST_TABLE), LOOSEST_TABLE)
    table = PotentialTable.of(contact, load, *loads, below=sunk, above=reach, tolerance=exact)
    power = 1.0 - contact.stiffness.load_exponent if contact.of_one_shape else 0.0
    coefficient = contact.stiffness_at(load) / load**power
    return TableStepper(
        table, coefficient, power, lift_load, terms.mass, terms.damping, pull, reach,
        contact.geometry.texture_period, asked.static, asked.forces,
    )  # fmt: skip


def _sunk(contact: Contact, load: float, heaviest: float, pull: float) -> float:
    """Return how much deeper (m) the contact of `load` (N) sinks at most where all of `pull` (N) adds to `heaviest`.

    Its first part sinks it far more than the mean indentation says: only a part of the length touches.
    """
    phases, stiffness = np.arange(MEAN_PHASES) / MEAN_PHASES, contact.stiffness_at(heaviest)
    solver = contact.solver(load)
    pressed, pulled = (solver.solve(phases, force / stiffness).height for force in (heaviest, heaviest + pull))
    return float(np.max(pressed - pulled))


def asking(stepper: TableStepper | SkinStepper, asked: Asked) -> TableStepper | SkinStepper:
    """Return the same stepper for other rows."""
    if isinstance(stepper, SkinStepper):
        return replace(stepper, with_static=asked.static, with_force=asked.forces)
    return replace(stepper, with_static=asked.static, with_forces=asked.forces)


def step_time(stepper: TableStepper | SkinStepper) -> float:
    """Return how long (s) a step is predicted to take."""
    if isinstance(stepper, SkinStepper):
        return stepper.points.count * _point_time(stepper.law)
    return TABLE_STEP


def _point_time(law: SkinLaw) -> float:
    return SKIN_POINT + SKIN_MEMORY * law.memories


def law_of(skin: Skin) -> SkinLaw:
    """Return the law of the skin."""
    return Relaxation(skin.times, skin.weights) if skin.weights else KelvinVoigt(skin.times[0])


def stiffness_round(contact: Contact, load: float) -> float:
    """Return the mean of -dF/dz (N/m) over a period at `load` (N): what a small motion meets."""
    phases = np.arange(MEAN_PHASES) / MEAN_PHASES
    height, _slope = contact.approach(phases, load)
    _depth, touching = contact.measure(phases, height, load)
    return float(contact.stiffness_at(load) * np.mean(touching))
