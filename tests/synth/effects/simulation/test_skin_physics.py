"""What viscous skin does: closed forms of full contact, recovery, loss, and the order of the scheme."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import pytest
from scipy.linalg import expm

from synth.contact.full_contact import full_contact
from synth.effects.simulation.skin_steps import VELOCITY
from synth.effects.simulation.steps import HEIGHT, ROWS, SLOPE_FORCE
from synth.effects.simulation.terms import Skin
from tests.reference import skin_oracle as twin
from tests.synth.effects.simulation.skin_cases import (
    LOAD,
    PERIOD,
    RELAXING,
    VOIGT,
    contact,
    elastic,
    indentations,
    scanned,
    steady,
    stepper_of,
    stepper_of_stiffness,
    turned,
    twin_of,
)  # fmt: skip

Real = npt.NDArray[np.float64]
STIFFNESS = 3e5  # N/m, near k of the default scene
DEEP = 100.0  # N, which presses everything flat: w / k = 330 um


def crept(skin: Skin, step: float, ramp: int, count: int) -> Real:
    """Return kappa e at `count` steps of an element whose pressure rises evenly from 0 to 1 in `ramp` steps.

    e' = g0 p' / kappa + sum of gi qi / taui, qi' = e' - qi / taui: a linear system in [e, qi, p'].
    """
    memories = skin.memories
    rates = np.zeros((memories + 2, memories + 2))
    rates[0, 1:-1] = np.array(skin.weights) / np.array(skin.times)
    rates[0, -1] = skin.relaxed_part
    rates[1:-1] = rates[0] - np.diag(1.0 / np.array([1.0, *skin.times, 1.0]))[1:-1]
    onward, found = expm(rates * step), np.empty(count)
    state = np.array([0.0] * (memories + 1) + [1.0 / (ramp * step)])
    for i in range(count):
        state[-1] *= i < ramp
        state = onward @ state
        found[i] = state[0]
    return found


def test_full_contact_is_one_sinusoid() -> None:
    closed = full_contact(contact().geometry, contact().stiffness, 30.0)
    assert closed is not None
    stepper = stepper_of(VOIGT, 1025, load=30.0)
    turns = steady(0.02, 1 / 48000, 4000)
    _, out = scanned(stepper, turns, 30.0, 1 / 48000)
    wanted = closed.mean + 2.0 * np.real(closed.first * np.exp(2j * np.pi * turns))
    assert out[HEIGHT] == pytest.approx(elastic(stepper, turns, 30.0), abs=1e-12 * abs(closed.mean))
    error = out[HEIGHT] - wanted
    assert np.ptp(error) < 1e-3 * np.ptp(wanted) and np.max(np.abs(error)) < 1e-3 * abs(closed.mean)


@pytest.mark.parametrize("time", [1e-4, 0.004, 0.1])
def test_a_step_of_load_in_full_contact_sinks_in_as_an_exponential(time: float) -> None:
    stepper, step, count = stepper_of_stiffness(Skin((time,)), 129, STIFFNESS), 1e-4, 400
    _, out = scanned(stepper, np.zeros(count + 1), np.array([DEEP, *[1.01 * DEEP] * count]), step)
    sunk = (out[HEIGHT, 0] - out[HEIGHT, 1:]) / (0.01 * DEEP / STIFFNESS)
    first = sunk[0]
    assert sunk == pytest.approx(1.0 - (1.0 - first) * np.exp(-step / time * np.arange(count)), abs=1e-9)
    evenly = 1.0 - time / step * -math.expm1(-step / time)  # a load that rises evenly over the first step
    assert first == pytest.approx(evenly, abs=0.6 * min((step / time) ** 2, 0.3))


@pytest.mark.parametrize("law", [RELAXING, Skin((0.01,), (0.5,))])
def test_a_step_of_load_on_relaxing_skin_creeps_as_that_solid(law: Skin) -> None:
    errors, ramp = [], 1e-3
    for parts in (2, 4, 8):
        step, count = ramp / parts, 40 * parts
        times = step * np.arange(1, count + 1)
        loads = DEEP * (1.0 + 0.01 * np.minimum(times / ramp, 1.0))
        stepper = stepper_of_stiffness(law, 65, STIFFNESS)
        state = stepper.start(0, DEEP, 0.0, step)
        start, out = state.numbers[0] * stepper.points.height_scale, np.empty((ROWS, count))
        stepper.run(state, turned(np.zeros(count)), loads, out)
        sunk = (start - out[HEIGHT]) / (0.01 * DEEP / STIFFNESS)
        errors.append(np.max(np.abs(sunk - crept(law, step, parts, count))))
    assert errors[-1] < 1e-4
    assert np.array(errors[:-1]) / errors[1:] == pytest.approx([4.0] * 2, rel=0.2)


@pytest.mark.parametrize("time", [0.001, 0.004])
def test_skin_that_the_surface_has_left_recovers_as_an_exponential(time: float) -> None:
    stepper, step, count = stepper_of(Skin((time,)), 257), 1e-4, 100
    state, _ = scanned(stepper, steady(0.08, step, 300), LOAD, step)
    before = indentations(state)
    touched, still = np.zeros(257, dtype=bool), np.full(1, 0.08 / PERIOD * step * 300)
    for _ in range(count):
        earlier = indentations(state)
        stepper.run(state, turned(still), np.full(1, 1e-4), np.empty((ROWS, 1)))
        touched |= indentations(state) > earlier * math.exp(-step / time) * (1.0 + 1e-12)
    left = (before > 1e-6) & ~touched
    assert np.sum(left) > 20
    assert indentations(state)[left] == pytest.approx(before[left] * math.exp(-count * step / time), rel=1e-13)


def loss(law: Skin, points: int, speed: float, parts: int) -> tuple[float, float]:
    """Return the work of the surface and the loss in the dashpots (J) in the third period of a steady scan."""
    stepper, step = stepper_of(law, points, with_force=True), PERIOD / speed / parts
    turns, loads, rows = steady(speed, step, 3 * parts), np.full(1, LOAD), np.empty((ROWS, 1))
    state = stepper.start(0, LOAD, speed / PERIOD, step)
    worked = dissipated = 0.0
    for i in range(3 * parts):
        before = indentations(state)
        stepper.run(state, turned(turns[i : i + 1]), loads, rows)
        if i >= 2 * parts:
            worked += rows[SLOPE_FORCE, 0] * PERIOD / parts
            moved = (indentations(state) - before) * stepper.points.height_scale
            dissipated += law.times[0] / step * float(np.sum(moved**2)) * contact().stiffness_at(LOAD) / (points - 1)
    return worked, dissipated


def test_the_work_of_the_surface_is_what_the_dashpots_lose() -> None:
    gaps = []
    for points, parts in ((257, 240), (513, 480), (1025, 960)):
        worked, dissipated = loss(VOIGT, points, 0.08, parts)
        assert worked > 1e-5
        gaps.append(abs(dissipated / worked - 1.0))
    assert gaps[-1] < 0.01 and gaps[0] > 3.0 * gaps[1] > 9.0 * gaps[2]


def test_the_work_of_coarse_elements_is_within_their_loss_in_the_twin() -> None:
    """At 83 elements a front adds its jump from one to the next to the loss of the twin: it is the larger."""
    stepper = stepper_of(VOIGT, 83, with_force=True)
    step = PERIOD / 0.08 / 120
    foundation = twin_of(stepper, step)
    finger = twin.rested(foundation, 0.0, LOAD)
    worked, lost = 0.0, 0.0
    for i in range(1, 241):
        before = finger.dissipated
        twin.go_on(foundation, finger, i / 120, LOAD)
        if i > 120:
            worked += finger.force * PERIOD / 120
            lost += finger.dissipated - before
    assert 1e-5 < worked < lost < 3.0 * worked


@pytest.mark.parametrize("falling", ["time", "speed"])
def test_the_loss_vanishes_without_a_dashpot_and_without_speed(falling: str) -> None:
    works = []
    for part in (1.0, 0.1, 0.01):
        time, speed = (0.004 * part, 0.08) if falling == "time" else (0.004, 0.08 * part)
        works.append(loss(Skin((time,)), 257, speed, 480)[0])
    assert works[0] > 2.0 * works[1] > 16.0 * works[2] > 0.0
    elastic, _ = loss(Skin((0.0,)), 257, 0.08, 480)
    assert abs(elastic) < 1e-5 * works[0]


@pytest.mark.parametrize(
    ("law", "settings"),
    [(VOIGT, {}), (RELAXING, {}), (VOIGT, {"mass": 2e-3, "damping": 2.0}),
     (RELAXING, {"mass": 2e-3, "damping": 2.0})],
)  # fmt: skip
def test_the_error_of_a_step_falls_with_its_square(law: Skin, settings: dict[str, float]) -> None:
    """A surface that sets out smoothly under a load that moves, at so many points that their distance is not seen."""
    stepper, runs = stepper_of(law, 4097, **settings), []
    for halved in (0, 1, 2, 3, 6):
        parts = 2**halved
        times = np.arange(1, 50 * parts + 1) / (50 * parts)
        turns, loads = 1.5 * times**3, LOAD * (1.3 - 0.3 * np.cos(6.0 * times))
        _, out = scanned(stepper, turns, loads, 0.02 / (50 * parts))
        runs.append(out[HEIGHT, parts - 1 :: parts])
    errors = [float(np.sqrt(np.mean((run - runs[-1]) ** 2))) for run in runs[:-1]]
    assert errors[0] < 0.05 * np.ptp(runs[-1])
    assert math.log2(errors[0] / errors[-1]) / 3.0 > 1.6


@pytest.mark.parametrize("time", [0.0, 2e-4])
def test_a_mass_swings_on_the_skin_as_the_damped_oscillator(time: float) -> None:
    mass, damping, step = 5e-3, 4.0, 1 / 96000
    stepper = stepper_of_stiffness(Skin((time,)), 65, STIFFNESS, mass=mass, damping=damping)
    count = 600
    state, out = stepper.start(0, DEEP, 0.0, step), np.empty((ROWS, count))
    state.numbers[VELOCITY] = 1e-3  # m/s: the blow that sets it swinging
    rest = state.numbers[0] * stepper.points.height_scale
    stepper.run(state, turned(np.zeros(count)), np.full(count, DEEP), out)
    decay = (damping + STIFFNESS * time) / (2.0 * mass)
    natural = math.sqrt(STIFFNESS / mass - decay**2)
    times = step * np.arange(1, count + 1)
    wanted = 1e-3 / natural * np.exp(-decay * times) * np.sin(natural * times)
    assert np.max(np.abs(out[HEIGHT] - rest - wanted)) < 5e-3 * np.max(wanted)


def plain_elements(points: int, turns: Real, step: float) -> Real:
    """Return z (m) of as many elements of Kelvin-Voigt skin, each its own: sum of the pressures = w."""
    stepper = stepper_of(VOIGT, points)
    (finger, texture, quarter), keep = stepper.points.rows, math.exp(-step / VOIGT.times[0])
    wanted = contact().indentation(LOAD) / stepper.points.height_scale * (1.0 - keep)
    state = stepper.start(0, LOAD, 0.0, step)
    indentation, z, found = indentations(state), state.numbers[0], []
    for turn in turns:
        profile = finger + math.cos(2 * np.pi * turn) * texture + math.sin(2 * np.pi * turn) * quarter
        free = profile - keep * indentation
        z = float(np.mean(free)) - wanted
        for _ in range(60):
            touching = free > z
            last, z = z, float((np.sum(free[touching]) - wanted * points) / np.sum(touching))
            if abs(z - last) < 1e-12:
                break
        indentation = np.maximum(profile - z, keep * indentation)
        found.append(z * stepper.points.height_scale)
    return np.array(found)


def test_many_plain_elements_come_to_the_z_of_few_cut_ones() -> None:
    step, count = 1 / 24000, 300
    turns = steady(0.08, step, count)
    _, out = scanned(stepper_of(VOIGT, 8193), turns, LOAD, step)
    swing = np.ptp(out[HEIGHT, 60:])
    errors = [np.max(np.abs(plain_elements(n, turns, step) - out[HEIGHT])[60:]) / swing for n in (2049, 16385)]
    _, few = scanned(stepper_of(VOIGT, 513), turns, LOAD, step)
    error = (few - out)[HEIGHT, 60:]
    assert errors[1] < 5e-4 < errors[0]
    assert np.ptp(error) < 0.02 * swing
