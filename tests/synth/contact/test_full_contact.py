"""Full contact in closed form against the oracle."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from synth.contact.geometry import Geometry
from synth.contact.load_balance import full_contact, mean_sine_factor
from synth.contact.stiffness import Stiffness
from tests.reference.stiffness_oracle import contact_in_metres
from tests.synth.engine_cases import load_of, random_document, scene_of, touch_of

HEAVY = 40.0  # N: flattens every scene of these tests


@pytest.mark.parametrize("seed", range(8))
def test_full_contact_is_one_sinusoid(seed: int) -> None:
    scene = scene_of(**random_document(np.random.default_rng(seed), 48000))
    geometry, law = Geometry.of_scene(scene), Stiffness.of_scene(scene)
    closed = full_contact(geometry, law, HEAVY)
    theta = np.arange(12) / 12
    wanted = contact_in_metres(replace(touch_of(scene), load=HEAVY), theta)
    if closed is None:
        assert float(np.min(wanted.contact_length)) < geometry.contact_length * (1 + 1e-12)
        pytest.fail("this load was chosen to flatten the contact")
    z = closed.mean + 2 * (closed.first * np.exp(2j * np.pi * theta)).real
    assert np.max(np.abs(z - wanted.approach)) <= 1e-14 * law.indentation(HEAVY) + 1e-14 * geometry.height_scale
    assert closed.slope == pytest.approx(float(wanted.load_slope[0]), rel=1e-9)


def test_it_is_never_claimed_where_a_part_of_the_contact_is_free() -> None:
    random = np.random.default_rng(5)
    claimed = 0
    for _ in range(60):
        scene = scene_of(**random_document(random, 48000))
        geometry, law = Geometry.of_scene(scene), Stiffness.of_scene(scene)
        load = load_of(law, random.uniform(0.5, 1.5) * geometry.height_scale)
        if full_contact(geometry, law, load) is not None:
            claimed += 1
            wanted = contact_in_metres(replace(touch_of(scene), load=load), np.arange(16) / 16, dtype=np.float64)
            assert float(np.min(wanted.contact_length)) == pytest.approx(geometry.contact_length, rel=1e-12)
    assert 10 < claimed < 60


def test_light_contacts_are_left_to_the_solver() -> None:
    scene = scene_of()
    geometry, law = Geometry.of_scene(scene), Stiffness.of_scene(scene)
    assert full_contact(geometry, law, 0.3) is None
    assert full_contact(geometry, law, 0.0) is None


def test_the_amplitude_is_the_sinc_of_the_periods_in_the_contact() -> None:
    for turns in (0.3, 1.5, 12.5, 3.75):
        geometry = Geometry(40e-6, 0.5e-3, 20e-6, 10e-3 / turns, 0.7, 10e-3)
        closed = full_contact(geometry, Stiffness.of_contact(geometry, 1.35e5), HEAVY)
        assert closed is not None
        assert 2 * abs(closed.first) == pytest.approx(20e-6 * abs(np.sinc(turns)), rel=1e-12)


@pytest.mark.parametrize("turns", [1.0, 2.0, 20.0, 4096.0])
def test_whole_periods_in_the_contact_cancel_exactly(turns: float) -> None:
    assert mean_sine_factor(turns) == 0.0
    assert mean_sine_factor(0.0) == 1.0


def test_the_sinc_keeps_its_digits_near_whole_turns() -> None:
    for turns in (0.1, 0.5, 1.5, 2.25, 1000.125, 12.500001):
        assert mean_sine_factor(turns) == pytest.approx(
            math.sin(math.pi * math.fmod(turns, 2.0)) / (math.pi * turns), rel=1e-9
        )
