"""The contact of a fingertip: eq. 1 over an area, of ridges that are curved and unequal on a round finger.

Model   The fingertip is a field of ridges (`ridge_field`) on a paraboloid (`footprint`). z solves

            F(z) = integral of max(h1 + h2(x - p) - z, 0) dA / (L0 W0) = w / k(w)

        L0 and W0 are the length and width of the footprint on a flat plate at 1 N, and k is that of eqs 4-5 at L0: its
        area L0^2 becomes L0 W0. The footprint is an oval that grows with the load, and the pressure falls to zero at
        its edge. `fingertip_solver` solves it on a texture along a line, `area_grid` on a height field.
Source  Fagiani & Barbieri (2016), eqs 1, 4, 5.
Limits  Columns, nodes and cells are numerics: `halved` brings them closer together, down to FINEST. The foundation is
        independent at each point (Winkler).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from dataclasses import field as dataclass_field
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar, Self

import numpy as np

from synth.arrays import Array
from synth.contact.area_path import BEGINS_OVER_AREA, MIDDLE, ContactOnArea, Line
from synth.contact.finger_columns import COLUMNS, FingerSurface
from synth.contact.fingertip_solver import FingertipGrid, texture_nodes
from synth.contact.footprint import Footprint
from synth.contact.geometry import Geometry
from synth.contact.load_balance import Contact, PhaseSolver
from synth.contact.stiffness import Stiffness
from synth.response_cache import kept
from synth.surfaces.height_field import HeightField
from synth.surfaces.profile import Profile
from synth.surfaces.ridge_field import RidgeField

if TYPE_CHECKING:
    from synth.contact.area_grid import AreaGrid

PIECES_A_RIDGE, FEWEST_PIECES = 16, 48  # of the texture: per ridge, and least number under the finger and per period
RISES = 8  # pieces over the height of a ridge, where the texture is steep
CLOSER, LOWER = 1.5, 1.0 / 3.0  # powers of the distance of columns: of the length of pieces, and of their rise
"""Below the usual distances. Nodes cost less memory than columns, and their error is the larger one.
That of the rises is a tenth of it."""
FINEST = 1.0 / 8.0  # least factor on the distance of columns: some 100 MB of them, 1 s
MOST_NODES, MOST_COLUMNS = 1 << 19, 24_000  # of a period, 34 MB; of a finger, as 10 mm have at FINEST


def area_grid(
    field: RidgeField, footprint: Footprint, texture: HeightField, scale: float, line: Line, coarser: float = 1.0
) -> AreaGrid:
    """Return the cells of `field` on `footprint` over a height field.

    scale: of the heights in the solver, m.
    line: position of the finger across, and its direction.
    coarser: factor on the size of the cells.
    """
    from synth.contact.area_contact import finger_grid, lattice_step, rims_of  # only a height field needs its kernels

    size = footprint.reach
    step = lattice_step(texture, size, field.period, coarser)

    def heights(x: Array, y: Array) -> Array:
        return field.heights(x, y, line.direction) - footprint.drop(x, y, line.direction)

    def rims(x: Array, y: Array, _size: tuple[float, float]) -> Array:
        along, across = (c * x + s * y) / size[0], (c * y - s * x) / size[1]
        return rims_of(np.asarray(along**2 + across**2 < 0.25, np.float64))

    c, s = math.cos(line.direction), math.sin(line.direction)
    box = math.hypot(size[0] * c, size[1] * s), math.hypot(size[0] * s, size[1] * c)
    area = footprint.length * footprint.width
    return finger_grid(heights, rims, box, max(size), step, (0.0, line.y), area, texture, scale, coarser)


@kept
def line_grid(surface: FingerSurface, texture: Profile, scale: float, coarser: float) -> FingertipGrid:
    """Return the solver of `surface` over a `texture` along a line.

    scale: of the heights in the solver, m.
    coarser: factor on the distance of columns, from which those of nodes, rows and levels follow.
    """
    ridge, tall = surface.field.period, 2.0 * surface.field.amplitude or surface.footprint.depth
    under = min(surface.footprint.reach[0], texture.period)
    length = min(ridge / PIECES_A_RIDGE, under / FEWEST_PIECES)
    closer, lower = (CLOSER, LOWER) if coarser < 1.0 else (1.0, 1.0)
    nodes = texture_nodes(texture, coarser**closer * length, coarser**lower * tall / RISES)
    return FingertipGrid(surface, nodes, texture.period, texture.extent, coarser, scale)


@dataclass(frozen=True)
class FingertipContact(ContactOnArea):
    """A contact of a fingertip: its surface stays the same at every load.

    geometry: with the mean ridges, over the nominal length L0; the texture is a profile.
    stiffness: of eqs 4-5 at L0.
    field: the ridges.
    footprint: on a flat plate at 1 N.
    line: where the finger stands on a height field.
    coarser: factor on the distances of columns, rows, levels and nodes; on a height field, on the size of the cells.
    refines: whether `refined` makes them smaller, which files require.
    """

    field: RidgeField = dataclass_field(kw_only=True)
    footprint: Footprint = dataclass_field(kw_only=True)

    @property
    def begins(self) -> float:  # type: ignore[override]
        """See `Contact`; over an area it is that of other fingers."""
        return BEGINS_OVER_AREA if self.geometry.over_area else 0.0

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
        """Return the contact.

        geometry, stiffness: over the nominal length.
        width: of the footprint at 1 N, m.
        line, coarser, refines: as of the class.
        """
        geometry = geometry.as_profile()
        # eqs 4-5 require a period of the plate, too, which has none: that of the ridges is chosen
        flat = replace(geometry, profile=None, texture_amplitude=0.0, texture_period=geometry.ridge_period)
        law = Stiffness.of_contact(flat, stiffness.contact_modulus, width)
        law = replace(law, given=stiffness.given)
        if geometry.ridge_amplitude == 0.0:  # eqs 4-5 have no stiffness for two flat surfaces
            law = stiffness
        footprint = Footprint.of(geometry.contact_length, width, geometry.ridge_amplitude, law)
        return cls(geometry, stiffness, line, coarser, refines, field=field, footprint=footprint)

    @property
    def surface(self) -> FingerSurface:
        """Its surface."""
        return FingerSurface(self.field, self.footprint)

    @cached_property
    def grid(self) -> PhaseSolver:
        """Its columns; on a height field, its cells."""
        texture, scale = self.geometry.profile, self.geometry.height_scale
        assert texture is not None
        if isinstance(texture, HeightField):
            return kept(area_grid)(self.field, self.footprint, texture, scale, self.line, self.coarser)
        return line_grid(self.surface, texture, scale, self.coarser)

    hard_edges: ClassVar[bool] = False
    own_middle: ClassVar[float] = 0.0
    """x of its middle, m."""

    @property
    def lattice(self) -> tuple[tuple[float, float], float]:
        """Length and width of the region in which it may touch, and the period of its ridges (m)."""
        return self.footprint.reach, self.field.period

    @property
    def own_area(self) -> float:
        """L0 W0 (m^2), to which its stiffness belongs."""
        return self.footprint.length * self.footprint.width

    def own_heights(self, x: Array, y: Array) -> Array:
        """Return its height (m) at every pair of `x` and `y` (m) from its middle, along and across it."""
        return self.surface.heights(x, y)

    def middle_line(self, places: Array) -> Array:
        """Return the height of the fingertip (m) at x = `places` (m, from the middle) on the line y = 0."""
        row = np.zeros(1)
        return np.asarray(self.field.heights(places, row)[:, 0] - self.footprint.drop(places, row)[:, 0])

    def halved(self) -> Self | None:
        """Return the contact at half of its distances, or None.

        It is None where columns, nodes or cells would be too many, and below the usual distances along a line unless it
        refines: the error of a voice is then the change from distances twice as large.
        """
        texture = self.geometry.profile
        if isinstance(texture, HeightField):
            from synth.contact.area_contact import smaller_cells

            return smaller_cells(self, *self.lattice)
        columns = COLUMNS * self.footprint.reach[0] / self.field.period / (0.5 * self.coarser)
        if 0.5 * self.coarser < (FINEST if self.refines else 1.0) or columns > MOST_COLUMNS:
            return None
        grid, finer = self.grid, replace(self, coarser=0.5 * self.coarser)
        assert isinstance(grid, FingertipGrid) and isinstance(finer.grid, FingertipGrid)
        if len(finer.grid.nodes.places) > MOST_NODES:
            return None
        finer.grid.reach_as(grid)
        return finer

    def width_at(self, load: float) -> float:
        """Return W0 (m): areas are relative to L0 W0 at every load."""
        return self.footprint.width

    def heights(self, phases: Array, loads: Array, path: Array | None = None) -> Array:
        """See `ContactOnArea`."""
        return Contact.heights(self, phases, loads) if path is None else super().heights(phases, loads, path)

    def grid_at(self, direction: float) -> AreaGrid:
        """Return its cells on a height field at another direction (rad)."""
        texture, line = self.geometry.profile, Line(self.line.y, direction)
        assert isinstance(texture, HeightField)
        return area_grid(self.field, self.footprint, texture, self.geometry.height_scale, line, self.coarser)
