"""The dimensionless groups of the model, and the way back.

Model   integral_0^tau max(A cos(2 pi X / Lambda - 2 pi theta + phi) - cos(2 pi X) - Z, 0) dX = W, with X = x / lambda1,
        Z = z / a1, tau = L / lambda1, Lambda = lambda2 / lambda1, A = a2 / a1, W = w / w*, w* = k a1 lambda1 / L.
Source  Fagiani & Barbieri (2016), eqs 6 and 7. The paper's text names tau; Lambda, A and W follow from eqs 2, 6 and 7.
Limits  a1 > 0: a smooth finger has no a1 to divide by. The solver itself is relative to a1 + a2 and has no such limit.
"""

from __future__ import annotations

from dataclasses import dataclass

from synth.contact.geometry import Geometry
from synth.contact.stiffness import Stiffness
from synth.errors import CannotRender


@dataclass(frozen=True, slots=True)
class Groups:
    """tau, Lambda, A and W of eq. 7."""

    ridges: float
    period_ratio: float
    amplitude_ratio: float
    load: float

    @classmethod
    def of_contact(cls, geometry: Geometry, stiffness: Stiffness, load: float) -> Groups:
        """Return the groups of a contact at `load` (N); CannotRender for a smooth finger (a1 = 0)."""
        a1 = geometry.ridge_amplitude
        if not a1 > 0.0:
            raise CannotRender("The groups of eqs 6-7 need finger ridges: finger.ridge_amplitude is 0 m.")
        tau = geometry.ridges
        return cls(
            ridges=tau,
            period_ratio=geometry.equivalent[1] / geometry.ridge_period,
            amplitude_ratio=geometry.equivalent[0] / a1,
            load=tau * stiffness.indentation(load) / a1,
        )

    def geometry(self, ridge_period: float, ridge_amplitude: float, texture_phase: float) -> Geometry:
        """Return the geometry with these groups, given lambda1 (m), a1 (m) and phi (rad)."""
        return Geometry(
            ridge_amplitude=ridge_amplitude,
            ridge_period=ridge_period,
            texture_amplitude=self.amplitude_ratio * ridge_amplitude,
            texture_period=self.period_ratio * ridge_period,
            texture_phase=texture_phase,
            contact_length=self.ridges * ridge_period,
        )

    def newtons(self, geometry: Geometry, contact_modulus: float) -> float:
        """Return the load (N) that gives W in `geometry` with the contact modulus E* (Pa): eqs 4-6 the other way."""
        indentation = self.load / self.ridges * geometry.ridge_amplitude
        return Stiffness.of_contact(geometry, contact_modulus).load(indentation)
