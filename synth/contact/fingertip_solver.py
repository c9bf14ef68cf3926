"""The approach z of a fingertip at any phase of a texture along a line: eq. 1 as an integral over its surface.

Model   The texture does not vary across the scan, so a fingertip meets it by its area above a level alone
        (`finger_columns`): F(z) = integral over x of A(x, z - h2(x - p)) / (L0 W0). The integral goes over the nodes of
        the texture, which follow its edges. Where the finger spans several periods, the columns of
        all periods are added first, so a phase costs the nodes of one period:

            F(z) = sum over the nodes of weight B(s + p, z - h2(s)),   B(q, l) = sum over n of A(q + n period, l)

        B is linear between close columns and cubic between levels. Between columns A is cubic: so below the usual
        distances B has DENSER columns for each of A. F is convex and falls nearly as the square of a
        distance. Newton's method, within a bracket, begins at a parabola through the phases before.
        Nodes: a period is divided into pieces. A piece that rises by more than asked, or has one of few corners within,
        is divided at the corner that is nearest to its middle, or at its middle. Each piece has the two nodes of
        Gauss's rule. So the nodes are close at an edge, however steep, and far apart where the texture is flat.
Source  Fagiani & Barbieri (2016), eq. 1; Gauss-Legendre quadrature. The division is this project's.
Limits  |error of z| < 1e-11 of the scale for these nodes and columns. Their own error is told by `refined` contacts.
        A rise within a piece is seen at its corners and at LOOKS places.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.contact.exact_solver import Approaches
from synth.contact.finger_columns import FingerColumns, FingerSurface
from synth.contact.node_kernels import measure_nodes, solve_nodes, sum_node_slopes
from synth.kernels import inlined, signed_kernel
from synth.surfaces.profile import Profile

LOOKS = 9  # places of a piece at which its rise is looked at
MOST_HALVINGS = 40  # never reached: a piece of 1 m is then as long as an atom
GAUSS = 0.5 / math.sqrt(3.0)  # of the length of a piece, from its middle
Floats = np.ndarray[Any, np.dtype[np.float32]]
DENSER = 2  # the error of a line is of order 2, that of a cubic of order 3
FEWEST_COLUMNS = 64  # of B, over a period, at the usual distances: halving must bring these closer, too
TOGETHER = 16  # columns of B that are written at once, so that neighbours in memory are
CELLS_A_NODE = 4  # work of a node under the finger, in cells of the exact solver: 20 to 40 ns
DEEPENING = 8  # phases that are solved first, to find how deep the columns must be
MARGIN = 1.02  # on the depth of the columns
DEEPEST = 1.6  # factor by which columns become deeper at once: in columns that are too shallow z is too low


@dataclass(frozen=True, slots=True)
class TextureNodes:
    """Nodes over one period.

    places: m, rising.
    weights: length that each node stands for, m.
    heights: of the texture, m.
    slopes: dh/dx.
    """

    places: Array
    weights: Array
    heights: Array
    slopes: Array


def texture_nodes(texture: Profile, length: float, rise: float) -> TextureNodes:
    """Return the nodes of `texture`: pieces of at most `length` (m) in which it rises by at most `rise` (m)."""
    ends = pieces(texture, length, rise)
    begins, lengths = ends[:-1], np.diff(ends)
    middles, apart = begins + 0.5 * lengths, GAUSS * lengths
    places = np.stack([middles - apart, middles + apart], axis=1)
    heights = texture.heights(places)
    near = texture.heights(np.stack([begins + 1e-9 * lengths, ends[1:] - 1e-9 * lengths], axis=1))
    mean = (near[:, 1] - near[:, 0]) / lengths  # the mean slope of a piece counts for both of its nodes
    return TextureNodes(places.ravel(), np.repeat(0.5 * lengths, 2), heights.ravel(), np.repeat(mean, 2))


def pieces(texture: Profile, length: float, rise: float) -> Array:
    """Return the ends of the pieces (m), from the first corner, or 0, over a period."""
    period, corners = texture.period, np.asarray(texture.corners, np.float64)
    begin = float(corners[0]) if len(corners) else 0.0
    sparse = len(corners) * length < period
    corners = np.append(corners[1:], np.inf)
    ends = np.linspace(begin, begin + period, math.ceil(period / length) + 1)
    looked = np.arange(LOOKS) / (LOOKS - 1)
    for _ in range(MOST_HALVINGS):
        begins, widths = ends[:-1], np.diff(ends)
        first, past = np.searchsorted(corners, begins, "right"), np.searchsorted(corners, ends[1:], "left")
        heights = texture.heights(begins[:, np.newaxis] + widths[:, np.newaxis] * looked)
        inside = past > first
        middle = begins + 0.5 * widths
        nearest = np.clip(np.searchsorted(corners, middle), first, np.maximum(past - 1, first))
        before = np.clip(nearest - 1, first, None)
        at = np.where(np.abs(corners[before] - middle) < np.abs(corners[nearest] - middle), before, nearest)
        corner = np.where(inside, corners[np.minimum(at, len(corners) - 1)], middle)
        at_corner = texture.heights(np.where(inside, corner, middle))
        above = np.maximum(heights.max(axis=1), at_corner)
        below = np.minimum(heights.min(axis=1), at_corner)
        divided = (widths > 1.001 * length) | (above - below > rise)
        if sparse:  # many corners within short pieces are seen by their rise alone
            divided |= inside & (widths > 0.25 * length)
        if not divided.any():
            return ends
        where = np.where(inside, corner, middle)[divided]
        ends = np.sort(np.concatenate([ends, where]))
    return ends


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
