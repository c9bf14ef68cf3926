"""The approach z of a fingertip at any phase of the texture, exact over the points of the fingertip.

Model   The points lie in columns across the scan, and all points of a column meet the texture at one height h2. z
        solves F(z) = sum of max(h1 + h2 - z, 0) over the points = w / k. The heights h1 of a column are sorted once,
        with their running sums. So a column adds the running sum at the rank of z - h2 among its heights. The rank is
        found from bins of equal height. F is piecewise linear, convex and falling. Newton's method ends when a step
        passes no point, or is so small that what it passes no longer counts.
Source  Fagiani & Barbieri (2016), eq. 1; a rank in sorted heights is the projection on the simplex of Duchi et al.
        (2008), here in columns.
Limits  |error of z| < 1e-11 of the scale against a sum over all points, whose heights are rounded to float32.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.contact.exact_solver import Approaches
from synth.kernels import signed_kernel
from synth.surfaces.profile import Profile

Floats = np.ndarray[Any, np.dtype[np.float32]]
Indices = np.ndarray[Any, np.dtype[np.int64 | np.int32]]

MOST_HEIGHTS = 1 << 20  # heights of the texture under columns that are computed at a time
KEPT_HEIGHTS = 2  # such sets that are cached: a table solves the same phases at every load
BINS = 2  # per point of a column: the rank of a level is found after half a step, on average
MOST_STEPS = 100  # never reached in the tests; limits the time per phase
SETTLED = 1e-8  # of the scale: Newton's method ends after a step this small, with an error of its square
EMPTY = 1e-14  # of the scale, summed over the points: smaller targets count as none, and z is the highest point
FIRST = 0.05  # of the scale below the highest point: where Newton's method starts if nothing is known
PIECES = "i8[::1], f4[::1], f8[::1], f8[::1], i4[::1]"  # types of `FingertipGrid.pieces`


@dataclass(frozen=True, slots=True)
class FingertipGrid:
    """The points of a fingertip, in columns across the scan; heights are relative to `height_scale`.

    places: x of each column, from the middle, m.
    starts: int64 [columns + 1]: where the points of each column begin.
    heights: float32, of all points, falling within each column.
    shape: [2 columns]: height of the top of each column, and its number of bins per height.
    sums: [points + columns]: running sums of the heights, one more per column than it has points.
    ranks: int32 [BINS points + columns]: number of points of a column in higher bins; the bins divide its height.
    texture: heights under the columns.
    cell: area of a point, relative to L0 W0.
    height_scale: m.
    """

    places: Array
    starts: Indices
    heights: Floats
    shape: Array
    sums: Array
    ranks: Indices
    texture: Profile
    cell: float
    height_scale: float

    name = "points of the fingertip"

    @classmethod
    def of(cls, places: Array, heights: Array, texture: Profile, cell: float, scale: float) -> FingertipGrid:
        """Return the grid of points.

        places: x of the columns, m.
        heights: of the points, m [columns, rows]; -inf: there is no point.
        cell: area of a point, relative to L0 W0.
        scale: m.
        """
        counts, columns = np.isfinite(heights).sum(axis=1), len(places)
        ordered = -np.sort(-heights, axis=1) / scale
        points = ordered[np.isfinite(ordered)].astype(np.float32)
        starts = np.concatenate([[0], np.cumsum(counts)])
        shape, sums = np.zeros(2 * columns), np.zeros(len(points) + columns)
        ranks = np.zeros(BINS * len(points) + columns, dtype=np.int32)
        prepare_columns(starts, points, shape, sums, ranks)
        return cls(places, starts, points, shape, sums, ranks, texture, cell, scale)

    @property
    def cells(self) -> int:
        """Work per phase, in cells of the exact solver: a column takes about as long as a cell."""
        return len(self.places)

    @property
    def nbytes(self) -> int:
        """Memory of the grid in bytes."""
        return self.places.nbytes + sum(one.nbytes for one in self.pieces)

    @property
    def pieces(self) -> tuple[Indices, Floats, Array, Array, Indices]:
        """The arrays that the kernels read."""
        return self.starts, self.heights, self.shape, self.sums, self.ranks

    def under(self, phases: Array) -> Array:
        """Return the texture's heights under the columns, relative to the scale, at `phases` [phases, columns]."""
        return _under(self.texture, self.places.tobytes(), phases.tobytes(), self.height_scale)

    def solve(self, phases: Array, indentation: float | Array, guess: Array | None = None) -> Approaches:
        """Return the approach as `exact_solver.Grid.solve` does; `touching` is the area that touches over L0 W0."""
        count = len(phases)
        height, touching, iterations = np.empty(count), np.empty(count), np.zeros(count, dtype=np.int64)
        begin = np.full(count, np.nan) if guess is None else np.asarray(guess / self.height_scale)
        targets = np.full(count, np.asarray(indentation, dtype=float) / (self.height_scale * self.cell))
        for part in self._parts(count):
            made = height[part], touching[part], iterations[part]
            solve_columns(*self.pieces, self.under(phases[part]), targets[part], begin[part], *made)
        return Approaches(height * self.height_scale, touching * self.cell, iterations)

    def measure(self, phases: Array, heights: Array) -> tuple[Array, Array]:
        """Return F(z) (m) and the area that touches, over L0 W0, at each of `phases` (turns) and `heights` (z, m)."""
        depth, touching = np.empty(len(phases)), np.empty(len(phases))
        z = heights / self.height_scale
        for part in self._parts(len(phases)):
            measure_columns(*self.pieces, self.under(phases[part]), z[part], depth[part], touching[part])
        return depth * self.cell * self.height_scale, touching * self.cell

    def _parts(self, count: int) -> list[slice]:
        step = max(1, MOST_HEIGHTS // len(self.places))
        return [slice(first, min(first + step, count)) for first in range(0, count, step)]


@lru_cache(maxsize=KEPT_HEIGHTS)
def _under(texture: Profile, places: bytes, phases: bytes, scale: float) -> Array:
    x, turns = np.frombuffer(places), np.frombuffer(phases)
    found = texture.heights(x - (turns % 1.0 * texture.period)[:, np.newaxis]) / scale
    return np.ascontiguousarray(found)


@signed_kernel(f"void({PIECES})")
def prepare_columns(starts, heights, shape, sums, ranks):
    """Write top and bins per height of each column to `shape`, the running sums and the ranks of `FingertipGrid`."""
    for c in range(len(starts) - 1):
        first, count = starts[c], starts[c + 1] - starts[c]
        shape[2 * c], shape[2 * c + 1] = -math.inf, 0.0
        if count == 0:
            continue
        top, spread = float(heights[first]), float(heights[first]) - float(heights[first + count - 1])
        bins = BINS * count
        a_height = (bins - 1) / spread if spread > 0.0 else 0.0
        shape[2 * c], shape[2 * c + 1] = top, a_height
        total, at, bin_at = 0.0, first + c, BINS * first + c
        b = 0
        for i in range(count):
            sums[at + i] = total
            total += float(heights[first + i])
            while b <= int((top - float(heights[first + i])) * a_height):
                ranks[bin_at + b] = i
                b += 1
        sums[at + count] = total
        while b <= bins:
            ranks[bin_at + b] = count
            b += 1


@signed_kernel(f"UniTuple(f8, 2)({PIECES}, f8[::1], f8)")
def column_sums(starts, heights, shape, sums, ranks, under, z):
    """Return the sum of max(h - z, 0) over all points, and the number of points above z."""
    area, touching = 0.0, 0
    for c in range(len(under)):
        level = z - under[c]
        below = shape[2 * c] - level
        if not below > 0.0:
            continue
        first, end = starts[c], starts[c + 1]
        b = min(int(below * shape[2 * c + 1]), BINS * (end - first))
        at = first + ranks[BINS * first + c + b]  # points of bins before this one lie above the level
        while at < end and heights[at] > level:
            at += 1
        area += sums[at + c] - (at - first) * level
        touching += at - first
    return area, float(touching)


@signed_kernel(f"void({PIECES}, f8[:, ::1], f8[::1], f8[::1], f8[::1], f8[::1], i8[::1])")
def solve_columns(starts, heights, shape, sums, ranks, under, targets, guess, height, touching, iterations):
    """Write z, the number of points that touch and the number of steps, at each row of `under`.

    guess: z that Newton's method starts from, or NaN: from the row before.
    """
    z = math.nan
    for p in range(len(under)):
        top = -math.inf
        for c in range(len(starts) - 1):
            top = max(top, shape[2 * c] + under[p, c])
        if targets[p] < EMPTY:
            height[p], touching[p], iterations[p], z = top, 0.0, 1, top
            continue
        if not math.isnan(guess[p]):
            z = guess[p]
        if not z < top:
            z = top - min(targets[p], FIRST)
        before, count = -1.0, 0.0
        for step in range(MOST_STEPS):
            area, count = column_sums(starts, heights, shape, sums, ranks, under[p], z)
            iterations[p] = step + 1
            if count == 0.0:  # a step from the left may round onto the highest point
                z = top
                break
            change = (area - targets[p]) / count
            z += change
            if count == before or abs(change) < SETTLED:
                break
            before = count
        height[p], touching[p] = z, count


@signed_kernel(f"void({PIECES}, f8[:, ::1], f8[::1], f8[::1], f8[::1])")
def measure_columns(starts, heights, shape, sums, ranks, under, z, depth, touching):
    """Write the sum of max(h - z, 0) and the number of points above z, at each row of `under`."""
    for p in range(len(under)):
        depth[p], touching[p] = column_sums(starts, heights, shape, sums, ranks, under[p], z[p])
