"""A contact that grows with the load about its middle, while ridges and texture keep their positions.

Model   The contact spans x0 <= x <= x0 + L with L(w) = L0 (w / w0)^p, limited to the shortest and the longest length,
        and x0 = (L0 - L) / 2. k follows from eqs 4-5 at L = L(w), so w / k grows as w^1.5 L^-3. The approach changes by

            dz/dw = (q (e0 + e1) L / 2 - (1.5 - 2 q) L w / k) / (w |C|)

        where e0 and e1 are the indentations at the two ends, |C| is the length that touches, and q is p, or 0 where L
        is at a limit. A stiffness that the scene gives grows with L, so w / k grows as w / L; 1 replaces 1.5 - 2 q.
Source  Fagiani & Barbieri (2016), eqs 1-5, whose L is constant. The power law is that of Hertz for p = 1/3, an
        unverified default. dz/dw is derived here, from the integral of max(h - z, 0) over the contact, L w / k.
Limits  As for `profile_solver` at the length of that load. The ends stay hard edges. dz/dw has a step where L reaches
        the shortest or longest length, and z has a bend over the load wherever an end passes a ridge. So rows must be
        close: for an error of 2e-3 in displacement on the default scene, 1/1024 of an octave apart at the worst place
        (1/256: 6e-3, 1/64: 9e-2, 1/16: 0.3; at constant length 1/64 is enough).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.contact.exact_solver import Approaches
from synth.contact.geometry import Geometry
from synth.contact.load_balance import Contact, PhaseSolver, solver_of
from synth.contact.profile_solver import SegmentGrid
from synth.contact.stiffness import Stiffness

USUAL_LOAD = 8.0  # N: loads up to it share one polyline, so z does not depend on the other loads of the same call
SHORTEST, LONGEST = 10e-6, 0.1  # m: the range of a scene's contact length; no other part expects a length outside it


@dataclass(frozen=True, slots=True)
class Growth:
    """The law by which the contact length grows, as load^exponent from the nominal length at the reference load.

    exponent: 0 to 1.
    reference_load: N.
    shortest, longest: limits of the length, m.
    """

    exponent: float = 1.0 / 3.0
    reference_load: float = 1.0
    shortest: float = SHORTEST
    longest: float = LONGEST

    def length(self, nominal: float, load: Any) -> Any:
        """Return L (m) at `load` (N, any shape) of a contact of `nominal` length (m)."""
        return np.clip(nominal * (load / self.reference_load) ** self.exponent, self.shortest, self.longest)


@dataclass(frozen=True)
class GrowingContact(Contact):
    """A contact whose length follows `growth`; geometry, stiffness and grid are those of the nominal length."""

    of_one_shape = False
    of_one_surface = False  # the load moves the ends
    growth: Growth = Growth()

    @classmethod
    def of(cls, geometry: Geometry, stiffness: Stiffness, growth: Growth | None = None) -> GrowingContact:
        """Return the contact; geometry, stiffness: of the nominal length."""
        geometry = geometry.as_profile()
        return cls(geometry, stiffness, growth or Growth())

    def length(self, load: float) -> float:
        """Return L (m) at `load` (N)."""
        return float(self.growth.length(self.geometry.contact_length, load))

    def geometry_at(self, load: float) -> Geometry:
        """Return the surfaces over the contact at `load` (N); x = 0 is the end of the contact at that load."""
        nominal, length = self.geometry.contact_length, self.length(load)
        return self.geometry.part(0.5 * (nominal - length), length)

    def solver(self, load: float) -> PhaseSolver:
        """Return the solver of this contact at `load` (N)."""
        return solver_of(self.geometry_at(load))

    def indentation(self, load: float) -> float:
        """Return w / k (m) at `load` (N): the mean of max(h - z, 0) over the length at that load."""
        return self.stiffness.over(self.length(load)).indentation(load)

    def stiffness_at(self, load: float) -> float:
        """Return k (N/m) at `load` (N): the force per metre of that mean."""
        return self.stiffness.over(self.length(load)).stiffness(load)

    def heights(self, phases: Array, loads: Array) -> Array:
        """Return z (m) at each of `phases` (turns) and `loads` (N, above 0), one load per phase.

        All loads share one polyline, over the contact at USUAL_LOAD, or at the next power of two (N) above the heaviest
        of them if that is longer.
        """
        growth, nominal = self.growth, self.geometry.contact_length
        lengths = growth.length(nominal, loads)
        law = self.stiffness
        deep, shallow = loads**law.load_exponent, (nominal / lengths) ** law.length_exponent
        indentations = law.indentation(1.0) * deep * shallow
        heaviest = max(USUAL_LOAD, float(np.max(loads)))
        longest = float(growth.length(nominal, 2.0 ** math.ceil(math.log2(heaviest))))
        geometry = self.geometry.part(0.5 * (nominal - longest), longest)
        grid = solver_of(geometry)
        assert isinstance(grid, SegmentGrid)
        return grid.solve(phases, indentations, numbers=grid.numbers_of(geometry, lengths)).height

    def _growth(self, phases: Array, solved: Approaches, load: float) -> Array:
        growth, geometry = self.growth, self.geometry_at(load)
        exponent = growth.exponent if growth.shortest < geometry.contact_length < growth.longest else 0.0
        ends = [geometry.heights(end, phases) - solved.height for end in (0.0, geometry.contact_length)]
        gained = 0.5 * exponent / load * (np.maximum(ends[0], 0.0) + np.maximum(ends[1], 0.0))
        law = self.stiffness
        power = law.load_exponent + (1.0 - law.length_exponent) * exponent
        return np.asarray(power * self.indentation(load) / load - gained)
