"""A finger on an energy table with mass or adhesion: energy, known limits, exact contacts, closed forms, release."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from synth.contact.geometry import Geometry
from synth.contact.load_balance import Contact
from synth.contact.stiffness import Stiffness
from synth.effects.simulation.energy_table import EnergyTable
from synth.effects.simulation.steps import ATTACHED, HEIGHT, REACTION, ROWS, SLOPE_FORCE, StiffnessLaw
from synth.effects.simulation.table_steps import TableStepper
from tests.few import few, paired, thorough
from tests.synth.effects.simulation.table_cases import (
    LIFT,
    LOAD,
    PERIOD,
    PHASE,
    energy,
    read,
    released,
    run,
    scanned,
    stepper,
    stiffness_at,
    table_of,
)
from tests.synth.effects.simulation.test_energy_table import SCENES
from tests.synth.engine_cases import Real


@pytest.mark.parametrize(
    ("name", "mass", "rate", "load"),
    [
        ("default", 1e-6, 8000, LOAD),
        thorough("default", 1e-6, 192000, LOAD),
        ("default", 1e-3, 48000, LOAD),
        ("default", 1.0, 8000, LOAD),
        thorough("default", 1.0, 192000, LOAD),
        thorough("default", 1e-4, 48000, 1e-2),
        thorough("default", 1e-4, 48000, 50.0),
        ("large", 1e-6, 8000, LOAD),
        thorough("large", 1e-2, 192000, LOAD),
    ],
)
def test_energy_stays_for_ten_seconds(name: str, mass: float, rate: int, load: float) -> None:
    steps = stepper(mass, name=name, load=load, lightest=load, heaviest=load)
    state, floor = released(steps, rate, 1e-6, load)
    begin = energy(steps, state, load) - floor
    phases, loads, out = np.full(rate, PHASE, dtype=np.uint64), np.full(rate, load), np.zeros((ROWS, rate))
    for _second in range(10):
        steps.run(state, phases, loads, out)
        assert abs(energy(steps, state, load) - floor - begin) <= 2e-8 * begin
    assert np.ptp(out[HEIGHT]) > 1e-6  # it does swing


@pytest.mark.parametrize(("mass", "damping", "rate"), [(1e-4, 0.05, 48000), (1e-6, 1e-3, 8000)])
def test_damping_never_adds_energy(mass: float, damping: float, rate: int) -> None:
    steps = stepper(mass, damping)
    state, floor = released(steps, rate, 30e-6)
    before = begin = energy(steps, state, LOAD) - floor
    for _step in range(1500):
        steps.run(state, state.phase.copy(), np.array([LOAD]), np.zeros((ROWS, 1)))
        after = energy(steps, state, LOAD) - floor
        assert after <= before + 1e-13 * begin
        before = after
    assert before < 0.5 * begin


@pytest.mark.parametrize(
    ("moving", "name", "pull"),
    paired([(1e-4, 0.5), (1e-6, 0.0), (1.0, 0.0), (0.0, 0.0)], ["default", "large", "locked"], [0.0, 0.1]),
)
def test_a_finger_at_rest_stays_there_bit_for_bit(moving: tuple[float, float], name: str, pull: float) -> None:
    """moving: mass (kg) and damping (N s/m)."""
    (mass, damping), random = moving, np.random.default_rng(11)
    for load in (1e-3, 0.3, 50.0):
        steps = stepper(mass, damping, pull, name=name, load=load, lightest=load, heaviest=load, tol=1e-2)
        for phase in random.integers(0, 1 << 64, 10, dtype=np.uint64):
            state = steps.start(int(phase), load, 0.0, 1.0 / 48000)
            z, out = state.numbers[0], np.zeros((ROWS, 50))
            steps.run(state, np.full(50, phase), np.full(50, load), out)
            assert np.all(out[HEIGHT] == z)
            assert state.numbers[1] == 0.0


def test_small_oscillations_have_the_frequency_of_the_touching_part() -> None:
    steps, rate = stepper(1e-3), 192000
    state, _floor = released(steps, rate, 1e-10)
    touching = read(steps, PHASE, float(state.numbers[0]))[1]
    expected = math.sqrt(stiffness_at(steps, LOAD) * touching / steps.mass) / (2.0 * math.pi)
    z = run(steps, state, np.full(rate, PHASE / 2**64), LOAD)[HEIGHT]
    z -= z.mean()
    crossings = np.flatnonzero((z[:-1] < 0.0) & (z[1:] >= 0.0))
    places = crossings - z[crossings] / (z[crossings + 1] - z[crossings])
    found = rate * (len(places) - 1) / (places[-1] - places[0])
    assert found == pytest.approx(expected, rel=2e-4)


@pytest.mark.parametrize(("mass", "damping"), [(1e-3, 0.0), (1e-3, 1.0)])
def test_second_order_in_the_step(mass: float, damping: float) -> None:
    steps, base, seconds, turns = stepper(mass, damping), 24000, 0.02, 20.0
    scans = {factor: scanned(steps, base * factor, seconds, turns)[HEIGHT] for factor in (1, 2, 4, 64)}
    runs = {factor: z[factor - 1 :: factor] for factor, z in scans.items()}
    errors = [float(np.max(np.abs(runs[factor] - runs[64]))) for factor in (1, 2, 4)]
    assert errors[0] < 0.02 * np.ptp(runs[64])
    assert 3.0 < errors[0] / errors[1] < 5.0
    assert 3.0 < errors[1] / errors[2] < 5.0


def test_motion_agrees_with_the_exact_contact() -> None:
    mass, damping = 1e-3, 0.3
    contact, turns, seconds, rate = table_of("default")[0], 100.0, 0.01, 384000
    stiffness = contact.stiffness_at(LOAD)
    steps = stepper(mass, damping, tol=2e-4)
    state = steps.start(0, LOAD, turns, 1.0 / rate)

    def reaction(t: float, z: float) -> float:
        return stiffness * float(contact.measure(np.array([turns * t % 1.0]), np.array([z]), LOAD)[0][0])

    def motion(t: float, y: Real) -> list[float]:
        force = reaction(t, float(y[0])) - LOAD
        return [float(y[1]), (force - damping * float(y[1])) / mass]

    begin, times = state.numbers[:2].tolist(), np.arange(1, round(seconds * rate) + 1) / rate
    exact = solve_ivp(motion, (0.0, seconds), begin, "DOP853", times, rtol=1e-7, atol=[1e-11, 1e-8]).y[0]
    z = run(steps, state, turns * times, LOAD)[HEIGHT]
    assert np.max(np.abs(z - exact)) <= 3e-4 * np.ptp(exact)


def test_slow_scans_with_mass_follow_the_elastic_contact() -> None:
    steps = stepper(1e-3, 5.0)
    out = [[scanned(one, 48000, 0.5, turns)[HEIGHT] for one in (steps, steps.elastic)] for turns in (8.0, 2.0)]
    lag = [float(np.max(np.abs(moved - still))) for moved, still in out]
    assert lag[1] < 0.35 * lag[0] < 0.35 * np.ptp(out[1][1])


def test_elastic_heights_are_those_of_the_exact_contact() -> None:
    steps = stepper(lightest=0.1, heaviest=1.0)
    turns, loads = np.arange(500) * 0.01, 0.3 + 0.2 * np.sin(np.arange(500) * 0.03)
    out = run(steps, steps.start(0, 0.3, 0.0, 1e-4), turns, loads)
    contact = table_of("default")[0]
    exact = [contact.approach(np.array([turn % 1.0]), load)[0][0] for turn, load in zip(turns, loads, strict=True)]
    assert np.max(np.abs(out[HEIGHT] - exact)) <= 1e-3 * steps.table.motion


@pytest.mark.parametrize("name", few(SCENES, 1))
def test_elastic_heights_balance_every_load_on_a_coarse_table(name: str) -> None:
    steps = stepper(name=name, load=5.0, lightest=5.0, heaviest=5.0, tol=0.1)
    loads = 5.0 * np.abs(np.sin(np.arange(5000) * 0.0317)) ** 4  # down to 0, which counts as the lift load
    turns = np.random.default_rng(9).random(5000)
    state = steps.start(0, 5.0, 0.0, 1e-4)
    z = run(steps, state, turns, loads)[HEIGHT]
    depth = steps.table.read(turns, z)[0]
    wanted = np.maximum(loads, LIFT) ** 1.5 / steps.stiffness.coefficient
    assert np.max(np.abs(depth / wanted - 1.0)) <= 1e-9


def test_a_finger_that_is_let_fall_flies_a_parabola_and_comes_back() -> None:
    mass, rate, height = 1e-3, 48000, 100e-6
    steps = stepper(mass)
    state, _floor = released(steps, rate, height)
    z = run(steps, state, np.full(2000, PHASE / 2**64), LOAD)[HEIGHT]
    crest = float(table_of("default")[0].approach(np.array([PHASE / 2**64]), 0.0)[0][0])
    bends = np.diff(z, 2) * rate**2
    flying = np.minimum(np.minimum(z[:-2], z[1:-1]), z[2:]) > crest + 1e-6
    assert np.count_nonzero(flying) > 100
    assert bends[flying] == pytest.approx(-LOAD / mass, rel=1e-6)
    assert np.max(z[1000:]) == pytest.approx(z[0], abs=0.05 * height)  # no energy is lost
    assert np.min(z) < crest  # it pressed into the surface


def test_a_fast_scan_loses_contact_and_regains_it() -> None:
    steps = stepper(0.05, name="large", forces=True)
    out = scanned(steps, 48000, 0.5, 50.0)
    lost = out[REACTION] == 0.0
    assert np.count_nonzero(lost) > 1000
    assert np.max(out[REACTION, int(np.argmax(lost)) :]) > LOAD
    assert np.all(out[ATTACHED] == 1.0)


def test_the_elastic_slope_force_does_no_work_over_a_period() -> None:
    steps = stepper(forces=True)
    out = scanned(steps, 20000, 1.0, 1.0)
    assert abs(np.mean(out[SLOPE_FORCE])) <= 1e-6 * np.std(out[SLOPE_FORCE])
    assert out[REACTION] == pytest.approx(LOAD, rel=1e-9)


def test_work_against_the_slopes_is_what_the_damper_loses() -> None:
    for rate, miss in ((48000, 1e-3), (192000, 1e-4)):  # the net work is a small part of what F gives and takes
        steps, turns = stepper(1e-3, 1.0, forces=True), 100.0
        out = scanned(steps, rate, 0.5, turns)
        period = round(rate / turns)
        z, force = out[HEIGHT, -period - 1 :], out[SLOPE_FORCE, -period - 1 :]
        work = float(np.sum(0.5 * (force[1:] + force[:-1]))) * PERIOD / period
        lost = float(np.sum(np.diff(z) ** 2)) * rate * steps.damping
        assert z[-1] == pytest.approx(z[0], abs=1e-12 * np.ptp(z))  # steady
        assert work == pytest.approx(lost, rel=miss)


def flat(pull: float, reach: float, **wanted: Any) -> TableStepper:
    """Return a contact of two surfaces of 1 nm, flat compared to the reach of adhesion: k = 1e5 N/m at every load."""
    geometry = Geometry(1e-9, 0.5e-3, 1e-9, 0.8e-3, 1.0, 10e-3)
    contact = Contact(geometry, Stiffness.of_contact(geometry, 1.35e5))
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
