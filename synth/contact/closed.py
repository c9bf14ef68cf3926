"""Full contact, in closed form.

Model   Where the load flattens everything, F(z) = mean(h) - z, so z = mean(h) - w / k: one sinusoid of amplitude
        a2 |sinc(L / lambda2)|, whatever the ridges do.
Source  Fagiani & Barbieri (2016), eqs 1-2; sinc(x) = sin(pi x) / (pi x).
Limits  holds where z stays below every height for the whole period: a sufficient bound is used, so contacts that are
        only just full are left to the solver.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from synth.contact.geometry import Geometry
from synth.contact.stiffness import Stiffness


@dataclass(frozen=True, slots=True)
class FullContact:
    """z of a full contact: mean (m), first Fourier coefficient (m, one-sided as in `spectrum`), slope with the load
    (m/N).
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
    a1, a2 = geometry.ridge_amplitude, geometry.texture_amplitude
    indentation = stiffness.indentation(load)
    ridge_mean = a1 * mean_sine_factor(2.0 * geometry.ridges)  # mean of a1 cos(2 pi x / lambda1) over L
    if geometry.ridge_phase != 0.0:
        middle = math.pi * (geometry.ridges % 2.0) + geometry.ridge_phase
        ridge_mean = a1 * mean_sine_factor(geometry.ridges) * math.cos(middle)
    swing = a2 * abs(mean_sine_factor(geometry.texture_periods))
    if not indentation >= a1 + a2 - ridge_mean + swing:
        return None
    angle = math.pi * (geometry.texture_periods % 2.0) + geometry.texture_phase
    first = 0.5 * a2 * mean_sine_factor(geometry.texture_periods)
    slope = 0.0 if load == 0.0 else -1.5 * indentation / load
    return FullContact(-ridge_mean - indentation, complex(first * math.cos(angle), -first * math.sin(angle)), slope)
