"""Error bounds of a series of equal steps, by the changes of its last two doublings and by the folding in them.

Stage   RESPONSE, used by `spectrum`.
Source  Kinks of order 3/2 make harmonic n fall as n^-2.5. An event that all phases miss has a bound of its own.
Limits  Those of `spectrum`.
"""

from __future__ import annotations

import math

import numpy as np

from synth.arrays import Array
from synth.response.demand import Complex, Demand, curves, harmonics_of, points_for

FLOOR = 1e-12  # round-off of the solver, relative to the scale of a response (of z: a1 + a2; design, section 4)
# Weights in the bound: of the last change, of the change before it, and of folding in each. With 1, 0.2, 2 and 0.5 one
# bound in 2000 is exceeded; with the changes only, one in 60. From MANY harmonics on, with SEEN_WELL phases or more
# each, chance cancellation is rare: of 2787 such bounds the largest error was 0.92 of the bound.
SURE, SURE_OF_MANY = (1.0, 0.3, 3.0, 1.0), (0.55, 0.11, 0.55, 0.16)
MANY, SEEN_WELL = 128, 4  # harmonics, and phases of each
MISSING = 3.0  # safety factor on the harmonics above those that the phases resolve
UNSEEN = 0.25  # change of a harmonic by an event between M phases, times M^4, relative to the scale: see `_unseen`
FOLDED_SHARE = 8  # folding is measured in at least the lowest 1/8 of the harmonics that the grid resolves


def _missing(height: Array, highest: int, order: int) -> float:
    """Return an estimate of the part of derivative `order` in harmonics above those that the phases resolve.

    They are assumed to fall as those of a kink, from the largest of the last known harmonics, with random phases.
    """
    seen = len(height) // 2
    if highest < seen:
        return 0.0
    last = float(np.max(np.abs(harmonics_of(height, seen - 1)[3 * seen // 4 :])))
    n = np.arange(seen, highest + 1)
    sizes = last * (n / seen) ** -2.5 * (2.0 * math.pi * n) ** order
    return 2.0 * math.sqrt(float(np.sum(sizes**2)))


def _unseen(height: Array, highest: int, order: int, scale: float) -> float:
    """Return the most that an event between two phases adds to derivative `order` of harmonics 1 to `highest`.

    Just below full contact two valleys part for a short time while they pass each other. If this time is a part 1/M of
    a period, the gap between them is about M^-2 deep and M^-1 wide, z moves by M^-3 of the scale, and each harmonic up
    to M changes by M^-4.
    """
    n = 2.0 * math.pi * np.arange(1, min(highest, len(height)) + 1)
    return 2.0 * UNSEEN * scale * float(np.sum(n**order)) / float(len(height)) ** 4


def error_floor(scale: float, highest: int, order: int) -> float:
    """Return the round-off error in a derivative over theta: FLOOR of `scale` (for z: a1 + a2) in the response."""
    return FLOOR * scale * (2.0 * math.pi * highest) ** order


def series_errors(height: Array, demand: Demand, scale: float) -> tuple[tuple[float, ...], bool]:
    """Return the error bound of each order relative to its peak-to-peak, and whether all are within the tolerance.

    The error is the folding of harmonics around the number of phases and its multiples. The last two doublings removed
    the folding of harmonics around half and a quarter of that number. The bound uses the largest change of the curve.
    A few harmonics may change little by chance. The bound therefore also uses the change that harmonics of random phase
    would cause if they folded as strongly as their neighbours.
    """
    series = tuple(harmonics_of(height[::step], demand.total) for step in (1, 2, 4))
    now, points = series[0][: demand.highest + 1], points_for(demand.highest)
    errors, good = [], True
    for order in demand.orders:
        error = max(
            speed**order * _error(height, tuple(one[: count + 1] for one in series), order, scale)
            for count, speed in demand.bands
        )
        extent = float(np.ptp(curves(now, order, points)))
        good = good and error <= demand.tolerance * extent + error_floor(scale, demand.highest, order)
        errors.append(error / extent if extent > 0.0 else 0.0)
    return tuple(errors), good


def _error(height: Array, series: tuple[Complex, ...], order: int, scale: float) -> float:
    """Return the error bound of derivative `order` over theta; series: of all phases, every second and every fourth."""
    now, before, earlier = series
    highest = len(now) - 1
    points, n = points_for(highest), 2.0 * math.pi * np.arange(1, highest + 1)
    many = highest >= MANY and len(height) > SEEN_WELL * highest
    last = float(np.max(np.abs(curves(now - before, order, points))))
    previous = float(np.max(np.abs(curves(before - earlier, order, points))))
    together = 2.0 * math.sqrt(float(np.sum(n ** (2 * order))))
    folded = _folded(height, highest), _folded(height[::2], highest)
    parts = (last, previous, together * folded[0], together * folded[1])
    error = max(weight * part for weight, part in zip(SURE_OF_MANY if many else SURE, parts, strict=True))
    error = max(error, MISSING * _missing(height, highest, order))
    return error + _unseen(height, highest, order, scale)


def _folded(height: Array, highest: int) -> float:
    """Return the rms change (m) of a harmonic in the last doubling, which removed the part that had folded into it."""
    half = len(height) // 2
    most = min(max(min(highest, half // 2), half // FOLDED_SHARE, 4), half // 2 - 1)
    took = harmonics_of(height, most)[1:] - harmonics_of(height[::2], most)[1:]
    return float(np.sqrt(np.mean(np.abs(took) ** 2)))
