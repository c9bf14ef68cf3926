"""An element of skin: each step is the closed form of what it holds, at any length of step."""

from __future__ import annotations

import numpy as np
import pytest

from synth.effects.simulation.steps import Stiffness
from synth.effects.simulation.terms import DECAY, FOLLOW, HARDNESS, KEEP, LOSE, Skin, when_pressed
from tests.synth.effects.simulation.skin_cases import RELAXING


def pressed(skin: Skin, step: float, pressures: list[float], start: float = 0.0) -> float:
    """Return the indentation after pressures (of kappa), each held for a step."""
    head, indentation = skin.coefficients(step).head, start
    for pressure in pressures:
        indentation = pressure / head[HARDNESS] + head[KEEP] * indentation
    return indentation


def pressures_of(skin: Skin, step: float, indentations: list[float]) -> list[float]:
    """Return the pressures (of kappa) of an element that goes evenly from one indentation to the next."""
    coefficients, before, springs = skin.coefficients(step), 0.0, np.zeros(skin.memories)
    found = []
    for indentation in indentations:
        free = coefficients.head[KEEP] * before - coefficients.terms[LOSE] @ springs
        found.append(float(coefficients.head[HARDNESS] * (indentation - free)))
        springs = coefficients.terms[DECAY] * springs + coefficients.terms[FOLLOW] * (indentation - before)
        before = indentation
    return found


def relaxing(skin: Skin, rate: float, ramp: float, time: float) -> float:
    """Return the pressure (of kappa) `time` after a ramp of indentation at `rate` that began `ramp` + `time` ago."""
    weights, times = np.array(skin.weights), np.array(skin.times)
    springs = weights * times * rate * -np.expm1(-ramp / times) * np.exp(-time / times)
    return float((skin.relaxed_part * rate * ramp + springs.sum()) / skin.relaxed_part)


@pytest.mark.parametrize("steps", [1e-6, 0.01, 1.0, 30.0, 1e3])
def test_an_element_under_constant_pressure_creeps_as_an_exponential(steps: float) -> None:
    skin = Skin((0.004,))
    found = pressed(skin, steps * 0.004, [2.0, 2.0, 2.0], start=0.5)
    assert found == pytest.approx(2.0 + (0.5 - 2.0) * np.exp(-3.0 * steps), rel=1e-12)


def test_an_element_without_pressure_recovers_as_an_exponential() -> None:
    assert pressed(Skin((0.004,)), 0.001, [0.0] * 40, start=1.0) == pytest.approx(np.exp(-10.0), rel=1e-13)


def test_without_a_dashpot_an_element_is_elastic() -> None:
    coefficients = Skin((0.0,)).coefficients(1e-3)
    assert coefficients.head.tolist() == [0.0, 1.0] and coefficients.when == 1.0


@pytest.mark.parametrize("parts", [1, 7, 50])
def test_a_ramp_that_is_then_held_relaxes_as_the_springs_do_however_it_is_cut(parts: int) -> None:
    rate, ramp, rest = 3.0, 0.02, 0.1
    climb = [rate * ramp * (i + 1) / parts for i in range(parts)]
    found = pressures_of(RELAXING, ramp / parts, climb)
    assert found[-1] == pytest.approx(relaxing(RELAXING, rate, ramp, 0.0), rel=1e-12)
    count = round(rest / ramp * parts)
    held = pressures_of(RELAXING, ramp / parts, climb + [rate * ramp] * count)
    assert held[-1] == pytest.approx(relaxing(RELAXING, rate, ramp, rest), rel=1e-12)


def test_a_quick_indentation_meets_the_instantaneous_modulus_and_a_slow_one_the_relaxed() -> None:
    assert pressures_of(RELAXING, 1e-9, [1.0])[0] == pytest.approx(1.0 / RELAXING.relaxed_part, rel=1e-6)
    assert pressures_of(RELAXING, 1e6, [1.0])[0] == pytest.approx(1.0, rel=1e-5)


def test_an_element_that_is_left_alone_meets_no_pressure() -> None:
    step, coefficients = 0.002, RELAXING.coefficients(0.002)
    springs, before = np.array([0.3, 0.7, 0.9]), 1.0
    for _ in range(5):
        free = float(coefficients.head[KEEP] * before - coefficients.terms[LOSE] @ springs)
        springs = coefficients.terms[DECAY] * springs + coefficients.terms[FOLLOW] * (free - before)
        before = free
        pressure = RELAXING.relaxed_part * free + np.array(RELAXING.weights) @ springs
        assert abs(pressure) < 1e-15 and 0.0 < free < 1.0
    assert step == coefficients.step


@pytest.mark.parametrize("steps", [1e-9, 1e-6, 1e-3, 1.0, 1e3, 1e9])
def test_coefficients_are_numbers_at_any_length_of_step(steps: float) -> None:
    for coefficients in (Skin((1.0,)).coefficients(steps), RELAXING.coefficients(steps)):
        assert np.all(np.isfinite(coefficients.head)) and np.all(np.isfinite(coefficients.terms))
        assert 0.0 <= coefficients.head[KEEP] < 1.0 <= coefficients.head[HARDNESS] * (1.0 + 1e-12)
        assert 0.5 <= coefficients.when <= 1.0


@pytest.mark.parametrize("steps", [0.03, 0.1, 2.0, 40.0])
def test_an_even_indentation_has_the_pressure_of_the_step_when_it_is_said_to(steps: float) -> None:
    skin, step = Skin((1.0,)), steps
    head, start, speed = skin.coefficients(step).head, 0.7, 0.3
    pressure = head[HARDNESS] * (start + speed * step - head[KEEP] * start)
    assert pressure == pytest.approx(start + speed * step * when_pressed(steps) + speed, rel=1e-12)


def test_the_series_for_short_steps_meets_the_formula() -> None:
    assert when_pressed(0.03 * (1 - 1e-12)) == pytest.approx(when_pressed(0.03), abs=1e-12)


def test_loads_below_the_lightest_count_as_the_lightest() -> None:
    law = Stiffness(100.0, -0.5, 1e-4)
    assert law.at(0.25) == 200.0 and law.at(0.0) == law.at(1e-4) == pytest.approx(1e4)
