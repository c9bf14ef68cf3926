"""The approach z of a fingertip at any phase of a texture along a line: eq. 1 as an integral over its surface.

Model   The texture does not vary across the scan, so a fingertip meets it by its area above a level alone
        (`finger_columns`): F(z) = integral over x of A(x, z - h2(x - p)) / (L0 W0). The integral goes over the nodes of
        the texture (`texture_nodes`), which follow its edges. Where the finger spans several periods, the columns of
        all periods are added first, so a phase costs the nodes of one period:

            F(z) = sum over the nodes of weight B(s + p, z - h2(s)),   B(q, l) = sum over n of A(q + n period, l)

        B is linear between close columns and cubic between levels. F is convex and falls nearly as the square of a
        distance. Newton's method, within a bracket, begins at a parabola through the phases before.
Source  Fagiani & Barbieri (2016), eq. 1.
Limits  |error of z| < 1e-11 of the scale for these nodes and columns. Their own error is told by `refined` contacts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.contact.exact_solver import Approaches
from synth.contact.finger_columns import FingerColumns, FingerSurface
from synth.contact.texture_nodes import TextureNodes
from synth.kernels import inlined, inner, signed_kernel, summing

Floats = np.ndarray[Any, np.dtype[np.float32]]

CELLS_A_NODE = 4  # work of a node under the finger, in cells of the exact solver: 20 to 40 ns
FEWEST_COLUMNS = 64  # of B, over a period, at the usual distances: halving must bring these closer, too
MOST_STEPS = 100  # never reached in the tests; limits the time per phase
SETTLED = 1e-7  # of the scale: Newton's method ends after a step this small, with an error of its square
EMPTY = 1e-14  # of the scale: smaller indentations count as none, and z is the highest point
FIRST = 0.5  # of the depth to which a paraboloid is pressed in: the first step from the highest point, and the longest
DEEPENING = 8  # phases that are solved first, to find how deep the columns must be
BELOW = 0.02  # of the scale: how far below a first guess of z the nodes are looked at
MARGIN = 1.02  # on the depth of the columns
DEEPEST = 1.6  # factor by which columns become deeper at once: in columns that are too shallow z is too low
Place, ONE = np.uint64, np.uint64(1)  # an unsigned index: with a signed one Numba checks for negative indices
PIECES = "f4[:,:,::1], f8[:,::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[::1]"


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
        whole = min(period, width)
        count = math.ceil(max(whole / columns.step, FEWEST_COLUMNS / coarser))
        levels = columns.areas.shape[1]
        areas, ends = np.zeros((count + 1, levels, 2), np.float32), np.zeros((count + 1, 2))
        tops = np.full(count + 1, -math.inf)
        first, copies = columns.first - columns.step, math.ceil(width / whole)
        read = columns.areas, columns.ends, columns.tops, columns.step
        add_copies(*read, whole, copies, 1.0 / area, areas, ends, tops)
        by_level = np.ascontiguousarray(areas.transpose(1, 0, 2))
        return cls(by_level, ends, tops, first, whole / count, columns.top, columns.drop)


class FingertipGrid:
    """A fingertip on a texture along a line.

    surface: of the finger.
    nodes: of the texture, over a period.
    period: of the texture, m.
    extent: bounds of the heights of the texture, m.
    coarser: factor on the distances of columns, rows and levels.
    height_scale: m.
    """

    name = "surface of the fingertip"

    def __init__(
        self,
        surface: FingerSurface,
        nodes: TextureNodes,
        period: float,
        extent: tuple[float, float],
        coarser: float,
        scale: float,
    ) -> None:
        self.surface, self.nodes, self.period, self.extent = surface, nodes, period, extent
        self.coarser, self.height_scale = coarser, scale
        self.area = surface.footprint.length * surface.footprint.width
        self._fold: Fold | None = None
        self._ready: tuple[Any, ...] | None = None
        self._slopes = nodes.slopes

    @property
    def cells(self) -> int:
        """Work per phase, in cells of the exact solver."""
        under = min(1.0, self.surface.footprint.length / self.period)
        return math.ceil(CELLS_A_NODE * under * len(self.nodes.places))

    @property
    def nbytes(self) -> int:
        """Memory in bytes, without the columns of the finger, which its textures share."""
        kept = self.fold.areas.nbytes + self.fold.tops.nbytes
        return int(kept + 4 * self.nodes.places.nbytes)

    @property
    def fold(self) -> Fold:
        """The columns, added over the periods."""
        if self._fold is None:
            self._deepen(0.0)
        assert self._fold is not None
        return self._fold

    def _begin(self, indentation: float) -> None:
        """Make the columns as deep as a paraboloid with ridges is pressed into a plate at w / k (m)."""
        if self._fold is None and math.isfinite(indentation):
            self._deepen(self._pressed(indentation) + 2.0 * self.surface.field.amplitude)

    def _pressed(self, indentation: float) -> float:
        """Return how far a paraboloid is pressed into a plate at w / k (m), m; it grows with the root of w / k."""
        return math.sqrt(8.0 / math.pi * max(indentation, 0.0) * self.surface.footprint.depth)

    def solve(self, phases: Array, indentation: float | Array, guess: Array | None = None) -> Approaches:
        """Return the approach as `exact_solver.Grid.solve` does; `touching` is the area that touches over L0 W0."""
        count, phases = len(phases), np.ascontiguousarray(phases, dtype=float)
        targets = np.full(count, np.asarray(indentation, dtype=float))
        height, touching, iterations = np.empty(count), np.empty(count), np.zeros(count, dtype=np.int64)
        begin = np.full(count, np.nan) if guess is None else np.asarray(guess, dtype=float)
        self._begin(float(np.max(targets, initial=0.0)))
        some = np.arange(0, count, max(1, count // DEEPENING))
        if len(some) < count:  # deep enough at some phases is deep enough at nearly all
            self.solve(phases[some], targets[some], begin[some])
        while True:
            pieces = self._pieces()
            deepest = solve_nodes(*pieces, self.height_scale, phases, targets, begin, height, touching, iterations)
            levels = pieces[0].shape[0] - 1
            if deepest <= levels or levels * pieces[-1][1] >= self.surface.tall:
                break
            self._deepen(min(MARGIN * deepest, DEEPEST * levels) * pieces[-1][1])
        return Approaches(height, touching, iterations)

    def measure(self, phases: Array, heights: Array) -> tuple[Array, Array]:
        """Return F(z) (m) and the area that touches, over L0 W0, as `exact_solver.Grid.measure` does."""
        levels = np.ascontiguousarray(heights.reshape(len(phases), -1), dtype=float)
        self._below(float(np.min(levels, initial=math.inf)))
        depth, touching = np.zeros(levels.shape), np.zeros(levels.shape)
        measure_nodes(*self._pieces(), phases, levels, depth, touching)
        return depth.reshape(heights.shape), touching.reshape(heights.shape)

    def slope_integrals(self, period: float, phases: Array, heights: Array) -> Array:
        """Return S (m), T, N_1 (m) and N_0 of `pressure`, over L0 W0, at each of `phases` and z (`heights`, m).

        period: of the texture, m.
        """
        self._below(float(np.min(heights, initial=math.inf)))
        sums = np.empty((4, len(phases)))
        sum_node_slopes(*self._pieces(), self._slopes, phases, heights, sums)
        return sums

    def _pieces(self) -> tuple[Any, ...]:
        """Return the arrays that the kernels read; the nodes begin at the first column."""
        fold, nodes = self.fold, self.nodes
        if self._ready is None or self._ready[0] is not fold.areas:
            numbers = np.array([fold.step, fold.drop, self.period, self._pressed(1.0)])
            first = (fold.top - fold.tops) / fold.drop
            places = (nodes.places - fold.first) % self.period / fold.step
            order = np.argsort(places, kind="stable")
            levels = (fold.top + nodes.heights) / fold.drop
            read = (one[order] for one in (places, nodes.weights, levels))
            self._ready = fold.areas, fold.ends, first, *read, numbers
            self._slopes = nodes.slopes[order]
        return self._ready

    def reach_as(self, other: FingertipGrid) -> None:
        """Make the columns as deep as those of `other`, so that they are made once."""
        if other._fold is not None:
            self._below_top(other._fold.drop * (other._fold.areas.shape[0] - 3))

    def _below(self, z: float) -> None:
        """Make the columns deep enough for the approach `z` (m) at every phase."""
        self._below_top(self.fold.top - z + self.extent[1])

    def _below_top(self, depth: float) -> None:
        """Make the columns at least as deep as `depth` (m) below the top of the fingertip."""
        reached = math.inf if self._fold is None else self._fold.drop * (self._fold.areas.shape[0] - 1)
        if self._fold is None or (math.isfinite(depth) and reached < min(depth, self.surface.tall)):
            self._deepen(MARGIN * depth)

    def _deepen(self, depth: float) -> None:
        """Make the columns for a level `depth` (m) below the top of the fingertip."""
        self._fold = Fold.of(self.surface.columns(depth, self.coarser), self.period, self.area, self.coarser)


@signed_kernel("void(f4[:,:,::1], f8[:,::1], f8[::1], f8, f8, i8, f8, f4[:,:,::1], f8[:,::1], f8[::1])")
def add_copies(columns, last, heights, step, whole, copies, factor, areas, ends, tops):
    """Write the fold of `columns`, cubic between them, and its highest points.

    last: `columns` at the last level.
    step: of the columns, m.
    whole: width of the fold, m, which begins one step before the first column.
    """
    count, levels, known = len(areas) - 1, areas.shape[1], len(columns)
    both = np.empty(2 * levels)
    flat, out = columns.reshape(known, 2 * levels), areas.reshape(count + 1, 2 * levels)
    for m in range(count + 1):
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
            for k in range(-1, 3):
                if not 0 <= at + k < known:
                    continue
                if k == -1:
                    weight = -t * (t - 1.0) * (t - 2.0) / 6.0
                elif k == 0:
                    weight = (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0
                elif k == 1:
                    weight = -(t + 1.0) * t * (t - 2.0) / 2.0
                else:
                    weight = (t + 1.0) * t * (t - 1.0) / 6.0
                weight *= factor
                row = flat[at + k]
                for i in range(2 * levels):
                    both[i] += weight * row[i]
                ends[m, 0] += weight * last[at + k, 0]
                ends[m, 1] += weight * last[at + k, 1]
        tops[m] = highest
        for i in range(2 * levels):
            out[m, i] = max(both[i], 0.0)  # cubics between columns may pass 0 beside a highest point


@inlined
def cubic(a0, d0, a1, d1, t):
    """Return value and slope at `t` of the cubic with the values a and the slopes d at 0 and 1."""
    rise = a1 - a0
    p, q = d0 + d1 - 2.0 * rise, 3.0 * rise - 2.0 * d0 - d1
    return a0 + t * (d0 + t * (q + t * p)), d0 + t * (2.0 * q + 3.0 * t * p)


@inlined
def column_above(areas, ends, c, start, level):
    """Return A and N of the column `c` at `level`, both relative; start: level of its highest point.

    Between its highest point and the next level, A is a power of the depth that continues there with equal slope.
    """
    if not level > start:
        return 0.0, 0.0
    last = areas.shape[0] - 1
    if level >= last:  # where the whole column touches, or Newton's method passes
        return ends[c, 0] + (level - last) * ends[c, 1], ends[c, 1]
    i = Place(level)
    a1, d1 = areas[i + ONE, c, 0], areas[i + ONE, c, 1]
    if start > i:
        whole, part = i + 1.0 - start, (level - start) / (i + 1.0 - start)
        power = max(d1 * whole / a1, 1.0) if a1 > 0.0 else 1.0
        a = a1 * part**power
        return a, power * a / (level - start)
    return cubic(areas[i, c, 0], areas[i, c, 1], a1, d1, level - i)


@inner
def beside(areas, ends, first, c, u, level):
    """Return `above` where the levels of one of the columns are not whole: beside its highest point, or below them."""
    after = c + ONE
    if not level > min(first[c], first[after]):
        return 0.0, 0.0
    a, d = column_above(areas, ends, c, first[c], level)
    b, e = column_above(areas, ends, after, first[after], level)
    return a + u * (b - a), d + u * (e - d)


@inlined
def above(areas, ends, first, place, level):
    """Return B and -dB/d(level) times the distance of levels; place in columns, level in levels below the top."""
    c = Place(place)
    after, u, whole = c + ONE, place - c, math.floor(level)
    if whole < max(first[c], first[after]) or whole >= areas.shape[0] - 1:
        return beside(areas, ends, first, c, u, level)
    i = Place(whole)
    high, low = areas[i], areas[i + ONE]
    a0, d0 = high[c, 0] + u * (high[after, 0] - high[c, 0]), high[c, 1] + u * (high[after, 1] - high[c, 1])
    a1, d1 = low[c, 0] + u * (low[after, 0] - low[c, 0]), low[c, 1] + u * (low[after, 1] - low[c, 1])
    return cubic(a0, d0, a1, d1, level - whole)


@inlined
def begins(places, moved, span):
    """Return the number of the first node at or after the first column, at a phase that moves them by `moved`."""
    return np.searchsorted(places, span - moved)


@inlined
def node_at(places, begin, k, moved, span):
    """Return the number and the place (columns) of the node `k` after the one at the first column."""
    i = begin + k
    if i < len(places):
        return i, max(places[i] + moved - span, 0.0)
    return i - len(places), places[i - len(places)] + moved


@inner
def gather(first, places, weights, levels, moved, span, lowest, columns, kept):
    """Write the nodes that may touch above `lowest`; return their number and the highest point, in levels.

    columns: number of the column before each [nodes].
    kept: part of the way to the next column, level, weight, and the first whole level of both columns [4, nodes].
    """
    count, top, last, begin = 0, -math.inf, len(first) - 1, begins(places, moved, span)
    for k in range(len(places)):
        i, place = node_at(places, begin, k, moved, span)
        c = int(place)
        if c >= last:
            break
        near, far = first[Place(c)], first[Place(c) + ONE]
        reach = levels[i] - min(near, far)
        top = max(top, reach)
        if reach > lowest:
            columns[count] = c
            kept[0, count], kept[1, count], kept[2, count] = place - c, levels[i], weights[i]
            kept[3, count] = math.ceil(max(near, far))
            count += 1
    return count, top


@inner
def sums_of(areas, ends, first, columns, kept, count, z):
    """Return the sums of B and -dB/d(level) over gathered nodes, and the deepest level that touches; z in levels."""
    last = areas.shape[0] - 1
    depth, touching = inner_sums(areas, columns, kept, count, z)
    deepest = 0.0
    for i in range(count):
        level = kept[1, i] - z
        if kept[3, i] <= level < last:
            deepest = max(deepest, level)
            continue
        a, d = beside(areas, ends, first, Place(columns[i]), kept[0, i], level)
        if d > 0.0:
            depth += kept[2, i] * a
            touching += kept[2, i] * d
            deepest = max(deepest, level)
    return depth, touching, deepest


@summing
def inner_sums(areas, columns, kept, count, z):
    """Return both sums over the nodes between the first and the last whole level of their columns.

    The loop has no branches, so that several nodes are read at once.
    """
    last, depth, touching = areas.shape[0] - 1, 0.0, 0.0
    parts, levels, weights, starts = kept[0], kept[1], kept[2], kept[3]
    for number in range(count):
        k = Place(number)
        level, u, c = levels[k] - z, parts[k], Place(columns[k])
        i = Place(min(max(level, 0.0), last - 1.0))
        t = level - i
        a0 = areas[i, c, 0] + u * (areas[i, c + ONE, 0] - areas[i, c, 0])
        d0 = areas[i, c, 1] + u * (areas[i, c + ONE, 1] - areas[i, c, 1])
        a1 = areas[i + ONE, c, 0] + u * (areas[i + ONE, c + ONE, 0] - areas[i + ONE, c, 0])
        d1 = areas[i + ONE, c, 1] + u * (areas[i + ONE, c + ONE, 1] - areas[i + ONE, c, 1])
        a, d = cubic(a0, d0, a1, d1, t)
        weight = weights[k] if starts[k] <= level and level < last and d > 0.0 else 0.0
        depth += weight * a
        touching += weight * d
    return depth, touching


@signed_kernel(f"f8({PIECES}, f8, f8[::1], f8[::1], f8[::1], f8[::1], f8[::1], i8[::1])")
def solve_nodes(
    areas, ends, first, places, weights, levels, numbers, scale, phases, targets, guess, height, touching, iterations
):
    """Write z (m), the part that touches and the number of steps at each of `phases`; return the deepest level.

    guess: z (m) that Newton's method starts from, or NaN: from the parabola through the three phases before.
    """
    drop, span = numbers[1], numbers[2] / numbers[0]
    below, deepest, pressed = BELOW * scale / drop, 0.0, numbers[3] / drop
    kept, columns = np.empty((4, len(places))), np.empty(len(places), np.int64)
    z, last, earlier = math.nan, math.nan, math.nan
    for p in range(len(phases)):
        moved = (phases[p] - math.floor(phases[p])) * span
        ahead = 3.0 * (z - last) + earlier
        if math.isnan(ahead):
            ahead = z if math.isnan(last) else 2.0 * z - last
        earlier, last = last, z
        z = guess[p] / drop if not math.isnan(guess[p]) else ahead
        lowest = z - below if not math.isnan(z) else math.inf
        count, top = gather(first, places, weights, levels, moved, span, lowest, columns, kept)
        if targets[p] < EMPTY * scale:
            z = top
            height[p], touching[p], iterations[p] = z * drop, 0.0, 1
            continue
        if not z < top:
            z = top - FIRST * pressed * math.sqrt(targets[p])
        low, high, longest = -math.inf, top, FIRST * pressed * math.sqrt(targets[p])
        for turn in range(MOST_STEPS):
            if z < lowest:
                lowest = z - below
                count, top = gather(first, places, weights, levels, moved, span, lowest, columns, kept)
            depth, width, deep = sums_of(areas, ends, first, columns, kept, count, z)
            deepest = max(deepest, deep)
            iterations[p] = turn + 1
            change = 0.0
            if depth > 0.0:  # Newton's step for the root of F, which is nearly straight
                change = 2.0 * (depth - math.sqrt(depth * targets[p])) / width
            if depth >= targets[p]:
                low = z
            else:
                high = z
            if depth <= 0.0 or not low <= z + change <= high:
                change = 0.5 * (low + high) - z if low > -math.inf else -math.inf
            if change < -longest:
                change, longest = -longest, 2.0 * longest
            z += change
            if abs(change) * drop < SETTLED * scale:
                break
        height[p], touching[p] = z * drop, width / drop
    return deepest


@signed_kernel(f"void({PIECES}, f8[::1], f8[:,::1], f8[:,::1], f8[:,::1])")
def measure_nodes(areas, ends, first, places, weights, levels, numbers, phases, z, depth, touching):
    """Write F (m) and the part that touches at each of `phases` and each of its z (m): [phases, levels]."""
    drop, span, last = numbers[1], numbers[2] / numbers[0], len(first) - 1
    for p in range(len(phases)):
        moved = (phases[p] - math.floor(phases[p])) * span
        begin = begins(places, moved, span)
        for k in range(len(places)):
            i, place = node_at(places, begin, k, moved, span)
            if int(place) >= last:
                break
            for j in range(z.shape[1]):
                a, d = above(areas, ends, first, place, levels[i] - z[p, j] / drop)
                depth[p, j] += weights[i] * a
                touching[p, j] += weights[i] * d / drop


@signed_kernel(f"void({PIECES}, f8[::1], f8[::1], f8[::1], f8[:,::1])")
def sum_node_slopes(areas, ends, first, places, weights, levels, numbers, slopes, phases, z, out):
    """Write S, T, N_1 and N_0 at each of `phases` and z (m): [4, phases]."""
    drop, span, last = numbers[1], numbers[2] / numbers[0], len(first) - 1
    for p in range(len(phases)):
        moved = (phases[p] - math.floor(phases[p])) * span
        slope, rise, depth, width = 0.0, 0.0, 0.0, 0.0
        begin = begins(places, moved, span)
        for k in range(len(places)):
            i, place = node_at(places, begin, k, moved, span)
            if int(place) >= last:
                break
            a, d = above(areas, ends, first, place, levels[i] - z[p] / drop)
            depth += weights[i] * a
            width += weights[i] * d / drop
            slope += weights[i] * a * slopes[i]
            rise += weights[i] * d / drop * slopes[i]
        out[0, p], out[1, p], out[2, p], out[3, p] = slope, rise, depth, width
