"""The series of z: its stated error against far more phases, closed forms and differences."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from synth.contact.load_balance import Contact
from synth.response.spectrum import Demand, curves, harmonics_of, points_for, solve_spectrum
from tests.reference.synthesis_oracle import synthesise
from tests.synth.engine_cases import Real, contact_of, random_document, scene_of, touch_of

ORDERS = (0, 1, 2)
FLOOR = 1e-12  # of a1 + a2: the round-off that the contract allows in displacement


def brute(contact: Contact, load: float, highest: int, phases: int = 1 << 15) -> Any:
    """Return harmonics 0 to `highest` from far more phases than any series of these tests takes."""
    height, _slope = contact.approach(np.arange(phases) / phases, load)
    return np.fft.rfft(height)[: highest + 1] / phases


def distance(series: Any, truth: Any, order: int) -> tuple[float, float]:
    """Return the largest difference of two series' derivatives and the peak-to-peak of the second."""
    points = points_for(len(truth) - 1)
    difference = curves(series[: len(truth)] - truth, order, points)
    return float(np.max(np.abs(difference))), float(np.ptp(curves(truth, order, points)))


def random_contact(random: np.random.Generator) -> tuple[Contact, float]:
    scene = scene_of(**random_document(random, 48000))
    return contact_of(scene), scene.scan.load


@pytest.mark.parametrize("seed", range(20))
def test_the_stated_error_is_not_exceeded(seed: int) -> None:
    random = np.random.default_rng(seed)
    contact, load = random_contact(random)
    highest, tolerance = int(random.integers(3, 200)), float(10 ** random.uniform(-4, -2))
    series = solve_spectrum(contact, load, Demand(highest, ORDERS, tolerance))
    truth = brute(contact, load, highest)
    floor = FLOOR * contact.geometry.height_scale
    for order in ORDERS:
        error, extent = distance(series.harmonics, truth, order)
        allowed = floor * (2 * math.pi * highest) ** order
        assert error <= series.errors[order] * extent + allowed
        assert series.closed or series.errors[order] * extent <= tolerance * extent + allowed


@pytest.mark.parametrize("period_ratio", [64.0, 100.0, 128.0])
@pytest.mark.parametrize("load", [0.03, 0.4])
def test_a_locked_texture_many_ridges_long_does_not_converge_falsely(period_ratio: float, load: float) -> None:
    ridge = 0.2e-3
    scene = scene_of(
        finger={"ridge_period": ridge, "contact_length": 2 * period_ratio * ridge},
        texture={"period": period_ratio * ridge, "amplitude": 100e-6},
    )
    contact = contact_of(scene)
    highest = int(1.5 * period_ratio)
    series = solve_spectrum(contact, load, Demand(highest, ORDERS, 1e-3))
    truth = brute(contact, load, highest)
    for order in ORDERS:
        error, extent = distance(series.harmonics, truth, order)
        assert error <= 1e-3 * extent
    line = int(period_ratio)
    assert abs(truth[line]) > 30 * abs(truth[line - 2])  # the line is there, and what it is worth:
    assert abs(series.harmonics[line] - truth[line]) <= 1e-2 * abs(truth[line])


@pytest.mark.parametrize("seed", [1, 4])
def test_the_series_is_that_of_the_oracle(seed: int) -> None:
    scene = scene_of(**random_document(np.random.default_rng(seed), 8000))
    wanted = synthesise(touch_of(scene), scene.scan.speed, 3200.0, relative_error=1e-6)
    highest = wanted.harmonics.size
    series = solve_spectrum(contact_of(scene), scene.scan.load, Demand(highest, ORDERS, 1e-5))
    truth = np.concatenate([[wanted.mean], wanted.harmonics])
    for order in ORDERS:
        error, extent = distance(series.harmonics, truth, order)
        assert error <= 1.2e-5 * extent


@pytest.mark.parametrize("seed", range(4))
def test_the_closed_form_is_what_the_solver_finds_just_above_full_contact(seed: int) -> None:
    scene = scene_of(**random_document(np.random.default_rng(seed), 48000))
    contact = contact_of(scene)
    low, high = 0.01, 100.0
    demand = Demand(8, ORDERS, 1e-4)
    for _ in range(60):
        middle = math.sqrt(low * high)
        low, high = (low, middle) if solve_spectrum(contact, middle, demand).closed else (middle, high)
    load = high * 1.000001
    series = solve_spectrum(contact, load, demand)
    assert series.closed
    truth = brute(contact, load, 8, 1 << 10)
    assert np.max(np.abs(series.harmonics - truth)) <= FLOOR * contact.geometry.height_scale
    closed, (_height, slope) = contact.closed(load), contact.approach(np.arange(64) / 64, load)
    assert closed is not None and closed.slope == pytest.approx(float(slope.mean()), rel=1e-10)


@pytest.mark.parametrize("load", [0.02, 0.3, 1.2, 40.0])
def test_slopes_are_the_differences_over_the_load(load: float) -> None:
    contact = contact_of(scene_of())
    step = 1e-4 * load
    slopes = harmonics_of(contact.approach(np.arange(1 << 13) / (1 << 13), load)[1], 6)
    difference = (brute(contact, load + step, 6) - brute(contact, load - step, 6)) / (2 * step)
    scale = np.max(np.abs(difference))
    assert np.max(np.abs(slopes - difference)) <= 1e-4 * scale
    assert np.max(np.abs(difference[1:])) > 1e-4 * scale or contact.closed(load) is not None


def test_harmonics_beyond_the_demand_are_kept_when_asked_for() -> None:
    contact = contact_of(scene_of())
    series = solve_spectrum(contact, 0.3, Demand(20, (0,), 1e-4), keep=60)
    assert series.harmonics.shape == (61,)
    assert np.max(np.abs(series.harmonics - brute(contact, 0.3, 60))) <= 1e-4 * abs(series.harmonics[1])


def test_a_tighter_tolerance_takes_more_phases() -> None:
    contact = contact_of(scene_of())
    phases = [solve_spectrum(contact, 0.3, Demand(100, ORDERS, 10.0**-digits)).phases for digits in (2, 3, 4, 5)]
    assert phases == sorted(phases)
    assert phases[0] < phases[-1]


@pytest.mark.parametrize("order", ORDERS)
def test_curves_are_the_derivatives_of_the_sum(order: int) -> None:
    random = np.random.default_rng(3)
    series = random.normal(size=6) + 1j * random.normal(size=6)
    theta: Real = np.arange(64) / 64
    n = np.arange(1, 6)
    wanted = 2 * (np.exp(2j * np.pi * np.outer(theta, n)) @ (series[1:] * (2j * np.pi * n) ** order)).real
    assert curves(series, order, 64) == pytest.approx(wanted, rel=1e-12, abs=1e-9)
