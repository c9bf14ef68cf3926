"""The contact of a probe over an area: a round tip on a foundation, whose direction does not matter.

Model   The tip is a paraboloid of radius R. z solves

            F(z) = integral of max(h2 - d - z, 0) dA = w / K,   d = r^2 / (2 R)

        r is the distance from the middle of the tip. K = kappa / L (Pa/m) is the foundation modulus of the same probe
        along a line, where k is that of a contact as wide as long (`curved_contact`). It falls as w^-0.2. On a flat
        plate the tip touches a disc of radius b, w = pi K b^4 / (4 R). So b is (16 / (3 pi))^(1/4) = 1.14 times the
        half-length L / 2 along a line, and the disc is 1.02 times L^2.
        On a texture that does not vary across, a strip of the tip at x has the area (4/3) sqrt(2 R) u^(3/2) above z,
        where u = max(h2 - x^2 / (2 R) - z, 0). Along a line, where the tip is a cylinder, it is L u.
        Areas are relative to R^2.
Source  Johnson, Contact Mechanics (1985), sec. 4.3 (Winkler foundation, paraboloid); Fagiani & Barbieri (2016), eqs 1,
        4, 5; the rest is derived here.
Limits  As for `area_grid`. The cells cover what touches at USUAL_LOAD or at the heaviest load of the scene.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import ClassVar, Self

import numpy as np

from synth.arrays import Array
from synth.contact.area_contact import finger_grid, lattice_step, rims_of, smaller_cells
from synth.contact.area_grid import AreaGrid
from synth.contact.area_path import ContactOnArea, Line
from synth.contact.curved_contact import USUAL_LOAD, RoundFinger, span_of
from synth.contact.geometry import Geometry
from synth.contact.stiffness import Stiffness
from synth.response_cache import kept
from synth.surfaces.height_field import HeightField

USUAL = 0.3  # N, of a usual hand: the cells resolve the length that touches at it


@dataclass(frozen=True)
class TipOnArea(ContactOnArea):
    """A probe on a height field.

    geometry: over a length R about the middle of the tip.
    stiffness: of eqs 4-5 at this length.
    tip: the probe along a line, with its foundation.
    heaviest: load (N), up to which nothing touches beyond `span`.
    deeper: distance (m) by which z may be lower than at that load.
    """

    of_any_direction = True
    tip: RoundFinger = field(kw_only=True)
    heaviest: float = field(kw_only=True)
    deeper: float = field(kw_only=True, default=0.0)

    @classmethod
    def of(
        cls, geometry: Geometry, stiffness: Stiffness, heaviest: float, line: Line, coarser: float, refines: bool
    ) -> Self:
        """Return the contact; SceneError where the tip is too flat.

        heaviest: load of the scene, N.
        The other arguments are as of the class.
        """
        tip = RoundFinger.of(stiffness, geometry.contact_length, 1.0)
        heaviest = max(heaviest, USUAL_LOAD)
        touched(geometry, tip, heaviest)  # raises where it is too flat
        return cls(geometry, stiffness, line, coarser, refines, tip=tip, heaviest=heaviest)

    @cached_property
    def span(self) -> float:
        """Diameter (m) of what may touch."""
        return touched(self.geometry, self.tip, self.heaviest, self.deeper)

    def under(self, law: Stiffness) -> Self:
        """See `Contact`: the tip keeps its radius."""
        return replace(self, stiffness=law, tip=RoundFinger.of(law, self.tip.radius, 1.0))

    @property
    def lattice(self) -> tuple[tuple[float, float], float]:
        """Length and width of what may touch, and the length that touches at USUAL (m)."""
        return (self.span, self.span), self.tip.length_at(USUAL)

    hard_edges: ClassVar[bool] = False

    @property
    def own_area(self) -> float:
        """R^2 (m^2), to which its stiffness belongs."""
        return self.tip.radius**2

    def own_heights(self, x: Array, y: Array) -> Array:
        """Return its height (m) at every pair of `x` and `y` (m) from its middle."""
        return np.asarray(-(x[:, np.newaxis] ** 2 + y**2) / (2.0 * self.tip.radius))

    def over_loads(self, heaviest: float, deeper: float = 0.0) -> Self:
        """See `Contact`."""
        return replace(self, heaviest=max(heaviest, USUAL_LOAD), deeper=deeper)

    @property
    def stiffness_exponent(self) -> float:
        """See `Contact`: kappa / L."""
        return self.tip.foundation_exponent - self.tip.length_exponent

    def indentation(self, load: float) -> float:
        """Return w / (K R^2) (m) at `load` (N)."""
        return volume(self.tip, load) / self.tip.radius**2

    def stiffness_at(self, load: float) -> float:
        """Return K R^2 (N/m) at `load` (N); 0 at no load."""
        return load / self.indentation(load) if load > 0.0 else 0.0

    def halved(self) -> Self | None:
        """See `Contact`."""
        return smaller_cells(self, *self.lattice)

    def grid_at(self, direction: float) -> AreaGrid:
        """Return its cells, the same at every direction."""
        return tip_grid(self.geometry, self.tip.radius, *self.lattice, self.line.y, self.coarser)


def volume(tip: RoundFinger, load: float) -> float:
    """Return w / K (m^3) at `load` (N)."""
    return tip.area(load) * tip.length_at(load)


def touched(geometry: Geometry, tip: RoundFinger, heaviest: float, deeper: float = 0.0) -> float:
    """Return the diameter (m) of what may touch at any place, at `heaviest` (N).

    deeper: distance (m) by which z may be lower.
    """
    low, high = geometry.extent
    pressed = math.sqrt(volume(tip, heaviest) / (math.pi * tip.radius))  # on a plate: z is never lower than on one
    return span_of(tip, high - low + pressed + deeper, heaviest)


@kept
def tip_grid(
    geometry: Geometry, radius: float, size: tuple[float, float], resolved: float, y: float, coarser: float
) -> AreaGrid:
    """Return the cells of a tip on the height field of `geometry`.

    radius: m.
    size, resolved: as of `ContactOnArea.lattice`.
    y: place of its middle across, m.
    coarser: factor on the size of the cells.
    """
    texture = geometry.profile
    assert isinstance(texture, HeightField)
    step = lattice_step(texture, size, resolved, coarser)

    def heights(x: Array, y: Array) -> Array:
        return np.asarray(-(x[:, np.newaxis] ** 2 + y**2) / (2.0 * radius))

    def rims(x: Array, y: Array, _size: tuple[float, float]) -> Array:
        return rims_of(np.asarray(x**2 + y**2 < (0.5 * size[0]) ** 2, np.float64))

    middle, scale = (0.5 * geometry.contact_length, y), geometry.height_scale
    return finger_grid(heights, rims, size, size[0], step, middle, radius**2, texture, scale, coarser)
