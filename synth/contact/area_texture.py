"""The heights of a texture as `area_grid` reads them: means over cells, at several places per cell.

Stage   CONTACT.
Model   h2 is the mean of the texture over the cell of a point of the finger. It is stored at FINER places per cell
        along and across, in the order [place in a cell across, along, row, column], so that the neighbours of a point
        are its neighbours in memory. The stored columns reach beyond a period by the length of the finger, so no
        index wraps.
Limits  A texture is stored once for all directions of a finger; the most recently used ones are kept.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from synth.contact.area_solver import WIDE
from synth.surfaces.height_field import HeightField

Floats = np.ndarray[Any, np.dtype[np.float32]]
Indices = np.ndarray[Any, np.dtype[np.int64]]

WAVE, COARSE_WAVE = (
    48,
    16,
)  # places of the texture per shortest wave: a line between two errs by 0.2 or 2 % of that wave
FINER = (1, 2, 4, 8)  # places per cell that are tried
MOST_PLACES = 1 << 25  # of the texture: 128 MB
PLACES_TOGETHER = 1 << 18  # that are computed together: 1 MB
KEPT = 3  # stored textures: a scene, the one before a change, and a coarser lattice


@dataclass(frozen=True, slots=True)
class StoredTexture:
    """A texture on the lattice of a finger; heights are relative to the scale of the solver.

    heights: float32, see the module.
    crests: float32 [rows, columns], the highest place of the texture from each cell on, over the length of a block.
    shape: int64 [5], see `area_solver.ROWS`.
    columns: cells per period along.
    highest: the highest place.
    period: along and across, m.
    """

    heights: Floats
    crests: Floats
    shape: Indices
    columns: float
    highest: float
    period: tuple[float, float]

    @property
    def nbytes(self) -> int:
        """Memory in bytes."""
        return self.heights.nbytes + self.crests.nbytes


@lru_cache(KEPT)
def stored_texture(
    texture: HeightField, step: tuple[float, float], columns: int, scale: float, wave: int = WAVE
) -> StoredTexture:
    """Return `texture` on a lattice.

    step: distance of its cells along and across, m. The period across is whole steps, or a step whole periods.
    columns: cells of the longest finger.
    scale: by which heights are divided, m.
    wave: places per shortest wave.
    """
    span = math.ceil(texture.period / step[0]) + -(-columns // WIDE) * WIDE + 1
    whole = max(1, round(texture.across / step[1]))
    finer = finer_places(texture, step, (span, whole), wave)
    heights = cell_means(texture, step, finer, (span, whole), scale)
    shape = np.array([whole, *finer, span * whole, span], dtype=np.int64)
    crests = crests_of(heights.reshape(*finer[::-1], whole, span))
    periods = texture.period, texture.across
    return StoredTexture(heights, crests, shape, texture.period / step[0], float(heights.max()), periods)


def finer_places(
    texture: HeightField, step: tuple[float, float], counts: tuple[int, int], places: int
) -> tuple[int, int]:
    """Return the places of the texture per cell, along and across, within MOST_PLACES.

    step: distance of the points along and across, m.
    counts: cells of the stored texture along and across.
    places: per shortest wave.
    """
    tall = math.pi * (texture.extent[1] - texture.extent[0])  # over the slope: the period of a sinusoid
    wanted = []
    for slope, cell in zip((texture.slope_bound, texture.slope_across), step, strict=True):
        wave = tall / max(slope, 1e-12)
        wanted.append(next((one for one in FINER if one * wave >= places * cell), FINER[-1]))
    while wanted[0] * wanted[1] * counts[0] * counts[1] > MOST_PLACES and max(wanted) > 1:
        wanted[0 if wanted[0] >= wanted[1] else 1] //= 2
    return wanted[0], wanted[1]


def cell_means(
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
    edges = finer[0] // 2, finer[1] // 2
    x = np.asarray(np.arange(-edges[0], along + edges[0]) * (step[0] / finer[0]), np.float64)
    y = np.asarray(np.arange(rows) * (texture.across / rows), np.float64)
    means = np.empty((finer[1], finer[0], counts[1], counts[0]), np.float32)
    together = max(1, PLACES_TOGETHER // (along * finer[1]))
    for first in range(0, counts[1], together):
        end = min(first + together, counts[1])
        near = np.arange(first * finer[1] - edges[1], end * finer[1] + edges[1]) % rows
        heights = texture.lattice(x, y[near])
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
