"""Integrals of the pressure field, on fine segments, against an oracle that shares no code with them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import beta

from synth.contact.geometry import Geometry
from synth.contact.pressure import PressureField
from synth.contact.profile_solver import SegmentGrid
from tests.few import few
from tests.reference.pressure_oracle import Surfaces, power_mean, rise_mean, slope_mean
from tests.synth.engine_cases import Real, spread

EXPONENTS = (0.5, 0.8, 1.0, 1.25, 1.5)
FINE = 1 << 12  # segments of a period of the texture, or of a ridge, at least
NEAR = 1e-6  # of the largest that a sum may be: what segments so short leave


def field_of(geometry: Geometry, dome: float = 0.0) -> PressureField:
    wanted = FINE * max(1, math.ceil(geometry.texture_period / geometry.ridge_period))
    fine = replace(geometry.as_profile(), segments=wanted)
    return PressureField(SegmentGrid.of_geometry(fine, dome), geometry.contact_length)


def random_geometry(random: np.random.Generator) -> Geometry:
    """Return surfaces of any kind: locked or not, smooth fingers, flat textures, ridges that begin anywhere."""
    ridge = spread(random, 2e-4, 1e-3)
    ratio = float(random.choice([1.0, 0.5, 2.0, spread(random, 0.1, 30), spread(random, 0.3, 3)]))
    heights = spread(random, 2e-6, 1e-4), spread(random, 2e-6, 1e-4)
    flat = random.integers(0, 12)
    return Geometry(
        ridge_amplitude=0.0 if flat == 0 else heights[0],
        ridge_period=ridge,
        texture_amplitude=0.0 if flat == 1 else heights[1],
        texture_period=ratio * ridge,
        texture_phase=float(random.uniform(0, 6.3)),
        contact_length=spread(random, 5e-4, 1e-2),
        ridge_phase=float(random.choice([0.0, random.uniform(-9, 9)])),
    )


def oracle_of(geometry: Geometry, dome: float, phase: float) -> Surfaces:
    return Surfaces(
        geometry.ridge_amplitude, geometry.ridge_period, geometry.ridge_phase,
        geometry.texture_amplitude, geometry.texture_period, geometry.texture_phase,
        geometry.contact_length, dome, phase * geometry.texture_period,
    )  # fmt: skip


def highest_and_lowest(surfaces: Surfaces) -> tuple[float, float]:
    heights = surfaces.height(np.linspace(0, surfaces.length, 20001, dtype=np.longdouble))
    return float(heights.max()), float(heights.min())


def compare(geometry: Geometry, dome: float, phase: float, z: float) -> None:
    """Hold every sum at one phase and z (m) against the oracle."""
    field, surfaces = field_of(geometry, dome), oracle_of(geometry, dome, phase)
    phases, heights = np.array([phase]), np.array([z])
    found = field.slopes(phases, heights)
    scale = geometry.height_scale + abs(z) + dome * geometry.contact_length**2 / 8
    steepest = 2 * math.pi * geometry.texture_amplitude / geometry.texture_period
    depth, touching = power_mean(surfaces, z, 1.0), power_mean(surfaces, z, 0.0)
    assert abs(found.depth[0] - depth) <= NEAR * scale * max(touching, 1e-6)
    assert abs(found.slope[0] - slope_mean(surfaces, z)) <= NEAR * scale * steepest
    assert abs(found.touching[0] - touching) <= 1e-4
    assert abs(found.rise[0] - rise_mean(surfaces, z)) <= 1e-4 * steepest
    for exponent in EXPONENTS:
        powers = field.powers(phases, heights, exponent)
        power, below = power_mean(surfaces, z, exponent), power_mean(surfaces, z, exponent - 1.0)
        assert powers.power[0] == pytest.approx(power, rel=1e-5), exponent
        assert powers.below[0] == pytest.approx(below, rel=1e-3), exponent


@pytest.mark.parametrize("seed", few(range(24), 8))
def test_every_sum_is_that_of_the_oracle(seed: int) -> None:
    random = np.random.default_rng(seed)
    geometry, dome = random_geometry(random), float(random.choice([0.0, random.uniform(0, 10)]))
    phase = float(random.uniform(-1, 1))
    highest, lowest = highest_and_lowest(oracle_of(geometry, dome, phase))
    for share in (spread(random, 1e-3, 1e-2), random.uniform(0.01, 1.0), random.uniform(1.0, 2.0)):
        compare(geometry, dome, phase, highest - share * (highest - lowest))


@pytest.mark.parametrize("exponent", [0.5, 0.8, 1.5])
def test_a_single_crest_is_a_beta_function(exponent: float) -> None:
    """A cap y = d - c x^2 / 2 of a smooth finger: the integral of y^g is d^g sqrt(2 d / c) B(1/2, g + 1)."""
    geometry = Geometry(0.0, 5e-4, 2e-5, 1e-3, 0.0, 8e-4)
    depth = 1e-2 * geometry.height_scale
    found = field_of(geometry).powers(np.array([0.4]), np.array([2e-5 - depth]), exponent)
    curvature = 2e-5 * (2 * math.pi / 1e-3) ** 2
    wanted = depth**exponent * math.sqrt(2 * depth / curvature) * float(beta(0.5, exponent + 1)) / 8e-4
    assert found.power[0] == pytest.approx(wanted, rel=1e-2)  # the crest is no parabola so far down


def slopes_over_z(field: PressureField, phases: Real, heights: Real, step: float) -> tuple[Real, Real]:
    up, down = field.slopes(phases, heights + step), field.slopes(phases, heights - step)
    upper, lower = field.powers(phases, heights + step, 1.3), field.powers(phases, heights - step, 1.3)
    return (up.slope - down.slope) / (2 * step), (upper.power - lower.power) / (2 * step)


def test_derivatives_over_z_are_those_that_are_told() -> None:
    field = field_of(Geometry(4e-5, 5e-4, 2e-5, 8e-4, 1.4, 1e-2), 3.0)
    phases, heights = np.linspace(0, 1, 40), np.linspace(-2e-5, 3e-5, 40)
    slope, power = slopes_over_z(field, phases, heights, 1e-11)
    found, powers = field.slopes(phases, heights), field.powers(phases, heights, 1.3)
    assert np.max(np.abs(slope + found.rise)) <= 1e-4 * np.max(np.abs(found.rise))
    assert np.max(np.abs(power + 1.3 * powers.below)) <= 1e-4 * np.max(powers.below)


def test_nothing_touches_above_the_crests() -> None:
    field = field_of(Geometry(4e-5, 5e-4, 2e-5, 8e-4, 1.4, 1e-2))
    found = field.slopes(np.array([0.3]), np.array([7e-5]))
    powers = field.powers(np.array([0.3]), np.array([7e-5]), 0.7)
    assert found.slope[0] == found.depth[0] == found.touching[0] == powers.power[0] == powers.below[0] == 0.0


def test_a_longer_way_round_changes_nothing() -> None:
    field = field_of(replace(Geometry(4e-5, 5e-4, 2e-5, 8e-4, 1.4, 1e-2), ridge_phase=0.7))
    turned = [
        field.slopes(np.array([0.3125 + whole]), np.array([1e-5])).slope[0] for whole in (0.0, 1.0, -3.0, 2.0**30)
    ]
    assert len(set(turned)) == 1
