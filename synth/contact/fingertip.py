"""The contact of a fingertip: eq. 1 over an area, of ridges that are curved and unequal on a round finger.

Model   The fingertip is a field of ridges (`ridge_field`) on a paraboloid, sampled at points in columns across the
        scan. The texture does not vary across the scan, so it meets all points of a column at one height h2. z solves

            F(z) = sum over the points of max(h1 + h2(x - p) - z, 0) dA / (L0 W0) = w / k(w)

        L0 and W0 are the length and width of the footprint on a flat plate at 1 N, and k is that of eqs 4-5 at L0: its
        area L0^2 becomes L0 W0. The footprint is an oval that grows with the load, and the pressure falls to zero at
        its edge. The radii follow from L0 and W0: at 1 N the outermost crests touch there. The fingertip ends where an
        oval of twice L0 and W0 ends, which a load of 5 N does not reach.
        `fingertip_solver` solves it.
Source  Fagiani & Barbieri (2016), eqs 1, 4, 5, for the foundation; Johnson, Contact Mechanics (1985), sec. 4.3, for a
        paraboloid on it. The radii and the points are this project's.
Limits  The points are the model itself; COLUMNS and ROWS set their number. A texture whose steepest part needs more
        columns has MOST_COLUMNS. The foundation is independent at each point (Winkler).
"""

from __future__ import annotations

import math
from collections.abc import Hashable
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Self

import numpy as np

from synth.arrays import Array
from synth.contact.fingertip_solver import FingertipGrid
from synth.contact.full_contact import FullContact
from synth.contact.geometry import Geometry
from synth.contact.line import MIDDLE, Line
from synth.contact.load_balance import Contact, PhaseSolver
from synth.contact.stiffness import Stiffness
from synth.errors import Fault, SceneError
from synth.surfaces.height_field import HeightField
from synth.surfaces.profile import Profile
from synth.surfaces.ridge_field import RidgeField, turned_back

if TYPE_CHECKING:
    from synth.contact.area_grid import AreaGrid

REFERENCE_LOAD = 1.0  # N: the load of the nominal footprint (the paper takes 1 cm^2 for 1 N); an unverified default
REACH = 2.0  # the oval in which there are points, relative to the nominal footprint
COLUMNS = 16, 8  # per mean ridge, and per wave of the texture; with twice as many the strongest line changes by 1 %
ROWS = 8, 16  # across the scan, per mean ridge and per period: a curved ridge must not pass a crest between two rows
FEWEST_COLUMNS, FEWEST_ROWS = 96, 24  # of the smallest fingertip
MOST_COLUMNS, MOST_ROWS = 4096, 1024  # 0.1 ms per solution, 80 MB; a period that needs more columns is refused
GRIDS_KEPT = 4  # a scene is prepared more than once; one takes 1 to 80 MB
SMALLER_KEPT = 2  # the same with smaller cells: a file solves the last two sizes at several loads; up to 80 MB each


@dataclass(frozen=True, slots=True)
class Footprint:
    """The fingertip on a flat plate at 1 N.

    length, width: along and across the scan, m.
    depth: height of the paraboloid between its top and the edge of the footprint, m.
    """

    length: float
    width: float
    depth: float

    @property
    def reach(self) -> tuple[float, float]:
        """Length and width (m) of the region in which the fingertip may touch."""
        return REACH * self.length, REACH * self.width

    @classmethod
    def of(cls, length: float, width: float, ridge_amplitude: float, stiffness: Stiffness) -> Footprint:
        """Return the footprint of `length` and `width` (m); stiffness: on a flat plate, at `length`."""
        wanted = 4.0 / math.pi * stiffness.indentation(REFERENCE_LOAD)  # mean of max(h - z, 0) over the oval, m
        low, high = 0.0, 2.0 * wanted + 2.0 * ridge_amplitude
        for _ in range(100):  # bisection: the mean rises with the depth
            depth = 0.5 * (low + high)
            low, high = (depth, high) if _mean_above(depth, ridge_amplitude) < wanted else (low, depth)
        return cls(length, width, 0.5 * (low + high))

    def drop(self, x: Array, y: Array, direction: float = 0.0) -> Array:
        """Return how far the paraboloid lies below its top (m) at every pair of `x` and `y` (m): [columns, rows].

        direction: angle by which the fingertip is turned about its middle, rad.
        """
        along, across = turned_back(x, y, direction)
        return np.asarray(self.depth * ((2.0 * along / self.length) ** 2 + (2.0 * across / self.width) ** 2))


def _mean_above(depth: float, amplitude: float) -> float:
    """Return the mean over the oval of the heights above a plate that only the crests at its edge touch (m).

    depth: of the paraboloid at the edge, m.
    amplitude: of the ridges, m.
    Equal areas of a paraboloid have equal drops, so a place at the angle u of its ridge contributes
    max(depth - amplitude (1 - cos u), 0)^2 / (2 depth). Its mean over u is a closed form.
    """
    angle = math.pi if depth >= 2.0 * amplitude else math.acos(1.0 - depth / amplitude)
    over = depth - amplitude
    total = (over**2 + 0.5 * amplitude**2) * angle
    total += 2.0 * over * amplitude * math.sin(angle) + 0.25 * amplitude**2 * math.sin(2.0 * angle)
    return total / (2.0 * math.pi * depth)


def area_grid(
    field: RidgeField, footprint: Footprint, texture: HeightField, scale: float, line: Line, coarser: float = 1.0
) -> AreaGrid:
    """Return the cells of `field` on `footprint` over a height field.

    scale: of the heights in the solver, m.
    line: position of the finger across, and its direction.
    coarser: factor on the size of the cells.
    """
    from synth.contact.area_contact import finger_grid, lattice_step  # only a height field needs its kernels

    size = footprint.reach
    step = lattice_step(texture, size, field.period, coarser)

    def heights(x: Array, y: Array) -> Array:
        return field.heights(x, y, line.direction) - footprint.drop(x, y, line.direction)

    def shares(x: Array, y: Array, _size: tuple[float, float]) -> Array:
        along, across = (c * x + s * y) / size[0], (c * y - s * x) / size[1]
        return np.asarray(along**2 + across**2 < 0.25, np.float64)

    c, s = math.cos(line.direction), math.sin(line.direction)
    box = math.hypot(size[0] * c, size[1] * s), math.hypot(size[0] * s, size[1] * c)
    area = footprint.length * footprint.width
    return finger_grid(heights, shares, box, max(size), step, (0.0, line.y), area, texture, scale, coarser)


def require_columns(footprint: Footprint, texture: Profile) -> None:
    """Raise SceneError where `texture` is too fine for a fingertip that meets it along one line."""
    length = REACH * footprint.length
    if not isinstance(texture, HeightField) and length * COLUMNS[1] / texture.period > MOST_COLUMNS:
        shortest = COLUMNS[1] * length / MOST_COLUMNS
        allowed = (
            f"a period of {math.ceil(1e6 * shortest)} um or more under a fingertip of {1e3 * footprint.length:.4g} mm"
        )
        hint = 'Write a longer period, a shorter finger.contact_length, or finger.kind "comb".'
        raise SceneError([Fault("/texture", f"a period of {1e6 * texture.period:.4g} um", allowed, hint)])


@lru_cache(GRIDS_KEPT)
def fingertip_grid(
    field: RidgeField, footprint: Footprint, texture: Profile, scale: float, line: Line = MIDDLE, coarser: float = 1.0
) -> PhaseSolver:
    """Return the points of `field` on `footprint` over `texture`.

    scale: of the heights in the solver, m.
    line, coarser: as of `area_grid`, on a height field.
    """
    if isinstance(texture, HeightField):
        return area_grid(field, footprint, texture, scale, line, coarser)
    length, width = REACH * footprint.length, REACH * footprint.width
    steepest = max(texture.slope_bound, 1e-9)
    wave = math.pi * (texture.extent[1] - texture.extent[0]) / steepest  # the period of a sinusoid
    along = max(COLUMNS[0] / field.period, COLUMNS[1] / max(min(wave, texture.period), 1e-9))
    across = max(ROWS[0] / field.period, ROWS[1] / max(texture.equivalent().period, 1e-9))
    columns = min(max(FEWEST_COLUMNS, math.ceil(along * length)), MOST_COLUMNS)
    rows = min(max(FEWEST_ROWS, math.ceil(across * width)), MOST_ROWS)
    x, y = _middles(length, columns), _middles(width, rows)
    inside = (2.0 * x / length)[:, np.newaxis] ** 2 + (2.0 * y / width)[np.newaxis] ** 2 < 1.0
    heights = np.where(inside, field.heights(x, y) - footprint.drop(x, y), -np.inf)
    cell = (length / columns) * (width / rows) / (footprint.length * footprint.width)
    return FingertipGrid.of(x, heights, texture, cell, scale)


smaller_grid = lru_cache(SMALLER_KEPT)(fingertip_grid.__wrapped__)


def _middles(length: float, count: int) -> Array:
    """Return the middles of `count` equal parts of `length` (m) about 0."""
    return np.asarray((np.arange(count) + 0.5) * (length / count) - 0.5 * length)


@dataclass(frozen=True)
class FingertipContact(Contact):
    """A contact of a fingertip: its points stay the same at every load.

    geometry: with the mean ridges, over the nominal length L0; the texture is a profile.
    stiffness: of eqs 4-5 at L0.
    field: the ridges.
    footprint: on a flat plate at 1 N.
    line: where the finger stands on a height field.
    coarser: factor on the size of the cells on a height field.
    refines: whether `refined` makes them smaller, which files require.
    """

    of_one_line = False
    settles = 0.25  # as of `area_contact.CombOnArea`
    field: RidgeField
    footprint: Footprint
    line: Line = MIDDLE
    coarser: float = 1.0
    refines: bool = False

    @classmethod
    def of_field(
        cls,
        geometry: Geometry,
        stiffness: Stiffness,
        field: RidgeField,
        width: float,
        line: Line = MIDDLE,
        coarser: float = 1.0,
        refines: bool = False,
    ) -> FingertipContact:
        """Return the contact; SceneError where its texture is too fine.

        geometry, stiffness: over the nominal length.
        width: of the footprint at 1 N, m.
        line, coarser, refines: as of the class.
        """
        geometry = geometry.as_profile()
        # eqs 4-5 require a period of the plate, too, which has none: that of the ridges is chosen
        flat = replace(geometry, profile=None, texture_amplitude=0.0, texture_period=geometry.ridge_period)
        law = Stiffness.of_contact(flat, stiffness.contact_modulus)
        law = replace(law, given=stiffness.given)
        if geometry.ridge_amplitude == 0.0:  # eqs 4-5 have no stiffness for two flat surfaces
            law = stiffness
        footprint = Footprint.of(geometry.contact_length, width, geometry.ridge_amplitude, law)
        assert geometry.profile is not None
        require_columns(footprint, geometry.profile)
        return cls(geometry, stiffness, field, footprint, line, coarser, refines)

    @cached_property
    def grid(self) -> PhaseSolver:
        """Its points; on a height field, its cells."""
        texture, scale = self.geometry.profile, self.geometry.height_scale
        assert texture is not None
        made = fingertip_grid if self.coarser >= 1.0 else smaller_grid
        return made(self.field, self.footprint, texture, scale, self.line, self.coarser)

    def middle_line(self, places: Array) -> Array:
        """Return the height of the fingertip (m) at x = `places` (m, from the middle) on the line y = 0."""
        row = np.zeros(1)
        return np.asarray(self.field.heights(places, row)[:, 0] - self.footprint.drop(places, row)[:, 0])

    def refined(self) -> Self | None:
        """Return the contact with cells half as large, if it refines; None along a line: the points are the model."""
        return self.halved() if self.refines else None

    def halved(self) -> Self | None:
        """Return the contact with cells half as large; None where they would be too many, and along a line."""
        if not isinstance(self.geometry.profile, HeightField):
            return None
        from synth.contact.area_contact import smaller_cells

        return smaller_cells(self, self.footprint.reach, self.field.period)

    def as_profile(self) -> Self:
        """Return the contact itself: its texture is a profile."""
        return self

    def closed(self, load: float) -> FullContact | None:
        """Return None: the closed form is that of a flat comb."""
        return None

    def width_at(self, load: float) -> float:
        """Return W0 (m): areas are relative to L0 W0 at every load."""
        return self.footprint.width

    @property
    def key(self) -> Hashable:
        """Everything that z depends on, for a cache."""
        parts = self.geometry, self.stiffness, self.field, self.footprint
        return "fingertip", *parts, self.line, self.coarser, self.refines

    def heights(self, phases: Array, loads: Array, path: Array | None = None) -> Array:
        """Return z (m) at each of `phases` (turns) and `loads` (N, above 0), on its line or along a path.

        path: how far the texture has moved across (m), and the direction of the finger (rad) [2, phases].
        """
        if path is None:
            return super().heights(phases, loads)
        from synth.contact.area_path import heights_along

        return heights_along(self, phases, loads, path)

    def grid_at(self, direction: float) -> AreaGrid:
        """Return its cells on a height field at another direction (rad)."""
        texture, line = self.geometry.profile, Line(self.line.y, direction)
        assert isinstance(texture, HeightField)
        return area_grid(self.field, self.footprint, texture, self.geometry.height_scale, line, self.coarser)
