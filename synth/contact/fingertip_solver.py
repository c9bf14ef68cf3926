"""The approach z of a fingertip at any phase of the texture, exact over the points of the fingertip.

Model   The points lie in columns across the scan, and all points of a column meet the texture at one height h2: its
        mean over the width of the column. With the height at one point, waves as short as that width would alias to
        slow ones. z solves F(z) = sum of max(h1 + h2 - z, 0) over the points = w / k. The heights h1 of a column are
        sorted once, with their running sums. So a column adds the running sum at the rank of z - h2 among its heights.
        The rank is found from bins of equal height. F is piecewise linear, convex and falling. Newton's method ends
        when a step passes no point, or is so small that the points it passes have no effect.
Source  Fagiani & Barbieri (2016), eq. 1; the rank in sorted heights is that of the projection on the simplex by Duchi
        et al. (2008), here in columns.
Limits  |error of z| < 1e-11 of the scale against a sum over all points, whose heights are rounded to float32.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.contact.exact_solver import Approaches
from synth.kernels import inlined, inner, signed_kernel
from synth.surfaces.profile import Profile

Floats = np.ndarray[Any, np.dtype[np.float32]]
Indices = np.ndarray[Any, np.dtype[np.int64 | np.int32]]

CELLS_A_COLUMN = 1.4  # work of a column, in cells of the exact solver: 15 to 25 ns from a near guess
KNOTS = 64  # steps per width of a column; linear interpolation between them errs by 2e-5 of the texture
FEWEST_KNOTS, MOST_KNOTS = 1024, 1 << 18  # of a period
BINS = 2  # per point of a column: the rank of a level is found after half a step, on average
MOST_STEPS = 100  # never reached in the tests; limits the time per phase
SETTLED = 1e-8  # of the scale: Newton's method ends after a step this small, with an error of its square
EMPTY = 1e-14  # of the scale, summed over the points: smaller targets count as none, and z is the highest point
FIRST = 0.05  # of the scale below the highest point: where Newton's method starts if nothing is known
PIECES = "i8[::1], f4[::1], f8[::1], f8[::1], i4[::1], f8[::1], f8[::1]"  # types of `FingertipGrid.pieces`


@dataclass(frozen=True, slots=True)
class FingertipGrid:
    """The points of a fingertip, in columns across the scan; heights are relative to `height_scale`.

    places: x of each column, from the middle, in periods of the texture.
    starts: int64 [columns + 1]: where the points of each column begin.
    heights: float32, of all points, falling within each column.
    shape: [2 columns]: height of the top of each column, and its number of bins per height.
    sums: [points + columns]: running sums of the heights, one more per column than it has points.
    ranks: int32 [BINS points + columns]: number of points of a column in higher bins; the bins divide its height.
    texture: mean heights over a column's width, at equal steps of a period and its end.
    cell: area of a point, relative to L0 W0.
    height_scale: m.
    """

    places: Array
    starts: Indices
    heights: Floats
    shape: Array
    sums: Array
    ranks: Indices
    texture: Array
    cell: float
    height_scale: float

    name = "points of the fingertip"

    @classmethod
    def of(cls, places: Array, heights: Array, texture: Profile, cell: float, scale: float) -> FingertipGrid:
        """Return the grid of points.

        places: x of the columns, m, equally spaced.
        heights: of the points, m [columns, rows]; -inf: there is no point.
        cell: area of a point, relative to L0 W0.
        scale: m.
        """
        counts, columns = np.isfinite(heights).sum(axis=1), len(places)
        ordered = -np.sort((heights / -scale).astype(np.float32), axis=1)
        points = ordered[np.isfinite(ordered)]
        starts = np.concatenate([[0], np.cumsum(counts)])
        shape, sums = np.zeros(2 * columns), np.zeros(len(points) + columns)
        ranks = np.zeros(BINS * len(points) + columns, dtype=np.int32)
        prepare_columns(starts, points, shape, sums, ranks)
        knots = mean_heights(texture, float(places[1] - places[0])) / scale
        return cls(places / texture.period, starts, points, shape, sums, ranks, knots, cell, scale)

    @property
    def cells(self) -> int:
        """Work per phase, in cells of the exact solver."""
        return round(CELLS_A_COLUMN * len(self.places))

    @property
    def nbytes(self) -> int:
        """Memory of the grid in bytes."""
        return sum(one.nbytes for one in self.pieces)

    @property
    def pieces(self) -> tuple[Indices, Floats, Array, Array, Indices, Array, Array]:
        """The arrays that the kernels read."""
        return self.starts, self.heights, self.shape, self.sums, self.ranks, self.places, self.texture

    def solve(self, phases: Array, indentation: float | Array, guess: Array | None = None) -> Approaches:
        """Return the approach as `exact_solver.Grid.solve` does; `touching` is the area that touches over L0 W0."""
        count = len(phases)
        height, touching, iterations = np.empty(count), np.empty(count), np.zeros(count, dtype=np.int64)
        begin = np.full(count, np.nan) if guess is None else np.asarray(guess / self.height_scale)
        targets = np.full(count, np.asarray(indentation, dtype=float) / (self.height_scale * self.cell))
        solve_columns(*self.pieces, phases, targets, begin, height, touching, iterations)
        return Approaches(height * self.height_scale, touching * self.cell, iterations)

    def measure(self, phases: Array, heights: Array) -> tuple[Array, Array]:
        """Return F(z) (m) and the area that touches, over L0 W0, as `exact_solver.Grid.measure` does."""
        levels = np.ascontiguousarray(heights.reshape(len(phases), -1)) / self.height_scale
        depth, touching = np.zeros(levels.shape), np.zeros(levels.shape)
        measure_columns(*self.pieces, phases, levels, depth, touching)
        depth *= self.cell * self.height_scale
        return depth.reshape(heights.shape), touching.reshape(heights.shape) * self.cell

    def slope_integrals(self, period: float, phases: Array, heights: Array) -> Array:
        """Return S (m), T, N_1 (m) and N_0 of `pressure`, over L0 W0, at each of `phases` and z (`heights`, m).

        period: of the texture, m.
        """
        sums, scale = np.empty((4, len(phases))), self.height_scale
        sum_column_slopes(*self.pieces, phases, heights / scale, sums)
        return np.asarray(sums * self.cell * [[scale * scale / period], [scale / period], [scale], [1.0]])


def mean_heights(texture: Profile, width: float) -> Array:
    """Return the mean of `texture` over `width` (m) about each of equal steps of a period, and about its end (m)."""
    count = min(max(FEWEST_KNOTS, 1 << math.ceil(math.log2(KNOTS * texture.period / width))), MOST_KNOTS)
    places = np.asarray(np.arange(count) * (texture.period / count))
    series = np.fft.rfft(texture.heights(places))
    knots = np.fft.irfft(series * np.sinc(np.arange(len(series)) * (width / texture.period)), count)
    return np.append(knots, knots[0])


@signed_kernel("void(i8[::1], f4[::1], f8[::1], f8[::1], i4[::1])")
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


@inner
def column_sums(starts, heights, shape, sums, ranks, under, z):
    """Return the sum of max(h - z, 0) over all points, and the number of points above z.

    under: height of the texture at each column.
    """
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


@inlined
def texture_at(texture, turns):
    """Return the height of the texture `turns` periods from its start."""
    count = len(texture) - 1
    along = (turns - math.floor(turns)) * count
    knot = min(int(along), count - 1)
    return texture[knot] + (along - knot) * (texture[knot + 1] - texture[knot])


@inner
def place_texture(shape, places, texture, phase, under):
    """Write the height of the texture at each column, at `phase` (turns); return the highest point."""
    top = -math.inf
    for c in range(len(places)):
        under[c] = texture_at(texture, places[c] - phase)
        top = max(top, shape[2 * c] + under[c])
    return top


@signed_kernel(f"void({PIECES}, f8[::1], f8[::1], f8[::1], f8[::1], f8[::1], i8[::1])")
def solve_columns(
    starts, heights, shape, sums, ranks, places, texture, phases, targets, guess, height, touching, iterations
):
    """Write z, the number of points that touch and the number of steps, at each of `phases`.

    guess: z that Newton's method starts from, or NaN: from the line through the two phases before.
    """
    z, last, under = math.nan, math.nan, np.empty(len(places))
    for p in range(len(phases)):
        top = place_texture(shape, places, texture, phases[p], under)
        if targets[p] < EMPTY:
            height[p], touching[p], iterations[p], z, last = top, 0.0, 1, top, math.nan
            continue
        ahead = 2.0 * z - last
        last = z
        if not math.isnan(guess[p]):
            z = guess[p]
        elif not math.isnan(ahead):
            z = ahead
        if not z < top:
            z = top - min(targets[p], FIRST)
        before, count = -1.0, 0.0
        for step in range(MOST_STEPS):
            area, count = column_sums(starts, heights, shape, sums, ranks, under, z)
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


@inlined
def column_above(starts, heights, shape, sums, ranks, c, level):
    """Return the sum of max(h - level, 0) over the points of a column, and the number of its points above `level`."""
    below = shape[2 * c] - level
    if not below > 0.0:
        return 0.0, 0
    first, end = starts[c], starts[c + 1]
    b = min(int(below * shape[2 * c + 1]), BINS * (end - first))
    at = first + ranks[BINS * first + c + b]
    while at < end and heights[at] > level:
        at += 1
    return sums[at + c] - (at - first) * level, at - first


@signed_kernel(f"void({PIECES}, f8[::1], f8[::1], f8[:,::1])")
def sum_column_slopes(starts, heights, shape, sums, ranks, places, texture, phases, z, out):
    """Write S, T, N_1 and N_0 as sums over the points, of slopes per period, at each of `phases` and z.

    out: [4, phases].
    """
    knots = len(texture) - 1
    for p in range(len(phases)):
        slope, rise, depth, touching = 0.0, 0.0, 0.0, 0.0
        for c in range(len(places)):
            turns = places[c] - phases[p]
            along = (turns - math.floor(turns)) * knots
            knot = min(int(along), knots - 1)
            step = texture[knot + 1] - texture[knot]
            area, count = column_above(
                starts, heights, shape, sums, ranks, c, z[p] - texture[knot] - (along - knot) * step
            )
            slope += area * step * knots
            rise += count * step * knots
            depth += area
            touching += count
        out[0, p], out[1, p], out[2, p], out[3, p] = slope, rise, depth, touching


@signed_kernel(f"void({PIECES}, f8[::1], f8[:,::1], f8[:,::1], f8[:,::1])")
def measure_columns(starts, heights, shape, sums, ranks, places, texture, phases, z, depth, touching):
    """Add the sum of max(h - z, 0) and the number of points above z, at each of `phases` and each of its z.

    z, depth, touching: [phases, levels].

    The columns are processed one after another, because the points of a column fit into the fastest cache. The steps of
    `column_sums` are repeated here: a call for every level would take twenty times as long.
    """
    for c in range(len(places)):
        first, end = starts[c], starts[c + 1]
        for p in range(len(phases)):
            under = texture_at(texture, places[c] - phases[p])
            for i in range(z.shape[1]):
                level = z[p, i] - under
                below = shape[2 * c] - level
                if below > 0.0:
                    b = min(int(below * shape[2 * c + 1]), BINS * (end - first))
                    at = first + ranks[BINS * first + c + b]
                    while at < end and heights[at] > level:
                        at += 1
                    depth[p, i] += sums[at + c] - (at - first) * level
                    touching[p, i] += at - first
