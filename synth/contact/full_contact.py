"""Full contact, in closed form.

Model   Where the load flattens everything, F(z) = mean(h) - z, so z = mean(h) - w / k: one sinusoid of amplitude
        a2 |sinc(L / lambda2)|, whatever the ridges do.
Source  Fagiani & Barbieri (2016), eqs 1-2; sinc(x) = sin(pi x) / (pi x).
        Where L grows with the load about its middle as w^p, w / k falls as L^-3 (eqs 4-5) and sinc'(T) = (cos(pi T) -
        sinc(T)) / T gives the slopes of both means.
Limits  textures of one cosine, and the stiffness of eqs 4-5. It holds where z stays below every height for the whole
        period: a sufficient bound is used, so contacts that are only just full are left to the solver.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from synth.contact.geometry import Geometry
from synth.contact.stiffness import Stiffness


@dataclass(frozen=True, slots=True)
class FullContact:
    """z of a full contact: mean (m), first Fourier coefficient (m, one-sided as in `spectrum`), and the slope of each
    with the load (m/N).
    """

    mean: float
    first: complex
    slope: float
    first_slope: complex = 0j


def mean_sine_factor(turns: float) -> float:
    """Return sinc(turns) = sin(pi turns) / (pi turns), exactly zero at whole numbers of turns."""
    whole = round(turns)
    rest = turns - whole
    if whole != 0 and rest == 0.0:
        return 0.0
    sign = -1.0 if whole % 2 else 1.0
    return sign * math.sin(math.pi * rest) / (math.pi * turns) if turns else 1.0


def mean_sine_growth(turns: float) -> float:
    """Return T sinc'(T) = cos(pi T) - sinc(T) for T = `turns`: what sinc gains where T grows as w, times w."""
    return math.cos(math.pi * (turns % 2.0)) - mean_sine_factor(turns)


def full_contact(geometry: Geometry, stiffness: Stiffness, load: float, growth: float = 0.0) -> FullContact | None:
    """Return z of the full contact at `load` (N), or None where the contact may not be full at every phase.

    growth: p, where L grows as w^p about its middle while the surfaces stay; `geometry` and `stiffness` are those at
    `load`.
    """
    # no one sinusoid, or a mean that tables do not take to grow as w^1.5: the solver takes one step
    if geometry.profile is not None or stiffness.given is not None:
        return None
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
    turned = complex(first * math.cos(angle), -first * math.sin(angle))
    if load == 0.0:
        return FullContact(-ridge_mean - indentation, turned, 0.0)
    slope = -(1.5 - 3.0 * growth) * indentation / load
    if growth == 0.0:
        return FullContact(-ridge_mean - indentation, turned, slope)
    middle = math.pi * (geometry.ridges % 2.0) + geometry.ridge_phase
    slope -= growth / load * a1 * mean_sine_growth(geometry.ridges) * math.cos(middle)
    swell = growth / load * 0.5 * a2 * mean_sine_growth(geometry.texture_periods)
    first_slope = complex(swell * math.cos(angle), -swell * math.sin(angle))
    return FullContact(-ridge_mean - indentation, turned, slope, first_slope)
