"""The polynomial tables against the series that they stand for."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from synth.response.phase_cells import CUBIC, QUINTIC, fitted_table, polynomials
from synth.response.series_curve import SeriesCurve
from tests.synth.engine_cases import Real


def random_series(highest: int, seed: int, fall: float = 2.5) -> Any:
    """Return harmonics 0 to `highest` that fall as those of a contact do."""
    random = np.random.default_rng(seed)
    n = np.maximum(np.arange(highest + 1), 1)
    return (random.normal(size=highest + 1) + 1j * random.normal(size=highest + 1)) / n**fall


def signal(series: Any, theta: Real, order: int = 0) -> Real:
    """Return the `order`-th derivative over theta of the series without its mean, summed directly."""
    n = np.arange(1, len(series))
    return np.asarray(2 * (np.exp(2j * np.pi * np.outer(theta, n)) @ (series[1:] * (2j * np.pi * n) ** order)).real)


def read(table: Real, theta: Real, order: int = 0) -> Real:
    """Return the `order`-th derivative over theta of the table at `theta`."""
    cells = len(table)
    place = (theta % 1.0) * cells
    cell = np.floor(place).astype(int) % cells
    values = [np.polynomial.Polynomial(row).deriv(order) if order else np.polynomial.Polynomial(row) for row in table]
    return np.array([values[j](t) for j, t in zip(cell, place - np.floor(place), strict=True)]) * float(cells) ** order


@pytest.mark.parametrize("degree", [CUBIC, QUINTIC])
def test_a_table_shares_values_and_derivatives_at_the_ends_of_its_cells(degree: int) -> None:
    series = random_series(9, 1)
    table = polynomials(series, degree, 64)
    theta = np.arange(64) / 64
    for order in range((degree + 1) // 2):
        wanted = signal(series, theta, order)
        at_start = read(table, theta, order)
        ends = [np.polynomial.Polynomial(row).deriv(order)(1.0) * 64.0**order for row in table]
        scale = float(np.max(np.abs(wanted)))
        assert np.max(np.abs(at_start - wanted)) <= 1e-12 * scale
        assert np.max(np.abs(np.roll(ends, 1) - wanted)) <= 1e-11 * scale


@pytest.mark.parametrize(
    ("degree", "order", "power"), [(CUBIC, 0, 4), (QUINTIC, 0, 6), (QUINTIC, 1, 5), (QUINTIC, 2, 4)]
)
def test_the_error_falls_with_the_order_of_the_polynomials(degree: int, order: int, power: int) -> None:
    series = random_series(5, 2)
    theta = np.random.default_rng(0).uniform(0, 1, 3000)
    wanted = signal(series, theta, order)
    errors = [np.max(np.abs(read(polynomials(series, degree, cells), theta, order) - wanted)) for cells in (64, 128)]
    assert errors[0] / errors[1] == pytest.approx(2.0**power, rel=0.15)


@pytest.mark.parametrize("tolerance", [1e-2, 1e-4, 1e-6])
@pytest.mark.parametrize(("degree", "orders"), [(CUBIC, (0,)), (QUINTIC, (1, 2)), (QUINTIC, (0, 1, 2))])
def test_a_fitted_table_keeps_its_tolerance_everywhere(tolerance: float, degree: int, orders: tuple[int, ...]) -> None:
    series = random_series(37, 3)
    fitted = fitted_table(series, degree, orders, tolerance)
    theta = np.random.default_rng(1).uniform(0, 1, 3000)
    dense = np.arange(4096) / 4096
    for order, stated in zip(orders, fitted.errors, strict=True):
        error = np.max(np.abs(read(fitted.coefficients, theta, order) - signal(series, theta, order)))
        extent = float(np.ptp(signal(series, dense, order)))
        assert stated <= tolerance
        assert error <= 1.25 * stated * extent  # the quarters of a cell miss the very largest error by less


def test_a_looser_tolerance_takes_a_smaller_table() -> None:
    series = random_series(37, 3)
    sizes = [len(fitted_table(series, QUINTIC, (2,), tolerance).coefficients) for tolerance in (1e-1, 1e-3, 1e-6)]
    assert sizes[0] < sizes[1] < sizes[2]
    assert all(size & (size - 1) == 0 for size in sizes)


def test_a_series_is_read_as_a_curve_with_its_mean_at_any_place() -> None:
    series = random_series(40, 5)
    theta = np.random.default_rng(6).uniform(-3.0, 3.0, 500)
    wanted = series[0].real + signal(series, theta)
    apart = SeriesCurve(series).heights(theta, np.ones(500)) - wanted
    assert np.max(np.abs(apart)) <= 1e-7 * np.ptp(wanted)
