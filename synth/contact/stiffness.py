"""Stiffness of the contact: how far a load presses the finger in.

Model   E* = ((1 - nu1^2) / E1 + (1 - nu2^2) / E2)^-1;  k = 1.18 E* L^2 / a;  a = sqrt(4 w_l R_eq / (pi E*))
        w_l = w lambda_eq / L^2;  lambda_eq = 2 lambda1 lambda2 / (lambda1 + lambda2)
        1 / R_eq = 4 pi^2 a1 / lambda1^2 + 4 pi^2 a2 / lambda2^2
        So k falls as w^-1/2, and the mean indentation w / k grows as w^3/2 L^-3.
        A stiffness that the scene gives replaces these equations. w / k is then proportional to w. At another contact
        length k is proportional to L, as for a foundation of independent elements side by side.
Source  Fagiani & Barbieri (2016), eqs 4 and 5; 1.18 is the elastic-foundation equivalence for a line contact (eq. 4).
Limits  Hertzian ridges, quasi-static. For two flat surfaces R_eq and the indentation are infinite. A texture of any
        profile counts as the sinusoid of equal Rq and equal rms slope.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from synth.contact.geometry import Geometry
from synth.scene.scene import Scene

FOUNDATION = 1.18  # k_el / l = 1.18 E* / a, eq. 4; another value scales every indentation


@dataclass(frozen=True, slots=True)
class Stiffness:
    """The coefficients of eqs 4-5 that do not depend on the load.

    contact_modulus: E*, Pa.
    ridge_radius: R_eq, m; infinite for two flat surfaces.
    shared_period: lambda_eq, m.
    contact_length: L, m.
    given: k, N/m; None: k follows from eqs 4-5.
    """

    contact_modulus: float
    ridge_radius: float
    shared_period: float
    contact_length: float
    given: float | None = None

    @classmethod
    def of_scene(cls, scene: Scene) -> Stiffness:
        """Return the stiffness law of `scene`; a texture without a Young's modulus is rigid."""
        finger, texture = scene.finger, scene.texture
        compliance = (1.0 - finger.poisson_ratio**2) / finger.youngs_modulus
        if texture.youngs_modulus is not None:
            compliance += (1.0 - texture.poisson_ratio**2) / texture.youngs_modulus
        return replace(cls.of_contact(Geometry.of_scene(scene), 1.0 / compliance), given=finger.stiffness)

    @classmethod
    def of_contact(cls, geometry: Geometry, contact_modulus: float) -> Stiffness:
        """Return the law for `geometry` and the contact modulus E* (Pa)."""
        curvature = 4.0 * math.pi**2 * geometry.ridge_amplitude / geometry.ridge_period**2
        texture_amplitude, lambda2 = geometry.equivalent
        curvature += 4.0 * math.pi**2 * texture_amplitude / lambda2**2
        lambda1 = geometry.ridge_period
        return cls(
            contact_modulus=contact_modulus,
            ridge_radius=1.0 / curvature if curvature > 0.0 else math.inf,
            shared_period=2.0 * lambda1 * lambda2 / (lambda1 + lambda2),
            contact_length=geometry.contact_length,
        )

    def over(self, length: float) -> Stiffness:
        """Return the law of the same surfaces in contact over another `length` (m)."""
        given = None if self.given is None else self.given * length / self.contact_length
        return replace(self, contact_length=length, given=given)

    @property
    def load_exponent(self) -> float:
        """Power of the load by which w / k grows."""
        return 1.5 if self.given is None else 1.0

    @property
    def length_exponent(self) -> float:
        """Power of the contact length by which w / k falls."""
        return 3.0 if self.given is None else 1.0

    def half_width(self, load: float) -> float:
        """Return a, the half-width (m) of the line contact of one ridge, at `load` (N) (eq. 5)."""
        line_load = load * self.shared_period / self.contact_length**2
        return math.sqrt(4.0 * line_load * self.ridge_radius / (math.pi * self.contact_modulus))

    def stiffness(self, load: float) -> float:
        """Return k (N/m) at `load` (N) (eq. 4); infinite at no load, unless the scene gives it."""
        if self.given is not None:
            return self.given
        half_width = self.half_width(load)
        return FOUNDATION * self.contact_modulus * self.contact_length**2 / half_width if half_width else math.inf

    def indentation(self, load: float) -> float:
        """Return w / k (m), the mean indentation over the contact length, at `load` (N)."""
        if self.given is not None:
            return load / self.given
        return load * self.half_width(load) / (FOUNDATION * self.contact_modulus * self.contact_length**2)
