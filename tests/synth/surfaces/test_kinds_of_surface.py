"""Each kind of surface against its own formula: gratings by geometry, rough surfaces by their spectrum."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from synth.surfaces.grating import Grating
from synth.surfaces.harmonics import Harmonics
from synth.surfaces.measured import MeasuredProfile
from synth.surfaces.rough import Rough

LINES = np.array([1e-6, 0.0, 3e-6, 0.0, 2e-6])
SHIFTS = np.array([0.1, 0.0, 2.0, 0.0, -1.0])


def rough(**other: object) -> Rough:
    asked = {"hurst": 0.8, "rms_height": 1e-5, "rms_slope": None, "longest": 0.02, "shortest": 2e-5, "seed": 5} | other
    return Rough(0.02, 0.0, **asked)  # type: ignore[arg-type]


def power_of(profile: Rough, points: int = 2**15) -> np.ndarray:
    """Return the power of each order, from the heights only."""
    heights = profile.heights(np.arange(points) * profile.period / points)
    return np.abs(np.fft.rfft(heights) / points) ** 2


def test_harmonics_are_the_sum_of_their_cosines() -> None:
    profile = Harmonics(2e-3, 0.0, tuple(LINES), tuple(SHIFTS))
    places = np.linspace(-5e-3, 5e-3, 777)
    orders = np.arange(1, 6)[:, None]
    wanted = LINES @ np.cos(2.0 * math.pi * orders * places / 2e-3 + SHIFTS[:, None])
    assert np.max(np.abs(profile.heights(places) - wanted)) < 1e-14 * LINES.sum() * 100
    assert profile.rms[0] == pytest.approx(math.sqrt(np.sum(LINES**2) / 2.0), rel=1e-12)


def test_a_table_of_many_orders_is_their_sum_to_1e_9_of_rq() -> None:
    profile = rough()
    amplitudes, phases = profile.orders
    places = np.random.default_rng(1).uniform(0.0, 0.02, 40)
    orders = np.arange(1, len(amplitudes) + 1)[:, None]
    wanted = amplitudes @ np.cos(2.0 * math.pi * orders * places / 0.02 + phases[:, None])
    assert np.max(np.abs(profile.heights(places) - wanted)) < 1e-9 * profile.rms[0]


@settings(max_examples=60)
@given(
    duty=st.floats(0.05, 0.95),
    part=st.floats(0.02, 1.0),
    height=st.floats(1e-6, 1e-3),
)
def test_a_grating_has_its_duty_at_half_height_and_its_height_between_flats(
    duty: float, part: float, height: float
) -> None:
    period = 1e-3
    ramp = part * min(duty, 1.0 - duty) * period
    profile = Grating(period, height, duty, ramp)
    low, high = profile.extent
    assert high - low == pytest.approx(height)
    places = (np.arange(20_000) + 0.5) * period / 20_000
    above = profile.heights(places) > 0.5 * (low + high)
    assert np.mean(above) == pytest.approx(duty, abs=1.1e-4)
    flats = 0.5 * (duty * period - ramp), 0.5 * (duty * period + ramp)
    heights = profile.heights(np.array([0.0, 0.999 * flats[0], 0.5 * duty * period, 1.001 * flats[1], 0.5 * period]))
    assert heights == pytest.approx(
        [high, high, 0.5 * (low + high), low if flats[1] * 1.001 < 0.5 * period else heights[3], low],
        abs=1e-9 * height + 1e-3 * height * (flats[1] >= 0.4995 * period),
    )


@settings(max_examples=60)
@given(height=st.floats(1e-6, 1e-4), sharp=st.floats(1.01, 8.0), duty=st.floats(0.4, 0.6))
def test_rounded_edges_are_arcs_of_their_radius(height: float, sharp: float, duty: float) -> None:
    radius = 0.5 * height * sharp
    profile = Grating(1e-3, height, duty, None, radius)
    low, high = profile.extent
    begin = 0.5 * (duty * profile.period - profile.flank)  # the flat top's end, above the centre of the convex arc
    across = np.linspace(0.0, 0.5 * profile.flank, 50)[:-1]
    drop = high - profile.heights(begin + across)
    assert np.hypot(across, radius - drop) == pytest.approx(np.full(len(across), radius), rel=1e-9)
    rise = profile.heights(begin + profile.flank - across) - low
    assert rise == pytest.approx(drop, abs=1e-9 * height)
    assert len(profile.corners) == 0


@pytest.mark.parametrize("sharp", [1.00126, 1.01, 1.5, 10.0])
def test_the_roughness_of_rounded_edges_is_that_of_quadrature_over_the_angle_of_their_arcs(sharp: float) -> None:
    height, radius = 40e-6, 20e-6 * sharp
    profile = Grating(1e-3, height, 0.5, None, radius)
    last = math.acos(1.0 - 0.5 * height / radius)
    rates = quad(lambda t: math.tan(t) ** 2 * math.cos(t), 0.0, last, epsabs=0.0, epsrel=1e-10)[0] * radius
    assert profile.rms[1] == pytest.approx(math.sqrt(4.0 * rates / profile.period), rel=1e-9)
    assert profile.slope_bound == pytest.approx(math.tan(last), rel=1e-9)
    arcs = quad(lambda t: (0.5 * height - radius * (1.0 - math.cos(t))) ** 2 * math.cos(t), 0.0, last, epsabs=0.0)[0]
    flat = 0.25 * height**2 * (profile.period - 4.0 * radius * math.sin(last))
    assert profile.rms[0] == pytest.approx(math.sqrt((flat + 4.0 * radius * arcs) / profile.period), rel=1e-9)


def test_the_corners_of_a_trapezoid_are_where_its_flanks_end() -> None:
    profile = Grating(1e-3, 40e-6, 0.3, 50e-6)
    assert profile.corners == pytest.approx([125e-6, 175e-6, 825e-6, 875e-6])
    shifted = Grating(1e-3, 40e-6, 0.3, 50e-6, phase=2.0 * math.pi * 0.5)
    assert shifted.corners == pytest.approx([325e-6, 375e-6, 625e-6, 675e-6])


@pytest.mark.parametrize("hurst", [0.0, 0.3, 0.8, 1.0])
def test_the_spectrum_of_a_rough_surface_falls_as_its_hurst_exponent_says(hurst: float) -> None:
    profile = rough(hurst=hurst, longest=0.01, shortest=4e-5)
    power = power_of(profile)
    first, last = 2, 500
    orders = np.arange(first, last + 1)
    slope = np.polyfit(np.log(orders), np.log(power[orders]), 1)[0]
    assert slope == pytest.approx(-(1.0 + 2.0 * hurst), abs=1e-3)
    outside = np.concatenate([power[:first], power[last + 1 : 4096]])
    assert np.max(outside) < 1e-12 * power[last]


def test_a_rough_surface_has_exactly_the_size_that_was_asked_for() -> None:
    assert rough().rms[0] == pytest.approx(1e-5, rel=1e-12)
    assert rough(rms_height=None, rms_slope=0.15).rms[1] == pytest.approx(0.15, rel=1e-12)
    power = power_of(rough())
    assert math.sqrt(2.0 * np.sum(power)) == pytest.approx(1e-5, rel=1e-8)


def test_the_seed_alone_decides_a_rough_surface() -> None:
    places = np.linspace(0.0, 0.02, 100)
    assert np.array_equal(rough().heights(places), rough().heights(places))
    assert rough() == rough() != rough(seed=6)
    assert np.max(np.abs(rough().heights(places) - rough(seed=6).heights(places))) > 1e-6
    np.random.seed(1)
    assert np.array_equal(rough().heights(places), rough().heights(places))


def test_the_phases_of_a_seed_are_those_of_pcg64() -> None:
    _, phases = rough(seed=1).orders
    wanted = 2.0 * math.pi * np.array([0.5118216247002567, 0.9504636963259353, 0.14415961271963373])
    assert phases[:3] == pytest.approx(wanted, rel=1e-15)


def test_another_shortest_wave_keeps_the_longer_ones() -> None:
    fine, coarse = power_and_phase(rough()), power_and_phase(rough(shortest=2e-4))
    ratio = fine[:100] / coarse[:100]
    assert np.max(np.abs(np.angle(ratio))) < 1e-6
    assert np.ptp(np.abs(ratio)) < 1e-6 * np.mean(np.abs(ratio))


def power_and_phase(profile: Rough) -> np.ndarray:
    heights = profile.heights(np.arange(2**14) * profile.period / 2**14)
    return np.fft.rfft(heights)[1:]


@settings(max_examples=40)
@given(
    points=st.lists(st.floats(-1e-4, 1e-4), min_size=2, max_size=40),
    spacing=st.floats(1e-6, 1e-3),
    phase=st.floats(-30.0, 30.0),
)
def test_a_measured_profile_passes_through_its_points(points: list[float], spacing: float, phase: float) -> None:
    profile = MeasuredProfile(np.array(points), spacing, phase)
    places = np.arange(len(points), dtype=np.float64) * spacing - phase * profile.period / (2.0 * math.pi)
    wanted = np.array(points) - np.mean(points)
    room = 1e-9 * (np.ptp(points) + 1e-18)
    assert np.max(np.abs(profile.heights(places) - wanted)) <= room


def test_a_fine_measured_profile_becomes_the_sinusoid_that_it_samples() -> None:
    count = 4096
    profile = MeasuredProfile(2e-5 * np.cos(2.0 * math.pi * np.arange(count) / count), 0.8e-3 / count)
    equal = profile.equivalent()
    assert equal.amplitude == pytest.approx(2e-5, rel=1e-6)
    assert equal.period == pytest.approx(0.8e-3, rel=1e-6)
