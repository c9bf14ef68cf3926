"""Eqs 3 to 6 in SI, in plain floats: contact stiffness, mean indentation and the dimensionless groups.

Model   k = 1.18 E* / a L^2, a = sqrt(4 w_l R_eq / (pi E*)), w_l = w lambda_eq / L^2;
        tau = L / lambda1, Lambda = lambda2 / lambda1, A = a2 / a1, W = w / w*, w* = k a1 lambda1 / L.
Source  Fagiani & Barbieri 2016, eqs 3 to 7.
Limits  At no load k is infinite and the indentation w / k is zero. Without any amplitude eq. 5 has no radius. Lengths
        that eq. 7 measures in a1 are also returned in a1 + a2, so that a smooth finger (a1 = 0) has numbers.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from tests.reference.contact_oracle import Contact, solve_contact


@dataclass(frozen=True)
class Touch:
    """A finger on a sinusoidal texture in plain SI numbers; the defaults are the default scene."""

    load: float = 0.3
    contact_length: float = 10e-3
    ridge_period: float = 0.5e-3
    texture_period: float = 0.8e-3
    ridge_amplitude: float = 40e-6
    texture_amplitude: float = 20e-6
    finger_modulus: float = 101.2e3
    finger_poisson: float = 0.5
    texture_modulus: float | None = None
    texture_poisson: float = 0.5
    phase: float = math.sqrt(2.0)


@dataclass(frozen=True)
class Stiffness:
    """Results of eqs 4 to 7 for one Touch; SI, the last five without unit.

    ``indentation`` is w / k, the mean indentation over L. ``indentation_load`` is tau w / (k (a1 + a2)),
    the right hand side of eq. 7 with heights measured in a1 + a2; ``W`` is inf when a1 = 0.
    """

    effective_modulus: float
    half_width: float
    k: float
    indentation: float
    w_star: float
    W: float
    tau: float
    period_ratio: float
    amplitude_ratio: float
    indentation_load: float


def amplitude_of_roughness(roughness: float) -> float:
    """Eq. 3: a = pi / 2 Ra, both in metres."""
    return math.pi / 2 * roughness


def effective_modulus(touch: Touch) -> float:
    """E* of eq. 4 in Pa; a rigid sample (modulus None) adds nothing."""
    compliance = (1 - touch.finger_poisson**2) / touch.finger_modulus
    if touch.texture_modulus is not None:
        compliance += (1 - touch.texture_poisson**2) / touch.texture_modulus
    return 1 / compliance


def stiffness(touch: Touch) -> Stiffness:
    """Eqs 4 to 7. ValueError when neither surface has an amplitude, since eq. 5 then has no radius."""
    lambda1, lambda2, length = touch.ridge_period, touch.texture_period, touch.contact_length
    a1, a2, w = touch.ridge_amplitude, touch.texture_amplitude, touch.load
    if not a1 + a2 > 0:
        raise ValueError("eq. 5 needs an amplitude: both surfaces are flat")
    modulus = effective_modulus(touch)
    period_eq = 2 * lambda1 * lambda2 / (lambda1 + lambda2)
    radius_eq = 1 / (4 * math.pi**2 * a1 / lambda1**2 + 4 * math.pi**2 * a2 / lambda2**2)
    line_load = w * period_eq / length**2
    half_width = math.sqrt(4 * line_load * radius_eq / (math.pi * modulus))
    indentation = w * half_width / (1.18 * modulus * length**2)
    k = 1.18 * modulus / half_width * length**2 if half_width > 0 else math.inf
    tau = length / lambda1
    return Stiffness(
        effective_modulus=modulus,
        half_width=half_width,
        k=k,
        indentation=indentation,
        w_star=k * a1 * lambda1 / length,
        W=tau * indentation / a1 if a1 > 0 else math.inf,
        tau=tau,
        period_ratio=lambda2 / lambda1,
        amplitude_ratio=a2 / a1 if a1 > 0 else math.inf,
        indentation_load=tau * indentation / (a1 + a2),
    )


def contact_in_metres(
    touch: Touch, theta: npt.ArrayLike, loads: npt.ArrayLike | None = None, dtype: npt.DTypeLike = np.longdouble
) -> Contact:
    """The contact at texture phases ``theta`` (turns; theta = u t / lambda2), one phase or many, in SI.

    ``loads`` (N, broadcast against theta; default ``touch.load``) with the k of eqs 4-5 at each. Of the fields of
    Contact: ``approach`` and ``crest`` in m, ``contact_length`` in m, ``phase_slope`` in m per turn, and ``load_slope``
    dz/dw in m/N, k of eqs 4-5 following the load: -1.5 L / (k |C|).
    """
    weights = np.asarray(touch.load if loads is None else loads, dtype=float)
    each = [stiffness(replace(touch, load=float(weight))) for weight in weights.ravel()]
    load = np.array([one.indentation_load for one in each]).reshape(weights.shape)
    compliance = np.array([1 / one.k for one in each]).reshape(weights.shape)
    tall = touch.ridge_amplitude + touch.texture_amplitude
    contact = solve_contact(
        touch.contact_length / np.longdouble(touch.ridge_period),
        touch.texture_period / np.longdouble(touch.ridge_period),
        touch.texture_amplitude / np.longdouble(tall),
        load, theta, touch.phase, ridge=touch.ridge_amplitude / np.longdouble(tall), dtype=dtype,
    )  # fmt: skip
    length = contact.contact_length * touch.ridge_period
    slope = np.full(length.shape, -np.inf, dtype=length.dtype)
    softness = np.broadcast_to(1.5 * touch.contact_length * compliance, length.shape)
    np.divide(-softness, length, out=slope, where=length > 0)
    return Contact(contact.approach * tall, length, slope, contact.phase_slope * tall, contact.crest * tall)
