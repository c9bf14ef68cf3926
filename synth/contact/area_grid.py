"""The approach z of a finger on a height field, exact over the points of both.

Model   The points of the finger and those of the texture lie on one lattice. z solves

            F(z) = sum over the points of the finger of max(h1 + h2(x - p, y - q) - z, 0) dA / A0 = w / k

        h2 is the mean of the texture over the cell of a point, so that waves shorter than a cell do not move the
        finger slowly. It is known at FINER places per cell in both directions, and is bilinear between them. Those
        places are stored in an order in which the neighbours of a point are its neighbours in memory.
        Points of the finger stand in blocks of WIDE along the scan, the highest blocks first. A block whose highest
        point, on the highest place of the texture under it, is below z cannot touch, and is not read. F is piecewise
        linear, convex and falling, so Newton's method from the left ends exactly.
Source  Fagiani & Barbieri (2016), eq. 1; Newton's method here is Michelot's (1986) projection on the simplex.
Limits  The steps are taken in float32, the last one in float64: |error of z| < 1e-6 of the scale against a sum over
        all points. z does not depend on where the solver starts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.contact.area_solver import WIDE, measure_area, solve_area
from synth.contact.exact_solver import Approaches
from synth.surfaces.height_field import HeightField

Floats = np.ndarray[Any, np.dtype[np.float32]]
Indices = np.ndarray[Any, np.dtype[np.int64]]

NOWHERE = -1e30  # height of a place of a block at which the finger has no point
WAVE = 48  # places of the texture per shortest wave: a straight line between two errs by 0.2 % of that wave
FINER = (1, 2, 4, 8)  # places per cell that are tried
MOST_PLACES = 1 << 25  # of the texture: 128 MB
POINTS_A_CELL = 100  # points of the finger whose work is that of a cell of the exact solver: most are not read


@dataclass(frozen=True, slots=True)
class AreaGrid:
    """The points of a finger and of a texture; heights are relative to `height_scale`.

    tops: float32 [blocks], the highest point of each block, falling.
    starts: int64 [blocks, 2], row and first column of each block.
    heights: float32 [blocks, WIDE].
    texture: float32, see `stored_texture`.
    crests: float32 [rows, columns], the highest place of the texture from each cell on, over the length of a block.
    shape: int64 [5], see `area_solver.ROWS`.
    columns: cells per period along.
    highest: of the texture.
    cell: area of a point, relative to A0.
    height_scale: m.
    begin: x and y of the first point of the finger, in periods of the texture.
    """

    tops: Floats
    starts: Indices
    heights: Floats
    texture: Floats
    crests: Floats
    shape: Indices
    columns: float
    highest: float
    cell: float
    height_scale: float
    begin: tuple[float, float]

    name = "points of the area"

    @classmethod
    def of(
        cls, finger: Array, begin: tuple[float, float], step: tuple[float, float], texture: HeightField,
        cell: float, scale: float,
    ) -> AreaGrid:  # fmt: skip
        """Return the grid.

        finger: heights of its points, m [rows, columns]; -inf: there is no point.
        begin: x and y of its first point, m.
        step: distance of its points along and across, m. The period of the texture across is whole steps.
        texture: heights of the texture.
        cell: area of a point, relative to A0.
        scale: m.
        """
        rows, columns = finger.shape
        wide = -(-columns // WIDE)
        padded = np.full((rows, wide * WIDE), NOWHERE, np.float32)
        padded[:, :columns] = np.where(np.isfinite(finger), finger / scale, NOWHERE)
        blocks = padded.reshape(rows * wide, WIDE)
        tops = blocks.max(axis=1)
        order = np.argsort(-tops, kind="stable")
        order = order[tops[order] > 0.5 * NOWHERE]
        starts = np.stack([order // wide, order % wide * WIDE], axis=1).astype(np.int64)
        span = math.ceil(texture.period / step[0]) + wide * WIDE + 1
        whole = round(texture.across / step[1])
        finer = finer_places(texture, step, (span, whole))
        stored = stored_texture(texture, step, finer, (span, whole), scale)
        shape = np.array([whole, *finer, span * whole, span], dtype=np.int64)
        return cls(
            tops=np.ascontiguousarray(tops[order]),
            starts=starts,
            heights=np.ascontiguousarray(blocks[order]),
            texture=stored,
            crests=crests_of(stored.reshape(*finer[::-1], whole, span)),
            shape=shape,
            columns=texture.period / step[0],
            highest=float(stored.max()),
            cell=cell,
            height_scale=scale,
            begin=(begin[0] / texture.period, begin[1] / texture.across),
        )

    @property
    def cells(self) -> int:
        """Work per place, in cells of the exact solver."""
        return self.heights.size // POINTS_A_CELL + 1

    @property
    def nbytes(self) -> int:
        """Memory of the grid in bytes."""
        return sum(one.nbytes for one in (self.tops, self.starts, self.heights, self.texture, self.crests))

    @property
    def pieces(self) -> tuple[Floats, Indices, Floats, Floats, Floats, Indices, float, float]:
        """What the kernels read."""
        return self.tops, self.starts, self.heights, self.texture, self.crests, self.shape, self.columns, self.highest

    def solve(self, phases: Array, indentation: float | Array, guess: Array | None = None) -> Approaches:
        """Return the approach as `exact_solver.Grid.solve` does; `touching` is the area that touches over A0."""
        return self.solve_places(phases, np.zeros(len(phases)), indentation, guess)

    def solve_places(
        self, phases: Array, across: Array, indentation: float | Array, guess: Array | None = None
    ) -> Approaches:
        """Return the approach at each place of a path.

        phases, across: how far the finger has moved along and across, in periods of the texture.
        indentation, guess: as in `solve`.
        """
        count = len(phases)
        height, touching, iterations = np.empty(count), np.empty(count), np.zeros(count, dtype=np.int64)
        begin = np.full(count, np.nan) if guess is None else np.asarray(guess / self.height_scale)
        targets = np.full(count, np.asarray(indentation, dtype=float) / (self.height_scale * self.cell))
        x, y = self._corner(phases, across)
        solve_area(*self.pieces, x, y, targets, begin, height, touching, iterations)
        return Approaches(height * self.height_scale, touching * self.cell, iterations)

    def measure(self, phases: Array, heights: Array) -> tuple[Array, Array]:
        """Return F(z) (m) and the area that touches, over A0, as `exact_solver.Grid.measure` does."""
        levels = np.ascontiguousarray(heights.reshape(len(phases), -1)) / self.height_scale
        depth, touching = np.empty(levels.shape), np.empty(levels.shape)
        x, y = self._corner(phases, np.zeros(len(phases)))
        measure_area(*self.pieces, x, y, levels, depth, touching)
        depth *= self.cell * self.height_scale
        return depth.reshape(heights.shape), touching.reshape(heights.shape) * self.cell

    def _corner(self, phases: Array, across: Array) -> tuple[Array, Array]:
        """Return where the finger's first point meets the texture, in periods, 0 to 1."""
        return (self.begin[0] - phases) % 1.0, (self.begin[1] - across) % 1.0


def finer_places(texture: HeightField, step: tuple[float, float], counts: tuple[int, int]) -> tuple[int, int]:
    """Return the places of the texture per cell, along and across, within MOST_PLACES.

    step: distance of the points along and across, m.
    counts: cells of the stored texture along and across.
    """
    tall = math.pi * (texture.extent[1] - texture.extent[0])  # over the slope: the period of a sinusoid
    wanted = []
    for slope, cell in zip((texture.slope_bound, texture.slope_across), step, strict=True):
        wave = tall / max(slope, 1e-12)
        wanted.append(next((one for one in FINER if one * wave >= WAVE * cell), FINER[-1]))
    while wanted[0] * wanted[1] * counts[0] * counts[1] > MOST_PLACES and max(wanted) > 1:
        wanted[0 if wanted[0] >= wanted[1] else 1] //= 2
    return wanted[0], wanted[1]


def stored_texture(
    texture: HeightField,
    step: tuple[float, float],
    finer: tuple[int, int],
    counts: tuple[int, int],
    scale: float,
) -> Floats:
    """Return the means of the texture over cells, in the order [place in a cell across, along, row, column].

    counts: cells along, so many that no index wraps, and across, one period.
    The mean over a cell is that of the places in it, with half of each place on its edge.
    """
    along, rows = counts[0] * finer[0], counts[1] * finer[1]
    edge = finer[0] // 2
    x = np.asarray(np.arange(-edge, along + edge) * (step[0] / finer[0]), np.float64)
    y = np.asarray(np.arange(rows) * (texture.across / rows), np.float64)
    heights = texture.lattice(x, y)
    heights /= np.float32(scale)
    if finer[0] > 1:
        total = 0.5 * (heights[:, :along] + heights[:, 2 * edge :])
        for move in range(1, 2 * edge):
            total += heights[:, move : move + along]
        heights = total / np.float32(finer[0])
    if finer[1] > 1:
        half = finer[1] // 2
        total = 0.5 * (np.roll(heights, half, 0) + np.roll(heights, -half, 0))
        for move in range(1 - half, half):
            total += np.roll(heights, move, 0)
        heights = total / np.float32(finer[1])
    split = heights.reshape(counts[1], finer[1], counts[0], finer[0]).transpose(1, 3, 0, 2)
    return np.ascontiguousarray(split, dtype=np.float32).ravel()


def crests_of(stored: Floats) -> Floats:
    """Return the highest place of the texture over the WIDE cells from each cell on, and their neighbours.

    stored: [place in a cell across, along, row, column].
    """
    cells = stored.max(axis=(0, 1))
    cells = np.maximum(cells, np.roll(cells, -1, axis=0))  # a place between two rows is a mixture of both
    reach, found = 1, np.pad(cells, ((0, 0), (0, WIDE)), "edge")
    while reach < WIDE:
        found[:, :-reach] = np.maximum(found[:, :-reach], found[:, reach:])
        reach *= 2
    found[:, :-1] = np.maximum(found[:, :-1], found[:, 1:])  # and one between two columns
    return np.ascontiguousarray(found[:, : cells.shape[1]])
