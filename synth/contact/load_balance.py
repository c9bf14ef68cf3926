"""One contact of a scene, ready to be solved at any phase and load: its geometry, stiffness and solver.

Model   Eq. 1 gives z(theta, w) at an indentation w / k, and dz/dw = -m (w / k) / (w |C| / L). With k from eqs 4-5 m is
        1.5; with a given k it is 1. For two cosines over one length the integrals are elementary, and the
        solution is exact to round-off (`exact_solver`). Any other profile, and a round or growing finger, becomes a
        polyline of `Geometry.segments` segments per period, which can be refined (`profile_solver`).
        Full contact: where finger and texture touch everywhere, F(z) = mean(h) - z, so z = mean(h) - w / k. Over the
        phase, z is one sinusoid of amplitude a2 |sinc(L / lambda2)|, whatever the ridges; sinc(x) = sin(pi x) / (pi x).
        It is known for textures of one cosine, with the stiffness of eqs 4-5. z must stay below every height over the
        whole period. The bound used is sufficient but not necessary, so contacts that are barely full go to the solver.
Source  Fagiani & Barbieri (2016), eqs 1, 2, 4, 5.
Limits  A contact whose shape depends on the load has the same methods, with one solver per load. The most recently
        used solvers are cached.
"""

from __future__ import annotations

import math
from collections.abc import Hashable
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import ClassVar, Protocol, Self

import numpy as np

from synth.arrays import Array
from synth.contact.exact_solver import Approaches, Grid
from synth.contact.geometry import Geometry
from synth.contact.profile_solver import SegmentGrid
from synth.contact.stiffness import Stiffness
from synth.response_cache import kept

LEAST_TOUCHING = 1e-12  # of the length: keeps dz/dw finite where nothing touches
FINEST = 1 << 17  # segments per period and per contact; more take seconds to prepare and change z by 1e-8 of a1 + a2


@dataclass(frozen=True, slots=True)
class FullContact:
    """z of a full contact.

    mean: m.
    first: first Fourier coefficient, m, one-sided as in `spectrum`.
    slope: change of the mean with the load, m/N.
    """

    mean: float
    first: complex
    slope: float


def mean_sine_factor(turns: float) -> float:
    """Return sinc(turns) = sin(pi turns) / (pi turns), exactly zero at whole numbers of turns."""
    whole = round(turns)
    rest = turns - whole
    if whole != 0 and rest == 0.0:
        return 0.0
    sign = -1.0 if whole % 2 else 1.0
    return sign * math.sin(math.pi * rest) / (math.pi * turns) if turns else 1.0


def full_contact(geometry: Geometry, stiffness: Stiffness, load: float) -> FullContact | None:
    """Return z of the full contact at `load` (N), or None where the contact may not be full at every phase."""
    # z is not one sinusoid, or its mean does not grow as w^1.5, which tables assume; the solver then takes one step
    if geometry.profile is not None or stiffness.load_exponent != 1.5:
        return None
    a1, a2 = geometry.ridge_amplitude, geometry.texture_amplitude
    indentation = stiffness.indentation(load)
    ridge_mean = a1 * mean_sine_factor(2.0 * geometry.ridges)  # mean of a1 cos(2 pi x / lambda1) over L
    swing = a2 * abs(mean_sine_factor(geometry.texture_periods))
    if not indentation >= a1 + a2 - ridge_mean + swing:
        return None
    angle = math.pi * (geometry.texture_periods % 2.0) + geometry.texture_phase
    first = 0.5 * a2 * mean_sine_factor(geometry.texture_periods)
    turned = complex(first * math.cos(angle), -first * math.sin(angle))
    if load == 0.0:
        return FullContact(-ridge_mean - indentation, turned, 0.0)
    return FullContact(-ridge_mean - indentation, turned, -1.5 * indentation / load)


class PhaseSolver(Protocol):
    """One contact, ready to be solved at any phase."""

    @property
    def name(self) -> str:
        """Name of the solver in reports."""

    @property
    def cells(self) -> int:
        """Work per phase, in cells of the exact solver."""

    @property
    def nbytes(self) -> int:
        """Memory in bytes."""

    def solve(self, phases: Array, indentation: float | Array, guess: Array | None = None) -> Approaches:
        """Return the approach, as `exact_solver.Grid.solve` does."""

    def measure(self, phases: Array, heights: Array) -> tuple[Array, Array]:
        """Return the mean of max(h - z, 0) (m) and the touching part, as `exact_solver.Grid.measure` does."""


@kept
def solver_of(geometry: Geometry, dome: float = 0.0) -> PhaseSolver:
    """Return the solver of `geometry`.

    dome: 1 / R (1/m) of a round finger, which requires a texture as a profile.
    """
    return Grid.of_geometry(geometry) if geometry.profile is None else SegmentGrid.of_geometry(geometry, dome)


@dataclass(frozen=True)
class Contact:
    """Geometry and stiffness of one scene. Their solver is prepared when it is first needed."""

    of_one_shape: ClassVar[bool] = True
    """True: solver, length and width are the same at every load."""
    of_one_surface: ClassVar[bool] = True
    """True: the surfaces that touch at a given phase and z are the same at every load."""

    settles: ClassVar[float] = 0.5
    """Part of the error of the solver that is assumed to remain when its segments or cells are halved."""
    begins: ClassVar[float] = 0.0
    """Least part that is assumed after the first two halvings."""
    of_one_line: ClassVar[bool] = True
    """True: the finger has heights along one line; False: over an area."""
    of_any_direction: ClassVar[bool] = False
    """True: z does not change when the finger turns about its middle."""

    geometry: Geometry
    stiffness: Stiffness

    @cached_property
    def grid(self) -> PhaseSolver:
        """The solver; that of the nominal length, where the length depends on the load."""
        return solver_of(self.geometry)

    @property
    def refines(self) -> bool:
        """Whether `refined` has a finer discretisation where a tolerance requires it, as segments along a line have."""
        return True

    def refined(self) -> Self | None:
        """Return the contact on a discretisation twice as fine, if it refines and can be halved."""
        return self.halved() if self.refines else None

    def halved(self) -> Self | None:
        """Return the contact with segments, columns or cells half as long, even if it does not refine, or None.

        It is None where they would be too many, and where the solver is exact. Segments are too many where they have
        been halved at least once and are FINEST or more, per period or over the contact.
        """
        geometry = self.geometry
        if not isinstance(self.grid, SegmentGrid):
            return None
        periods = max(1.0, geometry.contact_length / geometry.texture_period)
        if geometry.segments is not None and periods * self.grid.segments >= FINEST:
            return None
        return self.on(replace(geometry, segments=2 * self.grid.segments))

    def doubled(self) -> Self | None:
        """Return the contact with cells or columns twice as large, or segments as before they were halved, or None.

        Where its own cannot be halved, the change from larger ones is its error.
        """
        if not self.of_one_line:
            return replace(self, coarser=2.0 * self.coarser)  # type: ignore[attr-defined, call-arg]
        if self.geometry.segments is None:
            return None
        return self.on(replace(self.geometry, segments=self.geometry.segments // 2))

    def on(self, geometry: Geometry) -> Self:
        """Return this contact on other surfaces."""
        return replace(self, geometry=geometry)

    def under(self, law: Stiffness) -> Self:
        """Return this contact with another law of the stiffness, of the same surfaces and length."""
        return replace(self, stiffness=law)

    def as_profile(self) -> Contact:
        """Return this contact with its texture as a profile: the integrals of the pressure are sums over segments."""
        return self.on(self.geometry.as_profile())

    @property
    def of_cosines(self) -> bool:
        """Whether both surfaces are one cosine over one length, which the exact solver solves in half the time."""
        return self.geometry.profile is None

    @property
    def key(self) -> Hashable:
        """Everything that z depends on, for a cache."""
        return tuple(getattr(self, one.name) for one in fields(self))

    @property
    def dome(self) -> float:
        """1 / R (1/m) of the parabola that is subtracted from h, about the middle of the length; 0: a flat finger."""
        return 0.0

    def geometry_at(self, load: float) -> Geometry:
        """Return the surfaces over the length that the solver spans at `load` (N)."""
        return self.geometry

    def covering(self, heaviest: float) -> Contact:
        """Return this contact with cells that serve loads up to `heaviest` (N), where they depend on the load."""
        return self

    def over_loads(self, heaviest: float, deeper: float = 0.0) -> Contact:
        """Return this contact over one length that serves all loads up to `heaviest` (N).

        deeper: distance (m) below the lowest z of these loads to which the length serves too, on a round finger.

        Its reaction is k(w) times a mean of max(h - z, 0) that depends on phase and z only, if it is `of_one_surface`.
        """
        return self

    @property
    def stiffness_exponent(self) -> float:
        """Power of the load by which k grows, over one length."""
        return 1.0 - self.stiffness.load_exponent

    def width_at(self, load: float) -> float:
        """Return the length (m) of a ridge across the scan at `load` (N): the same as along the scan (eq. 4)."""
        return self.geometry_at(load).contact_length

    def work_at(self, load: float) -> int:
        """Return the work per phase at `load` (N), in cells of the exact solver."""
        return self.solver(load).cells

    def solver(self, load: float) -> PhaseSolver:
        """Return the solver of this contact at `load` (N)."""
        return self.grid

    def indentation(self, load: float) -> float:
        """Return w / k (m) at `load` (N): the mean of max(h - z, 0) over the length that its solver spans."""
        return self.stiffness.indentation(load)

    def indentations(self, loads: Array) -> Array:
        """Return w / k (m) at each of `loads` (N, above 0), over one length."""
        return np.asarray(self.indentation(1.0) * loads ** (1.0 - self.stiffness_exponent))

    def stiffness_at(self, load: float) -> float:
        """Return k (N/m) at `load` (N): the force per metre of that mean."""
        return self.stiffness.stiffness(load)

    def scale_at(self, load: float) -> float:
        """Return a1 + a2 (m), the scale of every error of z, at any `load` (N)."""
        return self.geometry.height_scale

    def closed(self, load: float) -> FullContact | None:
        """Return z in closed form where the contact is full at `load` (N), else None."""
        return full_contact(self.geometry, self.stiffness, load)

    def approach(self, phases: Array, load: float, guess: Array | None = None) -> tuple[Array, Array]:
        """Return z (m) and dz/dw (m/N) at each of `phases` (turns) and `load` (N).

        guess: starting value of z per phase; None: start from the preceding phases.
        """
        solved = self.solver(load).solve(phases, self.indentation(load), guess)
        if load <= 0.0:
            return solved.height, np.zeros_like(solved.touching)
        gained = self._growth(phases, solved, load)
        return solved.height, np.asarray(-gained / np.maximum(solved.touching, LEAST_TOUCHING))

    def heights(self, phases: Array, loads: Array) -> Array:
        """Return z (m) at each of `phases` (turns) and `loads` (N, above 0), one load per phase."""
        return self.grid.solve(phases, self.indentations(loads)).height

    def measure(self, phases: Array, heights: Array, load: float) -> tuple[Array, Array]:
        """Return the mean of max(h - z, 0) (m) and the touching part, as `exact_solver.Grid.measure` does.

        load: N, decides the shape of the contact. The reaction is `stiffness_at(load)` times that mean.
        """
        return self.solver(load).measure(phases, heights)

    def _growth(self, phases: Array, solved: Approaches, load: float) -> Array | float:
        """Return -dF/dw (m/N) at the `solved` z and `load`, where F is the mean of max(h - z, 0) minus w / k."""
        return (1.0 - self.stiffness_exponent) * self.indentation(load) / load
