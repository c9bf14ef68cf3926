"""Fingers on a height field: which points they have, and the contact of a comb of ridges over an area.

Stage   CONTACT.
Model   The points of a fingertip are those of `fingertip`. A comb is its ridges over a length L and, as eq. 4 takes it,
        a width L: h1 = -a1 cos(2 pi x / lambda1), the same across. Both are sampled on one lattice with the texture,
        and `area_grid` solves eq. 1 as a sum over the points, with k of eqs 4-5.
Source  Fagiani & Barbieri (2016), eqs 1, 2, 4, 5. The lattice is this project's.
Limits  The points are the model. Their distance follows from the ridges and from the shortest wave of the texture,
        until there are MOST_POINTS; finer waves are then felt through their mean over a cell.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from synth.arrays import Array
from synth.contact.area_grid import AreaGrid
from synth.contact.area_path import heights_along
from synth.contact.area_texture import COARSE_WAVE, MOST_PLACES, WAVE, stored_texture
from synth.contact.full_contact import FullContact
from synth.contact.geometry import Geometry
from synth.contact.line import MIDDLE, Line
from synth.contact.load_balance import Contact, PhaseSolver
from synth.errors import CannotRender
from synth.surfaces.height_field import HeightField
from synth.surfaces.ridge_field import turned_back

POINTS_A_WAVE = 8  # of the texture; with twice as many the strongest line of random dots changes by less than 1 %
POINTS_A_RIDGE = 64  # of a comb, along: its hard ends and steep flanks need more than a fingertip's
MOST_POINTS = 1 << 20  # of a finger: 4 MB, 0.3 ms per solution
FEWEST_ROWS = 16  # of a comb
COARSEST = 4.0  # times as far apart the points may be to hold the texture in memory; on a fingertip 4 along a ridge

Heights = Callable[[Array, Array], Array]


def lattice_step(
    texture: HeightField, size: tuple[float, float], along: float, across: float, coarser: float = 1.0
) -> tuple[float, float]:
    """Return the distance (m) of points along and across.

    size: of the finger, m.
    along, across: points per metre that its ridges need.
    coarser: factor on both distances.

    A period across is whole steps, or a step whole periods: the mean over those does not vary across.
    Raises CannotRender if the texture would take more than MOST_PLACES with points COARSEST times as far apart.
    """
    tall = math.pi * (texture.extent[1] - texture.extent[0])  # over the slope: the period of a sinusoid
    wanted = [
        max(own, POINTS_A_WAVE * slope / tall if tall > 0.0 else 0.0)
        for own, slope in ((along, texture.slope_bound), (across, texture.slope_across))
    ]
    points = wanted[0] * size[0] * wanted[1] * size[1] / MOST_POINTS
    places = wanted[0] * (texture.period + math.hypot(*size)) * max(1.0, wanted[1] * texture.across) / MOST_PLACES
    if places > COARSEST**2:
        raise CannotRender(
            f"A finger whose points are {1e6 / wanted[0]:.3g} um by {1e6 / wanted[1]:.3g} um apart needs too much "
            f"memory on a texture that repeats after {texture.period:.4g} m by {texture.across:.4g} m. Write a smaller "
            "texture, a longer finger.contact_length or a longer finger.ridge_period."
        )
    crowded = coarser * math.sqrt(max(1.0, points, places))
    rows, periods = math.ceil(texture.across * wanted[1] / crowded), math.floor(crowded / (texture.across * wanted[1]))
    return crowded / wanted[0], texture.across * max(1, periods) / max(1, rows)


def wave_places(coarser: float) -> int:
    """Return the places of the texture per shortest wave, for points that are `coarser` times as far apart."""
    return WAVE if coarser == 1.0 else COARSE_WAVE


def finger_grid(
    heights: Heights, size: tuple[float, float], widest: float, step: tuple[float, float], middle: tuple[float, float],
    area: float, texture: HeightField, scale: float, wave: int,
) -> AreaGrid:  # fmt: skip
    """Return the points of a finger.

    heights: heights (m) at every pair of x and y (m) from its middle: [len(x), len(y)]; -inf: there is no finger.
    size: length and width of the lattice, m.
    widest: length of the lattice at any direction of the finger, m.
    step: as of `lattice_step`.
    middle: place of the middle of the finger, x and y, m.
    area: A0, m^2.
    scale: m.
    wave: places of the texture per shortest wave.
    """
    columns, rows = (max(1, round(whole / one)) for whole, one in zip(size, step, strict=True))
    x = np.asarray((np.arange(columns) + 0.5 - 0.5 * columns) * step[0])
    y = np.asarray((np.arange(rows) + 0.5 - 0.5 * rows) * step[1])
    points = np.ascontiguousarray(heights(x, y).T)
    begin = float(x[0]) + middle[0], float(y[0]) + middle[1]
    stored = stored_texture(texture, step, math.ceil(widest / step[0]), scale, wave)
    return AreaGrid.of(points, begin, stored, step[0] * step[1] / area, scale)


@dataclass(frozen=True)
class CombOnArea(Contact):
    """A comb of ridges on a height field.

    geometry: over the length L.
    stiffness: of eqs 4-5 at L.
    line: where the comb stands.
    coarser: factor on the distance of the points.
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
        """Return its points at another direction (rad)."""
        return comb_grid(self.geometry, Line(self.line.y, direction), self.coarser)

    def refined(self) -> None:
        """Return None: the points are the model."""

    def as_profile(self) -> Self:
        """Return the contact itself."""
        return self

    def closed(self, load: float) -> FullContact | None:
        """Return None: the closed form is that of two cosines."""
        return None


def comb_grid(geometry: Geometry, line: Line = MIDDLE, coarser: float = 1.0) -> AreaGrid:
    """Return the points of a comb on the height field of `geometry`, whose x begins where a comb along x begins.

    line: where its middle stands across, and its direction.
    coarser: factor on the distance of the points.
    """
    texture, length = geometry.profile, geometry.contact_length
    assert isinstance(texture, HeightField)
    step = lattice_step(
        texture, (length, length), POINTS_A_RIDGE / min(geometry.ridge_period, length), FEWEST_ROWS / length, coarser
    )
    along = length / max(1, math.ceil(length / step[0] - 1e-9))  # the ends of a comb are hard
    width = max(1, round(length / step[1])) * step[1]

    def heights(x: Array, y: Array) -> Array:
        u, v = turned_back(x, y, line.direction)
        inside = (np.abs(u) < 0.5 * length) & (np.abs(v) < 0.5 * width)
        return np.where(inside, geometry.finger(u + 0.5 * length), -np.inf)

    c, s = abs(math.cos(line.direction)), abs(math.sin(line.direction))
    box, widest = (length * c + width * s, length * s + width * c), math.hypot(length, width)
    middle = 0.5 * length, line.y
    scale, wave = geometry.height_scale, wave_places(coarser)
    return finger_grid(heights, box, widest, (along, step[1]), middle, length * width, texture, scale, wave)
