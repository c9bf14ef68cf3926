"""The horizontal forces of a contact: potentials, closed forms, symmetries, and stated errors of their responses."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from synth.contact.curved_contact import RoundContact
from synth.contact.forces import ForceOfContact, FrictionForce, Response, SlopeForce
from synth.contact.geometry import Geometry
from synth.contact.growing_contact import GrowingContact, Growth
from synth.contact.load_balance import Contact
from synth.contact.scene_contact import contact_of
from synth.contact.stiffness import Stiffness
from synth.response.demand import Demand, curves, points_for
from synth.response.series_error import FLOOR
from synth.response.spectrum import solve_spectrum
from tests.few import paired, thorough
from tests.reference.pressure_oracle import Surfaces, balanced, power_mean, slope_mean
from tests.synth.engine_cases import Real, random_document, scene_of, spread
from tests.synth.response.shaped_cases import check_table, finer

PRESSURE = 2e4  # Pa
LIGHT = 1e-3  # N
HALVINGS = 4  # of the first segments
NEAR = 1e-7  # of the scale of a force: the error of segments this short
DEFAULT = contact_of(scene_of()).as_profile()


def contact_with(geometry: Geometry) -> Contact:
    return Contact(geometry, Stiffness.of_contact(geometry, 1.35e5)).as_profile()


def growing(geometry: Geometry, exponent: float) -> GrowingContact:
    return GrowingContact.of(geometry, Stiffness.of_contact(geometry, 1.35e5), growth=Growth(exponent))


GROWING = growing(Geometry(4e-5, 5e-4, 2e-5, 8e-4, 1.4, 8e-3), 1 / 6)


def friction_of(contact: Contact, exponent: float = 0.8) -> FrictionForce:
    return FrictionForce(contact, 0.6, exponent, PRESSURE)


def period(count: int) -> Real:
    return np.arange(count) / count


def random_contact(random: np.random.Generator) -> tuple[Contact, float]:
    scene = scene_of(**random_document(random, 48000))
    return contact_of(scene).as_profile(), scene.scan.load


def any_contact(seed: int) -> tuple[Contact, float]:
    """Return a contact of any kind (of one length, growing, or round) and a load (N) from 1e-3 to 50."""
    random = np.random.default_rng(seed)
    load = spread(random, 1e-3, 50)
    ridge = spread(random, 3e-4, 1e-3)
    geometry = Geometry(
        float(random.choice([0.0, 1.0, 1.0, 1.0])) * spread(random, 5e-6, 8e-5),
        ridge,
        spread(random, 2e-6, 1e-4),
        ridge * float(random.choice([1.0, 0.5, 2.0, spread(random, 0.3, 10)])),
        float(random.uniform(0, 6.3)),
        spread(random, 2e-3, 8e-3),
    )
    if seed % 3 == 1:
        return growing(geometry, float(random.choice([0.0, 1 / 6]))), load
    if seed % 3 == 2:
        return RoundContact.of(geometry, Stiffness.of_contact(geometry, 1.35e5)), load
    return contact_with(geometry), load


def oracle_of(contact: Contact, load: float, phase: float) -> Surfaces:
    one = contact.geometry_at(load)
    assert one.profile is not None and one.profile.cosine is not None
    return Surfaces(
        one.ridge_amplitude, one.ridge_period, one.ridge_phase, one.texture_amplitude, one.texture_period,
        one.profile.cosine.phase + one.texture_phase, one.contact_length, contact.dome, phase * one.texture_period,
    )  # fmt: skip


@pytest.mark.parametrize("seed", [*range(3), *(thorough(seed) for seed in range(3, 24))])  # one of each contact
def test_forces_are_those_of_the_oracle(seed: int) -> None:
    contact, load = any_contact(seed)
    contact = finer(contact, HALVINGS)
    exponent = float(np.random.default_rng(seed).uniform(0.5, 1.5))
    slope, friction = SlopeForce(contact), friction_of(contact, exponent)
    phase, stiffness = 0.3, contact.stiffness_at(load)
    surfaces = oracle_of(contact, load, phase)
    z = balanced(surfaces, load / stiffness)
    length = surfaces.length
    width = length if contact.dome == 0.0 else 2.0 * (1.5 / contact.dome * load / stiffness * length) ** (1 / 3)
    area = length * width
    wanted = 0.6 * PRESSURE * area * (stiffness / (area * PRESSURE)) ** exponent * power_mean(surfaces, z, exponent)
    for whole in (0.0, -3.0):
        found, _rate = slope.approach(np.array([phase + whole]), load)
        rubbed, _rate = friction.approach(np.array([phase + whole]), load)
        assert abs(found[0] + stiffness * slope_mean(surfaces, z)) <= NEAR * slope.scale_at(load)
        assert rubbed[0] == pytest.approx(wanted, rel=1e-4)


@pytest.mark.parametrize("seed", [0, 1, 2, *(thorough(seed) for seed in range(3, 8))])  # one of each contact
def test_the_slope_force_is_the_slope_of_a_potential(seed: int) -> None:
    """Pi = (k / 2) mean of (h - z)^2 + w z, at the z that balances the load, by differences of fourth order."""
    contact, load = any_contact(seed)
    stiffness, step = contact.stiffness_at(load), 1e-3

    def potential(phase: float) -> float:
        surfaces = oracle_of(contact, load, phase)
        z = balanced(surfaces, load / stiffness)
        return 0.5 * stiffness * power_mean(surfaces, z, 2.0) + load * z

    force = SlopeForce(finer(contact, HALVINGS))
    largest = float(np.max(np.abs(force.approach(period(64), load)[0])))
    phase = 0.13
    near = potential(phase + step) - potential(phase - step)
    far = potential(phase + 2 * step) - potential(phase - 2 * step)
    wanted = (8 * near - far) / (12 * step * contact.geometry_at(load).texture_period)
    assert abs(force.approach(np.array([phase]), load)[0][0] - wanted) <= 1e-3 * largest


@pytest.mark.parametrize(("locked", "load"), paired([False, True], [0.3, 1.0, 4.0]))
def test_no_work_is_done_over_a_period(locked: bool, load: float) -> None:
    """Over equal steps the mean falls as their number to the power -2.5, because of kinks where patches are born."""
    contact = contact_with(Geometry(4e-5, 5e-4, 2e-5, 5e-4, 1.4, 7.3e-3)) if locked else DEFAULT
    force, _rate = SlopeForce(finer(contact, HALVINGS)).approach(period(1 << 12), load)
    assert abs(force.mean()) <= 1e-7 * np.max(np.abs(force))
    assert np.max(np.abs(force)) > 1e-4 * load  # the force is not negligible


def full_slope_force(one: Geometry, contact: Contact, load: float, phases: Real) -> Real:
    """Return F_s in full contact, from elementary integrals of waves over 0..L."""
    length, k2, k1 = one.contact_length, 2 * math.pi / one.texture_period, 2 * math.pi / one.ridge_period
    a1, a2 = one.ridge_amplitude, one.texture_amplitude

    def waves(number: float, angle: Any) -> tuple[Any, Any]:
        """Return the means of cos and sin of number x + angle over 0..L."""
        if number == 0.0:
            return np.cos(angle), np.sin(angle)
        span = number * length
        return (np.sin(span + angle) - np.sin(angle)) / span, (np.cos(angle) - np.cos(span + angle)) / span

    angle = one.texture_phase - 2 * math.pi * phases
    cos2, sin2 = waves(k2, angle)
    mean = a2 * cos2 - a1 * waves(k1, one.ridge_phase)[0]
    z = mean - load / contact.stiffness_at(load)
    apart = 0.5 * (waves(k1 + k2, angle + one.ridge_phase)[1] + waves(k2 - k1, angle - one.ridge_phase)[1])
    slope_sum = -a2 * k2 * (0.5 * a2 * waves(2 * k2, 2 * angle)[1] - a1 * apart - z * sin2)
    return np.asarray(-contact.stiffness_at(load) * slope_sum)


@pytest.mark.parametrize("texture_period", [5e-4, 8e-4, 7e-3])
def test_full_contact_is_two_sinusoids(texture_period: float) -> None:
    geometry = Geometry(2e-5, 5e-4, 1e-5, texture_period, 1.4, 9.1e-3)
    contact = finer(contact_with(geometry), HALVINGS)
    force = SlopeForce(contact)
    found, _rate = force.approach(period(24), 30.0)
    assert np.max(np.abs(found - full_slope_force(geometry, contact, 30.0, period(24)))) <= NEAR * force.scale_at(30.0)
    lines = np.abs(np.fft.rfft(found))
    assert np.max(lines[3:]) <= 1e-5 * np.max(lines)


@pytest.mark.parametrize("seed", range(6))
def test_coulomb_friction_is_mu_times_the_load(seed: int) -> None:
    contact, load = any_contact(seed)
    friction = friction_of(contact, 1.0)
    found, rate = friction.approach(period(40), load)
    assert np.max(np.abs(found - 0.6 * load)) <= FLOOR * friction.scale_at(load)
    assert np.max(np.abs(rate - 0.6)) <= 1e-6
    closed = solve_spectrum(friction, load, Demand(8, (0, 1), 1e-3))
    assert closed.closed and closed.harmonics[0] == 0.6 * load and not closed.harmonics[1:].any()


def test_friction_tends_to_coulombs_as_the_exponent_tends_to_one() -> None:
    apart = [np.max(np.abs(friction_of(DEFAULT, 1.0 + small).approach(period(32), 0.3)[0] - 0.18)) for small in
             (-1e-2, -1e-4, 1e-4, 1e-6)]  # fmt: skip
    assert apart[0] <= 0.02 and apart[3] > 0.0
    assert apart[1] == pytest.approx(apart[0] / 100, rel=0.1)
    assert apart[2] == pytest.approx(apart[1], rel=0.01) and apart[3] == pytest.approx(apart[2] / 100, rel=0.01)


def test_a_smooth_finger_on_one_crest_is_pushed_neither_way() -> None:
    """Inside the contact the pressure is symmetric about the crest; at the end of the contact it is not."""
    force = SlopeForce(contact_with(Geometry(0.0, 5e-4, 2e-5, 1e-3, 0.0, 9e-4)))
    inside, _rate = force.approach(np.array([0.35, 0.45, 0.55]), LIGHT)
    assert np.max(np.abs(inside)) <= FLOOR * force.scale_at(LIGHT)
    ends, _rate = force.approach(np.array([0.95, 0.97]), LIGHT)  # the crest has left, and the next is still to come
    assert np.max(np.abs(ends)) > 1e-3 * LIGHT


@pytest.mark.parametrize("load", [0.02, 0.5])
def test_a_mirrored_scene_turns_the_slope_force_round_and_leaves_friction_as_it_is(load: float) -> None:
    one = Geometry(4e-5, 5e-4, 2e-5, 8.3e-4, 1.4, 7.7e-3, 0.4)
    mirrored = replace(
        one,
        texture_phase=-one.texture_phase - 2 * math.pi * one.texture_periods,
        ridge_phase=-one.ridge_phase - 2 * math.pi * one.ridges,
    )
    phases = period(50)
    for make, sign in ((SlopeForce, -1.0), (friction_of, 1.0)):
        here: ForceOfContact
        here, there = (make(finer(contact_with(each), HALVINGS)) for each in (one, mirrored))
        found, wanted = there.approach(-phases, load)[0], sign * here.approach(phases, load)[0]
        assert np.max(np.abs(found - wanted)) <= NEAR * here.scale_at(load)
        assert np.ptp(wanted) > 1e-3 * np.max(np.abs(wanted))


@pytest.mark.parametrize("load", [0.02, 0.3, 20.0])
@pytest.mark.parametrize("contact", [DEFAULT, GROWING])
@pytest.mark.parametrize("exponent", [0.0, 0.6, 1.4])  # 0: the slope force
def test_slopes_are_the_differences_over_the_load(contact: Contact, load: float, exponent: float) -> None:
    force = friction_of(contact, exponent) if exponent else SlopeForce(contact)
    phases, step = period(40), 1e-4 * load
    difference = (force.approach(phases, load + step)[0] - force.approach(phases, load - step)[0]) / (2 * step)
    _value, rate = force.approach(phases, load)
    assert np.max(np.abs(rate - difference)) <= 4e-4 * np.max(np.abs(difference))


@pytest.mark.parametrize("seed", [11, *(thorough(seed) for seed in range(16) if seed != 11)])
def test_the_stated_error_is_not_exceeded(seed: int) -> None:
    random = np.random.default_rng(seed)
    contact, load = random_contact(random)
    highest, tolerance = int(random.integers(3, 100)), float(10 ** random.uniform(-4, -2))
    exponent = float(random.uniform(0.5, 1.5))
    forces = (SlopeForce(contact), friction_of(contact, exponent))
    for force in forces:
        series = solve_spectrum(force, load, Demand(highest, (0, 1), tolerance))
        count = min(1 << 13, max(4 * series.phases, 1 << 11))
        fine = replace(force, contact=finer(contact, 3))  # a sixty-fourth of the error of the segments
        truth = np.fft.rfft(fine.approach(period(count), load)[0])[: highest + 1] / count
        for order in (0, 1):
            wanted = curves(truth, order, points_for(highest))
            error = float(np.max(np.abs(curves(series.harmonics - truth, order, points_for(highest)))))
            floor = FLOOR * force.scale_at(load) * (2 * math.pi * highest) ** order
            assert error <= series.errors[order] * np.ptp(wanted) + floor
            assert series.errors[order] <= tolerance + floor / np.ptp(wanted)


def test_a_domed_contact_has_series_too() -> None:
    for force in (SlopeForce(GROWING), friction_of(GROWING)):
        series = solve_spectrum(force, 0.4, Demand(20, (0,), 1e-3))
        truth = np.fft.rfft(force.approach(period(1 << 12), 0.4)[0])[:21] / (1 << 12)
        wanted = curves(truth, 0, points_for(20))
        assert np.max(np.abs(curves(series.harmonics - truth, 0, points_for(20)))) <= 1e-3 * np.ptp(wanted)


@pytest.mark.parametrize("exponent", [0.0, thorough(0.6), 1.4])  # 0: the slope force
def test_a_table_of_a_force_keeps_the_error_that_it_tells(exponent: float) -> None:
    force = friction_of(DEFAULT, exponent) if exponent else SlopeForce(DEFAULT)
    check_table(
        force, lambda theta, load: float(force.approach(np.array([theta]), load)[0][0]), 0.3 if exponent else 5e-3
    )


@pytest.mark.parametrize("exponent", [0.0, 0.6, 1.0, 1.4])
def test_there_is_no_force_at_no_load(exponent: float) -> None:
    force = friction_of(DEFAULT, exponent) if exponent else SlopeForce(DEFAULT)
    values, rates = force.approach(period(8), 0.0)
    assert not values.any() and not rates.any()


@pytest.mark.parametrize("tolerance", [1e-3, thorough(1e-5)])
@pytest.mark.parametrize("load", [thorough(1e-3), 0.3, thorough(5.0)])
def test_the_mean_of_friction_is_that_of_a_period(load: float, tolerance: float) -> None:
    """Against segments a sixteenth as long, whose error in the mean is 1e-6 of it."""
    wanted = float(friction_of(finer(DEFAULT, HALVINGS), 0.7).approach(period(1 << 12), load)[0].mean())
    series = solve_spectrum(friction_of(DEFAULT, 0.7), load, Demand(20, (0,), tolerance))
    assert series.harmonics[0].real == pytest.approx(wanted, rel=tolerance)


def test_keys_tell_forces_apart() -> None:
    forces: list[Response] = [SlopeForce(DEFAULT), SlopeForce(GROWING), friction_of(DEFAULT), friction_of(DEFAULT, 0.9)]
    assert len({force.key for force in forces}) == 4
    assert friction_of(DEFAULT).key == friction_of(contact_of(scene_of()).as_profile()).key
