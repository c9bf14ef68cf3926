"""Physics of viscous skin: slow twin, splits of runs, rest, closed forms of full contact, loss, order, extremes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

from synth.contact.load_balance import Contact, full_contact
from synth.contact.scene_contact import contact_of
from synth.effects.simulation.pulp import Pulp
from synth.effects.simulation.skin_points import SkinPoints
from synth.effects.simulation.skin_steps import SkinStepper
from synth.effects.simulation.steps import (
    ATTACHED,
    HEIGHT,
    REACTION,
    ROWS,
    SLOPE_FORCE,
    SPEED,
    Phases,
    State,
    Stepper,
    StiffnessLaw,
)
from synth.effects.simulation.terms import Skin
from tests.reference import skin_oracle as twin
from tests.synth.engine_cases import Real, scene_of

LOAD, PERIOD, LIGHTEST = 0.3, 0.8e-3, 1e-6  # of the default scene: N, m, N
VOIGT, RELAXING = Skin((0.004,)), Skin((0.004, 0.070, 1.4), (0.25, 0.25, 0.25))
LAWS = (VOIGT, RELAXING)


def contact(**sections: Any) -> Contact:
    return contact_of(scene_of(**sections))


def stepper_of(law: Skin, points: int, load: float = LOAD, **settings: Any) -> SkinStepper:
    """Return the stepper of the default scene."""
    stiffness = StiffnessLaw.of(contact(), load, LIGHTEST)
    return SkinStepper(SkinPoints.of_contact(contact(), load, points), law, stiffness, **settings)


def stepper_of_stiffness(law: Skin, points: int, stiffness: float, **settings: Any) -> SkinStepper:
    """Return the stepper of the default scene with a constant stiffness (N/m)."""
    found = SkinPoints.of_contact(contact(), LOAD, points)
    return SkinStepper(found, law, StiffnessLaw(stiffness, 0.0, LIGHTEST), **settings)


def elastic(stepper: SkinStepper, turns: Real, loads: float | Real, first: float | None = None) -> Real:
    """Return z (m) of the same finger without memory or mass."""
    begin = float(turns[0]) if first is None else first
    return np.asarray(scanned(stepper.elastic, turns, loads, 1e-4, begin)[1][HEIGHT])


def stood(root: Any) -> Any:
    """Return a z_w (m), not the true one, over the cube root of the load (N^(1/3))."""
    return 3e-5 - 4e-5 * root**2


def twin_of(stepper: SkinStepper, step: float) -> twin.Foundation:
    """Return the twin of a stepper of the default scene."""
    geometry, law = contact().geometry, stepper.law
    skin = twin.Skin(None, law.times, law.weights) if law.weights else twin.Skin(law.times[0])
    return twin.Foundation(
        geometry.ridge_amplitude, geometry.ridge_period, geometry.texture_amplitude, geometry.texture_period,
        geometry.texture_phase, geometry.contact_length, stepper.points.count, stepper.stiffness.coefficient,
        stepper.stiffness.power, skin, step, stepper.mass, stepper.damping, stepper.pulp.stiffness,
        lambda load: stood(load ** (1 / 3)),
    )  # fmt: skip


def turned(turns: Real) -> Phases:
    """Return `turns` as 64-bit fractions of a turn."""
    rest = turns - np.floor(turns)
    return np.asarray((rest * 2.0**63).astype(np.uint64) << np.uint64(1))


def scanned(
    stepper: SkinStepper, turns: Real, loads: float | Real, step: float, first: float = 0.0
) -> tuple[State, Real]:
    """Return state and rows of a finger that starts at `first` turns, relaxed, and scans through `turns`."""
    loads = np.broadcast_to(np.asarray(loads, dtype=float), turns.shape).copy()
    speed = float(turns[0] - first) / step
    state = stepper.start(int(turned(np.array([first]))[0]), float(loads[0]), speed, step)
    out = np.full((ROWS, len(turns)), np.nan)
    stepper.run(state, turned(turns), loads, out)
    return state, out


def steady(speed: float, step: float, count: int) -> Real:
    """Return the turns at `count` steps of `step` (s) at `speed` (m/s), from the first step on."""
    return np.asarray(speed / PERIOD * step * np.arange(1, count + 1))


def indentations(state: State) -> Real:
    """Return the indentation of every element, relative to a1 + a2."""
    return np.asarray(np.max(state.elements[:, 0], axis=0))


STIFFNESS = 3e5  # N/m, near k of the default scene
DEEP = 100.0  # N, which presses everything flat: w / k = 330 um
SCALE = 60e-6  # a1 + a2 of the default scene
PULP = {"mass": 1e-4, "damping": 2.4, "pulp": Pulp(5e3, stood)}
SETTINGS: list[tuple[Skin, dict[str, Any]]] = [
    (VOIGT, {}),
    (Skin((1e-5,)), {}),
    (RELAXING, {}),
    (Skin((1e-4,), (0.6,)), {}),
    (VOIGT, {"mass": 5e-3, "damping": 3.0}),
    (RELAXING, {"mass": 1e-4, "damping": 1.0}),
    (RELAXING, {"damping": 1.0}),
    (VOIGT, PULP),
    (RELAXING, PULP),
]


def wandering(count: int, seed: int) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """Return turns that move back and forth and loads that rise and fall, sometimes abruptly."""
    random = np.random.default_rng(seed)
    turns = 0.3 + np.cumsum(random.uniform(-0.02, 0.05) + 0.03 * np.sin(np.arange(count) / 7.0))
    loads = LOAD * np.exp(np.cumsum(0.05 * random.standard_normal(count)) - 2.0 * (np.arange(count) % 20 > 15))
    return turns, loads


@pytest.mark.parametrize(("law", "settings"), SETTINGS)
def test_every_row_is_that_of_the_twin(law: Skin, settings: dict[str, Any]) -> None:
    step, points, count = 1 / 8000, 83, 60
    stepper = stepper_of(law, points, with_force=True, **settings)
    turns, loads = wandering(count, 7)
    state = stepper.start(int(turned(np.array([0.3]))[0]), loads[0], 0.0, step)
    out = np.empty((ROWS, count))
    stepper.run(state, turned(turns), loads, out)
    foundation = twin_of(stepper, step)
    finger, static = twin.rested(foundation, 0.3, loads[0]), np.empty(count)
    for i in range(count):
        static[i] = twin.go_on(foundation, finger, turns[i], loads[i])
        assert out[HEIGHT, i] == pytest.approx(finger.z, abs=1e-12 * SCALE)
        assert out[REACTION, i] == pytest.approx(finger.pressing, rel=1e-9)
        assert out[SLOPE_FORCE, i] == pytest.approx(finger.force, abs=1e-9 * loads[i])
    assert np.all(out[ATTACHED] == 1.0)
    assert elastic(stepper, turns, loads, 0.3) == pytest.approx(static, abs=1e-12 * SCALE)


@pytest.mark.parametrize(("law", "settings"), SETTINGS)
def test_runs_of_any_lengths_give_the_same_bits(law: Skin, settings: dict[str, Any]) -> None:
    stepper: Stepper = stepper_of(law, 257, with_force=True, **settings)
    turns, loads = wandering(300, 3)
    state = stepper.start(5, 0.2, 40.0, 1 / 48000)
    whole, parts, again = state.resumed(1 / 48000), state.resumed(1 / 48000), np.empty((ROWS, 300))
    once = np.empty((ROWS, 300))
    stepper.run(whole, turned(turns), loads, once)
    begin = 0
    for end in (1, 2, 9, 100, 100, 299, 300):
        part = np.empty((ROWS, end - begin))
        stepper.run(parts, turned(turns[begin:end]), loads[begin:end], part)
        again[:, begin:end] = part
        begin = end
    assert np.array_equal(once, again)
    assert np.array_equal(whole.elements, parts.elements) and np.array_equal(whole.numbers, parts.numbers)


@pytest.mark.parametrize("settings", [{}, {"mass": 2e-3, "damping": 1.0}])
@pytest.mark.parametrize("law", [*LAWS, Skin((0.0,))])
@pytest.mark.parametrize("step", [1 / 192000, 1 / 8000, 0.1])
def test_a_finger_at_rest_stays_where_it_is(law: Skin, settings: dict[str, Any], step: float) -> None:
    stepper = stepper_of(law, 257, **settings)
    for place, load in ((0.0, LOAD), (0.37, 1e-5), (0.71, 3.0), (0.93, 800.0)):
        _, out = scanned(stepper, np.full(300, place), load, step, first=place)
        start = stepper.start(int(turned(np.array([place]))[0]), load, 0.0, step)
        assert np.all(out[HEIGHT] == start.numbers[0] * stepper.points.height_scale)
        rounding = stepper.mass / step**2 * np.spacing(np.max(np.abs(out[HEIGHT])))  # of z, in m z''
        assert out[REACTION] == pytest.approx(load, rel=1e-12, abs=max(1e-12, 4.0 * rounding))


@pytest.mark.parametrize(("swing", "factor"), [(0.0, 4.0), (0.3, 2.0)])
@pytest.mark.parametrize("law", LAWS)
def test_slow_scans_come_to_the_elastic_z(law: Skin, swing: float, factor: float) -> None:
    """To first order the memory adds tau d/dt of the mean indentation w / k, which is 0 at a constant load."""
    errors = []
    stepper = stepper_of(law, 257)
    fastest = 1e-6 if law.weights else 2e-4
    step = PERIOD / fastest / 2000
    for halved in range(4):
        count = 1500 * 2**halved
        turns = steady(fastest / 2**halved, step, count)
        loads = LOAD * (1.0 + swing * np.sin(2.0 * np.pi * turns))
        _, out = scanned(stepper, turns, loads, step)
        still = elastic(stepper, turns, loads)
        errors.append(np.sqrt(np.mean((out[HEIGHT] - still)[count // 2 :] ** 2)))
    assert errors[-1] < 0.02 * np.ptp(still)
    assert np.array(errors[:-1]) / errors[1:] == pytest.approx([factor] * 3, rel=0.1)


@pytest.mark.parametrize("settings", [{}, {"mass": 5e-3, "damping": 3.0}])
@pytest.mark.parametrize("steps", [1e-6, 1e-3, 1.0, 1e3])
@pytest.mark.parametrize("load", [1e-6, 0.3, 1e3])
def test_extremes_stay_numbers(load: float, steps: float, settings: dict[str, Any]) -> None:
    for law, time in ((VOIGT, 0.004), (RELAXING, 0.07)):
        stepper = stepper_of(law, 129, with_force=True, **settings)
        turns, loads = wandering(200, 5)
        _, out = scanned(stepper, turns, np.clip(loads / LOAD * load, 1e-6, 1e3), steps * time)
        assert np.all(np.isfinite(out)) and np.all(out[REACTION] >= 0.0)
        _, out = scanned(stepper, turns, np.where(np.arange(200) % 50 < 25, load, LOAD), steps * time)
        assert np.all(np.isfinite(out)) and np.all(out[REACTION] >= 0.0)


def test_light_skin_that_rests_for_long_keeps_no_denormal_numbers() -> None:
    for law in LAWS:
        stepper = stepper_of(law, 65)
        state, _ = scanned(stepper, steady(0.08, 1e-3, 100), LOAD, 1e-3)
        still = np.full(3000, 0.31)
        stepper.run(state, turned(still), np.full(3000, 0.01), np.empty((ROWS, 3000)))
        state = state.resumed(5.0)
        stepper.run(state, turned(still), np.full(3000, 0.01), np.empty((ROWS, 3000)))
        kept = np.abs(state.elements[state.elements != 0.0])
        assert kept.size and kept.min() > 1e-300


def test_loads_below_the_lightest_count_as_it() -> None:
    stepper = stepper_of(VOIGT, 129)
    rows = [scanned(stepper, steady(0.08, 1e-4, 50), load, 1e-4)[1] for load in (0.0, LIGHTEST)]
    assert np.array_equal(rows[0], rows[1])


def test_a_dome_is_taken_off_the_profile() -> None:
    class Domed(type(contact())):  # type: ignore[misc]
        dome = 2.0

    plain = contact()
    domed = Domed(plain.geometry, plain.stiffness)
    flat = SkinPoints.of_contact(plain, LOAD, 101).rows[0]
    taken = (flat - SkinPoints.of_contact(domed, LOAD, 101).rows[0]) * SCALE
    x = plain.geometry.contact_length * np.linspace(-0.5, 0.5, 101)
    assert taken == pytest.approx(x**2, abs=1e-15)


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
    evenly = 1.0 - time / step * -math.expm1(-step / time)  # for a load that rises evenly over the first step
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


@pytest.mark.parametrize(
    ("law", "settings"),
    [(VOIGT, {}), (RELAXING, {}), (VOIGT, {"mass": 2e-3, "damping": 2.0}),
     (RELAXING, {"mass": 2e-3, "damping": 2.0})],
)  # fmt: skip
def test_the_error_of_a_step_falls_with_its_square(law: Skin, settings: dict[str, Any]) -> None:
    """The surface starts smoothly under a varying load, with so many points that their distance has no effect."""
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
    state.numbers[SPEED] = 1e-3  # m/s: the impulse that starts the oscillation
    rest = state.numbers[0] * stepper.points.height_scale
    stepper.run(state, turned(np.zeros(count)), np.full(count, DEEP), out)
    decay = (damping + STIFFNESS * time) / (2.0 * mass)
    natural = math.sqrt(STIFFNESS / mass - decay**2)
    times = step * np.arange(1, count + 1)
    wanted = 1e-3 / natural * np.exp(-decay * times) * np.sin(natural * times)
    assert np.max(np.abs(out[HEIGHT] - rest - wanted)) < 5e-3 * np.max(wanted)
