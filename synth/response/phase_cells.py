"""Tables that are read at audio rate: piecewise polynomials over the phase, and over the load where it varies.

Model   A period is cut into equal cells, a power of two of them. In each cell the series is replaced by the polynomial
        that shares its value and derivatives at both ends: of first degree (value), of third (and slope), or of fifth
        (and curvature), for the quantities that need derivatives. Over the load it is the cubic through two rows and
        their slopes dz/dw.
Source  Hermite interpolation; the derivatives are exact, from the series.
Limits  cells are doubled until the polynomials keep the share of the tolerance that is theirs, measured at the
        quarters of every cell against the series.
"""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.kernels import unfused
from synth.response.spectrum import Complex, curves

Coefficients = np.ndarray[Any, np.dtype[np.float64]] | np.ndarray[Any, np.dtype[np.float32]]

LINEAR, CUBIC, QUINTIC = 1, 3, 5
MOST_CELLS = 1 << 18
FEWEST_CELLS = 16
TAIL_SHARE = 0.12  # of the tolerance: what the harmonics dropped from the end of a series may add up to


@dataclass(frozen=True, slots=True)
class Fitted:
    """A table and its error: coefficients float64 [cells, degree + 1], error of each order relative to its
    peak-to-peak.
    """

    coefficients: Array
    errors: tuple[float, ...]


def kept_harmonics(harmonics: Complex, orders: tuple[int, ...], tolerance: float) -> int:
    """Return how many harmonics the quantities need: the rest adds up to less than TAIL_SHARE of the tolerance."""
    n = np.arange(len(harmonics))
    needed = 1
    for order in orders:
        sizes = 2.0 * np.abs(harmonics) * (2.0 * np.pi * n) ** order
        sizes[0] = 0.0
        tails = np.cumsum(sizes[::-1])[::-1]
        # a peak-to-peak is at least twice the largest harmonic
        allowed = TAIL_SHARE * tolerance * max(2.0 * float(np.max(sizes)), 1e-300)
        needed = max(needed, int(np.count_nonzero(tails > allowed)) - 1 + int(sizes[0] > allowed))
    return min(max(needed, 1), len(harmonics) - 1)


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


class Room(threading.local):
    """Where a thread transforms, one series after another: memory that is new at each costs half of the time."""

    def __init__(self) -> None:
        self._spectra, self._sampled = np.empty(0, np.complex128), np.empty(0)

    def of(self, curves: int, points: int) -> tuple[Complex, Array]:
        """Return spectra [curves, points // 2 + 1], all zero, and values [curves, points], valid until asked again."""
        wide = points // 2 + 1
        if self._sampled.size < curves * points or self._spectra.size < curves * wide:
            self._spectra, self._sampled = np.empty(curves * wide, np.complex128), np.empty(curves * points)
        spectra = self._spectra[: curves * wide].reshape(curves, wide)
        spectra.fill(0.0)
        return spectra, self._sampled[: curves * points].reshape(curves, points)


_room = Room()


def derivatives(harmonics: Complex, count: int, points: int, room: tuple[Complex, Array] | None = None) -> Array:
    """Return series [..., harmonic] without their means and their first derivatives over theta, float64
    [..., count, points], in one transform.

    room: for the spectra, all zero, and for what is returned.
    """
    length, shape = harmonics.shape[-1], (*harmonics.shape[:-1], count)
    spectra, sampled = room or (np.zeros((math.prod(shape), points // 2 + 1), np.complex128), None)
    spectra = spectra.reshape(*shape, points // 2 + 1)
    rows, turns = spectra[..., 1:length], 2j * np.pi * np.arange(1, length)
    rows[..., 0, :] = harmonics[..., 1:] * points
    for order in range(1, count):
        rows[..., order, :] = rows[..., order - 1, :] * turns
    out = None if sampled is None else sampled.reshape(*shape, points)
    return np.asarray(np.fft.irfft(spectra, points, out=out))


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


def limited_slopes(low: Complex, high: Complex, slopes: Complex, width: float) -> Complex:
    """Return `slopes` (a unit of load), each harmonic held to what its two rows allow over an interval of `width`.

    Where a harmonic turns faster with the load than the rows can show, its slope would throw the cubic far beyond both
    rows; three times the larger of them is as far as a monotone cubic goes (Fritsch & Carlson, 1980).
    """
    bound = 3.0 * np.maximum(np.abs(low), np.abs(high)) / width
    size = np.abs(slopes)
    return np.asarray(slopes * np.minimum(1.0, bound / np.maximum(size, 1e-300)))


def load_cubic(
    low: Complex, low_slopes: Complex, high: Complex, high_slopes: Complex, width: float
) -> tuple[Complex, ...]:
    """Return the four series of the cubic in s = (w - w_low) / width through two rows and their slopes (m/N)."""
    rise = high - low
    first = width * limited_slopes(low, high, low_slopes, width)
    last = width * limited_slopes(low, high, high_slopes, width)
    return low, first, 3.0 * rise - 2.0 * first - last, first + last - 2.0 * rise


def surface(series: tuple[Complex, ...], degree: int, cells: int) -> Array:
    """Return coefficients [cells, degree + 1, 4]: powers of the place in a phase cell, then of the place between the
    rows.
    """
    table = np.empty((cells, degree + 1, len(series)))
    fill_surface(series, degree, table)
    return table


def fill_surface(series: tuple[Complex, ...], degree: int, table: Coefficients) -> None:
    """Write `surface` to `table`, float64 or rounded to float32: `polynomials` of CUBIC or QUINTIC of all the series,
    which are equally long, in one pass.
    """
    cells = len(table)
    stacked = np.stack(series)
    stride, count = stride_for(stacked.shape[-1], cells), 1 + degree // 2
    sampled = derivatives(stacked, count, stride * cells, _room.of(len(series) * count, stride * cells))
    (fill_cubics if degree == CUBIC else fill_quintics)(sampled, stride, table)


@unfused
def fill_cubics(sampled: Array, stride: int, table: Array) -> None:
    """Write the cubics of each series to `table` [cells, 4, series] from its values and slopes [series, 2, points]."""
    cells, turn = len(table), sampled.shape[2]
    width = 1.0 / cells
    for power in range(len(sampled)):
        next_value, next_slope = sampled[power, 0, 0], sampled[power, 1, 0] * width
        for cell in range(cells):
            value, slope = next_value, next_slope
            there = (cell + 1) * stride % turn
            next_value, next_slope = sampled[power, 0, there], sampled[power, 1, there] * width
            rise = next_value - value
            table[cell, 0, power] = value
            table[cell, 1, power] = slope
            table[cell, 2, power] = 3.0 * rise - 2.0 * slope - next_slope
            table[cell, 3, power] = slope + next_slope - 2.0 * rise


@unfused
def fill_quintics(sampled: Array, stride: int, table: Array) -> None:
    """Do the same for quintics, [cells, 6, series], from values, slopes and curvatures, [series, 3, points]."""
    cells, turn = len(table), sampled.shape[2]
    width, square = 1.0 / cells, 1.0 / cells**2
    for power in range(len(sampled)):
        next_value, next_slope = sampled[power, 0, 0], sampled[power, 1, 0] * width
        next_bend = sampled[power, 2, 0] * square
        for cell in range(cells):
            value, slope, bend = next_value, next_slope, next_bend
            there = (cell + 1) * stride % turn
            next_value, next_slope = sampled[power, 0, there], sampled[power, 1, there] * width
            next_bend = sampled[power, 2, there] * square
            rise = next_value - value
            table[cell, 0, power] = value
            table[cell, 1, power] = slope
            table[cell, 2, power] = 0.5 * bend
            table[cell, 3, power] = 10.0 * rise - 6.0 * slope - 4.0 * next_slope - 1.5 * bend + 0.5 * next_bend
            table[cell, 4, power] = -15.0 * rise + 8.0 * slope + 7.0 * next_slope + 1.5 * bend - next_bend
            table[cell, 5, power] = 6.0 * rise - 3.0 * (slope + next_slope) + 0.5 * (next_bend - bend)
