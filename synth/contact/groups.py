"""The dimensionless groups of the model.

Model   integral_0^tau max(A cos(2 pi X / Lambda - 2 pi theta + phi) - cos(2 pi X) - Z, 0) dX = W, with X = x / lambda1,
        Z = z / a1, tau = L / lambda1, Lambda = lambda2 / lambda1, A = a2 / a1, W = w / w*, w* = k a1 lambda1 / L.
Source  Fagiani & Barbieri (2016), eqs 6 and 7. The paper's text names tau; Lambda, A and W follow from eqs 2, 6 and 7.
Limits  a1 > 0, because the groups are relative to a1. The solver is relative to a1 + a2 and has no such limit.
"""

from __future__ import annotations

from dataclasses import dataclass

from synth.contact.geometry import Geometry
from synth.contact.stiffness import Stiffness


@dataclass(frozen=True, slots=True)
class Groups:
    """tau, Lambda, A and W of eq. 7."""

    ridges: float
    period_ratio: float
    amplitude_ratio: float
    load: float

    @classmethod
    def of_contact(cls, geometry: Geometry, stiffness: Stiffness, load: float) -> Groups | None:
        """Return the groups of a contact at `load` (N); None for a smooth finger (a1 = 0)."""
        a1 = geometry.ridge_amplitude
        if a1 == 0.0:
            return None
        tau = geometry.ridges
        return cls(
            ridges=tau,
            period_ratio=geometry.equivalent[1] / geometry.ridge_period,
            amplitude_ratio=geometry.equivalent[0] / a1,
            load=tau * stiffness.indentation(load) / a1,
        )
