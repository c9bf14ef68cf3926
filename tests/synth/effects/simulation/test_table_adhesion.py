"""A finger with adhesion on a table: its closed form, hysteresis, letting go, a brute-force follower."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from synth.contact.geometry import Geometry
from synth.contact.load_balance import Contact
from synth.contact.stiffness import Stiffness
from synth.effects.simulation.energy_table import EnergyTable
from synth.effects.simulation.steps import ATTACHED, HEIGHT, REACTION, SLOPE_FORCE, StiffnessLaw
from synth.effects.simulation.table_steps import TableStepper
from tests.synth.effects.simulation.table_cases import LIFT, LOAD, read, run


def flat(pull: float, reach: float, **wanted: Any) -> TableStepper:
    """Return a contact of two surfaces of 1 nm, flat beside the range of adhesion: k = 1e5 N/m at every load."""
    geometry = Geometry(1e-9, 0.5e-3, 1e-9, 0.8e-3, 1.0, 10e-3)
    contact = Contact.of(geometry, Stiffness.of_contact(geometry, 1.35e5))
    table = EnergyTable.of(contact, LOAD, 0.1 * LOAD, LOAD, reach, tolerance=1e-2)
    coefficients = {"mass": 0.0, "damping": 0.0, **wanted}
    return TableStepper(
        table, StiffnessLaw(1e5, 0.0, LIFT), pull=pull, reach=reach, texture_period=0.8e-3, **coefficients
    )


def test_adhesion_of_a_flat_contact_is_its_closed_form() -> None:
    pull, reach, stiffness = 0.02, 1e-6, 1e5
    steps = flat(pull, reach)
    loads = np.linspace(0.1, -0.04, 7001)
    out = run(steps, steps.start(0, 0.1, 0.0, 1e-4), np.zeros(7001), loads)
    held = out[ATTACHED] == 1.0
    assert -loads[held][-1] == pytest.approx(pull, rel=5e-3)  # pull-off
    assert not np.any(held[np.argmin(held) :])
    pressed = held & (loads > -0.9 * pull)
    assert out[HEIGHT][pressed] == pytest.approx(-(loads[pressed] + pull) / stiffness, abs=2e-9)
    balanced = float(np.interp(0.0, loads[held][::-1], out[HEIGHT][held][::-1]))
    assert balanced == pytest.approx(-pull / stiffness, abs=1e-10)

    def potential(z: float) -> float:
        near, far = float(read(steps, 0, z)[3]), float(read(steps, 0, z - reach)[3])
        return (stiffness + pull / reach) * near - pull / reach * far

    assert potential(2 * reach) == 0.0
    assert -potential(balanced) == pytest.approx(0.5 * pull * reach + 0.5 * pull**2 / stiffness, rel=2e-3)


def test_pulling_and_pushing_slowly_take_different_paths_that_close() -> None:
    steps = flat(0.02, 1e-6)
    loads = np.concatenate([np.linspace(0.1, -0.05, 1501), np.linspace(-0.05, 0.1, 1501)])
    out = run(steps, steps.start(0, 0.1, 0.0, 1e-4), np.zeros(3002), loads)
    away, back = out[:, :1501], out[:, :1500:-1]
    apart = np.abs(away[HEIGHT] - back[HEIGHT])
    assert np.max(apart) > 1e-6
    assert np.all(away[ATTACHED] >= back[ATTACHED])
    assert np.sum(away[ATTACHED] - back[ATTACHED]) * 1e-4 == pytest.approx(0.02, rel=0.02)  # held from 0 down to -P
    assert apart[:900] == pytest.approx(0.0, abs=1e-17)


@pytest.mark.parametrize(("mass", "damping"), [(1e-4, 0.5), (0.0, 0.0), (1e-6, 0.0)])
def test_a_finger_that_has_let_go_waits_out_of_range_for_load(mass: float, damping: float) -> None:
    steps = flat(0.02, 1e-6, mass=mass, damping=damping)
    loads = np.concatenate([np.full(50, 0.05), np.full(2000, -0.1), np.zeros(20), np.full(20000, 0.05)])
    turns = np.arange(len(loads)) * 1e-4
    out = run(steps, steps.start(0, 0.05, 0.0, 1.0 / 48000), turns, loads)
    assert np.all(out[ATTACHED, :50] == 1.0)
    assert np.all(out[ATTACHED, 2000:2070] == 0.0)
    assert np.all(out[[SLOPE_FORCE, REACTION], 2060] == 0.0)
    assert out[HEIGHT, 2000:2070] == pytest.approx(1e-6, abs=3e-9)
    assert np.all(out[ATTACHED, 2070:] == 1.0)
    if damping or not mass:
        assert out[HEIGHT, -1] == pytest.approx(-7e-7, abs=2e-9)


def test_where_a_finger_begins_is_told_by_the_load() -> None:
    steps = flat(0.02, 1e-6)
    assert steps.start(0, 0.0, 0.0, 1e-4).numbers[3] == 0.0
    assert steps.start(0, -0.01, 0.0, 1e-4).numbers[3] == 1.0
    assert steps.start(0, -0.03, 0.0, 1e-4).numbers[3] == 0.0
    assert steps.start(0, 0.05, 0.0, 1e-4).numbers[0] == pytest.approx(-7e-7, abs=1e-9)
