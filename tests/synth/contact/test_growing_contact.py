"""A contact that grows with the load: against an oracle that shifts nothing, its slope, its limits, its series."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest

from synth.contact.curved_contact import RoundContact
from synth.contact.geometry import Geometry
from synth.contact.growing_contact import GrowingContact, Growth
from synth.contact.load_balance import Contact
from synth.contact.stiffness import Stiffness
from synth.scene.scene import Scene
from tests.reference.shaped_contact_oracle import growing_contact, grown_length
from tests.reference.stiffness_oracle import contact_in_metres
from tests.synth.engine_cases import random_document, scene_of, spread, touch_of
from tests.synth.response.shaped_cases import THETA, check_series, check_table, differences, finer

COARSE, FINE = 1e-5, 3e-9  # of a1 + a2: errors of the first segments, and of segments a sixteenth as long
ROUND_OFF = 2e-13  # of a1 + a2
EXPONENTS = (0.15, 0.25, 1 / 3, 0.5, 1.0)


def growing(scene: Scene, exponent: float = 1 / 3) -> GrowingContact:
    return GrowingContact.of(Geometry.of_scene(scene), Stiffness.of_scene(scene), growth=Growth(exponent))


def random_scene(random: np.random.Generator) -> Scene:
    return scene_of(**random_document(random, 48000))


@pytest.mark.parametrize("seed", range(24))
def test_random_scenes_agree_with_the_oracle(seed: int) -> None:
    random = np.random.default_rng(seed)
    scene, exponent, load = random_scene(random), float(random.choice([0.0, *EXPONENTS])), spread(random, 1e-4, 50)
    contact, theta = growing(scene, exponent), random.uniform(0, 1, 2)
    length = contact.geometry_at(load).contact_length
    scale = contact.geometry.height_scale
    assert length == pytest.approx(grown_length(touch_of(scene), load, exponent), rel=1e-14)
    assert contact.stiffness_at(load) * contact.indentation(load) == pytest.approx(load, rel=1e-12)
    wanted = [growing_contact(touch_of(scene), one, load, exponent) for one in theta.tolist()]
    for halvings, allowed in ((0, COARSE), (4, FINE)):
        one = finer(contact, halvings)
        z = one.approach(theta, load)[0]
        depth, touching = one.measure(theta, z, load)
        assert depth == pytest.approx(contact.indentation(load), rel=1e-6, abs=ROUND_OFF * scale)
        assert z == pytest.approx([each.approach for each in wanted], abs=allowed * scale)
    assert touching * length == pytest.approx([each.length for each in wanted], abs=1e-5 * length)


def test_at_constant_length_the_oracle_is_the_other_oracle() -> None:
    touch, theta = touch_of(scene_of()), np.array([0.1, 0.4, 0.83])
    for load in (1e-4, 0.05, 2.0, 60.0):
        wanted = contact_in_metres(touch, theta, load)
        found = [growing_contact(touch, one, load, 0.0) for one in theta.tolist()]
        assert [one.approach for one in found] == pytest.approx(np.asarray(wanted.approach, dtype=float), abs=1e-18)
        assert [one.length for one in found] == pytest.approx(np.asarray(wanted.contact_length, dtype=float), rel=1e-9)


@pytest.mark.parametrize("seed", range(24))
def test_the_slope_is_the_difference_over_the_load(seed: int) -> None:
    random = np.random.default_rng(100 + seed)
    contact, load = finer(growing(random_scene(random), EXPONENTS[seed % 5]), 4), spread(random, 1e-3, 50)
    apart = np.abs(differences(contact, load) - contact.approach(THETA, load)[1])
    scale = np.max(np.abs(contact.approach(THETA, load)[1]))
    assert np.median(apart) <= 1e-5 * scale
    assert np.max(apart) <= 1e-3 * scale  # where an end or a patch is just about to touch, the slope bends


@pytest.mark.parametrize(("load", "length"), [(0.0, 1e-5), (1e-12, 1e-5), (1e-3, 1e-3), (8.0, 20e-3), (2e3, 0.1)])
def test_the_length_stays_in_its_bounds_and_the_slope_with_it(load: float, length: float) -> None:
    contact = growing(scene_of())
    assert contact.geometry_at(load).contact_length == pytest.approx(length, rel=1e-12)
    if load in (1e-12, 2e3):
        _z, slope = contact.approach(THETA, load)
        assert slope == pytest.approx(differences(contact, load), rel=1e-3)
    if load == 0.0:
        assert not np.any(contact.approach(THETA, load)[1])
        assert contact.indentation(load) == 0.0


def test_ridges_and_texture_stay_where_they_are() -> None:
    contact = growing(scene_of())
    nominal = contact.geometry
    for load in (1e-4, 0.02, 0.3, 5.0, 200.0):
        here = contact.geometry_at(load)
        begin = 0.5 * (nominal.contact_length - here.contact_length)
        for place in (0.1e-3, 4e-3, 7.7e-3):
            assert here.heights(place - begin, THETA) == pytest.approx(nominal.heights(place, THETA), abs=1e-17)


def test_ten_thousands_of_periods_before_the_contact_keep_their_phase() -> None:
    nominal = Geometry(10e-6, 10e-6, 5e-6, 1e-6, 0.3, 0.01)
    contact = GrowingContact.of(nominal, Stiffness.of_contact(nominal, 1.35e5), growth=Growth(0.35))
    for load in (0.6, 100.0, 700.0):
        here = contact.geometry_at(load)
        begin = (Fraction(nominal.contact_length) - Fraction(here.contact_length)) / 2
        for shift, period in (
            (here.ridge_phase - nominal.ridge_phase, nominal.ridge_period),
            (here.texture_phase, nominal.texture_period),
        ):
            wanted = begin / Fraction(period)
            away = float((Fraction(shift / (2 * math.pi)) - wanted + Fraction(1, 2)) % 1 - Fraction(1, 2))
            assert abs(away) <= 1e-10


def test_a_texture_mirrored_gives_the_response_mirrored() -> None:
    scene = scene_of(finger={"contact_length": "10 mm", "ridge_period": "0.5 mm"})  # 20 ridges: the same both ways
    contact, nominal = finer(growing(scene), 4), Geometry.of_scene(scene)
    for load in (1e-3, 0.05, 0.3, 2.0):
        mirrored = nominal.texture_periods - THETA + nominal.texture_phase / math.pi
        z, slope = contact.approach(THETA, load)
        turned, turned_slope = contact.approach(mirrored, load)
        assert turned == pytest.approx(z, abs=FINE * nominal.height_scale)
        assert turned_slope == pytest.approx(slope, rel=1e-4)
        assert np.ptp(z) > 1e-3 * nominal.height_scale


@pytest.mark.parametrize("load", [0.01, 0.3, 3.0])
def test_a_series_keeps_its_error(load: float) -> None:
    scene = scene_of()
    check_series(growing(scene), load, lambda theta: growing_contact(touch_of(scene), theta, load, 1 / 3))


def test_a_table_keeps_the_error_that_it_tells() -> None:
    scene = scene_of()
    check_table(growing(scene), lambda theta, load: growing_contact(touch_of(scene), theta, load, 1 / 3).approach)


def test_places_with_loads_of_their_own_are_solved_as_each_load_is() -> None:
    random = np.random.default_rng(11)
    loads = np.exp(random.uniform(np.log(1e-3), np.log(20.0), 60))
    phases = random.uniform(0.0, 1.0, 60)
    geometry = Geometry(40e-6, 0.5e-3, 20e-6, 0.8e-3, 1.4, 10e-3)
    stiffness = Stiffness.of_contact(geometry, 1.35e5)
    for contact in (
        Contact.of(geometry, stiffness),
        GrowingContact.of(geometry, stiffness),
        RoundContact.of(geometry, stiffness),
    ):
        each = [contact.approach(phases[i : i + 1], float(load))[0][0] for i, load in enumerate(loads)]
        assert np.max(np.abs(contact.heights(phases, loads) - each)) < 2e-13 * geometry.height_scale
