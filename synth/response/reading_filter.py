"""The filters of readers: from z at every few frames to displacement, velocity or acceleration at every frame.

Stage   RESPONSE: reading its result. `reading_filter` is that of a table, `band_filter` that of live fingers that are
        solved.
Model   z is taken at every `stride`-th frame. Between two of these, at the part s = j / stride of the way, the output
        is hold z_k + sum over m of b_jm (z_(m+1) - z_m), over taps - 1 differences around k. The weights b are exact
        for polynomials of degree 3. Over the frequencies in the band they have the least relative error (least
        squares). Since only differences count, a finger at rest gives exactly zero, and every term of a changing load
        is included.
        Solutions contain the frequencies above the band, which a table leaves out. So `band_filter` has many more
        differences: from EDGE times the band on, its response is to be zero, and its weights fit both aims.
Source  Least-squares design of linear-phase filters (Parks and Burrus, Digital Filter Design, 1987); derived here.
Limits  The `error` of a filter of a table is 5e-4 for acceleration, 1e-4 for velocity and 3e-5 for displacement with 10
        samples of z per period of the band, which is a look-ahead of 0.33 ms at 48 kHz. Where the band is more than a
        tenth of the rate, filters are longer and err by up to a tenth at the end of the band.
        Of `band_filter`, for a band of at most an eighth of the rate: error below 1e-3. From EDGE times the band on,
        4e-3 of the derivative at the end of the band is left. The output is REACH periods of the band behind the
        motion, 2.25 ms at 1 kHz. A wider band has fewer solutions per period, and its edge ends at half of their rate.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.polynomial import Polynomial

from synth.arrays import Array
from synth.response.demand import Complex
from synth.response.mip_levels import WIDTH

ORDERS = {"displacement": 0, "approach": 0, "velocity": 1, "acceleration": 2}
SAMPLES_A_PERIOD = 10  # samples of z in the shortest period of the band; with 5 the filter would be twice as long
LONGEST_STRIDE = 8  # frames; also the number of parts of a step for which the usual filter has weights
USUAL_HIGHEST = 0.14  # cycles per step, end of the usual filter's band: WIDTH / SAMPLES_A_PERIOD
TAPS = 8  # samples of z per output
DECIMALS = 10  # of the weights, which are of order 1: rounding makes them equal on every machine
MOST_TAPS = 64  # largest number of taps, where the rate gives fewer samples per period
ENOUGH = 1e-3  # taps are added while the error is larger
EXACT_DEGREE = 3  # polynomials up to this degree are exact
GRID = 200  # frequencies at which the error is evaluated
SOLUTIONS = 8  # per period of the band; 12 mostly reduce the folded error to a third to a half (docs/live-motion.md)
EDGE = 2.0  # times the band: the frequency from which on nothing is left; a steeper edge requires a longer delay
REACH = 2.25  # delay of the output, in periods of the band; with 2.0 twice as much is left above the edge
KEPT_OUT = 0.3  # weight of what is left above the edge, relative to the error in the band
POINTS = 64  # least number of frequencies in each part; more cost time, and linear algebra on several cores


@dataclass(frozen=True, slots=True)
class ReadingFilter:
    """The filter of one quantity.

    stride: frames from one sample of z to the next.
    weights: of the differences of z, float64 [stride, taps - 1], in units of the quantity.
    hold: 1 where z itself is part of the output, else 0.
    error: largest relative error over the frequencies in the band.
    """

    stride: int
    weights: Array
    hold: float
    error: float

    @property
    def taps(self) -> int:
        """Samples of z per output."""
        return int(self.weights.shape[1]) + 1

    @property
    def delay(self) -> int:
        """Frames by which the output is behind the motion."""
        return self.stride * self.taps // 2


@cache
def usual_weights(order: int) -> tuple[tuple[float, ...], ...]:
    """Return the weights of derivative `order` at each eighth of a step [LONGEST_STRIDE, TAPS - 1], per step."""
    found = np.round(designed(order, LONGEST_STRIDE, TAPS, USUAL_HIGHEST), DECIMALS)
    return tuple(tuple(row) for row in found.tolist())


@cache
def reading_filter(quantity: str, rate: int, band: float) -> ReadingFilter:
    """Return the filter of `quantity` (one of ORDERS) at `rate` (Hz) for frequencies up to WIDTH times `band` (Hz).

    All quantities at one rate and band have filters of one length, so their channels are in phase.
    """
    order, taps = ORDERS[quantity], TAPS
    stride = 1 << math.floor(math.log2(min(max(rate / (SAMPLES_A_PERIOD * band), 1.0), LONGEST_STRIDE)))
    highest = min(WIDTH * band * stride / rate, 0.49)
    weights = np.array(usual_weights(order))[:: LONGEST_STRIDE // stride]
    if rate < SAMPLES_A_PERIOD * band:
        taps = _taps_for(stride, highest)
        weights = designed(order, stride, taps, highest)
    error = filter_error(weights, order, highest)
    return ReadingFilter(stride, weights * (rate / stride) ** order, float(order == 0), error)


@cache
def _taps_for(stride: int, highest: float) -> int:
    """Return the fewest taps with which every derivative errs by ENOUGH at most; MOST_TAPS where none suffice."""
    for taps in range(TAPS, MOST_TAPS, 2):
        errors = [filter_error(designed(order, stride, taps, highest), order, highest) for order in range(3)]
        if max(errors) <= ENOUGH:
            return taps
    return MOST_TAPS


def responses(taps: int, order: int, stride: int, highest: float, points: int = GRID) -> tuple[Complex, Complex]:
    """Return the frequency response of each difference [points, taps - 1], and the wanted ones [points, stride].

    Both are complex, at `points` frequencies up to `highest` (cycles per step), relative to the size of the derivative.
    """
    turned = 2j * np.pi * highest * (np.arange(points) + 0.5)[:, np.newaxis] / points
    scale = np.abs(turned) ** order
    basis = np.diff(np.exp(turned * steps_of(taps)), axis=1) / scale
    aims = (turned**order * np.exp(turned * (np.arange(stride) / stride)) - float(order == 0)) / scale
    return np.asarray(basis), np.asarray(aims)


def steps_of(taps: int) -> Array:
    """Return the places of the samples, in steps from the sample at or before the output."""
    return np.asarray(np.arange(taps) - (taps // 2 - 1.0))


def filter_error(weights: Array, order: int, highest: float) -> float:
    """Return the largest relative error of `weights` [stride, taps - 1] up to `highest` (cycles per step)."""
    basis, aims = responses(weights.shape[1] + 1, order, len(weights), highest)
    return float(np.max(np.abs(basis @ weights.T - aims)))


def designed(
    order: int, stride: int, taps: int, highest: float, points: int = GRID, beyond: float | None = None
) -> Array:
    """Return the weights of the differences for the derivative `order` at each part of a step [stride, taps - 1].

    highest: the error is least up to this frequency (cycles per step).
    points: number of frequencies up to it.
    beyond: frequency from which on nothing is to be left; None: it does not matter.
    """
    parts, degrees = np.arange(stride) / stride, np.arange(1, EXACT_DEGREE + 1)
    rises = np.diff(steps_of(taps) ** degrees[:, np.newaxis], axis=1)
    wanted = np.array([Polynomial.basis(degree).deriv(order)(parts) for degree in degrees])
    fits = [responses(taps, order, stride, highest, points)]
    if beyond is not None:  # no output, relative to the size of the derivative at the end of the band
        f = beyond + (0.5 - beyond) * (np.arange(points) + 0.5)[:, np.newaxis] / points
        scale = (2.0 * math.pi * highest) ** order / KEPT_OUT
        above = np.diff(np.exp(2j * np.pi * f * steps_of(taps)), axis=1) / scale
        fits.append((above, np.full((points, stride), -float(order == 0) / scale, dtype=np.complex128)))
    rows, right = (
        np.concatenate([part for one in both for part in (one.real, one.imag)]) for both in zip(*fits, strict=True)
    )
    start = np.linalg.lstsq(rises, wanted, rcond=None)[0]
    free = np.linalg.qr(rises.T, "complete")[0][:, len(degrees) :]  # changes that keep these polynomials exact
    q, r = np.linalg.qr(rows @ free)
    found = start + free @ np.linalg.solve(r, q.T @ (right - rows @ start))
    return np.ascontiguousarray(found.T)


@cache
def band_filter(quantity: str, rate: int, band: float, finer: float = 1.0) -> ReadingFilter:
    """Return the filter of `quantity` (one of `reading_filter.ORDERS`) at `rate` (Hz), for solutions at equal steps.

    band: Hz.
    finer: factor on the number of solutions per second, up to one per frame. The delay stays the same.
    All quantities at one rate and band have filters of one length, so their channels are in phase.
    """
    order, usual = ORDERS[quantity], max(1, math.floor(rate / (SOLUTIONS * band)))
    late = max(2, math.ceil(REACH * rate / (band * usual))) * usual  # frames
    stride = max(one for one in range(1, late + 1) if (late % one == 0 and one * finer <= usual) or one == 1)
    taps = 2 * late // stride
    gone = min(EDGE * band * stride / rate, 0.5)
    kept = min(band * stride / rate, gone / math.sqrt(EDGE))
    weights = np.round(designed(order, stride, taps, kept, max(POINTS, taps), gone), DECIMALS)
    error = filter_error(weights, order, kept)
    return ReadingFilter(stride, weights * (rate / stride) ** order, float(order == 0), error)
