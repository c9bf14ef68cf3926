"""Fingers on a height field: which cells they have, and the contact of a comb of ridges over an area.

Stage   CONTACT.
Model   The heights of a fingertip are those of `fingertip`. A comb covers a length L and, as in eq. 4, a width L. Its
        heights are h1 = -a1 cos(2 pi x / lambda1) and do not vary across. The finger is divided into cells, the texture
        into cells of nearly the same size. `area_grid` solves eq. 1 as a sum over the cells, with k of eqs 4-5.
Source  Fagiani & Barbieri (2016), eqs 1, 2, 4, 5. The lattice is this project's.
Limits  The size of the cells follows from the ridges and from the shortest wave of the texture, but there are at most
        MOST_CELLS. Shorter waves then count only by their mean over a cell.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import ClassVar, Self, TypeVar

import numpy as np

from synth.arrays import Array
from synth.contact.area_grid import BESIDE, OUTSIDE, AreaGrid, FingerRows
from synth.contact.area_path import MIDDLE, ContactOnArea, Line
from synth.contact.area_solver import ROW
from synth.contact.area_texture import FINER, FINER_OF_SMALLER, MOST_PLACES, stored_texture
from synth.contact.geometry import Geometry
from synth.contact.load_balance import Contact
from synth.errors import Fault, SceneError
from synth.response_cache import kept
from synth.surfaces.height_field import HeightField
from synth.surfaces.ridge_field import turned_back

CELLS_A_WAVE = 8  # per wave of the texture, along and across
CELLS_A_RANDOM_WAVE = 5  # the same for a random texture, whose waves err differently: acceleration errs by 2 % there
CELLS_A_RIDGE = 12  # per ridge, along and across, since ridges may lie in any direction
FEWEST_CELLS = 24  # over the length or the width of a finger, whichever is shorter
MOST_CELLS = 1 << 20  # of a finger: 16 MB
MOST_SMALLER = 8 << 20  # of a finger whose cells are smaller than usual, for a file: 134 MB
CELLS_TOGETHER = 1 << 18  # that are computed together: 2 MB an array
NARROW = 1e-4  # least extent of a cell across an edge, relative to its other extent: `beside_edge` divides by it
COARSEST = 4.0  # largest factor on the cells that keeps the texture in memory; a fingertip then has 3 cells per ridge

T = TypeVar("T", bound=Contact)
Heights = Callable[[Array, Array], Array]
Rims = Callable[[Array, Array, tuple[float, float]], Array]


def lattice_step(
    texture: HeightField, size: tuple[float, float], ridge: float, coarser: float = 1.0
) -> tuple[float, float]:
    """Return the size of a cell (m) along and across.

    size: of the finger, m.
    ridge: period of its ridges, m.
    coarser: factor on both sizes.

    A period across is a whole number of steps, or a step is a whole number of periods, whose mean does not vary across.
    Raises SceneError if the texture would take more than MOST_PLACES with cells COARSEST times as large.
    """
    tall = math.pi * (texture.extent[1] - texture.extent[0])  # divided by the slope: period of a sinusoid
    own = max(CELLS_A_RIDGE / ridge, FEWEST_CELLS / min(size))
    cells_a_wave = CELLS_A_RANDOM_WAVE if texture.random else CELLS_A_WAVE
    wanted = [
        max(own, cells_a_wave * slope / tall if tall > 0.0 else 0.0)
        for slope in (texture.slope_bound, texture.slope_across)
    ]
    cells = wanted[0] * size[0] * wanted[1] * size[1] / MOST_CELLS
    places = wanted[0] * (texture.period + math.hypot(*size)) * max(1.0, wanted[1] * texture.across) / MOST_PLACES
    if places > COARSEST**2:
        cell = f"{1e6 / wanted[0]:.3g} um by {1e6 / wanted[1]:.3g} um"
        value = f"a surface that repeats after {texture.period:.4g} m by {texture.across:.4g} m"
        allowed = f"{COARSEST**2 * MOST_PLACES:.2g} cells of this finger, {cell} each; the surface has {{}}"
        hint = "Write a smaller texture, a longer finger.contact_length or a longer finger.ridge_period."
        raise SceneError([Fault("/texture", value, allowed.format(f"{places * MOST_PLACES:.2g}"), hint)])
    crowded = coarser * math.sqrt(max(1.0, cells, places))
    rows, periods = math.ceil(texture.across * wanted[1] / crowded), math.floor(crowded / (texture.across * wanted[1]))
    return crowded / wanted[0], texture.across * max(1, periods) / max(1, rows)


def smaller_cells(contact: T, size: tuple[float, float], ridge: float) -> T | None:
    """Return `contact` with cells half as large along and across; None where they would be too many.

    size, ridge: as of `lattice_step`.
    """
    texture, coarser = contact.geometry.profile, 0.5 * contact.coarser  # type: ignore[attr-defined]
    assert isinstance(texture, HeightField)
    step = lattice_step(texture, size, ridge, coarser)
    cells = size[0] * size[1] / (step[0] * step[1] * ROW)
    places = (texture.period + math.hypot(*size)) * max(1.0, texture.across / step[1]) / step[0]
    if coarser < 1.0 and (cells > MOST_SMALLER or places > MOST_PLACES):
        return None
    return replace(contact, coarser=coarser)  # type: ignore[call-arg]


def finger_grid(
    heights: Heights, rims: Rims, size: tuple[float, float], widest: float, step: tuple[float, float],
    middle: tuple[float, float], area: float, texture: HeightField, scale: float, coarser: float,
) -> AreaGrid:  # fmt: skip
    """Return the cells of a finger.

    heights: heights (m) at every pair of x and y (m) from its middle: [len(x), len(y)], also beyond its edge.
    rims: see `AreaGrid.finger`, of each cell at x and y of its middle (m, any shape) and of its size (m).
    size: length and width that the cells must cover, m.
    widest: the largest length that they must cover at any direction of the finger, m.
    step: as of `lattice_step`.
    middle: place of the middle of the finger, x and y, m.
    area: A0, m^2.
    scale: m.
    coarser: factor on the size of the cells, already included in `step`.
    """
    own = step[0], ROW * step[1]
    columns, rows = (math.ceil(whole / one) + 1 for whole, one in zip(size, own, strict=True))
    x = np.asarray((np.arange(-BESIDE, columns + BESIDE) + 0.5 - 0.5 * columns) * own[0])
    y = np.asarray((np.arange(-1, rows + 1) + 0.5 - 0.5 * rows) * own[1])
    begin = float(x[BESIDE]) + middle[0], float(y[1]) + middle[1]
    finest = FINER if coarser >= 1.0 else FINER_OF_SMALLER
    stored = stored_texture(texture, step, math.ceil(widest / step[0]) + 1, scale, finest)
    finger, together = FingerRows(rows, columns), max(1, CELLS_TOGETHER // columns)
    for first in range(0, rows, together):
        near = y[first : first + together + 2]
        middles = x[BESIDE:-BESIDE] + own[0] * finger.moved[first : first + together, np.newaxis]
        finger.put(first, heights(x, near).T / scale, rims(middles, near[1:-1, np.newaxis], own))
    return AreaGrid.of(finger, begin, stored, own[0] * own[1] / area, scale)


class CombOnArea(ContactOnArea):
    """A comb of ridges on a height field, with the stiffness of eqs 4-5 at L."""

    hard_edges: ClassVar[bool] = True

    @property
    def own_area(self) -> float:
        """L^2 (m^2), to which its stiffness belongs."""
        return self.geometry.contact_length**2

    def own_heights(self, x: Array, y: Array) -> Array:
        """Return its height (m) at every pair of `x` and `y` (m) from its middle, along and across it."""
        heights = self.geometry.finger(x + 0.5 * self.geometry.contact_length)
        return np.repeat(heights[:, np.newaxis], len(y), axis=1)

    @property
    def lattice(self) -> tuple[tuple[float, float], float]:
        """Its length and width, and the period of its ridges (m)."""
        length = self.geometry.contact_length
        return (length, length), self.geometry.ridge_period

    def halved(self) -> Self | None:
        """See `Contact`."""
        return smaller_cells(self, *self.lattice)

    def grid_at(self, direction: float) -> AreaGrid:
        """Return its cells at another direction (rad)."""
        return comb_grid(self.geometry, Line(self.line.y, direction), self.coarser)


@kept
def comb_grid(geometry: Geometry, line: Line = MIDDLE, coarser: float = 1.0) -> AreaGrid:
    """Return the cells of a comb on the height field of `geometry`; x = 0 is where a comb along x begins.

    line: position of its middle across, and its direction.
    coarser: factor on the size of the cells.
    """
    texture, length = geometry.profile, geometry.contact_length
    assert isinstance(texture, HeightField)
    step = lattice_step(texture, (length, length), geometry.ridge_period, coarser)
    c, s = math.cos(line.direction), math.sin(line.direction)

    def heights(x: Array, y: Array) -> Array:
        return np.asarray(geometry.finger(turned_back(x, y, line.direction)[0] + 0.5 * length))

    def rims(x: Array, y: Array, size: tuple[float, float]) -> Array:
        along, across = 0.5 * length - np.abs(c * x + s * y), 0.5 * length - np.abs(c * y - s * x)
        return rims_of(beside_edge(along, c * size[0], s * size[1]) * beside_edge(across, s * size[0], c * size[1]))

    box, widest = length * (abs(c) + abs(s)), math.sqrt(2.0) * length
    middle, area, scale = (0.5 * length, line.y), length**2, geometry.height_scale
    grid = finger_grid(heights, rims, (box, box), widest, step, middle, area, texture, scale, coarser)
    return replace(grid, cell=1.0 / float(np.sum(grid.shares)))  # A0 is kept


def rims_of(shares: Array) -> Array:
    """Return the rims of the cells of a finger of one size; shares: of each cell that belongs to it."""
    return np.where(shares > 0.0, -shares, OUTSIDE)


def beside_edge(distance: Array, along: float, across: float) -> Array:
    """Return the share of a cell on the inner side of a straight edge.

    distance: of its middle from the edge, m; positive inside.
    along, across: extents of its two sides in the direction of that distance, m, of any sign.

    Over the cell, the distance from the edge is the sum of two uniformly distributed distances.
    """
    wide, narrow = sorted((0.5 * abs(along), 0.5 * abs(across)), reverse=True)
    narrow = max(narrow, NARROW * wide)
    ends = ((wide + narrow, 1.0), (wide - narrow, -1.0), (narrow - wide, -1.0), (-wide - narrow, 1.0))
    rising = sum(sign * np.maximum(distance + end, 0.0) ** 2 for end, sign in ends)
    return np.clip(rising / (8.0 * wide * narrow), 0.0, 1.0)
