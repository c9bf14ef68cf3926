"""The heights of a texture as `area_grid` reads them: means over cells, at several places per cell.

Stage   CONTACT.
Model   h2 is the mean of the texture over a cell of the finger. It is stored at up to FINER places per cell along and
        across, in the order [place in a cell across, along, row, column], so that neighbouring cells are neighbours in
        memory. The stored columns reach beyond a period by the length of the finger, so no index wraps.
Limits  A texture is stored once for all directions of a finger.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from synth.contact.area_solver import BEFORE, WIDE, highest_tops
from synth.response_cache import kept
from synth.surfaces.height_field import HeightField

Floats = np.ndarray[Any, np.dtype[np.float32]]
Flags = np.ndarray[Any, np.dtype[np.bool_]]
Indices = np.ndarray[Any, np.dtype[np.int64]]

FINER = 8  # most places per cell; with fewer, interpolation errors add up: all cells of a row have the same fraction
FINER_OF_SMALLER = 4  # the same for cells smaller than usual: the interpolation error is then a third of the others
MOST_PLACES = 1 << 24  # of the texture: 64 MB
PLACES_TOGETHER = 1 << 17  # that are computed together: 0.5 MB


@dataclass(frozen=True, slots=True, weakref_slot=True)
class StoredTexture:
    """A texture on the lattice of a finger; heights are relative to the scale of the solver.

    heights: float32, see the module.
    crests: float32 [rows, columns], the highest place of the texture from each cell on, over the length of a block.
    shape: int64 [5], see `area_solver.ROWS`.
    columns: cells per period along.
    highest: the highest place.
    period: along and across, m.
    step: size of a cell along and across, m.
    """

    heights: Floats
    crests: Floats
    shape: Indices
    columns: float
    highest: float
    period: tuple[float, float]
    step: tuple[float, float]

    @property
    def nbytes(self) -> int:
        """Memory in bytes."""
        return self.heights.nbytes + self.crests.nbytes


@kept
def stored_texture(
    texture: HeightField, step: tuple[float, float], columns: int, scale: float, finest: int = FINER
) -> StoredTexture:
    """Return `texture` on a lattice.

    step: distance of its cells along and across, m. The period across is a whole number of steps, or a step is a whole
        number of periods.
    columns: largest number of cells along a finger, at any of its directions.
    scale: by which heights are divided, m.
    finest: most places per cell along and across, a power of two.
    """
    span = math.ceil(texture.period / step[0]) + -(-columns // WIDE) * WIDE + 1 + 2 * BEFORE
    whole = max(1, round(texture.across / step[1]))
    finer = finer_places(span * whole, (finest, finest if texture.slope_across else 1))
    heights = cell_means(texture, step, finer, (span, whole), scale)
    shape = np.array([whole, *finer, span * whole, span], dtype=np.int64)
    tops = np.empty((whole, span), np.float32)
    highest_tops(heights, shape, tops)
    periods = texture.period, texture.across
    return StoredTexture(heights, crests_of(tops), shape, texture.period / step[0], float(tops.max()), periods, step)


def finer_places(cells: int, finest: tuple[int, int]) -> tuple[int, int]:
    """Return the places per cell of a texture of `cells` cells, along and across: powers of two, at most `finest`."""
    wanted = list(finest)
    while wanted[0] * wanted[1] * cells > MOST_PLACES and wanted[0] > 1:
        wanted[int(wanted[1] == wanted[0])] //= 2
    return wanted[0], wanted[1]


def cell_means(
    texture: HeightField,
    step: tuple[float, float],
    finer: tuple[int, int],
    counts: tuple[int, int],
    scale: float,
) -> Floats:
    """Return the means of the texture over cells, in the order [place in a cell across, along, row, column].

    counts: cells along (enough that no index wraps) and across (one period).
    The mean over a cell is that of the places in it; places on its edge count half.
    """
    along, rows = counts[0] * finer[0], counts[1] * finer[1]
    edges, before = (finer[0] // 2, finer[1] // 2), BEFORE * finer[0]
    x = np.asarray(np.arange(-before - edges[0], along + edges[0] - before) * (step[0] / finer[0]), np.float64)
    y = np.asarray(np.arange(rows) * (texture.across / rows), np.float64)
    means = np.empty((finer[1], finer[0], counts[1], counts[0]), np.float32)
    lines = texture.lines(x)
    together = max(1, PLACES_TOGETHER // (along * finer[1]))
    for first in range(0, counts[1], together):
        end = min(first + together, counts[1])
        near = np.arange(first * finer[1] - edges[1], end * finer[1] + edges[1]) % rows
        heights = lines(y[near])
        heights /= np.float32(scale)
        heights = running_mean(running_mean(heights.T, finer[0], along).T, finer[1], (end - first) * finer[1])
        split = heights.reshape(end - first, finer[1], counts[0], finer[0])
        means[:, :, first:end] = split.transpose(1, 3, 0, 2)
    return means.ravel()


def running_mean(heights: Floats, places: int, count: int) -> Floats:
    """Return the means over `places` + 1 rows of `heights` from each of the first `count` rows on.

    The first and the last row of each mean count half. One place is its own mean.
    """
    if places == 1:
        return heights
    total = 0.5 * (heights[:count] + heights[places : places + count])
    for move in range(1, places):
        total += heights[move : move + count]
    total /= np.float32(places)
    return np.asarray(total)


def crests_of(tops: Floats) -> Floats:
    """Return the highest of `tops` over the WIDE cells from each cell on; tops: of each cell [rows, columns]."""
    reach, found = 1, np.pad(tops, ((0, 0), (0, WIDE)), "edge")
    while reach < WIDE:
        found[:, :-reach] = np.maximum(found[:, :-reach], found[:, reach:])
        reach *= 2
    return np.ascontiguousarray(found[:, : tops.shape[1]])
