"""A contact that grows with the load: against an oracle that shifts nothing, its slope, its limits, its series."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from synth.contact.curved_contact import RoundContact
from synth.contact.exact_solver import Grid
from synth.contact.geometry import Geometry
from synth.contact.growing_contact import GrowingContact, Growth
from synth.contact.load_balance import Contact
from synth.contact.solvers import MOST_BYTES, MOST_KEPT, KeptSolvers
from synth.contact.stiffness import Stiffness
from synth.response.spectrum import Demand, solve_spectrum
from synth.scene.scene import Scene
from tests.reference.shaped_contact_oracle import growing_contact, grown_length
from tests.reference.stiffness_oracle import contact_in_metres
from tests.synth.engine_cases import contact_of, random_document, scene_of, spread, touch_of
from tests.synth.response.shaped_cases import ORDERS, THETA, check_series, check_table, differences

ROUND_OFF = 2e-13  # of a1 + a2: what the module states
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
    z = contact.approach(theta, load)[0]
    depth, touching = contact.measure(theta, z, load)
    assert length == pytest.approx(grown_length(touch_of(scene), load, exponent), rel=1e-14)
    assert depth == pytest.approx(contact.indentation(load), rel=1e-6, abs=ROUND_OFF * contact.geometry.height_scale)
    assert contact.stiffness_at(load) * contact.indentation(load) == pytest.approx(load, rel=1e-12)
    for i, wanted in enumerate(growing_contact(touch_of(scene), one, load, exponent) for one in theta.tolist()):
        assert abs(z[i] - wanted.approach) <= ROUND_OFF * contact.geometry.height_scale + 2e-15 * abs(wanted.approach)
        assert abs(touching[i] * length - wanted.length) <= 1e-8 * length


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
    contact, load = growing(random_scene(random), EXPONENTS[seed % 5]), spread(random, 1e-3, 50)
    apart = np.abs(differences(contact, load) - contact.approach(THETA, load)[1])
    scale = np.max(np.abs(contact.approach(THETA, load)[1]))
    assert np.median(apart) <= 1e-7 * scale
    assert np.max(apart) <= 1e-3 * scale  # where an end or a patch is just about to touch, the slope bends


def test_without_growth_every_number_is_that_of_the_contact_of_one_length() -> None:
    random = np.random.default_rng(7)
    for _ in range(20):
        scene, load = random_scene(random), spread(random, 1e-4, 50)
        flat, still = contact_of(scene), growing(scene, 0.0)
        for one, other in zip(flat.approach(THETA, load), still.approach(THETA, load), strict=True):
            assert np.array_equal(one, other)
        assert still.geometry_at(load) == flat.geometry
        assert still.indentation(load) == flat.indentation(load)
        assert still.stiffness_at(load) == flat.stiffness_at(load)
        assert still.closed(load) == flat.closed(load)


def test_at_the_reference_load_z_is_that_of_the_contact_of_one_length() -> None:
    random = np.random.default_rng(8)
    for _ in range(10):
        scene, load = random_scene(random), spread(random, 1e-3, 10)
        flat = contact_of(scene)
        grown = GrowingContact.of(flat.geometry, flat.stiffness, growth=Growth(0.4, load))
        assert np.array_equal(flat.approach(THETA, load)[0], grown.approach(THETA, load)[0])
        assert grown.solver(load) is grown.grid


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
            (here.texture_phase - nominal.texture_phase, nominal.texture_period),
        ):
            wanted = begin / Fraction(period)
            away = float((Fraction(shift / (2 * math.pi)) - wanted + Fraction(1, 2)) % 1 - Fraction(1, 2))
            assert abs(away) <= 1e-10


def test_a_texture_mirrored_gives_the_response_mirrored() -> None:
    scene = scene_of(finger={"contact_length": "10 mm", "ridge_period": "0.5 mm"})  # 20 ridges: the same both ways
    contact, nominal = growing(scene), Geometry.of_scene(scene)
    for load in (1e-3, 0.05, 0.3, 2.0):
        mirrored = nominal.texture_periods - THETA + nominal.texture_phase / math.pi
        z, slope = contact.approach(THETA, load)
        turned, turned_slope = contact.approach(mirrored, load)
        assert turned == pytest.approx(z, abs=ROUND_OFF * nominal.height_scale)
        assert turned_slope == pytest.approx(slope, rel=1e-9)
        assert np.ptp(z) > 1e-3 * nominal.height_scale


@pytest.mark.parametrize("seed", range(6))
def test_the_closed_form_of_full_contact_has_the_slopes_of_the_growing_length(seed: int) -> None:
    random = np.random.default_rng(200 + seed)
    scene, exponent = random_scene(random), (0.15, 0.25, 1 / 3)[seed % 3]
    contact, load = growing(scene, exponent), 1e-3
    while contact.closed(load) is None:
        load *= 1.1
    load *= 1.05
    assert contact.geometry_at(load).contact_length < 0.1
    series = solve_spectrum(contact, load, Demand(4, ORDERS, 1e-4))
    assert series.closed
    around = [solve_spectrum(contact, load * (1 + sign * 1e-5), Demand(4, ORDERS, 1e-4)) for sign in (1, -1)]
    wanted = (around[0].harmonics - around[1].harmonics) / (2e-5 * load)
    closed, (_z, slope) = contact.closed(load), contact.approach(THETA, load)
    assert closed is not None
    slopes = np.array([closed.slope, closed.first_slope, 0.0, 0.0, 0.0])
    assert np.abs(slopes - wanted) == pytest.approx(np.zeros(5), abs=1e-8 * abs(wanted[0]))
    assert slopes[1] == pytest.approx(wanted[1], rel=1e-5)
    read = 2 * (np.exp(2j * np.pi * THETA) * slopes[1]).real + slopes[0].real
    assert read == pytest.approx(slope, rel=1e-9)


@pytest.mark.parametrize("load", [0.01, 0.3, 3.0])
def test_a_series_keeps_its_error(load: float) -> None:
    scene = scene_of()
    check_series(growing(scene), load, lambda theta: growing_contact(touch_of(scene), theta, load, 1 / 3))


def test_a_table_keeps_the_error_that_it_tells() -> None:
    scene = scene_of()
    check_table(growing(scene), lambda theta, load: growing_contact(touch_of(scene), theta, load, 1 / 3).approach)


def test_threads_that_ask_for_other_loads_do_not_disturb_each_other() -> None:
    contact = growing(scene_of())
    loads = np.geomspace(0.01, 1.0, 3 * MOST_KEPT).tolist()
    alone = [growing(scene_of()).approach(THETA, load)[0] for load in loads]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda load: contact.approach(THETA, load)[0], loads * 3))
    for number, z in enumerate(together):
        assert np.array_equal(z, alone[number % len(loads)])


def test_few_solvers_are_kept_and_the_last_ones_are() -> None:
    geometry, laid_out = Geometry.of_scene(scene_of()), []

    def lay_out(asked: Geometry) -> Grid:
        laid_out.append(asked.contact_length)
        return Grid.of_geometry(asked)

    kept = KeptSolvers()
    lengths = [1e-3 * (1 + number) for number in range(MOST_KEPT + 2)]
    for length in lengths:
        kept.get(replace(geometry, contact_length=length), lay_out)
    assert laid_out == lengths
    assert 0 < kept.nbytes <= MOST_BYTES
    for length in lengths[2:]:
        kept.get(replace(geometry, contact_length=length), lay_out)
    assert laid_out == lengths
    kept.get(replace(geometry, contact_length=lengths[0]), lay_out)
    assert laid_out == [*lengths, lengths[0]]


def test_one_solver_is_kept_however_large() -> None:
    kept = KeptSolvers()
    large = Geometry(10e-6, 1.4e-6, 5e-6, 1.1e-6, 0.3, 0.1)
    solver = kept.get(large, Grid.of_geometry)
    assert kept.nbytes > MOST_BYTES
    assert kept.get(large, Grid.of_geometry) is solver


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
