"""The horizontal forces of a finger over an area, of slopes and of friction, at any place, direction and load.

Stage   CONTACT.
Model   y = max(h - z, 0), with z from eq. 1 at the load w. With the area A0 of `area_grid`:

            F_s = -w S / N_1,   S = integral of y grad h2 dA / A0,   N_g = integral of y^g dA / A0
            Q = mu p0 A0 (k / (A0 p0))^g N_g

        The gradient is that along x and y of the surface, so F_s has these two components; Q is the size of the
        friction, against the motion. F_s is the derivative of the elastic energy over the place, as along a line
        (`forces`). Where the finger turns, both are cross-faded between directions as z is (`area_path`).
        They have the methods of a contact, so that whatever reads z reads them.
Source  Fagiani & Barbieri (2016), eqs 1 and 4; Wandersman et al. (2011) for g. The slope force is derived in `forces`.
Limits  Those of `area_force_sums`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Hashable
from dataclasses import dataclass, field, replace
from typing import ClassVar, Self

import numpy as np

from synth.arrays import Array
from synth.contact.area_grid import AreaGrid
from synth.contact.area_path import ContactOnArea, Line, Places, read_along, solved_at
from synth.contact.forces import ForceDiscretisation
from synth.contact.geometry import Geometry
from synth.contact.load_balance import PhaseSolver

ALONG, ACROSS = 0, 1  # components of the slope force: along x and along y of the surface
SUMS_WORK = 1.6  # work of z and its sums, over that of z
NO_DEPTH = 1e-300  # m: keeps a quotient finite where rounding leaves no contact
RECENT_SUMS = 64  # calls whose sums are kept, some 0.1 MB each: more than those of a chunk of frames


class RecentSums:
    """The last sums of a finger, for its forces, which are read one after the other at the same places."""

    def __init__(self) -> None:
        self._known: deque[tuple[AreaGrid, Places, float, Array]] = deque(maxlen=RECENT_SUMS)

    def at(self, contact: ContactOnArea, grid: AreaGrid, at: Places, exponent: float) -> Array:
        """Return `AreaGrid.force_sums` at the z that balances each load."""
        for known, places, power, sums in list(self._known):
            if known is grid and power == exponent and all(map(np.array_equal, places, at)):
                return sums
        z, sizes = solved_at(contact, grid, at), contact.sizes(at.loads)
        own = np.full(len(z), grid.size) if sizes is None else sizes
        sums = grid.force_sums(at.phases, at.across, z, at.turns, own, exponent)
        self._known.append((grid, at, exponent, sums))
        return sums


@dataclass(frozen=True)
class ForceOverArea(ForceDiscretisation, ABC):
    """Base class of both forces.

    recent: shared by the forces of one finger.
    """

    of_cosines: ClassVar[bool] = False
    recent: RecentSums = field(default_factory=RecentSums, compare=False, repr=False, kw_only=True)

    @property
    @abstractmethod
    def key(self) -> Hashable:
        """Everything that the force depends on, for a cache."""

    @abstractmethod
    def _read(self, grid: AreaGrid, at: Places) -> Array:
        """Return the force (N) on one direction of the finger."""

    def heights(self, phases: Array, loads: Array, path: Array | None = None) -> Array:
        """Return the force (N) at each of `phases` (turns) and `loads` (N, above 0), as a contact returns z.

        path: how far the texture has moved across (m), and the direction of the finger (rad); None: on its line.
        """
        return read_along(self.contact, phases, loads, path, self._read)

    def approach(self, phases: Array, load: float, guess: Array | None = None) -> tuple[Array, Array]:
        """Return the force (N) on the line at each of `phases` and one `load` (N). It has no derivative: it is 0."""
        found = np.zeros(len(phases))
        return (self.heights(phases, np.full(len(phases), load)) if load > 0.0 else found), found

    @property
    def geometry(self) -> Geometry:
        """The surfaces."""
        geometry: Geometry = self.contact.geometry
        return geometry

    @property
    def line(self) -> Line:
        """Where the finger stands, and its direction."""
        line: Line = self.contact.line
        return line

    @property
    def grid(self) -> PhaseSolver:
        """The cells of its contact."""
        grid: PhaseSolver = self.contact.grid
        return grid

    def on_line(self, line: Line) -> Self:
        """Return the force of a finger on another line."""
        return replace(self, contact=self.contact.on_line(line))

    def doubled(self) -> Self:
        """Return the force on cells twice as large."""
        return replace(self, contact=self.contact.doubled())

    def solver(self, load: float) -> PhaseSolver:
        """Return the solver of the contact at `load` (N)."""
        solver: PhaseSolver = self.contact.solver(load)
        return solver

    def work_at(self, load: float) -> int:
        """Return the work per phase at `load` (N), in cells of the exact solver."""
        return round(SUMS_WORK * float(self.contact.work_at(load)))

    def closed(self, load: float) -> None:
        """Return None: there is no closed form."""
        return

    def scale_at(self, load: float) -> float:
        """Return the scale of rounding errors at `load` (N): the load times the steepest slope."""
        texture = self.geometry.profile
        steepest = 0.0 if texture is None else max(texture.slope_bound, getattr(texture, "slope_across", 0.0))
        return load * steepest


@dataclass(frozen=True)
class AreaSlopeForce(ForceOverArea):
    """One component of F_s (N): of the force that the slopes exert on the finger.

    component: ALONG or ACROSS.
    exponent: of the friction that is read at the same places; 0: there is none.
    """

    component: int = ALONG
    exponent: float = 0.0

    @property
    def key(self) -> Hashable:
        """See `ForceOverArea`."""
        return "slope force over an area", self.component, self.contact.key

    def _read(self, grid: AreaGrid, at: Places) -> Array:
        depth, *slopes = self.recent.at(self.contact, grid, at, self.exponent)[:3]
        return np.asarray(-at.loads * slopes[self.component] / np.maximum(depth, NO_DEPTH))


@dataclass(frozen=True)
class AreaFriction(ForceOverArea):
    """Q (N), at least 0; the law is that of `forces.FrictionForce`."""

    friction_coefficient: float = 0.0
    pressure_exponent: float = 1.0
    reference_pressure: float = 1.0

    @property
    def key(self) -> Hashable:
        """See `ForceOverArea`."""
        law = self.friction_coefficient, self.pressure_exponent, self.reference_pressure
        return "friction over an area", self.contact.key, law

    def _read(self, grid: AreaGrid, at: Places) -> Array:
        exponent, area = self.pressure_exponent, self.contact.areas(at.loads)
        power = self.recent.at(self.contact, grid, at, exponent)[3]
        stiff = at.loads / self.contact.indentations(at.loads)
        unit = self.friction_coefficient * self.reference_pressure * area
        return np.asarray(unit * (stiff / (area * self.reference_pressure)) ** exponent * power)
