"""Geometry, stiffness and groups (eqs 2 to 7) against the oracle, their power laws, and a row that the paper prints."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from synth.contact.geometry import Geometry
from synth.contact.stiffness import Groups, Stiffness
from synth.scene.surface_sections import amplitude_of
from tests.reference import stiffness_oracle
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


def test_an_elastic_texture_is_softer_than_a_rigid_one() -> None:
    rigid = Stiffness.of_scene(scene_of())
    equal = Stiffness.of_scene(scene_of(texture={"youngs_modulus": 101.2e3}))
    assert equal.contact_modulus == pytest.approx(rigid.contact_modulus / 2, rel=1e-14)
    assert equal.indentation(0.3) > rigid.indentation(0.3)


def test_the_indentation_grows_as_the_load_to_the_three_halves() -> None:
    law = Stiffness.of_scene(scene_of())
    assert law.indentation(4 * 0.3) == pytest.approx(8 * law.indentation(0.3), rel=1e-14)
    assert law.indentation(0.3) == pytest.approx(0.3 / law.stiffness(0.3), rel=1e-14)


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
