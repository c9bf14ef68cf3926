"""Self-affine areas: size, spectrum and bounds, against sums of cosines and Fourier transforms of many heights."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from synth.surfaces.profile import Array
from synth.surfaces.self_affine_area import SelfAffineArea

ISOTROPIC = SelfAffineArea(4e-3, 6e-3, 0.7, 8e-6, None, 2e-3, 0.1e-3, seed=5, phase=1.2)
FIELDS = [ISOTROPIC, replace(ISOTROPIC, hurst=0.0, across=4e-3, longest=0.5e-3), replace(ISOTROPIC, aspect=3.0, seed=2)]


def over(field: SelfAffineArea, columns: int, rows: int) -> tuple[Array, Array, Array]:
    """Return places along and across over a period, and the heights there."""
    x = np.asarray(np.arange(columns) * (field.period / columns), np.float64)
    y = np.asarray(np.arange(rows) * (field.across / rows), np.float64)
    return x, y, field.area(x, y)


def spectrum(field: SelfAffineArea) -> tuple[Array, Array, Array]:
    """Return the wave numbers (1/m) along, those across, and the power (m^2), of each wave: [rows, columns]."""
    lines = np.fft.fft2(over(field, 256, 256)[2]) / 256**2
    numbers = np.fft.fftfreq(256, 1.0 / 256)
    along, across = np.meshgrid(numbers / field.period, numbers / field.across)
    return along, across, np.abs(lines) ** 2


@pytest.mark.parametrize("field", FIELDS)
def test_size_is_exact(field: SelfAffineArea) -> None:
    assert field.rms[0] == pytest.approx(8e-6, rel=1e-12)
    along, _across, power = spectrum(field)
    assert math.sqrt(power.sum()) == pytest.approx(8e-6, rel=1e-10)
    slope = math.sqrt(np.sum(power * (2.0 * math.pi * along) ** 2))
    assert field.rms[1] == pytest.approx(slope, rel=1e-10)
    sloped = replace(field, rms_height=None, rms_slope=0.3)
    assert sloped.rms[1] == pytest.approx(0.3, rel=1e-12)
    assert sloped.rms[0] == pytest.approx(8e-6 * 0.3 / slope, rel=1e-10)


@pytest.mark.parametrize("field", FIELDS)
def test_power_falls_as_that_of_a_self_affine_surface(field: SelfAffineArea) -> None:
    along, across, power = spectrum(field)
    q = np.hypot(along, field.aspect * across)
    there = (q >= 1.0 / field.longest) & (q <= 1.0 / field.shortest)
    expected = q[there] ** -(2.0 + 2.0 * field.hurst)
    assert np.allclose(power[there] / power[there].sum(), expected / expected.sum(), rtol=1e-9, atol=0.0)
    assert power[~there].sum() < 1e-20 * power.sum()


def test_an_isotropic_area_is_correlated_alike_along_and_across() -> None:
    for seed in range(4):
        field = replace(ISOTROPIC, period=8e-3, across=8e-3, longest=1e-3, seed=seed)
        heights = over(field, 256, 256)[2]
        lengths = [correlation_length(lines, 8e-3 / 256) for lines in (heights, heights.T)]
        assert lengths[0] == pytest.approx(lengths[1], rel=0.15)
        wider = over(replace(field, aspect=3.0), 256, 256)[2]
        lengths = [correlation_length(lines, 8e-3 / 256) for lines in (wider, wider.T)]
        assert lengths[1] == pytest.approx(3.0 * lengths[0], rel=0.25)


def correlation_length(lines: Array, step: float) -> float:
    """Return the distance (m) along the lines at which their autocorrelation falls to 1 / e."""
    power = np.mean(np.abs(np.fft.rfft(lines, axis=1)) ** 2, axis=0)
    found = np.fft.irfft(power)
    below = int(np.argmax(found < found[0] / math.e))
    before, after = found[below - 1 : below + 1] / found[0]
    return step * float(below - (1.0 / math.e - after) / (before - after))


@pytest.mark.parametrize("seed", range(6))
def test_bounds_hold_and_are_close(seed: int) -> None:
    field = replace(FIELDS[seed % 3], seed=seed)
    x, y, heights = over(field, 1600, 1600)
    low, high, steepest, most_curved = field.bounds
    along, across = (np.abs(np.diff(heights, axis=axis)).max() / step for axis, step in ((1, x[1]), (0, y[1])))
    for found, bound in ((heights.min(), low), (heights.max(), high), (along, steepest), (across, field.slope_across)):
        assert 0.975 * abs(bound) < abs(found) <= abs(bound)
    assert np.abs(np.diff(heights, n=2, axis=1)).max() / x[1] ** 2 < most_curved


def test_a_sum_is_the_sum_of_its_waves_and_a_phase_shifts_it() -> None:
    field = replace(ISOTROPIC, longest=4e-3, shortest=2e-3, across=4e-3, phase=0.0)
    x, y = np.linspace(-5e-3, 7e-3, 31), np.linspace(-1e-3, 9e-3, 17)
    lines = np.fft.fft2(over(field, 8, 8)[2]) / 64
    total = np.zeros((17, 31))
    for m in range(-2, 3):
        for n in range(-2, 3):
            angle = 2.0 * math.pi / 4e-3 * (n * x + m * y[:, np.newaxis])
            total += abs(lines[m, n]) * np.cos(angle + np.angle(lines[m, n]))
    assert np.allclose(field.area(x, y), total, rtol=0.0, atol=1e-18)
    assert np.allclose(replace(field, phase=0.5 * math.pi).area(x, y), field.area(x + 1e-3, y), rtol=0.0, atol=1e-18)


def test_finer_waves_leave_the_others_as_they_are() -> None:
    fine = replace(ISOTROPIC, rms_height=8e-6, shortest=0.1e-3)
    coarse = replace(fine, shortest=0.4e-3)
    both = [np.fft.fft2(over(field, 256, 256)[2]) for field in (fine, coarse)]
    shared = np.abs(both[1]) > 1e-6 * np.abs(both[1]).max()
    assert shared.sum() > 100 and np.allclose(np.angle(both[0][shared] / both[1][shared]), 0.0, atol=1e-6)
    assert not np.allclose(over(replace(fine, seed=6), 32, 32)[2], over(fine, 32, 32)[2])
