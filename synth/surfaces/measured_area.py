"""Heights over an area, measured or computed elsewhere, as a height field.

Stage   SURFACES.
Model   The heights are at equal distances along x and y, with bilinear interpolation between them. `ends` states how
        the surface continues beyond its edges:
        mirror  It continues as its mirror image, without a step. The period is twice the length.
        join    It begins again: the last column connects to the first, and the last row to the first.
        At phase 0 the first column is at x = 0. y = 0 is in the middle of the map.
Source  The heights are given; the bilinear surface between them is a choice.
Limits  The mean is subtracted. The shape between two heights is unknown.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from synth.surfaces.height_field import HeightField
from synth.surfaces.profile import Array, Bounds
from synth.surfaces.surface_data import Heights, SurfaceData

Indices = np.ndarray[Any, np.dtype[np.intp]]

ENDS = ("mirror", "join")
HEIGHTS_TOGETHER = 1 << 15  # heights that are summed at a time: 256 KB


@dataclass(frozen=True, eq=False)
class MeasuredArea(HeightField):
    """A bilinear surface through a map of heights.

    data: heights float32 [rows, columns], at least two of each, and their spacing.
    ends: "mirror" or "join".
    phase: rad.
    """

    data: SurfaceData
    ends: str = "mirror"
    phase: float = 0.0
    kind = "heightmap"

    @property
    def key(self) -> Hashable:
        """Everything that decides the heights. The address identifies the map."""
        return self.kind, self.data.address, self.ends, self.phase

    @cached_property
    def _orders(self) -> tuple[Indices, Indices]:
        """The indices, in the map, of the columns and the rows of one period."""
        rows, columns = self.data.heights.shape
        if self.ends == "join":
            return np.arange(columns), np.arange(rows)
        both = [np.concatenate([np.arange(n), np.arange(n - 2, 0, -1)]) for n in (columns, rows)]
        return both[0], both[1]

    @property
    def period(self) -> float:  # type: ignore[override]
        """Along x, m."""
        return len(self._orders[0]) * self.data.spacing[0]

    @property
    def across(self) -> float:  # type: ignore[override]
        """Period in y, m."""
        return len(self._orders[1]) * self.data.spacing[1]

    @cached_property
    def _mean(self) -> float:
        columns, rows = (np.bincount(order) for order in self._orders)
        return float(rows @ (self.data.heights @ (columns / columns.sum())) / rows.sum())

    def area(self, x: Array, y: Array) -> Array:
        """Return the heights (m) at every pair of `x` and `y` (m)."""
        columns, rows = self._orders
        shift = self.phase / (2.0 * math.pi) * self.period
        middle = 0.5 * (self.data.heights.shape[0] - 1) * self.data.spacing[1]
        left, right, fx = _neighbours(np.asarray(x) + shift, self.data.spacing[0], columns)
        below, above, fy = _neighbours(np.asarray(y) + middle, self.data.spacing[1], rows)
        read, at = np.unique(np.concatenate([below, above]), return_inverse=True)
        some = self.data.heights[read]
        lines = (1.0 - fx) * some[:, left] + fx * some[:, right]
        found, upper = lines[at[: len(fy)]], lines[at[len(fy) :]]
        found *= (1.0 - fy)[:, np.newaxis]  # in place: fresh memory takes longer than the sums
        upper *= fy[:, np.newaxis]
        found += upper
        found -= self._mean
        return np.asarray(found)

    def _parts(self) -> Iterator[Heights]:
        """Yield the map in parts of several rows. Each part begins with the last row of the previous part.

        If the ends join, the first column is repeated after the last, and the first row after the last.
        """
        heights = self.data.heights if self.ends == "mirror" else np.pad(self.data.heights, ((0, 1), (0, 1)), "wrap")
        step = max(1, HEIGHTS_TOGETHER // heights.shape[1])
        for first in range(0, len(heights) - 1, step):
            yield heights[first : first + step + 1]

    @cached_property
    def _steepest(self) -> tuple[float, float]:
        """Largest |dh/dx| and |dh/dy|."""
        rises = [[np.max(np.abs(np.diff(rows, axis=axis))) for axis in (1, 0)] for rows in self._parts()]
        along, across = np.max(rises, axis=0)
        return float(along) / self.data.spacing[0], float(across) / self.data.spacing[1]

    @cached_property
    def bounds(self) -> Bounds:
        """Exact bounds of the heights and of the slope along x; the curvature is infinite unless the map is flat."""
        low, high = float(self.data.heights.min()), float(self.data.heights.max())
        slope = self._steepest[0]
        return Bounds(low - self._mean, high - self._mean, slope, math.inf if slope else 0.0)

    @property
    def slope_across(self) -> float:
        """Largest |dh/dy|."""
        return self._steepest[1]

    @cached_property
    def rms(self) -> tuple[float, float]:
        """Rq (m) and rms slope along x of the bilinear surface, from closed forms for each cell.

        The slope of a map that does not vary along x is that across.
        """
        square = slope = 0.0
        for part in self._parts():
            rows = part.astype(float) - self._mean
            rises = np.diff(rows, axis=1)
            for one, two in ((slice(-1), slice(-1)), (slice(-1), slice(1, None)), (slice(1, None), slice(1, None))):
                square += _product(rows[one], rows[two])
                slope += float(np.einsum("ij,ij->", rises[one], rises[two]))
        cells = 3.0 * math.prod(count - (self.ends == "mirror") for count in self.data.heights.shape)
        if slope == 0.0:
            return math.sqrt(max(square / cells, 0.0)), self._rms_slope_of_first_column()
        return math.sqrt(max(square / cells, 0.0)), math.sqrt(slope / cells) / self.data.spacing[0]

    def _rms_slope_of_first_column(self) -> float:
        column = self.data.heights[:, 0].astype(float)
        rises = np.diff(column, append=column[:1] if self.ends == "join" else [])
        return float(np.sqrt(np.mean(rises**2))) / self.data.spacing[1]


def _neighbours(places: Array, spacing: float, order: Indices) -> tuple[Indices, Indices, Array]:
    """Return the indices of the heights before and after each of `places` (m), and the steps from the first.

    order: indices of a period in the map.
    """
    steps = np.asarray(places / spacing) % len(order)
    before = np.minimum(steps.astype(np.intp), len(order) - 1)
    return order[before], order[(before + 1) % len(order)], steps - before


def _product(one: Array, two: Array) -> float:
    """Return the sum over all pieces of the mean product of two straight pieces [lines, ends]."""
    a, b, c, d = one[:, :-1], one[:, 1:], two[:, :-1], two[:, 1:]
    straight, crossed = (
        np.einsum("ij,ij->", e, f) + np.einsum("ij,ij->", g, h) for e, f, g, h in ((a, c, b, d), (a, d, b, c))
    )
    return float(2.0 * straight + crossed) / 6.0
