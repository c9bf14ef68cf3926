"""Contacts so light that only the crests touch: below w / k = 1e-10 of the heights, down to none."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from synth.contact.exact_solver import Grid
from synth.contact.geometry import Geometry
from tests.reference.contact_oracle import solve_contact
from tests.synth.engine_cases import Real, spread

PHI = math.sqrt(2.0)


def approach(geometry: Geometry, theta: Real, pressed: float) -> Real:
    return Grid.of_geometry(geometry).solve(theta, pressed).height


def oracle(geometry: Geometry, theta: Real, pressed: float) -> Real:
    wanted = solve_contact(
        geometry.contact_length, geometry.texture_period, geometry.texture_amplitude,
        geometry.contact_length * np.longdouble(pressed), theta, geometry.texture_phase, ridge=geometry.ridge_amplitude,
    )  # fmt: skip
    return np.asarray(wanted.approach)


@pytest.mark.parametrize("pressed", [0.9e-10, 1e-11, 1e-12, 1e-14, 1e-20, 0.0])
def test_random_scenes_agree_with_the_oracle_however_light_the_touch(pressed: float) -> None:
    random = np.random.default_rng(31)
    theta = random.uniform(0, 1, 6)
    for _ in range(40):
        amplitude = spread(random, 0.01, 20)
        geometry = Geometry(1.0, 1.0, amplitude, spread(random, 0.02, 50), PHI, spread(random, 0.3, 60))
        found, wanted = approach(geometry, theta, pressed), oracle(geometry, theta, pressed)
        allowed = 2e-12 if pressed == 0.0 or pressed > 1e-17 else 1e-9  # below, no load at all is solved
        assert np.max(np.abs(found - wanted)) <= allowed * (1 + amplitude)


@pytest.mark.parametrize("ridge", [0.0, 1.0])
def test_smooth_fingers_and_short_contacts_agree_with_the_oracle(ridge: float) -> None:
    theta = np.arange(16) / 16
    for tau in (0.02, 0.2, 0.5, 5.0):
        for period in (0.3, 3.0, 40.0):
            geometry = Geometry(ridge, 1.0, 1.0, period, PHI, tau)
            for pressed in (1e-11, 1e-13, 0.0):
                assert np.max(np.abs(approach(geometry, theta, pressed) - oracle(geometry, theta, pressed))) <= 4e-12


def test_equal_crests_share_the_load_as_parabolas_do() -> None:
    ridges, pressed = 7, 1e-12
    geometry = Geometry(1.0, 1.0, 0.0, 1.0, 0.0, float(ridges))
    found = approach(geometry, np.zeros(1), pressed)[0]
    depth = (pressed * 3 / (4 * math.sqrt(2.0)) * 2 * math.pi) ** (2 / 3)
    assert 1.0 - found == pytest.approx(depth, rel=1e-6)


def test_a_heavier_touch_sinks_deeper() -> None:
    geometry = Geometry(1.0, 1.0, 0.5, 1.6, PHI, 12.3)
    theta = np.arange(16) / 16
    heights = [approach(geometry, theta, pressed) for pressed in (0.0, 1e-15, 1e-13, 1e-11, 1e-9, 1e-7)]
    for lighter, heavier in itertools.pairwise(heights):
        assert np.all(heavier < lighter)


def test_without_load_nothing_touches() -> None:
    geometry = Geometry(1.0, 1.0, 0.5, 1.6, PHI, 12.3)
    assert np.all(Grid.of_geometry(geometry).solve(np.arange(16) / 16, 0.0).touching == 0.0)
