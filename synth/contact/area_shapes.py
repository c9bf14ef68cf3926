"""A comb over an area whose contact depends on the load: one that grows, and one that is round along its length.

Stage   CONTACT, for the effects `contact_growth` and `curvature`.
Model   Both are the contacts of the same effects along a line, with the width of the comb across.
        Growing: a square of the length L(w) about the middle of the comb, with k of eqs 4-5 at L(w). At every load it
        is the comb of that length:

            F(z) = integral of max(h1 + h2 - z, 0) dA / L^2 = w / k(L)

        Where every place has its own load, both sides are relative to L0^2.
        Round: a comb of the nominal width L0 that bends along its length: h1 - u^2 / (2 R), with kappa(w) of
        `curved_contact`, and F(z) = (w / kappa) / L0. It has edges along its sides only.
        On a texture that does not vary across, both have the z of the line.
Source  Fagiani & Barbieri (2016), eqs 1, 4, 5; Johnson, Contact Mechanics (1985), sec. 4.3. The rest is derived here.
Limits  Those of `area_grid`. The edges of a growing comb are as wide as a cell. A load above `heaviest` counts, for the
        size of the contact, as `heaviest`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from synth.arrays import Array
from synth.contact.area_contact import CombOnArea, beside_edge, finger_grid, lattice_step, rims_of
from synth.contact.area_grid import AREA_STEP, OUTSIDE, AreaGrid
from synth.contact.area_path import Line
from synth.contact.area_solver import ROW
from synth.contact.curved_contact import RoundFinger, lowest_approach, span_of
from synth.contact.exact_solver import Approaches
from synth.contact.geometry import Geometry
from synth.contact.growing_contact import Growth
from synth.contact.load_balance import PhaseSolver
from synth.response_cache import kept
from synth.surfaces.height_field import HeightField
from synth.surfaces.ridge_field import turned_back

USUAL_LOAD = 0.5  # N: the least load that the cells serve, so that scenes of light loads share them
STEP = 1e-3  # of the load, of differences over it: the size then changes by some hundredths of a cell


def covered(load: float) -> float:
    """Return the load (N) that the cells serve where the heaviest is `load` (N): a power of two."""
    return float(2.0 ** math.ceil(math.log2(max(load, USUAL_LOAD))))


@dataclass(frozen=True)
class GrowingCombOnArea(CombOnArea):
    """A comb of ridges whose square contact follows `growth`; geometry and stiffness are those of the nominal length.

    heaviest: the load (N) that the cells serve.
    """

    of_one_shape = False
    of_one_surface = False  # the load moves the ends
    growth: Growth = field(kw_only=True)
    heaviest: float = field(kw_only=True, default=USUAL_LOAD)

    @classmethod
    def of(cls, comb: CombOnArea, growth: Growth) -> Self:
        """Return the contact of `comb`."""
        return cls(comb.geometry, comb.stiffness, comb.line, comb.coarser, comb.refines, growth=growth)

    def covering(self, heaviest: float) -> Self:
        """See `Contact`."""
        return replace(self, heaviest=covered(heaviest))

    def over_loads(self, heaviest: float, deeper: float = 0.0) -> Self:
        """See `Contact`: its region is that of `heaviest`."""
        return replace(self, heaviest=heaviest)

    def length(self, load: float) -> float:
        """Return L (m) at `load` (N)."""
        return float(self._lengths(np.full(1, load))[0])

    def _lengths(self, loads: Array) -> Array:
        nominal = self.geometry.contact_length
        return np.asarray(self.growth.length(nominal, np.minimum(loads, self.heaviest)), np.float64)

    @property
    def lattice(self) -> tuple[tuple[float, float], float]:
        """Length and width of the largest contact, and the period of the ridges (m)."""
        longest = self.length(self.heaviest)
        return (longest, longest), self.geometry.ridge_period

    @property
    def own_area(self) -> float:
        """Area (m^2) at `heaviest`."""
        return self.length(self.heaviest) ** 2

    def areas(self, loads: Array) -> Array:
        """Return L0^2 (m^2), to which `indentations` belong."""
        return np.full(len(loads), self.geometry.contact_length**2)

    def grid_at(self, direction: float) -> AreaGrid:
        """Return its cells at another direction (rad), relative to L0^2."""
        longest, line = self.length(self.heaviest), Line(self.line.y, direction)
        return growing_grid(self.geometry, longest, line, self.coarser)

    def geometry_at(self, load: float) -> Geometry:
        """Return the surfaces over the length at `load` (N)."""
        length = self.length(load)
        return self.geometry.part(0.5 * (self.geometry.contact_length - length), length)

    def solver(self, load: float) -> PhaseSolver:
        """Return the cells at `load` (N), relative to the area at that load."""
        grid, loads = self.grid, np.full(1, load)
        assert isinstance(grid, AreaGrid)
        shrunk = (self.geometry.contact_length / self.length(load)) ** 2
        return replace(grid, size=float(self.sizes(loads)[0]), cell=grid.cell * shrunk)

    def indentation(self, load: float) -> float:
        """Return w / k (m) at `load` (N): the mean of max(h - z, 0) over the area at that load."""
        return self.stiffness.over(self.length(load)).indentation(load)

    def stiffness_at(self, load: float) -> float:
        """Return k (N/m) at `load` (N): the force per metre of that mean."""
        return self.stiffness.over(self.length(load)).stiffness(load)

    def indentations(self, loads: Array) -> Array:
        """Return the integral of max(h - z, 0) over L0^2 (m) at each of `loads` (N)."""
        law, grown = self.stiffness, self._lengths(loads) / self.geometry.contact_length
        return np.asarray(law.indentation(1.0) * loads**law.load_exponent * grown ** (2.0 - law.length_exponent))

    def sizes(self, loads: Array) -> Array:
        """Return half of L, in widths of an edge, at each of `loads` (N)."""
        texture = self.geometry.profile
        assert isinstance(texture, HeightField)
        return 0.5 * self._lengths(loads) / edge_of(lattice_step(texture, *self.lattice, self.coarser))

    def _growth(self, phases: Array, solved: Approaches, load: float) -> Array:
        """Return -dF/dw (m/N) at the `solved` z: of the load alone, less what the area at other loads carries."""
        ends = load * (1.0 - STEP), load * (1.0 + STEP)
        short, long = (self.solver(one).measure(phases, solved.height)[0] for one in ends)
        near, far = map(self.indentation, ends)
        return np.asarray(((far - near) - (long - short)) / (ends[1] - ends[0]))


@dataclass(frozen=True)
class RoundCombOnArea(CombOnArea):
    """A comb of ridges on a finger that is round along its length, of the nominal width.

    finger: without its ridges.
    heaviest: the load (N) that the cells serve.
    deeper: distance (m) below the lowest z of these loads that they serve too.
    """

    of_one_shape = False
    finger: RoundFinger = field(kw_only=True)
    heaviest: float = field(kw_only=True, default=USUAL_LOAD)
    deeper: float = field(kw_only=True, default=0.0)

    @classmethod
    def of(cls, comb: CombOnArea, radius: float | None, reference_load: float) -> Self:
        """Return the contact of `comb`; the arguments are those of `RoundContact.of`. SceneError where it is flat."""
        finger = RoundFinger.of(comb.stiffness, radius, reference_load)
        found = cls(comb.geometry, comb.stiffness, comb.line, comb.coarser, comb.refines, finger=finger)
        assert found.span > 0.0  # raises where it is too flat
        return found

    def covering(self, heaviest: float) -> Self:
        """See `Contact`."""
        return replace(self, heaviest=covered(heaviest))

    def over_loads(self, heaviest: float, deeper: float = 0.0) -> Self:
        """See `Contact`."""
        return replace(self, heaviest=heaviest, deeper=deeper)

    @property
    def dome(self) -> float:
        """See `Contact`."""
        return 1.0 / self.finger.radius

    @property
    def span(self) -> float:
        """Length (m) of what may touch at any place."""
        return round_span(self.geometry, self.finger, self.heaviest, self.deeper)

    @property
    def lattice(self) -> tuple[tuple[float, float], float]:
        """Length and width of what may touch, and the period of the ridges (m)."""
        return (self.span, self.geometry.contact_length), self.geometry.ridge_period

    def own_heights(self, x: Array, y: Array) -> Array:
        """Return its height (m) at every pair of `x` and `y` (m) from its middle, along and across it."""
        heights = self.geometry.finger(x + 0.5 * self.geometry.contact_length) - 0.5 * x**2 / self.finger.radius
        return np.repeat(heights[:, np.newaxis], len(y), axis=1)

    def grid_at(self, direction: float) -> AreaGrid:
        """Return its cells at another direction (rad)."""
        line = Line(self.line.y, direction)
        return round_grid(self.geometry, self.finger.radius, self.span, line, self.coarser)

    @property
    def stiffness_exponent(self) -> float:
        """See `Contact`: that of kappa."""
        return self.finger.foundation_exponent

    def indentation(self, load: float) -> float:
        """Return the F (m) that balances `load` (N)."""
        return self.finger.area(load) / self.geometry.contact_length

    def stiffness_at(self, load: float) -> float:
        """Return kappa L0 (N/m) at `load` (N)."""
        return load / self.indentation(load) if load > 0.0 else 0.0

    def heights(self, phases: Array, loads: Array, path: Array | None = None) -> Array:
        """Return z (m) on its line, or along a path; heavier loads than `heaviest` have cells of their own."""
        heaviest = float(np.max(loads, initial=0.0))
        if heaviest > self.heaviest:
            return self.over_loads(covered(heaviest), self.deeper).heights(phases, loads, path)
        return super().heights(phases, loads, path)


@kept
def round_span(geometry: Geometry, finger: RoundFinger, heaviest: float, deeper: float) -> float:
    """Return the length (m) of a round finger beyond which nothing touches at any place, at `heaviest` (N).

    deeper: distance (m) by which z may be lower.
    """
    room = geometry.extent[1] + deeper - lowest_approach(geometry, finger.radius, finger.area(heaviest))
    return span_of(finger, room, heaviest)


def edge_of(step: tuple[float, float]) -> float:
    """Return the width (m) of the edges of a growing comb; step: size of a cell of the texture (m)."""
    return max(step[0], ROW * step[1])


@kept
def growing_grid(geometry: Geometry, longest: float, line: Line, coarser: float) -> AreaGrid:
    """Return the cells of a comb that grows to the length `longest` (m); see `area_contact.comb_grid`."""
    texture, nominal = geometry.profile, geometry.contact_length
    assert isinstance(texture, HeightField)
    step = lattice_step(texture, (longest, longest), geometry.ridge_period, coarser)
    c, s = math.cos(line.direction), math.sin(line.direction)
    edge = edge_of(step)

    def heights(x: Array, y: Array) -> Array:
        return np.asarray(geometry.finger(turned_back(x, y, line.direction)[0] + 0.5 * nominal))

    def rims(x: Array, y: Array, _size: tuple[float, float]) -> Array:
        from_middle = np.maximum(np.abs(c * x + s * y), np.abs(c * y - s * x)) / edge
        return np.where(from_middle < 0.5 * longest / edge + 0.5, from_middle - 0.5, OUTSIDE)

    whole = longest + edge
    box, widest = whole * (abs(c) + abs(s)), math.sqrt(2.0) * whole
    middle, scale = (0.5 * nominal, line.y), geometry.height_scale
    grid = finger_grid(heights, rims, (box, box), widest, step, middle, nominal**2, texture, scale, coarser)
    return replace(grid, size=0.5 * longest / edge, covered=covered_part(grid, nominal / edge))


def covered_part(grid: AreaGrid, nominal: float) -> Array:
    """Return the area of the shares over that of the square, at sizes AREA_STEP apart; see `AreaGrid.covered`.

    nominal: L0 in widths of an edge.
    """
    rims = np.sort(grid.finger[:, 3][grid.finger[:, 3] < OUTSIDE].astype(np.float64))
    sizes = AREA_STEP * np.arange(1, math.ceil(rims[-1] / AREA_STEP) + 2 + round(1.0 / AREA_STEP))
    total = np.concatenate([np.zeros(1), np.cumsum(rims)])

    def above(levels: Array) -> Array:
        """Return the sum of max(level - rim, 0) at each of `levels`."""
        count = np.searchsorted(rims, levels)
        return np.asarray(levels * count - total[count])

    return np.asarray((above(sizes) - above(sizes - 1.0)) * grid.cell * (nominal / (2.0 * sizes)) ** 2)


@kept
def round_grid(geometry: Geometry, radius: float, span: float, line: Line, coarser: float) -> AreaGrid:
    """Return the cells of a comb that is round along its length; see `area_contact.comb_grid`.

    radius: m.
    span: length of what may touch, m.
    """
    texture, width = geometry.profile, geometry.contact_length
    assert isinstance(texture, HeightField)
    step = lattice_step(texture, (span, width), geometry.ridge_period, coarser)
    c, s = math.cos(line.direction), math.sin(line.direction)

    def heights(x: Array, y: Array) -> Array:
        along = turned_back(x, y, line.direction)[0]
        return np.asarray(geometry.finger(along + 0.5 * width) - 0.5 * along**2 / radius)

    def rims(x: Array, y: Array, size: tuple[float, float]) -> Array:
        there, across = np.abs(c * x + s * y) < 0.5 * span, 0.5 * width - np.abs(c * y - s * x)
        return rims_of(there * beside_edge(across, s * size[0], c * size[1]))

    box = span * abs(c) + width * abs(s), span * abs(s) + width * abs(c)
    middle, scale = (0.5 * width, line.y), geometry.height_scale
    return finger_grid(heights, rims, box, math.hypot(span, width), step, middle, width**2, texture, scale, coarser)
