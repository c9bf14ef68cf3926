"""Strain below the surface of the skin, as an elastic half-space: under a periodic pressure, and under a probe.

Model   Plane strain. Under the pressure p cos(q x) the strain normal to the surface, at the depth d, is
            (1 + nu) / E ((1 - 2 nu) + q d) e^(-q d) p cos(q x),
        compression counted positive. A pattern of wavelength 2 pi / q fades within a sixth of its wavelength.
        On the axis of a flat round probe of radius a that is pressed in by u, at the depth d, the skin moves by
            u 2 / pi (arctan(a / d) + a d / (2 (1 - nu) (a^2 + d^2))),
        and the strain is minus its derivative over d.
Source  Johnson (1985), Contact Mechanics, chapters 2 and 3; the rigid punch is Sneddon's (1946). Strain at the depth of
        receptors as what they respond to: Phillips & Johnson (1981), J. Neurophysiol. 46.
        MODULUS, POISSON: those of the skin of TouchSim (Saal et al., 2017).
Limits  One layer, linear, static. Skin has a stiff surface, which spreads a pattern further.
"""

from __future__ import annotations

import math

import numpy as np

from synth.arrays import Array

MODULUS, POISSON = 5e4, 0.4  # Pa


def strain_gain(wave_number: Array, depth: float, modulus: float = MODULUS, poisson: float = POISSON) -> Array:
    """Return the strain (1/Pa) at `depth` (m) for each amplitude of a pressure cos(q x).

    wave_number: q, rad/m, of either sign.
    """
    qd = np.abs(wave_number) * depth
    return np.asarray((1.0 + poisson) / modulus * ((1.0 - 2.0 * poisson) + qd) * np.exp(-qd))


def strain_under_probe(depth: float, radius: float, poisson: float = POISSON) -> float:
    """Return the strain (1/m) at `depth` (m) on the axis of a flat probe, per metre that it is pressed in.

    radius: of the probe, m.
    """
    far = radius**2 + depth**2
    bend = radius * (radius**2 - depth**2) / (2.0 * (1.0 - poisson) * far**2)
    return 2.0 / math.pi * (radius / far - bend)
