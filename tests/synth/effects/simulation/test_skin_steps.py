"""The stepper of viscous skin: its twin, splits of runs, rest, the elastic limit, extremes, the number of points."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from synth.contact.exact_solver import Grid
from synth.effects.simulation.skin_points import SkinPoints
from synth.effects.simulation.steps import ATTACHED, HEIGHT, REACTION, ROWS, SLOPE_FORCE, Stepper
from synth.effects.simulation.terms import Skin
from tests.reference import skin_oracle as twin
from tests.synth.effects.simulation.skin_cases import (
    LAWS,
    LIGHTEST,
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
    turned,
    twin_of,
)  # fmt: skip

SCALE = 60e-6  # a1 + a2 of the default scene
SETTINGS: list[tuple[Skin, dict[str, float]]] = [
    (VOIGT, {}),
    (Skin((1e-5,)), {}),
    (RELAXING, {}),
    (Skin((1e-4,), (0.6,)), {}),
    (VOIGT, {"mass": 5e-3, "damping": 3.0}),
    (RELAXING, {"mass": 1e-4, "damping": 1.0}),
    (RELAXING, {"damping": 1.0}),
]


def wandering(count: int, seed: int) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """Return turns that go to and fro and loads that rise and fall, now and then at once."""
    random = np.random.default_rng(seed)
    turns = 0.3 + np.cumsum(random.uniform(-0.02, 0.05) + 0.03 * np.sin(np.arange(count) / 7.0))
    loads = LOAD * np.exp(np.cumsum(0.05 * random.standard_normal(count)) - 2.0 * (np.arange(count) % 20 > 15))
    return turns, loads


@pytest.mark.parametrize(("law", "settings"), SETTINGS)
def test_every_row_is_that_of_the_twin(law: Skin, settings: dict[str, float]) -> None:
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
def test_runs_of_any_lengths_give_the_same_bits(law: Skin, settings: dict[str, float]) -> None:
    stepper: Stepper = stepper_of(law, 257, with_force=True, **settings)
    turns, loads = wandering(300, 3)
    state = stepper.start(5, 0.2, 40.0, 1 / 48000)
    whole, parts, again = state.copied(), state.copied(), np.empty((ROWS, 300))
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


def test_a_copied_state_goes_on_by_itself() -> None:
    stepper = stepper_of(VOIGT, 129)
    state, _ = scanned(stepper, steady(0.08, 1e-4, 50), LOAD, 1e-4)
    kept = state.elements.copy(), state.numbers.copy(), state.phase.copy()
    stepper.run(state.copied(), turned(np.array([0.9])), np.array([2.0]), np.empty((ROWS, 1)))
    assert all(np.array_equal(a, b) for a, b in zip(kept, (state.elements, state.numbers, state.phase), strict=True))
    assert stepper.state_bytes == state.elements.nbytes + state.numbers.nbytes + state.phase.nbytes


@pytest.mark.parametrize("settings", [{}, {"mass": 2e-3, "damping": 1.0}])
@pytest.mark.parametrize("law", [*LAWS, Skin((0.0,))])
@pytest.mark.parametrize("step", [1 / 192000, 1 / 8000, 0.1])
def test_a_finger_at_rest_stays_where_it_is(law: Skin, settings: dict[str, float], step: float) -> None:
    stepper = stepper_of(law, 257, **settings)
    for place, load in ((0.0, LOAD), (0.37, 1e-5), (0.71, 3.0), (0.93, 800.0)):
        _, out = scanned(stepper, np.full(300, place), load, step, first=place)
        start = stepper.start(int(turned(np.array([place]))[0]), load, 0.0, step)
        assert np.all(out[HEIGHT] == start.numbers[0] * stepper.points.height_scale)
        rounding = stepper.mass / step**2 * np.spacing(np.max(np.abs(out[HEIGHT])))  # of z, in m z''
        assert out[REACTION] == pytest.approx(load, rel=1e-12, abs=max(1e-12, 4.0 * rounding))


def test_the_elastic_finger_balances_every_load() -> None:
    """z of the polygon of heights, by bisection on its area above z."""
    turns, loads = wandering(40, 11)
    stepper = stepper_of(VOIGT, 257)
    finger, texture, quarter = stepper.points.rows
    found = elastic(stepper, turns, loads)
    for i, turn in enumerate(turns):
        profile = finger + np.cos(2 * np.pi * turn) * texture + np.sin(2 * np.pi * turn) * quarter
        fine = np.interp(np.linspace(0.0, 256.0, 256 * 400 + 1), np.arange(257), profile)
        area = np.mean(np.maximum(0.5 * (fine[1:] + fine[:-1]) - found[i] / SCALE, 0.0))
        assert area * SCALE == pytest.approx(contact().indentation(loads[i]), rel=2e-4)


@pytest.mark.parametrize(("swing", "factor"), [(0.0, 4.0), (0.3, 2.0)])
@pytest.mark.parametrize("law", LAWS)
def test_slow_scans_come_to_the_elastic_z(law: Skin, swing: float, factor: float) -> None:
    """The first order of the memory is tau d/dt of the mean indentation, w / k: none at a constant load."""
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
def test_extremes_stay_numbers(load: float, steps: float, settings: dict[str, float]) -> None:
    for law, time in ((VOIGT, 0.004), (RELAXING, 0.07)):
        stepper = stepper_of(law, 129, with_force=True, **settings)
        turns, loads = wandering(200, 5)
        _, out = scanned(stepper, turns, np.clip(loads / LOAD * load, 1e-6, 1e3), steps * time)
        assert np.all(np.isfinite(out)) and np.all(out[REACTION] >= 0.0)
        _, out = scanned(stepper, turns, np.where(np.arange(200) % 50 < 25, load, LOAD), steps * time)
        assert np.all(np.isfinite(out)) and np.all(out[REACTION] >= 0.0)


@pytest.mark.parametrize("law", LAWS)
def test_pressure_is_never_negative_and_the_surface_never_inside_the_skin(law: Skin) -> None:
    stepper, step = stepper_of(law, 257), 1 / 8000
    turns, loads = wandering(300, 13)
    state = stepper.start(int(turned(np.array([0.3]))[0]), LOAD, 0.0, step)
    coefficients, touched = state.coefficients, set()
    for i in range(300):
        before = state.copied()
        stepper.run(state, turned(turns[i : i + 1]), loads[i : i + 1], np.empty((ROWS, 1)))
        recovered = coefficients.head[0] * before.elements[:, 0]
        for j in range(coefficients.terms.shape[1]):
            recovered -= coefficients.terms[0, j] * before.elements[:, 1 + j]
        pressures = indentations(state) - np.max(recovered, axis=0)
        assert np.min(pressures) > -1e-15 and np.min(indentations(state) - state.elements[0, 0]) > -1e-15
        touched.add(int(np.sum(pressures > 1e-12)))
    assert 0 < min(touched) < max(touched) < 257


def test_light_skin_that_rests_for_long_keeps_no_denormal_numbers() -> None:
    for law in LAWS:
        stepper = stepper_of(law, 65)
        state, _ = scanned(stepper, steady(0.08, 1e-3, 100), LOAD, 1e-3)
        still = np.full(3000, 0.31)
        stepper.run(state, turned(still), np.full(3000, 0.01), np.empty((ROWS, 3000)))
        state.coefficients = law.coefficients(5.0)
        stepper.run(state, turned(still), np.full(3000, 0.01), np.empty((ROWS, 3000)))
        kept = np.abs(state.elements[state.elements != 0.0])
        assert kept.size and kept.min() > 1e-300


def test_rows_not_asked_for_are_zero() -> None:
    _, out = scanned(stepper_of(VOIGT, 65), steady(0.08, 1e-4, 20), LOAD, 1e-4)
    assert np.all(out[SLOPE_FORCE] == 0.0) and np.all(out[REACTION] > 0.0)


def test_loads_below_the_lightest_count_as_it() -> None:
    stepper = stepper_of(VOIGT, 129)
    rows = [scanned(stepper, steady(0.08, 1e-4, 50), load, 1e-4)[1] for load in (0.0, LIGHTEST)]
    assert np.array_equal(rows[0], rows[1])


def test_the_law_of_stiffness_is_that_of_the_contact() -> None:
    law = stepper_of(VOIGT, 65).stiffness
    assert law.power == pytest.approx(-0.5, abs=1e-14)
    assert [law.at(w) for w in (0.01, 2.0)] == pytest.approx([contact().stiffness_at(w) for w in (0.01, 2.0)])


def test_a_dome_is_taken_off_the_profile() -> None:
    class Domed(type(contact())):  # type: ignore[misc]
        dome = 2.0

    plain = contact()
    domed = Domed(plain.geometry, plain.stiffness, Grid.of_geometry(plain.geometry))
    flat = SkinPoints.of_contact(plain, LOAD, 101).rows[0]
    taken = (flat - SkinPoints.of_contact(domed, LOAD, 101).rows[0]) * SCALE
    x = plain.geometry.contact_length * np.linspace(-0.5, 0.5, 101)
    assert taken == pytest.approx(x**2, abs=1e-15)
