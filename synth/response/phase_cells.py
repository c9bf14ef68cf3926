"""A series over a period as piecewise polynomials over the phase, which are read at audio rate.

Model   A period is cut into equal cells, a power of two of them. In each cell the series is replaced by the polynomial
        that shares its value and derivatives at both ends: of first degree (value), of third (and slope), or of fifth
        (and curvature), for curves whose derivatives matter.
Source  Hermite interpolation; the derivatives are exact, from the series.
Limits  cells are doubled until the polynomials keep the share of the tolerance that is theirs, measured at the
        quarters of every cell against the series.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from synth.arrays import Array
from synth.response.spectrum import Complex, curves

LINEAR, CUBIC, QUINTIC = 1, 3, 5
MOST_CELLS = 1 << 18
FEWEST_CELLS = 16


@dataclass(frozen=True, slots=True)
class Fitted:
    """A table and its error: coefficients float64 [cells, degree + 1], error of each order relative to its
    peak-to-peak.
    """

    coefficients: Array
    errors: tuple[float, ...]


def kept_within(series: Complex, allowed: float) -> int:
    """Return how many harmonics of `series`, at least one, are to be kept so that the rest adds up to `allowed`."""
    sizes = 2.0 * np.abs(series[1:])
    tails = np.append(np.cumsum(sizes[::-1])[::-1], 0.0)
    return max(1, int(np.argmax(tails <= allowed)))


def dropped_tail(series: Complex, kept: int) -> float:
    """Return the largest value that the harmonics of `series` above `kept` can add up to."""
    return 2.0 * float(np.sum(np.abs(series[kept + 1 :])))


def polynomials(harmonics: Complex, degree: int, cells: int) -> Array:
    """Return the coefficients [cells, degree + 1] of the series without its mean, in powers of the place t in a
    cell.
    """
    stride = stride_for(len(harmonics), cells)
    sampled = derivatives(harmonics, 1 + degree // 2, stride * cells)[:, ::stride]
    value = sampled[0]
    table = np.empty((cells, degree + 1))
    rise = following(value) - value
    if degree == LINEAR:
        table[:, 0], table[:, 1] = value, rise
        return table
    slope = sampled[1] / cells
    next_slope = following(slope)
    table[:, 0], table[:, 1] = value, slope
    if degree == CUBIC:
        table[:, 2] = 3.0 * rise - 2.0 * slope - next_slope
        table[:, 3] = slope + next_slope - 2.0 * rise
        return table
    bend = sampled[2] / cells**2
    next_bend = following(bend)
    table[:, 2] = 0.5 * bend
    table[:, 3] = 10.0 * rise - 6.0 * slope - 4.0 * next_slope - 1.5 * bend + 0.5 * next_bend
    table[:, 4] = -15.0 * rise + 8.0 * slope + 7.0 * next_slope + 1.5 * bend - next_bend
    table[:, 5] = 6.0 * rise - 3.0 * (slope + next_slope) + 0.5 * (next_bend - bend)
    return table


def stride_for(harmonics: int, cells: int) -> int:
    """Return how many points a cell takes for a transform that holds so many harmonics, the mean included."""
    return max(1, (2 << (harmonics - 1).bit_length()) // cells)


def derivatives(harmonics: Complex, count: int, points: int) -> Array:
    """Return the series without its mean and its first derivatives over theta, float64 [count, points]."""
    spectra = np.zeros((count, points // 2 + 1), np.complex128)
    turns = 2j * np.pi * np.arange(1, len(harmonics))
    for order in range(count):
        spectra[order, 1 : len(harmonics)] = harmonics[1:] * turns**order
    return np.asarray(np.fft.irfft(spectra, points) * points)


def following(values: Array) -> Array:
    """Return at each place of a period the value at the next."""
    return np.concatenate([values[1:], values[:1]])


def fitted_table(harmonics: Complex, degree: int, orders: tuple[int, ...], tolerance: float) -> Fitted:
    """Return the smallest table of the series whose derivatives of `orders` keep `tolerance` of their peak-to-peak."""
    highest = len(harmonics) - 1
    cells = max(FEWEST_CELLS, (1 << highest.bit_length()) // 2)
    while True:
        table = polynomials(harmonics, degree, cells)
        errors = _errors(table, harmonics, orders)
        if max(errors) <= tolerance or 2 * cells > MOST_CELLS:
            return Fitted(table, errors)
        cells *= 2


def _errors(table: Array, harmonics: Complex, orders: tuple[int, ...]) -> tuple[float, ...]:
    cells, width = table.shape
    places = np.arange(4) / 4.0
    errors = []
    for order in orders:
        powers = np.zeros((width, 4))
        for power in range(order, width):
            factor = float(np.prod(np.arange(power - order + 1, power + 1)))
            powers[power] = factor * places ** (power - order)
        read = (table @ powers).ravel() * float(cells) ** order
        finer = max(1, (2 << (len(harmonics) - 1).bit_length()) // (4 * cells))
        truth = curves(harmonics, order, 4 * cells * finer)[::finer]
        extent = float(np.ptp(truth))
        errors.append(float(np.max(np.abs(read - truth))) / extent if extent > 0.0 else 0.0)
    return tuple(errors)
