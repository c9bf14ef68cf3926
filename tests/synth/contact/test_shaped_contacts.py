"""Contacts whose shape follows the load (growing or round): against oracles and closed forms; slope, series, tables."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from fractions import Fraction

import numpy as np
import pytest

from synth.contact.curved_contact import RoundContact, RoundFinger, lowest_approach
from synth.contact.geometry import Geometry
from synth.contact.growing_contact import GrowingContact, Growth
from synth.contact.load_balance import Contact
from synth.contact.profile_solver import SegmentGrid
from synth.contact.stiffness import Stiffness
from synth.errors import SceneError
from synth.scene.scene import Scene
from tests.few import few
from tests.reference.shaped_contact_oracle import (
    Pressed,
    fitting_radius,
    growing_contact,
    grown_length,
    round_contact,
    smooth_half_length,
)
from tests.reference.stiffness_oracle import contact_in_metres
from tests.synth.engine_cases import Real, random_document, scene_of, spread, touch_of
from tests.synth.response.shaped_cases import THETA, check_series, check_table, differences, finer

COARSE, FINE = 1e-5, 3e-9  # of a1 + a2: errors of the first segments, and of segments a sixteenth as long
CREST = 2e-6  # of a1 + a2: error of a crest, second order, with segments a sixteenth as long
ROUND_OFF = 2e-13  # of a1 + a2
EXPONENTS = (0.15, 0.25, 1 / 3, 0.5, 1.0)


def growing(scene: Scene, exponent: float = 1 / 3) -> GrowingContact:
    return GrowingContact.of(Geometry.of_scene(scene), Stiffness.of_scene(scene), growth=Growth(exponent))


def rounding(scene: Scene, radius: float | None = None) -> RoundContact:
    return RoundContact.of(Geometry.of_scene(scene), Stiffness.of_scene(scene), radius=radius)


def random_scene(random: np.random.Generator) -> Scene:
    return scene_of(**random_document(random, 48000))


def oracle_of(scene: Scene, contact: Contact) -> Callable[[float, float], Pressed]:
    """Return an oracle as a function of theta (turns) and load (N)."""
    touch = touch_of(scene)
    if isinstance(contact, GrowingContact):
        exponent = contact.growth.exponent
        return lambda theta, load: growing_contact(touch, theta, load, exponent)
    assert isinstance(contact, RoundContact)
    radius = contact.finger.radius
    return lambda theta, load: round_contact(touch, theta, load, radius)


each_shape = pytest.mark.parametrize("shaped", [growing, rounding])


def check_against_the_oracle(scene: Scene, contact: Contact, load: float, theta: Real) -> None:
    wanted = [oracle_of(scene, contact)(one, load) for one in theta.tolist()]
    length, scale = contact.geometry_at(load).contact_length, contact.geometry.height_scale
    for halvings, allowed in ((0, COARSE), (4, FINE)):
        one = finer(contact, halvings)
        z = one.approach(theta, load)[0]
        depth, touching = one.measure(theta, z, load)
        assert depth == pytest.approx(contact.indentation(load), rel=1e-6, abs=ROUND_OFF * scale)
        assert z == pytest.approx([each.approach for each in wanted], abs=allowed * scale)
    assert touching * length == pytest.approx([each.length for each in wanted], abs=1e-5 * length)


@pytest.mark.parametrize("seed", few(range(24), 6))
def test_random_growing_contacts_agree_with_the_oracle(seed: int) -> None:
    random = np.random.default_rng(seed)
    scene, exponent, load = random_scene(random), float(random.choice([0.0, *EXPONENTS])), spread(random, 1e-4, 50)
    contact = growing(scene, exponent)
    length = contact.geometry_at(load).contact_length
    assert length == pytest.approx(grown_length(touch_of(scene), load, exponent), rel=1e-14)
    assert contact.stiffness_at(load) * contact.indentation(load) == pytest.approx(load, rel=1e-12)
    check_against_the_oracle(scene, contact, load, random.uniform(0, 1, 2))


@pytest.mark.parametrize("seed", few(range(24), 8))
def test_random_round_contacts_agree_with_the_oracle(seed: int) -> None:
    random = np.random.default_rng(seed)
    scene = random_scene(random)
    fitting = fitting_radius(touch_of(scene))
    contact = rounding(scene, None if seed % 3 else fitting * spread(random, 1e-2, 2))
    assert seed % 3 == 0 or contact.finger.radius == pytest.approx(fitting, rel=1e-11)
    check_against_the_oracle(scene, contact, spread(random, 1e-4, 50), random.uniform(0, 1, 2))


@pytest.mark.parametrize("load", [1e-6, 0.02, 3.0])
def test_a_nearly_flat_finger_with_few_ridges_agrees_with_the_oracle(load: float) -> None:
    scene = scene_of(
        finger={"ridge_period": "10 mm", "ridge_amplitude": "3 um"}, texture={"period": "23 mm", "amplitude": "2 um"}
    )
    contact = rounding(scene, 200.0)
    assert contact.geometry_at(load).ridges < 20
    check_against_the_oracle(scene, contact, load, np.array([0.1, 0.62]))


def test_at_constant_length_the_oracle_is_the_other_oracle() -> None:
    touch, theta = touch_of(scene_of()), np.array([0.1, 0.4, 0.83])
    for load in (1e-4, 0.05, 2.0, 60.0):
        wanted = contact_in_metres(touch, theta, load)
        found = [growing_contact(touch, one, load, 0.0) for one in theta.tolist()]
        assert [one.approach for one in found] == pytest.approx(np.asarray(wanted.approach, dtype=float), abs=1e-18)
        assert [one.length for one in found] == pytest.approx(np.asarray(wanted.contact_length, dtype=float), rel=1e-9)


@pytest.mark.parametrize("seed", range(6))
def test_without_load_z_is_the_highest_crest_of_the_gap(seed: int) -> None:
    random = np.random.default_rng(300 + seed)
    scene, theta = random_scene(random), random.uniform(0, 1, 3)
    contact = rounding(scene)
    z, slope = finer(contact, 4).approach(theta, 0.0)
    crests = [oracle_of(scene, contact)(one, 0.0).crest for one in theta.tolist()]
    assert z == pytest.approx(crests, abs=CREST * contact.geometry.height_scale)
    assert not np.any(slope)
    assert contact.indentation(0.0) == contact.stiffness_at(0.0) == 0.0


@pytest.mark.parametrize("seed", few(range(24), 12))
def test_the_slope_is_the_difference_over_the_load(seed: int) -> None:
    """The slope has a bend where an end or a patch begins to touch."""
    random = np.random.default_rng(100 + seed)
    scene, load = random_scene(random), spread(random, 1e-3, 50)
    round_one = rounding(scene, fitting_radius(touch_of(scene)) * spread(random, 0.02, 1))
    for contact, usual in ((finer(growing(scene, EXPONENTS[seed % 5]), 4), 1e-5), (round_one, 1e-7)):
        slope = contact.approach(THETA, load)[1]
        apart = np.abs(differences(contact, load) - slope)
        assert np.median(apart) <= usual * np.max(np.abs(slope))
        assert np.max(apart) <= 1e-3 * np.max(np.abs(slope))


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


def test_ridges_and_texture_stay_where_they_are_under_a_contact_that_grows() -> None:
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


def test_the_smooth_length_of_a_round_finger_grows_as_the_load_to_0_3() -> None:
    scene = scene_of()
    touch = touch_of(scene)
    for radius in (None, 8e-3, 0.3, 5.0):
        finger = RoundFinger.of(Stiffness.of_scene(scene), radius, 1.0)
        assert radius is not None or finger.length == Stiffness.of_scene(scene).contact_length
        for load in (1e-4, 0.02, 0.3, 7.0, 50.0):
            b = smooth_half_length(touch, load, finger.radius)
            assert finger.length_at(load) == pytest.approx(2 * b, rel=1e-12)
            assert finger.area(load) == pytest.approx(2 / 3 * b**3 / finger.radius, rel=1e-12)
            assert finger.length_at(load) == pytest.approx(finger.length * load**0.3, rel=1e-12)
            assert finger.foundation_at(load) * finger.area(load) == pytest.approx(load, rel=1e-12)


@pytest.mark.parametrize("load", [0.01, 0.3, 10.0])
def test_all_but_smooth_it_is_the_parabola_on_a_foundation(load: float) -> None:
    scene = scene_of(finger={"ridge_amplitude": 2e-9}, texture={"amplitude": 1e-9})
    contact = rounding(scene)
    b = 0.5 * contact.finger.length_at(load)
    deep = b * b / (2 * contact.finger.radius)
    assert deep > 1e3 * contact.geometry.height_scale
    z, slope = contact.approach(THETA, load)
    touching = contact.measure(THETA, z, load)[1] * contact.geometry_at(load).contact_length
    assert np.max(np.abs(z + deep)) <= contact.geometry.height_scale
    assert touching == pytest.approx(np.full(16, 2 * b), rel=2 * contact.geometry.height_scale / deep)
    assert slope == pytest.approx(np.full(16, -0.6 * deep / load), rel=2 * contact.geometry.height_scale / deep)


@pytest.mark.parametrize("seed", few(range(30), 10))
def test_no_phase_presses_at_the_ends_of_what_is_spanned(seed: int) -> None:
    random = np.random.default_rng(400 + seed)
    scene, load = random_scene(random), spread(random, 1e-9, 50)
    contact = rounding(scene, fitting_radius(touch_of(scene)) * spread(random, 1e-2, 1))
    finger, geometry = contact.finger, contact.geometry
    lowest = lowest_approach(geometry, finger.radius, finger.area(load))
    assert np.all(contact.approach(np.arange(64) / 64, load)[0] > lowest)
    span = contact.geometry_at(load).contact_length
    assert geometry.height_scale - 0.125 * span**2 / finger.radius <= lowest + 1e-12 * abs(lowest)
    widest = math.sqrt(4 * finger.radius * geometry.height_scale + 0.25 * finger.length_at(load) ** 2)
    assert span <= 2 * widest * (1 + 1e-9)


def test_a_wider_span_changes_nothing() -> None:
    contact = rounding(scene_of())
    geometry, finger = contact.geometry, contact.finger
    for load in (1e-4, 0.3, 20.0):
        span = 1.7 * contact.geometry_at(load).contact_length
        wide = SegmentGrid.of_geometry(geometry.part(0.5 * (geometry.contact_length - span), span), contact.dome)
        z = wide.solve(THETA, finger.area(load) / span).height
        assert z == pytest.approx(contact.approach(THETA, load)[0], abs=ROUND_OFF * geometry.height_scale)


@each_shape
def test_a_texture_mirrored_gives_the_response_mirrored(shaped: Callable[[Scene], Contact]) -> None:
    scene = scene_of(finger={"contact_length": "10 mm", "ridge_period": "0.5 mm"})  # 20 ridges: the same both ways
    contact, nominal = finer(shaped(scene), 4), Geometry.of_scene(scene)
    mirrored = nominal.texture_periods - THETA + nominal.texture_phase / math.pi
    for load in (1e-3, 0.05, 0.3, 5.0):
        z, slope = contact.approach(THETA, load)
        turned, turned_slope = contact.approach(mirrored, load)
        assert turned == pytest.approx(z, abs=FINE * nominal.height_scale)
        assert turned_slope == pytest.approx(slope, rel=1e-4)
        assert np.ptp(z) > 1e-3 * nominal.height_scale


def test_a_heavier_touch_sinks_deeper_without_a_step() -> None:
    contact = rounding(scene_of())
    heights = [contact.approach(THETA, load)[0] for load in np.geomspace(1e-12, 100, 60).tolist()]
    for lighter, heavier in itertools.pairwise(heights):
        assert np.all(heavier < lighter)
    for load in np.geomspace(1e-6, 100, 25).tolist():
        below, slope = contact.approach(THETA, load)
        above = contact.approach(THETA, load * (1 + 1e-9))[0]
        assert np.all(np.abs(above - below) <= 1.1e-9 * load * np.abs(slope) + 1e-12 * contact.geometry.height_scale)


@each_shape
@pytest.mark.parametrize("load", [0.01, 0.3, 3.0])
def test_a_series_keeps_its_error(shaped: Callable[[Scene], Contact], load: float) -> None:
    scene = scene_of()
    contact = shaped(scene)
    check_series(contact, load, lambda theta: oracle_of(scene, contact)(theta, load))


@pytest.mark.parametrize(("shaped", "told_at_most"), [(growing, 5e-3), (rounding, 2e-2)])
def test_a_table_keeps_the_error_that_it_tells(shaped: Callable[[Scene], Contact], told_at_most: float) -> None:
    scene = scene_of()
    contact = shaped(scene)
    check_table(contact, lambda theta, load: oracle_of(scene, contact)(theta, load).approach, told_at_most)


def test_places_with_loads_of_their_own_are_solved_as_each_load_is() -> None:
    random = np.random.default_rng(11)
    loads = np.exp(random.uniform(np.log(1e-3), np.log(20.0), 60))
    phases = random.uniform(0.0, 1.0, 60)
    geometry = Geometry(40e-6, 0.5e-3, 20e-6, 0.8e-3, 1.4, 10e-3)
    stiffness = Stiffness.of_contact(geometry, 1.35e5)
    surfaces = geometry, stiffness
    for contact in (Contact(*surfaces), GrowingContact.of(*surfaces), RoundContact.of(*surfaces)):
        each = [contact.approach(phases[i : i + 1], float(load))[0][0] for i, load in enumerate(loads)]
        assert np.max(np.abs(contact.heights(phases, loads) - each)) < 2e-13 * geometry.height_scale


def test_a_finger_too_flat_is_refused_before_anything_is_laid_out(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = scene_of()
    contact = rounding(scene)

    def laid_out(geometry: Geometry, dome: float = 0.0) -> SegmentGrid:
        raise AssertionError("laid out")

    monkeypatch.setattr(SegmentGrid, "of_geometry", laid_out)
    with pytest.raises(SceneError, match=r"1000 m, .* m at a load of 0 N; .*within 0\.2 m\. Write a smaller radius"):
        rounding(scene, 1e3)
    with pytest.raises(SceneError, match="at a load of 1e\\+05 N"):
        contact.approach(THETA, 1e5)
