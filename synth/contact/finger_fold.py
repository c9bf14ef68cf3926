"""The columns of a finger, added over the periods of a texture that it spans.

Model   B(q, l) = sum over n of A(q + n period, l), with A the area of a column above a level (`finger_columns`).
        Between columns A is cubic, and B is linear. So below the usual distances B has DENSER columns for each of A.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.contact.finger_columns import FingerColumns
from synth.kernels import inlined, signed_kernel

Floats = np.ndarray[Any, np.dtype[np.float32]]
DENSER = 2  # the error of a line is of order 2, that of a cubic of order 3
FEWEST_COLUMNS = 64  # of B, over a period, at the usual distances: halving must bring these closer, too
TOGETHER = 16  # columns of B that are written at once, so that neighbours in memory are


@dataclass(frozen=True, slots=True)
class Fold:
    """The columns of a finger, added over the periods of a texture that it spans.

    areas: float32 [levels, columns + 1, 2]: B and -dB/d(level) times the distance of levels, over L0 W0. As the finger
        moves, a node meets neighbouring columns at nearly the same level: neighbours in memory.
    ends: the same at the last level, float64 [columns + 1, 2].
    tops: height of the highest point of each column, m [columns + 1].
    first: place of the first column, m.
    step: distance of columns, m.
    top, drop: of the levels, m.
    """

    areas: Floats
    ends: Array
    tops: Array
    first: float
    step: float
    top: float
    drop: float

    @classmethod
    def of(cls, columns: FingerColumns, period: float, area: float, coarser: float) -> Fold:
        """Return the fold of `columns` over `period` (m); area: L0 W0, m^2; coarser: as of `FingertipGrid`."""
        width = columns.step * (len(columns.areas) + 1)
        whole, denser = min(period, width), DENSER if coarser < 1.0 else 1
        count = math.ceil(denser * max(whole / columns.step, FEWEST_COLUMNS / coarser))
        levels = columns.areas.shape[1]
        areas, ends = np.empty((levels, count + 1, 2), np.float32), np.zeros((count + 1, 2))
        tops = np.full(count + 1, -math.inf)
        first, copies = columns.first - columns.step, math.ceil(width / whole)
        read = columns.areas, columns.ends, columns.tops, columns.step
        add_copies(*read, whole, copies, 1.0 / area, areas, ends, tops)
        return cls(areas, ends, tops, first, whole / count, columns.top, columns.drop)


@inlined
def cubic_weight(k, t):
    """Return the weight of the column `k` (-1 to 2) in the cubic through four, at `t` between columns 0 and 1."""
    if k == -1:
        return -t * (t - 1.0) * (t - 2.0) / 6.0
    if k == 0:
        return (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0
    if k == 1:
        return -(t + 1.0) * t * (t - 2.0) / 2.0
    return (t + 1.0) * t * (t - 1.0) / 6.0


@signed_kernel("void(f4[:,:,::1], f8[:,::1], f8[::1], f8, f8, i8, f8, f4[:,:,::1], f8[:,::1], f8[::1])")
def add_copies(columns, last, heights, step, whole, copies, factor, areas, ends, tops):
    """Write the fold of `columns`, cubic between them, by level first, and its highest points.

    last: `columns` at the last level.
    step: of the columns, m.
    whole: width of the fold, m, which begins one step before the first column.
    """
    count, levels, known = len(ends) - 1, columns.shape[1], len(columns)
    flat, some = columns.reshape(known, 2 * levels), np.empty((TOGETHER, 2 * levels))
    for begin in range(0, count + 1, TOGETHER):
        past = min(begin + TOGETHER, count + 1)
        for m in range(begin, past):
            both = some[m - begin]
            both[:] = 0.0
            highest = -math.inf
            for n in range(copies):
                place = (m * whole / count + n * whole) / step - 1.0
                at = math.floor(place)
                if at >= known or at < -1:
                    continue
                t = place - at
                near, far = heights[max(at, 0)], heights[min(at + 1, known - 1)]
                between = near + t * (far - near) if min(near, far) > -math.inf else max(near, far)
                highest = max(highest, between)
                for k in range(max(-1, -at), min(3, known - at)):
                    weight = factor * cubic_weight(k, t)
                    row = flat[at + k]
                    for i in range(2 * levels):
                        both[i] += weight * row[i]
                    ends[m, 0] += weight * last[at + k, 0]
                    ends[m, 1] += weight * last[at + k, 1]
            tops[m] = highest
        for i in range(levels):
            for m in range(begin, past):
                areas[i, m, 0] = max(some[m - begin, 2 * i], 0.0)  # cubics may pass 0 beside a highest point
                areas[i, m, 1] = max(some[m - begin, 2 * i + 1], 0.0)
