"""Full contact, in closed form.

Model   Where finger and texture touch everywhere, F(z) = mean(h) - z, so z = mean(h) - w / k. Over the phase, z is one
        sinusoid of amplitude a2 |sinc(L / lambda2)|, whatever the ridges.
Source  Fagiani & Barbieri (2016), eqs 1-2; sinc(x) = sin(pi x) / (pi x).
Limits  Textures of one cosine, and the stiffness of eqs 4-5. z must stay below every height over the whole period.
        The bound used is sufficient but not necessary, so contacts that are barely full go to the solver.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from synth.contact.geometry import Geometry
from synth.contact.stiffness import Stiffness


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
