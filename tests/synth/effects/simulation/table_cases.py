"""Shared by the tests of table steps: fingers with mass, damping or adhesion on tables of the energy."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from synth.contact.load_balance import Contact
from synth.contact.scene_contact import contact_of
from synth.effects.simulation.energy_table import EnergyTable
from synth.effects.simulation.steps import ROWS, State, StiffnessLaw
from synth.effects.simulation.table_steps import TableStepper
from synth.response.phases import turns_to_phase
from tests.synth.effects.simulation.test_energy_table import SCENES
from tests.synth.engine_cases import Real, scene_of

LOAD = 0.3
LIFT = 1e-3
PERIOD = 0.8e-3


@functools.cache
def table_of(
    name: str, load: float = LOAD, lightest: float = LOAD, heaviest: float = LOAD, below: float = 0.0, tol: float = 1e-3
) -> tuple[Contact, EnergyTable]:
    contact = contact_of(scene_of(**SCENES[name]))
    return contact, EnergyTable.of(contact, load, lightest, heaviest, below, tolerance=tol)


def stepper(
    mass: float = 0.0,
    damping: float = 0.0,
    pull: float = 0.0,
    reach: float = 1e-6,
    *,
    name: str = "default",
    forces: bool = False,
    **spanned: float,
) -> TableStepper:
    if pull:
        spanned = {"below": reach, **spanned}
    contact, table = table_of(name, **spanned)
    period = scene_of(**SCENES[name]).texture.period
    stiffness = StiffnessLaw.of(contact, LOAD, LIFT)
    return TableStepper(table, stiffness, mass, damping, pull, reach, period, forces)


def run(steps: TableStepper, state: State, turns: Any, loads: Any) -> Real:
    out = np.zeros((ROWS, len(turns)))
    phases = turns_to_phase(np.asarray(turns, dtype=float))
    steps.run(state, phases, np.broadcast_to(np.asarray(loads, dtype=float), len(turns)).copy(), out)
    return out


def scanned(steps: TableStepper, rate: float, seconds: float, turns: float, load: float = LOAD) -> Real:
    """Return the rows of a finger that starts in equilibrium and scans at a constant speed."""
    state = steps.start(0, load, turns, 1.0 / rate)
    return run(steps, state, turns * np.arange(1, round(rate * seconds) + 1) / rate, load)


def read(steps: TableStepper, phase: int, z: float) -> Real:
    """Return I, l, dE/dtheta and E at one place."""
    return steps.table.read(np.array([phase / 2**64]), np.array([z]))[:, 0]


def stiffness_at(steps: TableStepper, load: float) -> float:
    """Return k (N/m) at `load` (N)."""
    law = steps.stiffness
    return float(law.coefficient * max(load, law.lightest) ** law.power)


def energy(steps: TableStepper, state: State, load: float) -> float:
    """Return m v^2 / 2 + k E + w z (J)."""
    z, v = float(state.numbers[0]), float(state.numbers[1])
    stiffness = stiffness_at(steps, load)
    return float(0.5 * steps.mass * v**2 + stiffness * read(steps, int(state.phase[0]), z)[3] + load * z)


PHASE = 12345678901234567890


def released(steps: TableStepper, rate: float, height: float, load: float = LOAD) -> tuple[State, float]:
    """Return a finger at rest, `height` above its equilibrium (m), and the energy of the equilibrium (J)."""
    state = steps.start(PHASE, load, 0.0, 1.0 / rate)
    floor = energy(steps, state, load)
    state.numbers[0] += height
    return state, floor
