"""The filter of a direct reader: from solutions at equal steps to one band-limited quantity at every frame.

Stage   SAMPLING, for live fingers that are solved.
Model   As in `reading_filter`, an output is hold z_k + sum over m of b_jm (z_(m+1) - z_m). There are many more
        differences, because solutions contain the frequencies above the band, which a table leaves out. The weights b
        are exact for polynomials of degree 3. Their response is to be that of the derivative up to the band, and zero
        from EDGE times the band on; between the two it falls. The weights are the least-squares fit of both aims.
Source  Least-squares design of linear-phase filters (Parks and Burrus, Digital Filter Design, 1987).
Limits  For a band of at most an eighth of the rate: relative error in the band below 1e-3. From EDGE times the band on,
        4e-3 of the derivative at the end of the band is left. The output is REACH periods of the band behind the
        motion, 2.25 ms at 1 kHz. A wider band has fewer solutions per period, and its edge ends at half of their rate.
"""

from __future__ import annotations

import math
from functools import cache

import numpy as np
from numpy.polynomial import Polynomial

from synth.arrays import Array
from synth.response.demand import Complex
from synth.response.reading_filter import DECIMALS, EXACT_DEGREE, ORDERS, ReadingFilter, responses, steps_of

SOLUTIONS = 8  # per period of the band; 12 mostly reduce the folded error to a third to a half (docs/live-motion.md)
EDGE = 2.0  # times the band: the frequency from which on nothing is left; a steeper edge requires a longer delay
REACH = 2.25  # delay of the output, in periods of the band; with 2.0 twice as much is left above the edge
KEPT_OUT = 0.3  # weight of what is left above the edge, relative to the error in the band
POINTS = 64  # least number of frequencies in each part; more cost time, and linear algebra on several cores


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
    weights = _designed(order, stride, taps, (kept, gone))
    error = max(_error(row, order, j / stride, kept) for j, row in enumerate(weights))
    return ReadingFilter(stride, weights * (rate / stride) ** order, float(order == 0), error)


def _designed(order: int, stride: int, taps: int, edges: tuple[float, float]) -> Array:
    """Return the weights of the differences for the derivative `order` at each part of a step [stride, taps - 1].

    edges: end of the band, and frequency from which on nothing is left, cycles per step.
    """
    parts, degrees, points = np.arange(stride) / stride, np.arange(1, EXACT_DEGREE + 1), max(POINTS, taps)
    rises = np.diff(steps_of(taps) ** degrees[:, np.newaxis], axis=1)
    wanted = np.array([Polynomial.basis(degree).deriv(order)(parts) for degree in degrees])
    basis = responses(taps, order, 0.0, edges[0], points)[0]
    aims = np.stack([responses(taps, order, part, edges[0], points)[1] for part in parts], axis=1)
    above, none = left_above(taps, order, edges, points)
    nones = np.repeat(none[:, np.newaxis], stride, axis=1)
    rows = np.concatenate([basis.real, basis.imag, KEPT_OUT * above.real, KEPT_OUT * above.imag])
    right = np.concatenate([aims.real, aims.imag, KEPT_OUT * nones.real, KEPT_OUT * nones.imag])
    start = np.linalg.lstsq(rises, wanted, rcond=None)[0]
    free = np.linalg.qr(rises.T, "complete")[0][:, len(degrees) :]  # changes that keep these polynomials exact
    q, r = np.linalg.qr(rows @ free)
    found = start + free @ np.linalg.solve(r, q.T @ (right - rows @ start))
    return np.ascontiguousarray(np.round(found, DECIMALS).T)


def left_above(taps: int, order: int, edges: tuple[float, float], points: int) -> tuple[Complex, Complex]:
    """Return the responses of the differences above the edge [points, taps - 1], and their aim [points]: no output.

    Both are relative to the size of the derivative at the end of the band.
    """
    f = edges[1] + (0.5 - edges[1]) * (np.arange(points) + 0.5) / points
    turned, scale = 2j * np.pi * f, (2.0 * math.pi * edges[0]) ** order
    basis = np.diff(np.exp(turned[:, np.newaxis] * steps_of(taps)), axis=1) / scale
    return np.asarray(basis), np.full(points, -float(order == 0) / scale, dtype=np.complex128)


def _error(row: Array, order: int, part: float, kept: float) -> float:
    """Return the largest relative error of the weights of one part of a step, up to `kept` (cycles per step)."""
    basis, aim = responses(len(row) + 1, order, part, kept)
    return float(np.max(np.abs(basis @ row - aim)))
