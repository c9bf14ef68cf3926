"""Fingers on a height field: which cells they have, and the contact of a comb of ridges over an area.

Stage   CONTACT.
Model   The heights of a fingertip are those of `fingertip`. A comb is its ridges over a length L and, as eq. 4 takes
        it, a width L: h1 = -a1 cos(2 pi x / lambda1), the same across. Both are divided into cells of one size with
        the texture, and `area_grid` solves eq. 1 as a sum over the cells, with k of eqs 4-5.
Source  Fagiani & Barbieri (2016), eqs 1, 2, 4, 5. The lattice is this project's.
Limits  The size of the cells follows from the ridges and from the shortest wave of the texture, until there are
        MOST_CELLS; finer waves are then felt through their mean over a cell.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from synth.arrays import Array
from synth.contact.area_grid import BESIDE, NOWHERE, AreaGrid
from synth.contact.area_path import heights_along
from synth.contact.area_solver import ROW
from synth.contact.area_texture import MOST_PLACES, Flags, stored_texture
from synth.contact.full_contact import FullContact
from synth.contact.geometry import Geometry
from synth.contact.line import MIDDLE, Line
from synth.contact.load_balance import Contact, PhaseSolver
from synth.errors import Fault, SceneError
from synth.surfaces.height_field import HeightField
from synth.surfaces.ridge_field import turned_back

CELLS_A_WAVE = 8  # of the texture, along and across
CELLS_A_RIDGE = 12  # the same of the ridges, which may lie in any direction
FEWEST_CELLS = 24  # over the length of a finger
MOST_CELLS = 1 << 20  # of a finger: 12 MB
COARSEST = 4.0  # times as large the cells may be to hold the texture in memory; on a fingertip 3 a ridge

Heights = Callable[[Array, Array], Array]
Inside = Callable[[Array, Array], Flags]


def lattice_step(
    texture: HeightField, size: tuple[float, float], ridge: float, coarser: float = 1.0
) -> tuple[float, float]:
    """Return the size of a cell (m) along and across.

    size: of the finger, m.
    ridge: period of its ridges, m.
    coarser: factor on both sizes.

    A period across is whole steps, or a step whole periods: the mean over those does not vary across.
    Raises SceneError if the texture would take more than MOST_PLACES with cells COARSEST times as large.
    """
    tall = math.pi * (texture.extent[1] - texture.extent[0])  # over the slope: the period of a sinusoid
    own = max(CELLS_A_RIDGE / ridge, FEWEST_CELLS / min(size))
    wanted = [
        max(own, CELLS_A_WAVE * slope / tall if tall > 0.0 else 0.0)
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


def finger_grid(
    heights: Heights, inside: Inside, size: tuple[float, float], widest: float, step: tuple[float, float],
    middle: tuple[float, float], area: float, texture: HeightField, scale: float,
) -> AreaGrid:  # fmt: skip
    """Return the cells of a finger.

    heights: heights (m) at every pair of x and y (m) from its middle: [len(x), len(y)], also beyond its edge.
    inside: whether there is a finger, at the same places.
    size: length and width of the lattice, m.
    widest: length of the lattice at any direction of the finger, m.
    step: as of `lattice_step`.
    middle: place of the middle of the finger, x and y, m.
    area: A0, m^2.
    scale: m.
    """
    own = step[0], ROW * step[1]
    columns, rows = (max(1, round(whole / one)) for whole, one in zip(size, own, strict=True))
    x = np.asarray((np.arange(-BESIDE, columns + BESIDE) + 0.5 - 0.5 * columns) * own[0])
    y = np.asarray((np.arange(-1, rows + 1) + 0.5 - 0.5 * rows) * own[1])
    begin = float(x[BESIDE]) + middle[0], float(y[1]) + middle[1]
    stored = stored_texture(texture, step, math.ceil(widest / step[0]), scale)
    there = inside(x[BESIDE:-BESIDE], y[1:-1]).T
    return AreaGrid.of(heights(x, y).T, there, begin, stored, own[0] * own[1] / area, scale)


@dataclass(frozen=True)
class CombOnArea(Contact):
    """A comb of ridges on a height field.

    geometry: over the length L.
    stiffness: of eqs 4-5 at L.
    line: where the comb stands.
    coarser: factor on the size of the cells.
    """

    of_one_line = False
    line: Line = MIDDLE
    coarser: float = 1.0

    @cached_property
    def grid(self) -> PhaseSolver:
        """Its points; the profile of its geometry is a height field."""
        return comb_grid(self.geometry, self.line, self.coarser)

    def heights(self, phases: Array, loads: Array, path: Array | None = None) -> Array:
        """Return z (m) on its line, or along a path; see `fingertip.FingertipContact.heights`."""
        if path is None:
            return super().heights(phases, loads)
        return heights_along(self, phases, loads, path)

    def grid_at(self, direction: float) -> AreaGrid:
        """Return its cells at another direction (rad)."""
        return comb_grid(self.geometry, Line(self.line.y, direction), self.coarser)

    def refined(self) -> None:
        """Return None: the cells are the model."""

    def as_profile(self) -> Self:
        """Return the contact itself."""
        return self

    def closed(self, load: float) -> FullContact | None:
        """Return None: the closed form is that of two cosines."""
        return None


def comb_grid(geometry: Geometry, line: Line = MIDDLE, coarser: float = 1.0) -> AreaGrid:
    """Return the cells of a comb on the height field of `geometry`, whose x begins where a comb along x begins.

    line: where its middle stands across, and its direction.
    coarser: factor on the size of the cells.
    """
    texture, length = geometry.profile, geometry.contact_length
    assert isinstance(texture, HeightField)
    step = lattice_step(texture, (length, length), geometry.ridge_period, coarser)
    along = length / max(1, math.ceil(length / step[0] - 1e-9))  # the ends of a comb are hard
    width = max(1, round(length / (ROW * step[1]))) * ROW * step[1]

    def heights(x: Array, y: Array) -> Array:
        return np.asarray(geometry.finger(turned_back(x, y, line.direction)[0] + 0.5 * length))

    def inside(x: Array, y: Array) -> Flags:
        u, v = turned_back(x, y, line.direction)
        return (np.abs(u) < 0.5 * length) & (np.abs(v) < 0.5 * width)

    c, s = abs(math.cos(line.direction)), abs(math.sin(line.direction))
    box, widest = (length * c + width * s, length * s + width * c), math.hypot(length, width)
    middle = 0.5 * length, line.y
    scale = geometry.height_scale
    grid = finger_grid(heights, inside, box, widest, (along, step[1]), middle, length * width, texture, scale)
    return replace(grid, cell=1.0 / int(np.sum(grid.finger[:, 0] > 0.5 * NOWHERE)))  # its edges are hard: A0 is kept
