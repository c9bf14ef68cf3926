"""A round fingertip, as whole renders: steady, and where speed and load vary."""

from __future__ import annotations

import functools

import numpy as np
import pytest

import ridgewave as rw
from synth import open_voice, parse_scene
from synth.contact.curved_contact import RoundContact
from synth.contact.geometry import Geometry
from synth.contact.pressure import PressureField
from synth.contact.profile_solver import SegmentGrid
from synth.contact.stiffness import Stiffness
from synth.surfaces import profile_of
from synth.surfaces.profile import Profile
from tests.reference.kinds_oracle import domed_approach
from tests.reference.shaped_contact_oracle import fitting_radius, round_contact
from tests.reference.stiffness_oracle import Touch
from tests.synth.effects.shaped_renders import PHASES, Approach, check_moving, check_steady
from tests.synth.effects.whole_renders import named, scene_of
from tests.synth.engine_cases import physical, touch_of
from tests.synth.response.shaped_cases import finer
from tests.synth.surfaces.texture_cases import random_texture


@functools.cache
def radius_of(touch: Touch) -> float:
    """Return R (m) of the default reference load, 1 N."""
    return fitting_radius(touch)


def approach_of(touch: Touch) -> Approach:
    """Return the oracle of a fingertip that touches, smooth, the nominal length at 1 N."""
    return lambda theta, load: round_contact(touch, theta, load, radius_of(touch)).approach


@pytest.mark.parametrize("name", named("default"))
def test_a_steady_render_errs_by_no_more_than_the_plan_says(name: str) -> None:
    scene = scene_of(name, {"curvature": {}}, output={"channels": ["displacement", "velocity"], "bandwidth": 1000})
    check_steady(scene, approach_of(touch_of(scene)), 4 * PHASES if name == "wide" else PHASES)


@pytest.mark.thorough
def test_where_speed_and_load_vary_it_is_the_oracle_too() -> None:
    check_moving({"curvature": {}}, approach_of(Touch()))


def test_a_nearly_flat_fingertip_is_about_as_loud_as_a_flat_one_where_ridges_lock() -> None:
    """Softer ends change a locked texture little: all ridges rise together."""
    round_one = scene_of("locked", {"curvature": {}}, output={"channels": ["displacement"]})
    flat_one = scene_of("locked", {}, output={"channels": ["displacement"]})
    moved = [float(np.ptp(physical(open_voice(one), 800))) for one in (round_one, flat_one)]
    assert moved[0] == pytest.approx(moved[1], rel=0.5)


@pytest.mark.parametrize("quantity", ["displacement", "acceleration"])
def test_a_sinusoid_by_another_name_is_one(quantity: str) -> None:
    output = {"quantity": quantity, "sample_rate": 8000, "duration": 0.1}
    wanted = rw.render({"output": output, "effects": {"curvature": {}}}).values
    texture = {"kind": "harmonics", "period": "0.8 mm", "amplitudes": ["20 um", "0.001 nm"], "phases": [0.0, 0.0]}
    found = rw.render({"texture": texture, "output": output, "effects": {"curvature": {}}}).values
    assert np.max(np.abs(found - wanted)) < 1e-3 * np.ptp(wanted)


@pytest.mark.parametrize("load", [0.02, 0.3, 3.0])
@pytest.mark.parametrize("kind", ["harmonics", "grating", "rough", "profile"])
def test_every_kind_of_texture_is_the_quadrature_on_its_heights(kind: str, load: float) -> None:
    texture = random_texture(kind, np.random.default_rng(7))
    scene = parse_scene({"texture": texture, "scan": {"load": load}, "effects": {"curvature": {}}})
    profile = profile_of(scene)
    touch = equivalent_touch(profile)
    contact = RoundContact.of(Geometry.of_scene(scene), Stiffness.of_scene(scene))
    assert contact.finger.radius == pytest.approx(radius_of(touch), rel=1e-9)
    turns = np.random.default_rng(8).random(4)
    wanted = domed_approach(scene.finger, profile, turns, load, touch, contact.finger.radius)
    extent = np.ptp(contact.approach(np.arange(256) / 256, load)[0])
    apart = [np.max(np.abs(one.approach(turns, load)[0] - wanted)) / extent for one in (contact, finer(contact, 2))]
    assert apart[0] <= 2e-3
    assert apart[1] <= 1e-4


def test_a_render_of_a_grating_errs_by_no_more_than_the_plan_says() -> None:
    texture = {"kind": "grating", "period": "1.5 mm", "height": "40 um", "duty": 0.4, "ramp": "0.2 mm"}
    output = {"channels": ["displacement", "velocity"], "bandwidth": 1000}
    scene = scene_of("default", {"curvature": {}}, texture=texture, output=output)
    profile, touch = profile_of(scene), equivalent_touch(profile_of(scene))
    radius = radius_of(touch)

    def approach(theta: float, load: float) -> float:
        return float(domed_approach(scene.finger, profile, np.array([theta]), load, touch, radius)[0])

    check_steady(scene, approach, 2 * PHASES)


def equivalent_touch(profile: Profile) -> Touch:
    """Return the default touch on the equivalent sinusoid of `profile`."""
    equal = profile.equivalent()
    return Touch(texture_period=equal.period, texture_amplitude=equal.amplitude)


def test_the_force_along_a_grating_under_a_round_finger_is_that_of_its_work() -> None:
    """Without loss F_s is k times the change of the pressed area with the place, divided by the place: dE = F_s dx."""
    texture = {"kind": "grating", "period": "1.5 mm", "height": "40 um", "duty": 0.4, "ramp": "0.2 mm"}
    scene = parse_scene({"texture": texture, "effects": {"curvature": {}}})
    contact = RoundContact.of(Geometry.of_scene(scene), Stiffness.of_scene(scene))
    geometry, step = contact.geometry_at(0.3), 1e-7
    grid = SegmentGrid.of_geometry(geometry, contact.dome)
    field, phases = PressureField(grid, geometry.contact_length), np.random.default_rng(9).random(12)
    z = contact.approach(phases, 0.3)[0]
    energy = [0.5 * field.powers(phases + move, z, 2.0).power for move in (-step, step)]
    slopes = field.slopes(phases, z)
    wanted = -(energy[1] - energy[0]) / (2.0 * step * geometry.texture_period)
    allowed = 1e-4 * np.max(np.abs(wanted))  # the chords of the ridges move with the knots of the texture
    assert slopes.slope == pytest.approx(wanted, abs=allowed)
    assert slopes.depth == pytest.approx(contact.indentation(0.3), rel=1e-9)
    assert slopes.touching == pytest.approx(contact.measure(phases, z, 0.3)[1], rel=1e-9)
