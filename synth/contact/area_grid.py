"""The approach z of a finger on a height field, exact over the points of both.

Model   The points of the finger and those of the texture lie on one lattice. z solves

            F(z) = sum over the points of the finger of max(h1 + h2(x - p, y - q) - z, 0) dA / A0 = w / k

        h2 is the mean of the texture over the cell of a point, so that waves shorter than a cell do not move the
        finger slowly. It is bilinear between the places of `area_texture`.
        Points of the finger stand in blocks of WIDE along the scan, the highest blocks first. A block whose highest
        point, on the highest place of the texture under it, is below z cannot touch, and is not read. F is piecewise
        linear, convex and falling, so Newton's method from the left ends exactly.
Source  Fagiani & Barbieri (2016), eq. 1; Newton's method here is Michelot's (1986) projection on the simplex.
Limits  The steps are taken in float32, the last one in float64: |error of z| < 1e-6 of the scale against a sum over
        all points. z does not depend on where the solver starts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from synth.arrays import Array
from synth.contact.area_solver import WIDE, measure_area, solve_area
from synth.contact.area_texture import Floats, Indices, StoredTexture
from synth.contact.exact_solver import Approaches

NOWHERE = -1e30  # height of a place of a block at which the finger has no point
POINTS_A_CELL = 100  # points of the finger whose work is that of a cell of the exact solver: most are not read


@dataclass(frozen=True, slots=True)
class AreaGrid:
    """The points of a finger over a texture; heights are relative to `height_scale`.

    tops: float32 [blocks], the highest point of each block, falling.
    starts: int64 [blocks, 2], row and first column of each block.
    heights: float32 [blocks, WIDE].
    texture: on the same lattice.
    cell: area of a point, relative to A0.
    height_scale: m.
    begin: x and y of the first point of the finger, in periods of the texture.
    """

    tops: Floats
    starts: Indices
    heights: Floats
    texture: StoredTexture
    cell: float
    height_scale: float
    begin: tuple[float, float]

    name = "points of the area"

    @classmethod
    def of(
        cls, finger: Array, begin: tuple[float, float], texture: StoredTexture, cell: float, scale: float
    ) -> AreaGrid:
        """Return the grid.

        finger: heights of its points, m [rows, columns]; -inf: there is no point.
        begin: x and y of its first point, m.
        texture: on the lattice of the finger, with the same scale.
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
        return cls(
            tops=np.ascontiguousarray(tops[order]),
            starts=starts,
            heights=np.ascontiguousarray(blocks[order]),
            texture=texture,
            cell=cell,
            height_scale=scale,
            begin=(begin[0] / texture.period[0], begin[1] / texture.period[1]),
        )

    @property
    def cells(self) -> int:
        """Work per place, in cells of the exact solver."""
        return self.heights.size // POINTS_A_CELL + 1

    @property
    def nbytes(self) -> int:
        """Memory of the grid in bytes."""
        return sum(one.nbytes for one in (self.tops, self.starts, self.heights, self.texture))

    @property
    def pieces(self) -> tuple[Floats, Indices, Floats, Floats, Floats, Indices, float, float]:
        """What the kernels read."""
        under = self.texture
        finger = self.tops, self.starts, self.heights
        return *finger, under.heights, under.crests, under.shape, under.columns, under.highest

    def solve(self, phases: Array, indentation: float | Array, guess: Array | None = None) -> Approaches:
        """Return the approach as `exact_solver.Grid.solve` does; `touching` is the area that touches over A0."""
        return self.solve_places(phases, np.zeros(len(phases)), indentation, guess)

    def solve_places(
        self, phases: Array, across: Array, indentation: float | Array, guess: Array | None = None
    ) -> Approaches:
        """Return the approach at each place of a path.

        phases, across: how far the texture has moved along and across, in periods.
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
