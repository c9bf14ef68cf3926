"""Every kind of surface has the properties of a profile: bounds, period, mean line, shift, roughness."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from synth.scene.texture_registry import kinds
from synth.surfaces.grating import Grating
from synth.surfaces.harmonics import Harmonics
from synth.surfaces.measured import MeasuredProfile
from synth.surfaces.profile import Profile
from synth.surfaces.rough import Rough
from synth.surfaces.sinusoid import Sinusoid

RANDOM = np.random.default_rng(7)
HEIGHTS = RANDOM.normal(0.0, 3e-6, 12) + 1e-3
AMPLITUDES, PHASES = tuple(RANDOM.uniform(0.0, 5e-6, 64)), tuple(RANDOM.uniform(0.0, 6.0, 64))
PROFILES: dict[str, Callable[[float], Profile]] = {
    "sinusoid": lambda phase: Sinusoid(20e-6, 0.8e-3, phase),
    "harmonics": lambda phase: Harmonics(1e-3, phase, AMPLITUDES[:7], PHASES[:7]),
    "64 harmonics": lambda phase: Harmonics(1e-3, phase, AMPLITUDES, PHASES),
    "one harmonic": lambda phase: Harmonics(1e-3, phase, (1e-5,), (0.3,)),
    "trapezoid": lambda phase: Grating(1e-3, 40e-6, 0.3, 50e-6, phase=phase),
    "triangle": lambda phase: Grating(1e-3, 40e-6, 0.5, 0.5e-3, phase=phase),
    "rounded": lambda phase: Grating(1e-3, 40e-6, 0.6, None, 60e-6, phase),
    "sharply rounded": lambda phase: Grating(1e-3, 40e-6, 0.4, None, 40e-6, phase),
    "rough": lambda phase: Rough(5e-3, phase, 0.8, 10e-6, None, 5e-3, 50e-6, 1),
    "jagged": lambda phase: Rough(20e-3, phase, 0.3, None, 0.2, 10e-3, 20e-6, 2),
    "profile": lambda phase: MeasuredProfile(HEIGHTS, 50e-6, phase),
}
each_kind = pytest.mark.parametrize("made", PROFILES.values(), ids=PROFILES)


def test_every_kind_along_a_line_has_a_profile_here() -> None:
    along = {kind.name for kind in kinds().values() if not kind.of_area}
    assert {made(0.0).kind for made in PROFILES.values()} == along


def places_in(profile: Profile, count: int = 20_000) -> np.ndarray:
    return np.random.default_rng(3).uniform(-3.0, 3.0, count) * profile.period


@each_kind
def test_heights_stay_within_the_extent_and_reach_it(made: Callable[[float], Profile]) -> None:
    profile = made(0.4)
    heights = profile.heights(places_in(profile))
    low, high = profile.extent
    assert np.all((heights >= low - 1e-18) & (heights <= high + 1e-18))
    assert heights.max() - heights.min() > 0.9 * (high - low)


@each_kind
def test_a_profile_repeats_after_its_period_and_keeps_the_shape_of_what_was_asked(
    made: Callable[[float], Profile],
) -> None:
    profile = made(0.4)
    places = places_in(profile, 600).reshape(20, 30)
    heights = profile.heights(places)
    assert heights.shape == places.shape
    room = profile.slope_bound * 1e-14 * profile.period + 1e-9 * (profile.extent[1] - profile.extent[0])
    assert np.max(np.abs(profile.heights(places + 5.0 * profile.period) - heights)) < room


@each_kind
@pytest.mark.parametrize("phase", [1.0, -0.3, 7.0, -400.0])
def test_a_phase_shifts_the_profile(made: Callable[[float], Profile], phase: float) -> None:
    base, shifted = made(0.0), made(phase)
    places = places_in(base, 500)
    moved = base.heights(places + phase * base.period / (2.0 * math.pi))
    height = base.extent[1] - base.extent[0]
    assert np.max(np.abs(shifted.heights(places) - moved)) < 1e-9 * height
    assert shifted.key != base.key


@each_kind
def test_slopes_and_curvatures_between_corners_stay_within_their_bounds(made: Callable[[float], Profile]) -> None:
    profile = made(1.3)
    step = 1e-6 * profile.period
    ends = np.concatenate([[0.0], profile.corners, [profile.period]])
    places = np.sort(np.random.default_rng(5).uniform(0.0, profile.period, 4_000))
    piece = np.searchsorted(ends, places)
    clear = np.minimum(places - ends[piece - 1], ends[np.minimum(piece, len(ends) - 1)] - places) > 2.0 * step
    before, at, after = (profile.heights(places[clear] + shift) for shift in (-step, 0.0, step))
    slopes = (after - before) / (2.0 * step)
    assert np.max(np.abs(slopes)) <= profile.slope_bound * (1.0 + 1e-6)
    assert np.max(np.abs(slopes)) > 0.8 * profile.slope_bound
    if math.isfinite(profile.curvature_bound):
        rounding = 1e-13 * (profile.extent[1] - profile.extent[0]) / step**2
        assert np.max(np.abs(after - 2.0 * at + before)) / step**2 <= profile.curvature_bound * 1.001 + rounding


@each_kind
def test_rq_rms_slope_and_the_mean_line_are_those_of_the_heights(made: Callable[[float], Profile]) -> None:
    profile = made(0.2)
    ends = np.unique(np.concatenate([[0.0], profile.corners, np.linspace(0.0, profile.period, 2_001)]))
    nodes, weights = np.polynomial.legendre.leggauss(8)
    middle, half = 0.5 * (ends[1:] + ends[:-1]), 0.5 * np.diff(ends)
    places = middle[:, None] + half[:, None] * nodes
    heights, share = profile.heights(places), half[:, None] * weights / profile.period
    step = 1e-5 * half[:, None]
    slopes = (profile.heights(places + step) - profile.heights(places - step)) / (2.0 * step)
    rq, slope = profile.rms
    assert abs(np.sum(heights * share)) < 1e-8 * rq
    assert math.sqrt(np.sum(heights**2 * share)) == pytest.approx(rq, rel=1e-6)
    assert math.sqrt(np.sum(slopes**2 * share)) == pytest.approx(slope, rel=1e-5)
    equal = profile.equivalent()
    assert equal.amplitude / math.sqrt(2.0) == pytest.approx(rq, rel=1e-12)
    assert math.sqrt(2.0) * math.pi * equal.amplitude / equal.period == pytest.approx(slope, rel=1e-12)


@each_kind
def test_a_closed_form_is_the_profile(made: Callable[[float], Profile]) -> None:
    profile = made(0.9)
    if profile.cosine is None:
        return
    closed, places = profile.cosine, places_in(profile, 200)
    wanted = closed.amplitude * np.cos(2.0 * math.pi * places / closed.period + closed.phase)
    assert closed.period == profile.period
    assert np.max(np.abs(profile.heights(places) - wanted)) < 1e-12 * closed.amplitude


@each_kind
def test_two_of_the_same_are_equal_and_share_a_key(made: Callable[[float], Profile]) -> None:
    assert made(0.9) == made(0.9)
    assert hash(made(0.9)) == hash(made(0.9))
    assert made(0.9).key == made(0.9).key != made(0.8).key


def test_a_measured_profile_is_linear_between_its_points_and_closes() -> None:
    profile = MeasuredProfile(np.array([0.0, 1e-6, 3e-6]), 1e-4)
    mean = 4e-6 / 3.0
    places = np.array([0.0, 0.5e-4, 1e-4, 1.5e-4, 2e-4, 2.5e-4, 3e-4])
    wanted = np.array([0.0, 0.5e-6, 1e-6, 2e-6, 3e-6, 1.5e-6, 0.0]) - mean
    assert profile.heights(places) == pytest.approx(wanted, abs=1e-18)
    assert profile.period == pytest.approx(3e-4)
    assert profile.slope_bound == pytest.approx(0.03)


def test_a_flat_profile_has_no_height_and_no_slope() -> None:
    profile = MeasuredProfile(np.full(5, 2e-3), 1e-4)
    assert not np.any(profile.heights(np.linspace(0.0, 1e-3, 50)))
    assert (profile.equivalent().amplitude, profile.slope_bound, profile.curvature_bound) == (0.0, 0.0, 0.0)
