"""Geometry, stiffness and groups (eqs 2 to 7) and full contact: against the oracle and a row of the paper."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from synth.contact.geometry import Geometry
from synth.contact.groups import Groups
from synth.contact.load_balance import full_contact, mean_sine_factor
from synth.contact.stiffness import Stiffness
from synth.scene.texture_section import amplitude_of
from tests.reference import stiffness_oracle
from tests.reference.stiffness_oracle import contact_in_metres
from tests.synth.engine_cases import load_of, random_document, scene_of, touch_of

LOADS = (1e-6, 1e-3, 0.3, 7.0, 1e3)


def test_roughness_becomes_amplitude_by_half_pi() -> None:
    assert amplitude_of(20e-6) == pytest.approx(31.41592653589793e-6, rel=1e-15)
    x = np.linspace(0.0, 1.0, 100_001)
    heights = amplitude_of(20e-6) * np.cos(2 * np.pi * x)
    assert np.trapezoid(np.abs(heights), x) == pytest.approx(20e-6, rel=1e-8)


def test_the_geometry_of_a_scene_has_its_numbers() -> None:
    scene = scene_of(
        finger={"ridge_period": "0.4 mm", "roughness": "10 um", "contact_length": "8 mm"},
        texture={"period": "0.5 mm", "amplitude": "12 um", "phase": 0.25},
    )
    geometry = Geometry.of_scene(scene)
    assert geometry.ridges == pytest.approx(20.0, rel=1e-15)
    assert geometry.texture_periods == pytest.approx(16.0, rel=1e-15)
    assert geometry.height_scale == pytest.approx(amplitude_of(10e-6) + 12e-6, rel=1e-15)
    assert geometry.texture_phase == 0.25
    assert geometry.texture_amplitude > 0.0
    assert Geometry.of_scene(scene_of(texture={"amplitude": 0})).texture_amplitude == 0.0


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("texture_modulus", [None, 2e5])
def test_stiffness_and_groups_are_those_of_the_oracle(seed: int, texture_modulus: float | None) -> None:
    document = random_document(np.random.default_rng(seed), 48000)
    document["texture"] |= {"youngs_modulus": texture_modulus, "poisson_ratio": 0.31}
    document["finger"]["poisson_ratio"] = 0.42
    scene = scene_of(**document)
    law, touch = Stiffness.of_scene(scene), touch_of(scene)
    for load in LOADS:
        wanted = stiffness_oracle.stiffness(replace(touch, load=load))
        assert law.contact_modulus == pytest.approx(wanted.effective_modulus, rel=1e-13)
        assert law.half_width(load) == pytest.approx(wanted.half_width, rel=1e-13)
        assert law.stiffness(load) == pytest.approx(wanted.k, rel=1e-13)
        assert law.indentation(load) == pytest.approx(wanted.indentation, rel=1e-13)
        assert load_of(law, law.indentation(load)) == pytest.approx(load, rel=1e-12)
        groups = Groups.of_contact(Geometry.of_scene(scene), law, load)
        assert groups is not None
        assert groups.ridges == pytest.approx(wanted.tau, rel=1e-14)
        assert groups.period_ratio == pytest.approx(wanted.period_ratio, rel=1e-14)
        assert groups.amplitude_ratio == pytest.approx(wanted.amplitude_ratio, rel=1e-14)
        assert groups.load == pytest.approx(wanted.W, rel=1e-13)


@pytest.mark.parametrize("width", [4e-3, 12e-3])
def test_a_fingertip_presses_on_its_length_times_its_width(width: float) -> None:
    """Eqs 4-5 know the contact by its area alone: a square of that area has the same k."""
    scene = scene_of(finger={"kind": "fingertip", "contact_length": "8 mm", "contact_width": width})
    law = Stiffness.of_scene(scene)
    for load in LOADS:
        square = replace(touch_of(scene), load=load, contact_length=math.sqrt(8e-3 * width))
        wanted = stiffness_oracle.stiffness(square)
        assert law.stiffness(load) == pytest.approx(wanted.k, rel=1e-13)
        assert law.indentation(load) == pytest.approx(wanted.indentation, rel=1e-13)
    assert law.over(4e-3).stiffness(1.0) == pytest.approx(law.stiffness(1.0) / 8.0, rel=1e-13)


def test_no_load_presses_nothing_in_and_is_infinitely_stiff() -> None:
    law = Stiffness.of_scene(scene_of())
    assert law.indentation(0.0) == 0.0
    assert law.half_width(0.0) == 0.0
    assert law.stiffness(0.0) == math.inf


def test_two_flat_surfaces_have_no_ridge_to_press() -> None:
    flat = scene_of(finger={"ridge_amplitude": 0}, texture={"amplitude": 0})
    law = Stiffness.of_contact(Geometry.of_scene(flat), 1e5)
    assert law.ridge_radius == math.inf
    assert law.indentation(0.3) == math.inf


def test_the_groups_of_a_published_row_come_out() -> None:
    scene = scene_of(finger={"roughness": 20e-6}, texture={"roughness": 10e-6, "period": 1e-3}, scan={"load": 0.5})
    groups = Groups.of_contact(Geometry.of_scene(scene), Stiffness.of_scene(scene), 0.5)
    assert groups is not None
    assert groups.load == pytest.approx(1.50, rel=0.01)
    assert (groups.ridges, groups.period_ratio, groups.amplitude_ratio) == pytest.approx((20.0, 2.0, 0.5))


def test_a_smooth_finger_has_no_groups_and_no_load_is_group_zero() -> None:
    smooth, ridged = scene_of(finger={"ridge_amplitude": 0}), scene_of()
    assert Groups.of_contact(Geometry.of_scene(smooth), Stiffness.of_scene(smooth), 0.3) is None
    groups = Groups.of_contact(Geometry.of_scene(ridged), Stiffness.of_scene(ridged), 0.0)
    assert groups is not None and groups.load == 0.0


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
