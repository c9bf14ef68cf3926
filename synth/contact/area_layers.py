"""The mean of max(h - z, 0) of a finger on a height field, at all places of a lattice, level by level.

Stage   CONTACT.
Model   F(p, z) = sum over the points of the finger of max(h1 + h2(x - p, y - q) - z, 0) dA / A0

        The texture is cut into layers at heights l_j, `step` apart. Each place of it is split between the two layers
        next to its height h2, in shares T_j whose mean height is h2. The levels z_k are multiples of `step`, too. Then

            F(p, z_k) = sum over j of the correlation of T_j with A_(k - j),   A_m = max(h1 - m step, 0) dA / A0

        so F at all places is one product of Fourier series per level and layer. A_m is updated from A_(m + 1), and only
        the points between the two levels are added. A layer is averaged over cells of the lattice, and a point is
        spread over the places around it. The Fourier series are divided by the gains of both.
Source  Fagiani & Barbieri (2016), eq. 1, on the points of `area_grid`. The layers are this project's.
Limits  max(h - z, 0) is convex in h2, so two layers in place of h2 never make F smaller. They add at most half of the
        second difference of F over the levels, and a twelfth of it where heights are uniformly distributed in a layer.
        Waves shorter than two places of the lattice are left out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.contact.area_grid import NOWHERE, AreaGrid
from synth.contact.area_solver import BEFORE, ROW, ROWS, WIDE
from synth.contact.layer_sums import TAPS, fold, lay_texture, mix, share_points

Floats = np.ndarray[Any, np.dtype[np.float32]]
Numbers = np.ndarray[Any, np.dtype[np.int64]]
Complex = np.ndarray[Any, np.dtype[np.complex64]]
Work = Callable[[int, int], object]

SAMPLES = 2  # of the texture per cell of the lattice, and per cell of the finger; with 4 the error is the same
GAUSS = np.array([[-1.0, -1.0, 1.0, 1.0], [-1.0, 1.0, -1.0, 1.0]]) / math.sqrt(12.0)  # along and across, cells
BATCH = 4  # levels that are computed together: the series are read from memory once for all of them
AFRESH = 12  # work of adding one point again, relative to that of taking one place of the images down by one level
SPREAD = 32  # deep levels are 1/SPREAD of their depth below the top apart, since F is nearly a power of the depth


@dataclass(frozen=True, slots=True)
class LayerPlan:
    """Lattice and levels. Heights are relative to the `height_scale` of the grid, levels are numbers of steps.

    places: of the lattice along and across, per period.
    step: between layers.
    stride: steps between the first levels.
    top: the first level, above all points.
    first: the lowest layer that can touch at the lowest level.
    layers: number of layers.
    """

    places: tuple[int, int]
    step: float
    stride: int
    top: int
    first: int
    layers: int

    @classmethod
    def of(cls, grid: AreaGrid, places: tuple[int, int], step: float, stride: int, lowest: float) -> LayerPlan:
        """Return the plan of levels down to `lowest`."""
        low, high, tallest = float(grid.texture.heights.min()), grid.texture.highest, float(grid.tops[0])
        top = math.floor((high + tallest) / step) + 1
        first = max(math.floor(low / step), math.floor((lowest - tallest) / step) - 1)
        return cls(places, step, stride, top, first, math.floor(high / step) + 2 - first)

    def batches(self) -> Iterator[Numbers]:
        """Yield the levels from the top down, BATCH at a time. The iterator never ends."""
        level = self.top
        while True:
            levels = []
            for _ in range(BATCH):
                levels.append(level)
                level -= max(self.stride, (self.top - level) // SPREAD)
            yield np.array(levels)

    def batches_down_to(self, lowest: float) -> list[Numbers]:
        """Return the batches from the top down to the first one that reaches `lowest`."""
        found = []
        for levels in self.batches():
            found.append(levels)
            if levels[-1] * self.step <= lowest:
                break
        return found

    def images(self, levels: Numbers) -> Numbers:
        """Return the level of the image of the finger for each of `levels` and each layer [levels, layers]."""
        return np.asarray(levels[:, np.newaxis] - self.first - np.arange(self.layers))

    def samples(self, grid: AreaGrid) -> tuple[int, int]:
        """Return the samples of the texture per cell of the lattice, along and across."""
        along, across = (
            max(SAMPLES, math.ceil(SAMPLES * cells / places))
            for cells, places in zip((grid.texture.columns, int(grid.texture.shape[ROWS])), self.places, strict=True)
        )
        return along, across


def in_bands(work: Work, rows: int, workers: int) -> None:
    """Call work(first, end) for bands of `rows`, one per worker."""
    ends = [rows * i // workers for i in range(workers + 1)]
    if workers == 1:
        work(0, rows)
        return
    with ThreadPoolExecutor(workers) as pool:
        list(pool.map(work, ends[:-1], ends[1:]))


@dataclass(frozen=True, slots=True)
class AreaLayers:
    """Layers of a texture and points of a finger, ready for F at any level.

    series: of the layers, complex64 [layers, rows, columns / 2 + 1].
    x, y: of the points of the finger, in places of the lattice.
    heights: of these points, falling.
    shares: of these points, the same as of their cells.
    """

    grid: AreaGrid
    plan: LayerPlan
    series: Complex
    x: Array
    y: Array
    heights: Array
    shares: Array
    workers: int

    @classmethod
    def of(cls, grid: AreaGrid, plan: LayerPlan, workers: int = 1) -> AreaLayers:
        """Return the layers of `grid`."""
        columns, rows = plan.places
        x, y, heights, shares = finger_points(grid)
        return cls(grid, plan, layer_series(grid, plan, workers), x * columns, y * rows, heights, shares, workers)

    def batches(self) -> Iterator[tuple[Numbers, Floats]]:
        """Yield the levels from the top down, BATCH at a time, and F (m) there, float32 [BATCH, rows, columns].

        The iterator never ends.
        """
        from scipy.fft import irfft2

        columns, rows = self.plan.places
        finger, mixed = FingerSeries.of(self), np.empty((BATCH, *self.series.shape[1:]), np.complex64)
        for levels in self.plan.batches():
            slots = finger.slots(self.plan.images(levels))
            arguments = self.series, finger.series, slots, mixed
            in_bands(partial(mix, *arguments), rows, self.workers)
            yield levels, irfft2(mixed, (rows, columns), workers=self.workers)


@dataclass(slots=True)
class FingerSeries:
    """A cache of the Fourier series of the finger's images, which drops those that are no longer needed.

    series: complex64 [slots, rows, columns / 2 + 1].
    kept: slot of each level that is kept.
    free: the other slots.
    image: memory for the image of one level [rows, columns].
    """

    layers: AreaLayers
    images: FingerImages
    series: Complex
    kept: dict[int, int]
    free: list[int]
    image: Floats

    @classmethod
    def of(cls, layers: AreaLayers) -> FingerSeries:
        """Return an empty cache."""
        image = np.empty(layers.plan.places[::-1], np.float32)
        series = np.empty((0, *layers.series.shape[1:]), np.complex64)
        return cls(layers, FingerImages.of(layers), series, {}, [], image)

    def slots(self, wanted: Numbers) -> Numbers:
        """Return the slots of the `wanted` levels (any shape). Levels above all of these are dropped."""
        from scipy.fft import rfft2

        levels, at = np.unique(wanted, return_inverse=True)
        self.free += [self.kept.pop(level) for level in list(self.kept) if level > levels[-1]]
        lacking = [level for level in levels[::-1].tolist() if level not in self.kept]
        if len(lacking) > len(self.free):
            more = np.empty((len(lacking) - len(self.free), *self.series.shape[1:]), np.complex64)
            self.free += range(len(self.series), len(self.series) + len(more))
            self.series = np.concatenate([self.series, more])
        for level in lacking:
            self.kept[level] = self.free.pop()
            self.images.reach(level)
            fold(self.images.sums, *self.images.corner, self.image)
            self.series[self.kept[level]] = rfft2(self.image, workers=self.layers.workers)
        return np.ascontiguousarray(np.array([self.kept[level] for level in levels.tolist()])[at].reshape(wanted.shape))


@dataclass(slots=True)
class FingerImages:
    """The sums of max(h1 - m step, 0) / step over the points near each place, at one level m after the other.

    corner: column and row of the first place of the images.
    level: m.
    used: number of points above the level.
    above: sums of min(n, 1) over these points, each of which is n steps above the level [rows, columns].
    rest: sums of 1 - min(n, 1) [rows, columns].
    sums: [rows, columns].
    """

    layers: AreaLayers
    corner: tuple[int, int]
    level: int
    used: int
    above: Array
    rest: Array
    sums: Array

    @classmethod
    def of(cls, layers: AreaLayers) -> FingerImages:
        """Return the images at a level above the highest point: all are zero."""
        x, y = np.floor(layers.x), np.floor(layers.y)
        corner = int(x.min()) - 1, int(y.min()) - 1
        spans = int(y.max()) - corner[1] + TAPS - 1, int(x.max()) - corner[0] + TAPS - 1
        shape = min(spans[0], layers.plan.places[1]), min(spans[1], layers.plan.places[0])
        level = math.floor(layers.heights[0] / layers.plan.step) + 1
        return cls(layers, corner, level, 0, *(np.zeros(shape) for _ in range(3)))

    def reach(self, level: int) -> None:
        """Go down to `level`: step by step, or by adding all points again where that is less work."""
        heights = self.layers.heights
        end = int(np.searchsorted(-heights, -level * self.layers.plan.step, side="right"))
        if (self.level - level) * self.sums.size > AFRESH * end:
            for image in (self.above, self.rest, self.sums):
                image[:] = 0.0
            self._add(slice(0, end), level)
        while self.level > level:
            self.above += self.rest
            self.rest[:] = 0.0
            after = int(np.searchsorted(-heights, -(self.level - 1) * self.layers.plan.step, side="right"))
            self.sums += self.above
            self._add(slice(self.used, after), self.level - 1)

    def _add(self, points: slice, level: int) -> None:
        """Add points that are above `level` and not yet in the images, and set the level."""
        layers = self.layers
        x, y = layers.x[points] - self.corner[0], layers.y[points] - self.corner[1]
        heights = layers.heights[points] / layers.plan.step - level
        share_points(x, y, heights, layers.shares[points], self.sums, self.above, self.rest)
        self.used, self.level = points.stop, level


def finger_points(grid: AreaGrid) -> tuple[Array, Array, Array, Array]:
    """Return x and y (periods of the texture), height and share of points of the finger, the highest first.

    Each cell has the four points of Gauss's rule. Over them the gap has the same variance as over the cell.
    """
    there = grid.finger[:, 0] > 0.5 * NOWHERE
    mean, along, across = (grid.finger[:, n][there].astype(np.float64) for n in range(3))
    share = grid.shares[there]
    column = (grid.places[:, :1] - BEFORE + np.arange(WIDE))[there]
    row = np.broadcast_to(grid.places[:, 1:2], there.shape)[there]
    u, v = (part[:, np.newaxis] for part in GAUSS)
    x = grid.begin[0] + (column + u) / grid.texture.columns
    y = grid.begin[1] + (row + ROW * v) / grid.texture.shape[ROWS]
    heights = (mean + u * along + v * across).ravel()
    order = np.argsort(-heights, kind="stable")
    return x.ravel()[order], y.ravel()[order], heights[order], share[order % len(share)]


def layer_series(grid: AreaGrid, plan: LayerPlan, workers: int) -> Complex:
    """Return the Fourier series that, times those of the images, give F (m) [layers, rows, columns / 2 + 1].

    They are complex conjugates, because F is a correlation.
    """
    from scipy.fft import rfft2

    columns, rows = plan.places
    fine = plan.samples(grid)
    layers = np.zeros((plan.layers, rows, columns), np.float32)
    arguments = grid.texture.heights, grid.texture.shape, grid.texture.columns, *fine, plan.step, plan.first, layers
    in_bands(partial(lay_texture, *arguments), rows, workers)
    series = rfft2(layers, workers=workers)
    scale = plan.step * grid.cell / len(GAUSS[0]) * grid.height_scale
    along = passed(np.arange(columns // 2 + 1) / columns, fine[0])
    across = passed(np.asarray(np.fft.fftfreq(rows), np.float64), fine[1])
    np.conjugate(series, out=series)
    series *= (scale / (across[:, np.newaxis] * along)).astype(np.float32)
    return np.asarray(series)


def passed(frequencies: Array, fine: int) -> Array:
    """Return the gain at each of `frequencies` (per cell) of averaging `fine` samples per cell and spreading points."""
    moved = np.arange(1 - fine, fine)[:, np.newaxis]
    tent = np.sum((fine - np.abs(moved)) * np.cos(2.0 * np.pi * moved / fine * frequencies), axis=0) / fine**2
    return np.asarray(tent * np.sinc(frequencies) ** TAPS)
