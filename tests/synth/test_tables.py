"""The polynomial tables against the series that they stand for."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from synth.response.phase_cells import (
    CUBIC,
    QUINTIC,
    TAIL_SHARE,
    fill_surface,
    fitted_table,
    kept_harmonics,
    limited_slopes,
    load_cubic,
    polynomials,
    surface,
)
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


@pytest.mark.parametrize("orders", [(0,), (1,), (2,), (0, 1, 2)])
@pytest.mark.parametrize("tolerance", [1e-1, 1e-2, 1e-3])
def test_the_harmonics_dropped_are_within_their_share(orders: tuple[int, ...], tolerance: float) -> None:
    series = random_series(300, 4)
    kept = kept_harmonics(series, orders, tolerance)
    theta = np.arange(4096) / 4096
    rest = series.copy()
    rest[: kept + 1] = 0.0
    for order in orders:
        error = float(np.max(np.abs(signal(rest, theta, order))))
        assert error <= TAIL_SHARE * tolerance * float(np.ptp(signal(series, theta, order)))
    if orders == (0,):
        assert kept < 300
    assert 1 <= kept <= 300


def test_nothing_is_dropped_from_a_series_that_does_not_fall() -> None:
    assert kept_harmonics(random_series(50, 5, fall=0.0), (0,), 1e-3) == 50


def test_one_harmonic_is_kept_of_a_sinusoid_and_of_nothing() -> None:
    assert kept_harmonics(np.array([3.0, 1e-6j, 0.0, 0.0, 0.0]), (0, 1, 2), 1e-3) == 1
    assert kept_harmonics(np.zeros(5, dtype=complex), (0, 2), 1e-3) == 1


def test_the_cubic_over_the_load_passes_through_both_rows_with_their_slopes() -> None:
    low, high = random_series(6, 6), random_series(6, 7)
    low_slopes, high_slopes = 2.0 * random_series(6, 8), 2.0 * random_series(6, 9)
    width = 0.05
    a, b, c, d = load_cubic(low, low_slopes, high, high_slopes, width)
    assert np.allclose(a, low, rtol=0, atol=1e-15)
    assert np.allclose(a + b + c + d, high, rtol=0, atol=1e-14)
    assert np.allclose(b / width, limited_slopes(low, high, low_slopes, width), rtol=1e-13)
    assert np.allclose((b + 2 * c + 3 * d) / width, limited_slopes(low, high, high_slopes, width), rtol=1e-10)


def test_slopes_are_held_only_where_they_would_throw_the_cubic_beyond_its_rows() -> None:
    low, high = np.array([1.0, 1e-3j]), np.array([1.1, 2e-3])
    gentle, wild = np.array([1.0, 0.1j]), np.array([1.0, 5.0j])
    assert np.array_equal(limited_slopes(low, high, gentle, 0.05), gentle)
    held = limited_slopes(low, high, wild, 0.05)
    assert held[0] == wild[0]
    assert held[1] == pytest.approx(3 * 2e-3 / 0.05 * 1j)


def test_a_surface_is_the_table_of_the_series_at_every_load() -> None:
    series = tuple(random_series(6, seed) for seed in (10, 11, 12, 13))
    table = surface(series, QUINTIC, 32)
    assert table.shape == (32, 6, 4)
    for s in (0.0, 0.3, 1.0):
        at_load = table @ np.array([1.0, s, s**2, s**3])
        wanted = polynomials(series[0] + s * series[1] + s**2 * series[2] + s**3 * series[3], QUINTIC, 32)
        assert np.max(np.abs(at_load - wanted)) <= 1e-12 * float(np.max(np.abs(wanted)))


@pytest.mark.parametrize("degree", [CUBIC, QUINTIC])
@pytest.mark.parametrize(("highest", "cells"), [(1, 16), (9, 16), (38, 256), (101, 64), (380, 2048)])
def test_the_compiled_surface_is_its_readable_twin_bit_for_bit(degree: int, highest: int, cells: int) -> None:
    series = tuple(random_series(highest, seed) for seed in (20, 21, 22, 23))
    twin = np.stack([polynomials(one, degree, cells) for one in series], axis=2)
    assert np.array_equal(surface(series, degree, cells), twin)
    single = np.full((cells, degree + 1, 4), np.nan, np.float32)
    fill_surface(series, degree, single)
    assert np.array_equal(single, twin.astype(np.float32))
