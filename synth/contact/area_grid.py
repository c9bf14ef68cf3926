"""The approach z of a finger on a height field, from a sum over cells of the finger.

Model   The finger is divided into rectangular cells. z solves

            F(z) = sum over the cells of M(h1 + h2(x - p, y - q) - z, s) b dA / A0 = w / k

        h1 and h2 are the means of finger and texture over a cell. h2 is bilinear between the places of `area_texture`.
        Within a cell the gap is a plane, whose values are taken as uniformly distributed from u - s to u + s. u is the
        mean. 2 s is the length of the vector of the gap's changes over the cell along and across. So

            M(u, s) = 0 for u < -s,   (u + s)^2 / (4 s) between,   u for u > s

        is the mean of max(gap, 0) over a cell. b is the share of the cell that belongs to the finger: it is below 1 at
        hard edges. Each row of cells is shifted by a fraction of a cell against the one before, and the rows of the
        finger are closer together than those of the texture. The errors of the bilinear heights therefore differ from
        row to row, and do not add up.
        Cells are grouped into blocks of WIDE along the scan, the highest blocks first. A block cannot touch, and is not
        read, where its highest cell on the highest place of the texture under it would be below z. When the finger
        turns by a fraction of a degree, the blocks move about its middle, and the heights of their cells are corrected
        by the slope of the finger.
Source  Fagiani & Barbieri (2016), eq. 1. The cells are this project's.
Limits  Against the integral, with 12 cells per ridge, at 80 mm/s and up to 1 kHz: acceleration errs by 2 to 12 % of its
        peak-to-peak on dots, displacement by 0.04 to 0.7 %. Cells half as large err by a third to a tenth of that. z
        does not depend on where the solver starts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.contact.area_force_sums import sum_forces
from synth.contact.area_solver import BEFORE, ROW, WIDE, measure_area, solve_area
from synth.contact.area_texture import Floats, Indices, StoredTexture
from synth.contact.exact_solver import Approaches

NOWHERE = -1e30  # height of a cell of a block at which there is no finger
AREA_STEP = 1.0 / 16.0  # of a size: between two, the area is nearly a straight line
OUTSIDE = 1e9  # rim of such a cell: no finger is as large
BESIDE = 4  # columns of heights on each side of the finger, for the interpolation of its shifted rows
GOLDEN = 0.618033988749895  # shift of each row against the one before, cells
FARTHEST = 600.0  # cells per rad, largest `arms`: with more, a turn by 0.01 rad would leave the stored texture
CELLS_A_CELL = (
    30  # cells within A0 that cost as much as a cell of the exact solver; those beyond hardly touch; a probe has fewer
)


class FingerRows:
    """The cells of a finger, row by row, and the shift of each row.

    cells: float32 [4, rows, whole blocks], as in `AreaGrid`; at first the height is NOWHERE and all else 0.
    columns: number of cells in a row.
    moved: shift of each row, cells [rows].
    """

    def __init__(self, rows: int, columns: int) -> None:
        self.columns = columns
        self.moved = np.asarray(np.arange(rows) * GOLDEN % 1.0 - 0.5, np.float64)
        self.cells: Floats = np.zeros((4, rows, -(-columns // WIDE) * WIDE), np.float32)
        self.cells[0], self.cells[3] = NOWHERE, OUTSIDE

    def put(self, first: int, finger: Array, rims: Array) -> None:
        """Put the cells of the rows from `first` on.

        finger: heights at the middles of the cells, and of BESIDE more columns and one more row on each side, relative
            to the scale of the solver.
        rims: of each cell, see `AreaGrid.finger` [rows, columns]. A cell above OUTSIDE never belongs to the finger.
        """
        end = first + len(rims)
        found = shifted(means_and_slopes(finger), self.moved[first:end])
        into = self.cells[:, first:end, : self.columns]
        np.copyto(into[:3], found, "same_kind", rims < OUTSIDE)
        into[3] = rims


@dataclass(frozen=True, slots=True, weakref_slot=True)
class AreaGrid:
    """The cells of a finger over a texture; heights are relative to `height_scale`.

    tops: float32 [blocks], the highest top of the cells of each block, falling.
    places: [blocks, 3], column and row of the first cell of each block on the lattice of the texture, which has
        BEFORE columns before x = 0, and the smallest rim of its cells.
    arms: [blocks + 1, 2], distance by which each block moves along and across as the finger turns, cells per rad. Last:
        the same for the shift of the finger across, from one cell of a block to the next.
    finger: float32 [blocks, 4, WIDE], mean height of each cell, its change over the cell along and across, and its rim.
        The share of a cell that belongs to a finger of some size is the size minus the rim, from 0 to 1. The rim of a
        finger of one size is minus the share; its size is 0.
    texture: on the same lattice.
    cell: area of a cell, relative to A0.
    height_scale: m.
    begin: x and y of the first cell of the finger, in periods of the texture.
    size: of the finger where no other is given.
    covered: of a finger of many sizes, the area of its shares over that of its square, at sizes AREA_STEP apart; empty
        for a finger of one size. The mean over the square is then that over the shares.
    """

    tops: Floats
    places: Array
    arms: Array
    finger: Floats
    texture: StoredTexture
    cell: float
    height_scale: float
    begin: tuple[float, float]
    size: float = 0.0
    covered: Array = field(default_factory=lambda: np.empty(0))

    name = "cells of the area"

    @classmethod
    def of(
        cls, rows: FingerRows, begin: tuple[float, float], texture: StoredTexture, cell: float, scale: float
    ) -> AreaGrid:
        """Return the grid.

        rows: the cells of the finger.
        begin: x and y of its first cell, m.
        texture: stored with the same size of a cell and the same scale.
        cell: area of a cell, relative to A0.
        scale: m.
        """
        step, (kinds, count, padded) = texture.step, rows.cells.shape
        wide = padded // WIDE
        blocks = np.moveaxis(rows.cells.reshape(kinds, count * wide, WIDE), 0, 1)
        tops = np.max(blocks[:, 0] + 0.5 * np.hypot(blocks[:, 1], blocks[:, 2]), axis=1)
        order = np.argsort(-tops, kind="stable")
        order = order[tops[order] > 0.5 * NOWHERE]
        row, column = order // wide, order % wide * WIDE
        places = np.stack([column + rows.moved[row] + BEFORE, row * ROW, np.min(blocks[order, 3], axis=1)], axis=1)
        x, y = column + 0.5 * (WIDE - rows.columns), (row - 0.5 * (count - 1)) * ROW  # from the middle of the finger
        flat = step[0] / step[1]
        arms = np.stack([np.clip(np.append(-y / flat, -flat / ROW), -FARTHEST, FARTHEST), np.append(x * flat, 0.0)], 1)
        return cls(
            tops=np.ascontiguousarray(tops[order]),
            places=np.ascontiguousarray(places, np.float64),
            arms=np.ascontiguousarray(arms),
            finger=np.ascontiguousarray(blocks[order]),
            texture=texture,
            cell=cell,
            height_scale=scale,
            begin=(begin[0] / texture.period[0], begin[1] / texture.period[1]),
        )

    @property
    def cells(self) -> int:
        """Work per place, in cells of the exact solver."""
        return math.ceil(min(1.0 / self.cell, WIDE * len(self.tops)) / CELLS_A_CELL)

    @property
    def shares(self) -> Array:
        """Share of each cell that belongs to the finger, 0 to 1 [blocks, WIDE]."""
        return np.clip(self.size - self.finger[:, 3].astype(np.float64), 0.0, 1.0)

    @property
    def nbytes(self) -> int:
        """Memory of the grid in bytes."""
        return sum(one.nbytes for one in (self.tops, self.places, self.arms, self.finger, self.texture))

    @property
    def pieces(self) -> tuple[Floats, Array, Array, Floats, Floats, Floats, Indices, float, float]:
        """What the kernels read."""
        under = self.texture
        finger = self.tops, self.places, self.arms, self.finger.ravel()
        return *finger, under.heights, under.crests, under.shape, under.columns, under.highest

    def solve(self, phases: Array, indentation: float | Array, guess: Array | None = None) -> Approaches:
        """Return the approach as `exact_solver.Grid.solve` does; `touching` is the area that touches over A0."""
        return self.solve_places(phases, np.zeros(len(phases)), indentation, guess)

    def solve_places(
        self,
        phases: Array,
        across: Array,
        indentation: float | Array,
        guess: Array | None = None,
        turns: Array | None = None,
        sizes: Array | None = None,
    ) -> Approaches:
        """Return the approach at each place of a path.

        phases, across: how far the texture has moved along and across, in periods.
        indentation, guess: as in `solve`.
        turns: angle by which the finger is turned from its direction, rad; None: 0.
        sizes: of the finger; None: `size`.
        """
        count = len(phases)
        height, touching, iterations = np.empty(count), np.empty(count), np.zeros(count, dtype=np.int64)
        begin = np.full(count, np.nan) if guess is None else np.asarray(guess / self.height_scale)
        targets = np.full(count, np.asarray(indentation, dtype=float) / (self.height_scale * self.cell))
        targets *= self._covered(sizes)
        x, y = self._corner(phases, across)
        angles = np.zeros(count) if turns is None else np.ascontiguousarray(turns)
        own = np.full(count, self.size) if sizes is None else np.ascontiguousarray(sizes)
        solve_area(*self.pieces, x, y, angles, own, targets, begin, height, touching, iterations)
        return Approaches(height * self.height_scale, touching * self.cell, iterations)

    def measure(self, phases: Array, heights: Array) -> tuple[Array, Array]:
        """Return F(z) (m) and the area that touches, over A0, as `exact_solver.Grid.measure` does."""
        levels = np.ascontiguousarray(heights.reshape(len(phases), -1)) / self.height_scale
        depth, touching = np.empty(levels.shape), np.empty(levels.shape)
        x, y = self._corner(phases, np.zeros(len(phases)))
        measure_area(*self.pieces, x, y, self.size, levels, depth, touching)
        depth *= self.cell * self.height_scale / self._covered(None)
        return depth.reshape(heights.shape), touching.reshape(heights.shape) * self.cell

    def force_sums(
        self, phases: Array, across: Array, heights: Array, turns: Array, sizes: Array, exponent: float = 0.0
    ) -> Array:
        """Return N_1 (m), both components of S (m) and N_g (m^g) of `area_forces` at each place and z: [4, places].

        heights: z, m.
        exponent: g; 0: N_g is left out.
        The other arguments are as in `solve_places`.
        """
        sums, scale, (along, beside) = np.empty((4, len(phases))), self.height_scale, self.texture.step
        x, y = self._corner(phases, across)
        sum_forces(*self.pieces, x, y, np.ascontiguousarray(turns), sizes, heights / scale, exponent, sums)
        steep = [scale, scale**2 / along, scale**2 / (ROW * beside), scale**exponent]
        return np.asarray(self.cell / self._covered(sizes) * sums * np.array(steep)[:, np.newaxis])

    def _covered(self, sizes: Array | None) -> Any:
        """Return `covered` at `sizes`; None: at `size`."""
        if not len(self.covered):
            return 1.0
        known = AREA_STEP * np.arange(1, len(self.covered) + 1)
        return np.interp(self.size if sizes is None else sizes, known, self.covered)

    def _corner(self, phases: Array, across: Array) -> tuple[Array, Array]:
        """Return where the first cell meets the texture, in periods, 0 to 1; ValueError where it is not finite."""
        if not (np.isfinite(phases).all() and np.isfinite(across).all()):
            raise ValueError("phases and across contain values that are not finite.")
        return (self.begin[0] - phases) % 1.0, (self.begin[1] - across) % 1.0


def means_and_slopes(heights: Array) -> Array:
    """Return the mean height of each cell, and the changes of height over it along and across [3, rows, columns].

    heights: at the middles of the cells, and of one more on each side [rows + 2, columns + 2].
    The mean is that of the parabolas through the neighbours in both directions.
    """
    middle, (left, right) = heights[1:-1, 1:-1], (heights[1:-1, :-2], heights[1:-1, 2:])
    below, above = heights[:-2, 1:-1], heights[2:, 1:-1]
    mean = middle + (left + right + below + above - 4.0 * middle) / 24.0
    return np.stack([mean, 0.5 * (right - left), 0.5 * (above - below)])


def shifted(values: Array, moved: Array) -> Array:
    """Return each row of `values` at places `moved` columns further on, by polynomials through 2 BESIDE - 1 neighbours.

    values: [..., rows, columns + 2 (BESIDE - 1)].
    moved: [rows], -0.5 to 0.5.
    """
    reach = BESIDE - 1
    columns, found, taps = values.shape[-1] - 2 * reach, np.zeros(1), np.arange(-reach, reach + 1)
    for tap in taps:
        others = taps[taps != tap]
        weight = np.prod((moved[:, np.newaxis] - others) / (tap - others), axis=1)
        found = found + weight[:, np.newaxis] * values[..., tap + reach : tap + reach + columns]
    return np.asarray(found)
