"""The exact solver against an independent oracle."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest

from synth.contact.exact_solver import MOST_ITERATIONS, SMALLEST_INDENTATION, Approaches, Grid
from synth.contact.geometry import Geometry
from tests.few import thorough
from tests.reference.contact_oracle import solve_contact
from tests.synth.engine_cases import Real, spread

PHI = math.sqrt(2.0)
PROMISED = 2e-12  # of a1 + a2: the project's promise
ROUND_OFF = 2e-13  # of a1 + a2: the limit that the module states
BOUND = 40  # the largest seen was 37; a cold start at the smallest load takes log3(1e12) = 25 for a crest, 30 at an end


def unit(tau: float, period: float, amplitude: float, ridge: float = 1.0, phi: float = PHI) -> Geometry:
    """Return the geometry of dimensionless groups, with a1 = `ridge` and lambda1 = 1 m."""
    return Geometry(ridge, 1.0, amplitude, period, phi, tau)


def solved(geometry: Geometry, theta: Any, pressed: float, guess: Real | None = None) -> Approaches:
    return Grid.of_geometry(geometry).solve(np.atleast_1d(np.asarray(theta, dtype=float)), pressed, guess)


def errors(geometry: Geometry, theta: Any, pressed: float) -> tuple[float, float]:
    """Return the largest error of z over a1 + a2, and of the contact length over L."""
    theta = np.atleast_1d(np.asarray(theta, dtype=float))
    found = solved(geometry, theta, pressed)
    wanted = solve_contact(
        geometry.contact_length, geometry.texture_period, geometry.texture_amplitude,
        geometry.contact_length * np.longdouble(pressed), theta, geometry.texture_phase, ridge=geometry.ridge_amplitude,
    )  # fmt: skip
    z = np.max(np.abs(found.height - wanted.approach)) / geometry.height_scale
    return float(z), float(np.max(np.abs(found.touching - wanted.contact_length / geometry.contact_length)))


@pytest.mark.parametrize("scenes", [30, thorough(200)])
def test_random_scenes_agree_with_the_oracle(scenes: int) -> None:
    random = np.random.default_rng(20)
    worst, longest = 0.0, 0.0
    for _ in range(scenes):
        geometry = unit(
            spread(random, 0.3, 60), spread(random, 0.02, 50), spread(random, 0.01, 20), phi=random.uniform(0, 6.28)
        )
        z, length = errors(geometry, random.uniform(0, 1), spread(random, 1e-6, 3))
        worst, longest = max(worst, z), max(longest, length)
    assert worst <= PROMISED
    assert worst <= ROUND_OFF
    assert longest <= 1e-8  # where a patch is just born its width is the root of its height


def test_neighbouring_phases_from_the_phases_before_agree_with_the_oracle() -> None:
    random = np.random.default_rng(21)
    for _ in range(6):
        geometry = unit(spread(random, 0.3, 30), spread(random, 0.1, 20), spread(random, 0.01, 20))
        theta = random.uniform(0, 1) + np.arange(24) / spread(random, 24, 2000)
        assert errors(geometry, theta, spread(random, 1e-6, 3))[0] <= ROUND_OFF


def test_cold_and_warm_starts_find_the_same_root() -> None:
    random = np.random.default_rng(22)
    for _ in range(40):
        geometry = unit(spread(random, 0.3, 60), spread(random, 0.02, 50), spread(random, 0.01, 20))
        theta, pressed = np.sort(random.uniform(0, 1, 32)), spread(random, 1e-9, 3)
        warm = solved(geometry, theta, pressed).height
        cold = np.array([solved(geometry, one, pressed).height[0] for one in theta])
        guessed = solved(geometry, theta, pressed, warm + random.normal(0, 0.1, 32) * geometry.height_scale).height
        assert np.max(np.abs(warm - cold)) <= ROUND_OFF * geometry.height_scale
        assert np.max(np.abs(guessed - cold)) <= ROUND_OFF * geometry.height_scale


def any_contact(number: int, random: np.random.Generator) -> Geometry:
    """Return a contact of any kind, or one with an h that is nearly flat or nearly a line."""
    tau, period, amplitude = spread(random, 1e-2, 300), spread(random, 3e-3, 300), spread(random, 1e-9, 1e9)
    ridge, phase = 1.0, float(random.uniform(0, 6.28))
    match number % 6:
        case 1:
            ridge, amplitude = 0.0, 1.0
        case 2:
            period, amplitude = 1.0, spread(random, 0.5, 2.0)
        case 3:
            period, amplitude, phase = 1.0 + spread(random, 1e-12, 1e-3), 1.0, math.pi
        case 4:
            period, amplitude, phase = 1.0, 1.0 + spread(random, 1e-15, 1e-3), math.pi
        case 5:
            tau = spread(random, 1e-3, 0.2)
    return unit(tau, max(period, tau / 1000), amplitude, ridge, phase)


def test_iterations_are_bounded_and_what_takes_most_is_solved_and_not_cut_short() -> None:
    """At any load, from a cold start and from bad guesses; only few iterations where phases follow each other."""
    random, lightest, most = np.random.default_rng(60), SMALLEST_INDENTATION, 0
    for number in range(240):
        geometry = any_contact(number, random)
        scale = geometry.height_scale
        pressed = spread(random, 1e-22, 1e3) if number % 2 else spread(random, lightest, 1e6 * lightest)
        phases = random.uniform(0, 1, 4)  # unordered: each begins far from the end of the one before
        cold = solved(geometry, phases, pressed * scale)
        far = solved(geometry, phases, max(pressed, 1e-18) * scale, random.uniform(-50, 50, 4) * scale)
        most = max(most, int(cold.iterations.max()), int(far.iterations.max()))
        assert np.all(np.isfinite(cold.height))
        if number < 24 and geometry.texture_periods <= 300 and geometry.ridges <= 100:
            assert errors(geometry, phases[:1], max(pressed, lightest) * scale)[0] <= ROUND_OFF
    assert most <= BOUND < MOST_ITERATIONS
    period = solved(unit(20, 1.6, 0.5), np.arange(512) / 512, 0.02)
    assert float(period.iterations[8:].mean()) <= 3.0


CONTACTS: dict[str, tuple[list[Geometry], tuple[float, ...]]] = {
    "patches hide anywhere": ([unit(9.3, period, 2.5) for period in (0.31, 1.0, 3.7, 40.0)], (1e-8, 1e-3, 0.4)),
    "shorter than a ridge": (
        [unit(tau, period, 0.7) for tau in (0.02, 0.11, 0.29, 0.75) for period in (0.04, 0.9, 12.0)], (1e-6, 1e-2, 1.0)
    ),
    "the period of the ridges": ([unit(7, 1.0, height) for height in (0.3, 1.0, 1.0001, 4.0)], (1e-6, 1e-2, 0.5)),
    "a smooth finger": (
        [unit(6.0, period, 1.0, ridge=0.0) for period in (0.03, 0.8, 30.0)], (1e-7, 1e-2, 0.7, 3.0)
    ),
    "a smooth texture": ([unit(6.3, 1.7, 0.0)], (0.02,)),
    "a tiny texture": ([unit(12.3, 1.6, height) for height in (1e-3, 1e-6, 1e-9, 1e-12)], (1e-6, 1e-2, 0.3)),
    "thousands of texture periods": ([unit(20.0, 0.00942, height) for height in (0.5, 30.0)], (1e-4, 0.1)),
    "full contact": ([unit(tau, 1.7, 0.5) for tau in (0.3, 7.0, 20.3)], (4.0,)),
}  # fmt: skip
THETA = np.concatenate([np.arange(3) / 3, PHI / (2 * np.pi) + np.array([0.0, 1e-9, 1e-4])])


@pytest.mark.parametrize("name", CONTACTS)
def test_contacts_of_every_kind_agree_with_the_oracle(name: str) -> None:
    geometries, loads = CONTACTS[name]
    for geometry, pressed in itertools.product(geometries, loads):
        theta = THETA if geometry.texture_periods < 1000 else THETA[1:2]
        assert errors(geometry, theta, pressed)[0] <= ROUND_OFF
        found = solved(geometry, theta, pressed)
        if name == "full contact":
            assert np.max(np.abs(found.touching - 1.0)) <= 1e-12
        if name == "a smooth texture":
            assert np.ptp(found.height) <= 1e-15


@pytest.mark.parametrize("pressed", [0.9e-10, 1e-11, 1e-12, 1e-14, 1e-20, 0.0])
@pytest.mark.parametrize("scenes", [3, thorough(40)])
def test_contacts_so_light_that_only_crests_touch_agree_with_the_oracle(scenes: int, pressed: float) -> None:
    random = np.random.default_rng(31)
    several = [unit(spread(random, 0.3, 60), spread(random, 0.02, 50), spread(random, 0.01, 20)) for _ in range(scenes)]
    several += [unit(tau, period, 1.0, ridge) for tau in (0.02, 0.5, 5.0) for period in (0.3, 40.0)
                for ridge in (0.0, 1.0)]  # fmt: skip
    allowed = PROMISED if pressed == 0.0 or pressed > 1e-17 else 1e-9  # below, it is solved as no load
    for geometry in several:
        theta = random.uniform(0, 1, 2)
        assert errors(geometry, theta, pressed)[0] <= allowed
        assert pressed > 0.0 or not solved(geometry, theta, pressed).touching.any()


def test_equal_crests_share_the_load_as_parabolas_do() -> None:
    pressed = 1e-12
    found = solved(unit(7.0, 1.0, 0.0, phi=0.0), 0.0, pressed).height[0]
    depth = (pressed * 3 / (4 * math.sqrt(2.0)) * 2 * math.pi) ** (2 / 3)
    assert 1.0 - found == pytest.approx(depth, rel=1e-6)


def test_a_heavier_touch_sinks_deeper() -> None:
    loads = (0.0, 1e-15, 1e-13, 1e-11, 1e-9, 1e-7)
    heights = [solved(unit(12.3, 1.6, 0.5), np.arange(16) / 16, pressed).height for pressed in loads]
    for lighter, heavier in itertools.pairwise(heights):
        assert np.all(heavier < lighter)


def test_whole_turns_change_nothing() -> None:
    geometry = unit(12.0, 1.5, 0.7)
    turned = [solved(geometry, 0.3125 + whole, 0.05).height[0] for whole in (0.0, 1.0, -3.0, 2.0**30)]
    assert len(set(turned)) == 1


def test_lengths_scale_and_metres_are_metres() -> None:
    small = Geometry(40e-6, 0.5e-3, 20e-6, 0.8e-3, PHI, 10e-3)
    large = Geometry(1.0, 1.0, 0.5, 1.6, PHI, 20.0)
    theta = np.arange(16) / 16
    ratio = solved(small, theta, 2e-6).height / solved(large, theta, 2e-6 / 40e-6).height
    assert ratio == pytest.approx(40e-6, rel=1e-11)


def test_a_ridge_phase_shifts_the_finger_under_the_contact() -> None:
    """A contact that begins at x0 of another one equals that one with both phases shifted."""
    begin = 0.37
    long = Geometry(1.0, 1.0, 0.6, 1.31, PHI, 20.0)
    turned = Geometry(1.0, 1.0, 0.6, 1.31, PHI + 2.0 * np.pi * begin / 1.31, 5.0, 2.0 * np.pi * begin)
    phases, heights = np.linspace(0.0, 1.0, 7), np.linspace(-0.5, 1.2, 7)
    depth, touching = Grid.of_geometry(turned).measure(phases, heights)
    x = begin + 5.0 * (np.arange(1 << 18) + 0.5) / (1 << 18)
    for theta, z, mean, part in zip(phases, heights, depth, touching, strict=True):
        h = long.texture_amplitude * np.cos(2 * np.pi * (x / 1.31 - theta) + PHI) - np.cos(2 * np.pi * x)
        assert abs(np.mean(np.maximum(h - z, 0.0)) - mean) < 1e-9
        assert abs(np.mean(h > z) - part) < 1e-4
