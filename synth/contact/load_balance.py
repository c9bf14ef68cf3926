"""One contact, ready to be solved at any phase and load: geometry, stiffness and solver of a scene, in one place.

Model   eq. 1, with z(theta, w) at an indentation w / k; dz/dw = -m (w / k) / (w |C| / L), with k from eqs 4-5
        and m = 1.5, or with a k that is given and m = 1. Two cosines over one length have elementary antiderivatives
        and are solved to round-off (`exact_solver`). Any other profile, and any finger that is round or grows, becomes
        a polyline of `Geometry.segments` segments a period (`profile_solver`), which can be refined.
Source  Fagiani & Barbieri (2016), eqs 1, 2, 4, 5.
Limits  a contact whose shape depends on the load answers through the same methods with a solver for each load; those
        that were asked for last are kept.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, fields, replace
from functools import lru_cache
from typing import ClassVar, Self

import numpy as np

from synth.arrays import Array
from synth.contact.exact_solver import Approaches, Grid
from synth.contact.full_contact import FullContact, full_contact
from synth.contact.geometry import Geometry
from synth.contact.profile_solver import SegmentGrid
from synth.contact.stiffness import Stiffness

LEAST_TOUCHING = 1e-12  # of the length: keeps dz/dw finite where nothing touches
FINEST = 1 << 17  # segments of a period and of a contact; more take seconds to lay out and change z by 1e-8 of a1 + a2
MOST_KEPT = 4  # solvers, some 12 MB each at their finest; rows of load are solved one at a time

PhaseSolver = Grid | SegmentGrid
"""One contact, ready to be solved at any phase."""


@lru_cache(maxsize=MOST_KEPT)
def solver_of(geometry: Geometry, dome: float = 0.0) -> PhaseSolver:
    """Return the solver of `geometry`, laid out; dome: 1 / R (1/m) of a round finger, whose texture is a profile."""
    return Grid.of_geometry(geometry) if geometry.profile is None else SegmentGrid.of_geometry(geometry, dome)


@dataclass(frozen=True, slots=True)
class Contact:
    """Geometry and stiffness of one scene, and the solver that takes them."""

    of_one_shape: ClassVar[bool] = True
    """Solver and shape are those of every load, and w / k is that of the one contact length."""
    of_one_surface: ClassVar[bool] = True
    """What touches at one phase and z is the same at every load."""

    geometry: Geometry
    stiffness: Stiffness
    grid: PhaseSolver

    @classmethod
    def of(cls, geometry: Geometry, stiffness: Stiffness) -> Contact:
        """Return the contact, its grid laid out once."""
        return cls(geometry, stiffness, solver_of(geometry))

    def refined(self) -> Contact | None:
        """Return the contact on segments of half the length; None where its solver is exact.

        None too where the segments, halved once at least, are FINEST a period, or over the contact, or more.
        """
        geometry = self.geometry
        if not isinstance(self.grid, SegmentGrid):
            return None
        periods = max(1.0, geometry.contact_length / geometry.texture_period)
        if geometry.segments is not None and periods * self.grid.segments >= FINEST:
            return None
        return self.on(replace(geometry, segments=2 * self.grid.segments))

    def on(self, geometry: Geometry) -> Self:
        """Return this contact on other surfaces."""
        return replace(self, geometry=geometry, grid=solver_of(geometry))

    def as_profile(self) -> Contact:
        """Return this contact with a profile for its texture: what is told of the pressure is told of segments."""
        return self.on(self.geometry.as_profile())

    @property
    def key(self) -> Hashable:
        """What z depends on, for a cache."""
        return tuple(getattr(self, one.name) for one in fields(self) if one.name != "grid")

    @property
    def dome(self) -> float:
        """1 / R (1/m) of a parabola about the middle of the length that is taken off h; 0: the finger is flat."""
        return 0.0

    def geometry_at(self, load: float) -> Geometry:
        """Return the surfaces over the length that the solver at `load` (N) spans."""
        return self.geometry

    def width_at(self, load: float) -> float:
        """Return the length (m) of a ridge across the scan at `load` (N): that of the contact along it (eq. 4)."""
        return self.geometry_at(load).contact_length

    def work_at(self, load: float) -> int:
        """Return the work of a phase at `load` (N), in cells of the exact solver."""
        return self.solver(load).cells

    def solver(self, load: float) -> PhaseSolver:
        """Return what solves this contact at `load` (N)."""
        return self.grid

    def indentation(self, load: float) -> float:
        """Return w / k (m) at `load` (N): the mean of max(h - z, 0) over the length that its solver spans."""
        return self.stiffness.indentation(load)

    def stiffness_at(self, load: float) -> float:
        """Return k (N/m) at `load` (N): the force for a metre of that mean."""
        return self.stiffness.stiffness(load)

    def scale_at(self, load: float) -> float:
        """Return a1 + a2 (m), to which every error of z is relative at any `load` (N)."""
        return self.geometry.height_scale

    def closed(self, load: float) -> FullContact | None:
        """Return z in closed form where `load` (N) presses everything flat, else None."""
        return full_contact(self.geometry, self.stiffness, load)

    def approach(self, phases: Array, load: float, guess: Array | None = None) -> tuple[Array, Array]:
        """Return z (m) and dz/dw (m/N) at each of `phases` (turns) and `load` (N).

        guess: z at each phase, for a solver to begin from; None: from the phases before.
        """
        solved = self.solver(load).solve(phases, self.indentation(load), guess)
        if load <= 0.0:
            return solved.height, np.zeros_like(solved.touching)
        gained = self._growth(phases, solved, load)
        return solved.height, np.asarray(-gained / np.maximum(solved.touching, LEAST_TOUCHING))

    def heights(self, phases: Array, loads: Array) -> Array:
        """Return z (m) at each of `phases` (turns) and `loads` (N, above 0), one load a phase."""
        return self.grid.solve(phases, self.stiffness.indentation(1.0) * loads**self.stiffness.load_exponent).height

    def measure(self, phases: Array, heights: Array, load: float) -> tuple[Array, Array]:
        """Return the mean of max(h - z, 0) (m) and the touching part of the length, at each phase (turns) and z (m).

        load: N, at which the shape of the contact is taken. The reaction is `stiffness_at(load)` times that mean.
        """
        return self.solver(load).measure(phases, heights)

    def _growth(self, phases: Array, solved: Approaches, load: float) -> Array | float:
        """Return -dF/dw (m/N) at the z that was `solved` and `load`, F the mean of max(h - z, 0) less w / k."""
        return self.stiffness.load_exponent * self.indentation(load) / load
