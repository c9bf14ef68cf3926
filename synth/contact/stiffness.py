"""Stiffness of the contact: how far a load presses the finger in.

Model   E* = ((1 - nu1^2) / E1 + (1 - nu2^2) / E2)^-1;  k = 1.18 E* L^2 / a;  a = sqrt(4 w_l R_eq / (pi E*))
        w_l = w lambda_eq / L^2;  lambda_eq = 2 lambda1 lambda2 / (lambda1 + lambda2)
        1 / R_eq = 4 pi^2 a1 / lambda1^2 + 4 pi^2 a2 / lambda2^2
        So k falls as w^-1/2, and the mean indentation w / k grows as w^3/2 L^-3.
        L^2 is the area of the paper's square contact. Of a fingertip that is W0 wide it is L0 W0.
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

LOADS = 0.01, 10.0  # N, at which a law is checked
FOUNDATION = 1.18  # k_el / l = 1.18 E* / a, eq. 4; another value scales every indentation


@dataclass(frozen=True, slots=True)
class Stiffness:
    """The coefficients of eqs 4-5 that do not depend on the load.

    contact_modulus: E*, Pa.
    ridge_radius: R_eq, m; infinite for two flat surfaces.
    shared_period: lambda_eq, m.
    contact_length: L, m.
    contact_width: across the scan, m; None: the contact is as wide as long.
    given: k, N/m; None: k follows from eqs 4-5.
    """

    contact_modulus: float
    ridge_radius: float
    shared_period: float
    contact_length: float
    contact_width: float | None = None
    given: float | None = None

    def __post_init__(self) -> None:
        """Raise ValueError for a law of which w / k is no power of the load: contacts read it as one."""
        powers = (self.indentation(load) / load**self.load_exponent for load in LOADS)
        if not all(math.isclose(one, self.indentation(1.0), rel_tol=1e-9) for one in powers):
            name, power = type(self).__name__, self.load_exponent
            raise ValueError(f"{name}: indentation(load) must be indentation(1.0) * load**{power:g}, load_exponent")

    @classmethod
    def of_scene(cls, scene: Scene) -> Stiffness:
        """Return the stiffness law of `scene`; a texture without a Young's modulus is rigid."""
        finger, texture = scene.finger, scene.texture
        compliance = (1.0 - finger.poisson_ratio**2) / finger.youngs_modulus
        if texture.youngs_modulus is not None:
            compliance += (1.0 - texture.poisson_ratio**2) / texture.youngs_modulus
        law = cls.of_contact(Geometry.of_scene(scene), 1.0 / compliance, finger.contact_width)
        return replace(law, given=finger.stiffness)

    @classmethod
    def of_contact(cls, geometry: Geometry, contact_modulus: float, width: float | None = None) -> Stiffness:
        """Return the law for `geometry`, the contact modulus E* (Pa) and a `contact_width` (m)."""
        curvature = 4.0 * math.pi**2 * geometry.ridge_amplitude / geometry.ridge_period**2
        texture_amplitude, lambda2 = geometry.equivalent
        curvature += 4.0 * math.pi**2 * texture_amplitude / lambda2**2
        lambda1 = geometry.ridge_period
        return cls(
            contact_modulus=contact_modulus,
            ridge_radius=1.0 / curvature if curvature > 0.0 else math.inf,
            shared_period=2.0 * lambda1 * lambda2 / (lambda1 + lambda2),
            contact_length=geometry.contact_length,
            contact_width=width,
        )

    def over(self, length: float) -> Stiffness:
        """Return the law of the same surfaces in contact over another `length` (m), and as much wider."""
        grown = length / self.contact_length
        given, width = (None if one is None else one * grown for one in (self.given, self.contact_width))
        return replace(self, contact_length=length, contact_width=width, given=given)

    @property
    def area(self) -> float:
        """Return the area of the contact, m^2: L^2 of eqs 4-5."""
        return self.contact_length * (self.contact_length if self.contact_width is None else self.contact_width)

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
        line_load = load * self.shared_period / self.area
        return math.sqrt(4.0 * line_load * self.ridge_radius / (math.pi * self.contact_modulus))

    def stiffness(self, load: float) -> float:
        """Return k (N/m) at `load` (N) (eq. 4); infinite at no load, unless the scene gives it."""
        if self.given is not None:
            return self.given
        half_width = self.half_width(load)
        return FOUNDATION * self.contact_modulus * self.area / half_width if half_width else math.inf

    def indentation(self, load: float) -> float:
        """Return w / k (m), the mean indentation over the contact length, at `load` (N)."""
        if self.given is not None:
            return load / self.given
        return load * self.half_width(load) / (FOUNDATION * self.contact_modulus * self.area)
