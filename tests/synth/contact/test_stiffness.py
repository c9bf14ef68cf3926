"""Eqs 4 and 5 against the oracle and their own power laws."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from synth.contact.geometry import Geometry
from synth.contact.stiffness import Stiffness
from tests.reference import stiffness_oracle
from tests.synth.engine_cases import random_document, scene_of, touch_of

LOADS = (1e-6, 1e-3, 0.3, 7.0, 1e3)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("texture_modulus", [None, 2e5])
def test_stiffness_is_that_of_the_oracle(seed: int, texture_modulus: float | None) -> None:
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


def test_an_elastic_texture_is_softer_than_a_rigid_one() -> None:
    rigid = Stiffness.of_scene(scene_of())
    equal = Stiffness.of_scene(scene_of(texture={"youngs_modulus": 101.2e3}))
    assert equal.contact_modulus == pytest.approx(rigid.contact_modulus / 2, rel=1e-14)
    assert equal.indentation(0.3) > rigid.indentation(0.3)


def test_the_indentation_grows_as_the_load_to_the_three_halves() -> None:
    law = Stiffness.of_scene(scene_of())
    assert law.indentation(4 * 0.3) == pytest.approx(8 * law.indentation(0.3), rel=1e-14)
    assert law.indentation(0.3) == pytest.approx(0.3 / law.stiffness(0.3), rel=1e-14)


@pytest.mark.parametrize("load", LOADS)
def test_the_load_of_an_indentation_is_the_way_back(load: float) -> None:
    law = Stiffness.of_scene(scene_of())
    assert law.load(law.indentation(load)) == pytest.approx(load, rel=1e-13)


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
