"""Strain below the surface: beside line loads and point loads that are summed, and beside known limits."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad

from synth.perception.half_space import MODULUS, POISSON, strain_gain, strain_under_probe


@pytest.mark.parametrize("poisson", [0.3, 0.4, 0.5])
@pytest.mark.parametrize("depth", [0.15, 0.5, 1.0])
def test_a_periodic_pressure_is_a_sum_of_line_loads(depth: float, poisson: float) -> None:
    """Flamant's stresses of lines 1/64 of a wavelength apart, whose pressure fades out over sixty wavelengths."""
    x = np.arange(-120 * 64, 120 * 64) / 64.0
    load = np.cos(2.0 * math.pi * x) * np.exp(-0.5 * (x / 20.0) ** 2) / 64.0
    r2 = x**2 + depth**2
    normal, along = -2.0 / math.pi * depth**3 / r2**2, -2.0 / math.pi * depth * x**2 / r2**2
    strain = -(1.0 + poisson) / MODULUS * np.sum(load * ((1.0 - poisson) * normal - poisson * along))
    found = float(strain_gain(np.array([2.0 * math.pi]), depth, MODULUS, poisson)[0])
    assert found == pytest.approx(float(strain), rel=1e-3)


@pytest.mark.parametrize(("depth", "radius"), [(0.7e-3, 0.5e-3), (1.6e-3, 3e-3), (2e-3, 3e-3), (0.3e-3, 3e-3)])
def test_a_probe_is_a_sum_of_point_loads(depth: float, radius: float) -> None:
    """Boussinesq's stresses on the axis of the pressure under a flat punch, ring by ring."""

    def ring(r: float, *, normal: bool) -> float:
        rho = math.hypot(r, depth)
        aside = ((1.0 - 2.0 * POISSON) * depth / rho**3 - 3.0 * r**2 * depth / rho**5) / (4.0 * math.pi)
        return 2.0 * math.pi * r * (-1.5 / math.pi * depth**3 / rho**5 if normal else aside)

    pressed = 2.0 / (math.pi * radius * (1.0 - POISSON**2))  # mean pressure over E, per metre

    def stress(*, normal: bool) -> float:
        """The weight (radius - r)^(-1/2) of the punch is integrated exactly."""
        whole = quad(
            lambda r: ring(r, normal=normal) * 0.5 * pressed * radius / math.sqrt(radius + r),
            0.0, radius, weight="alg", wvar=(0.0, -0.5),
        )  # fmt: skip
        return float(whole[0])

    strain = -(stress(normal=True) - 2.0 * POISSON * stress(normal=False))
    assert strain_under_probe(depth, radius) == pytest.approx(strain, rel=1e-6)


def test_a_fine_pattern_fades_and_a_uniform_pressure_does_not() -> None:
    depth = 0.7e-3
    gains = strain_gain(2.0 * math.pi / np.array([1e9, 10e-3, 1e-3, 0.2e-3]), depth)
    assert gains[0] == pytest.approx((1.0 + POISSON) * (1.0 - 2.0 * POISSON) / MODULUS)
    assert gains[1] > gains[2] > gains[3] and gains[3] < 1e-7 * gains[1]
    assert np.array_equal(strain_gain(np.array([-4e3]), depth), strain_gain(np.array([4e3]), depth))
