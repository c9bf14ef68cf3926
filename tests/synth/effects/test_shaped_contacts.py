"""Contacts whose shape follows the load (growing, round) in whole renders, against an oracle of one phase and load."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from synth import open_voice, parse_scene
from synth.contact.curved_contact import RoundContact
from synth.contact.geometry import Geometry
from synth.contact.pressure import power_integrals, slope_integrals
from synth.contact.profile_solver import SegmentGrid
from synth.contact.stiffness import Stiffness
from synth.scene.scene import Scene
from synth.surfaces import profile_of
from synth.surfaces.profile import Profile
from tests.reference.kinds_oracle import domed_approach
from tests.reference.moving_oracle import Harmonics
from tests.reference.moving_points_oracle import Points, growing_points, round_points
from tests.reference.shaped_contact_oracle import fitting_radius, growing_contact, round_contact
from tests.reference.stiffness_oracle import Touch
from tests.synth.effects.whole_renders import SHORT, below, check_quantities, named, scene_of
from tests.synth.engine_cases import Real, physical, touch_of
from tests.synth.response.shaped_cases import finer
from tests.synth.surfaces.texture_cases import random_texture

RATE = 8000
PHASES = 128  # per period: what folds back onto the lowest harmonics is below a third of what the plan states
MEAN_LOADS = 65  # between which the mean is a cubic spline
REACH = 24  # frames on each side that the filter of the comparison reads

Approach = Callable[[float, float], float]
"""z (m) at theta (turns) and load (N)."""


def check_steady(scene: Scene, approach: Approach, phases: int = PHASES) -> None:
    """Assert that displacement and velocity of a steady scan err by no more than the plan reports."""
    sign = np.copysign(1.0, scene.scan.speed)
    z = [approach(float(sign * i / phases), scene.scan.load) for i in range(phases)]
    fundamental = abs(scene.scan.speed) / scene.texture.period
    several = [Harmonics(np.fft.rfft(z[::part]) / len(z[::part]), fundamental) for part in (1, 2)]
    own, frames = {}, np.arange(800)
    limit = scene.output.band_limit
    for order, quantity in enumerate(("displacement", "velocity", "acceleration")):
        fine, coarse = (one.signal(order, frames, scene.output.sample_rate, limit) for one in several)
        own[quantity] = 0.3 * float(np.max(np.abs(fine - coarse)) / np.ptp(fine))  # folding falls as the power -2.5
    assert own["displacement"] <= 1e-3
    check_quantities(scene, (several[0],), own)


def motion(seconds: float = 0.12) -> tuple[list[list[float]], Callable[[Real], tuple[Real, Real]]]:
    """Return a recording of varying speed and load, and its position (m) and load (N) as a function of time."""

    def at(t: Real) -> tuple[Real, Real]:
        return 5e-3 * t / seconds + 4e-4 * np.sin(40 * t), 0.35 + 0.2 * np.sin(30 * t)

    points = np.arange(round(seconds * 2000) + 1) / 2000
    return np.stack([points, *at(points)], axis=1).tolist(), at


def check_moving(effects: dict[str, Any], points_at: Callable[[float], Points], tolerance: float = 3e-3) -> None:
    """Assert that displacement, at varying speed and load, is that of the oracle about its mean at each load.

    points_at: a finger of points for loads (N) up to the heaviest.
    """
    recorded, at = motion()
    output = {"quantity": "displacement", "sample_rate": RATE, "bandwidth": "full", "full_scale": 1e-5}
    scene = parse_scene({"scan": {"trajectory": recorded}, "effects": effects, "output": output})
    found = physical(open_voice(scene), 450)[:, 0]
    place, load = at(np.arange(900) / (2 * RATE))
    points = points_at(float(np.max(load)))
    z = np.array([points.resting(w, np.array([p]))[0] for p, w in zip(place.tolist(), load.tolist(), strict=True)])
    about = z - points.means(float(np.min(load)), float(np.max(load)), MEAN_LOADS)(load)
    ours, truth = below(found, 1, reach=REACH), below(about, 2, reach=REACH)[: len(found) - 2 * REACH]
    error = float(np.max(np.abs(ours - truth)) / np.ptp(truth))
    assert error <= tolerance


SHAPES: dict[str, dict[str, Any]] = {"contact_growth": {"exponent": 0.25}, "curvature": {}}
each_shape = pytest.mark.parametrize("shape", SHAPES)


@functools.cache
def radius_of(touch: Touch) -> float:
    """Return R (m) of the default reference load, 1 N."""
    return fitting_radius(touch)


def approach_of(shape: str, touch: Touch) -> Approach:
    """Return the oracle of a contact that, if smooth, has the nominal length at 1 N, the default reference load."""
    if shape == "contact_growth":
        return lambda theta, load: growing_contact(touch, theta, load, 0.25).approach
    return lambda theta, load: round_contact(touch, theta, load, radius_of(touch)).approach


@each_shape
@pytest.mark.parametrize("name", named("default"))
def test_a_steady_render_errs_by_no_more_than_the_plan_says(name: str, shape: str) -> None:
    output = {"channels": ["displacement", "velocity"], "bandwidth": 1000}
    # at 0.3 N all of a growing contact touches
    pressed: dict[str, Any] = {"scan": {"load": "0.1 N"}} if name == "default" else {}
    scene = scene_of(name, {shape: SHAPES[shape]}, output=output, finger=SHORT, **pressed)
    phases = {"default": PHASES, "wide": 8 * PHASES}.get(name, 2 * PHASES)
    check_steady(scene, approach_of(shape, touch_of(scene)), phases)


@pytest.mark.thorough
@each_shape
def test_where_speed_and_load_vary_it_is_the_oracle_too(shape: str) -> None:
    touch = Touch()
    points_at = {
        "contact_growth": lambda heaviest: growing_points(touch, heaviest, 0.25),
        "curvature": lambda heaviest: round_points(touch, heaviest, radius_of(touch)),
    }
    check_moving({shape: SHAPES[shape]}, points_at[shape])


def test_at_the_reference_load_it_is_the_scene_without_it() -> None:
    """L = L0 (w / w0)^p: at w0 only the segments change, whatever p is."""
    output = {"quantity": "displacement", "sample_rate": 8000}
    plain = physical(open_voice(parse_scene({"output": output})), 800)
    for exponent in (0.0, 1 / 3, 1.0):
        effects = {"contact_growth": {"exponent": exponent, "reference_load": 0.3}}
        grown = physical(open_voice(parse_scene({"output": output, "effects": effects})), 800)
        assert np.max(np.abs(grown - plain)) <= 2e-4 * np.ptp(plain)


def test_in_full_contact_the_amplitude_is_the_sinc_of_the_grown_length() -> None:
    scene = scene_of("default", {"contact_growth": {"exponent": 0.5}}, scan={"load": "50 N"},
                     finger={"contact_length": "1.43 mm"}, output={"channels": ["displacement"]})  # fmt: skip
    block = physical(open_voice(scene), 800)[:, 0]
    wanted = 20e-6 * abs(np.sinc(1.43 * math.sqrt(50) / 0.8))
    assert np.ptp(block) == pytest.approx(2 * wanted, rel=1e-3)


def test_a_nearly_flat_fingertip_is_about_as_loud_as_a_flat_one_where_ridges_lock() -> None:
    """Softer ends change a locked texture little: all ridges rise together."""
    round_one = scene_of("locked", {"curvature": {}}, output={"channels": ["displacement"]})
    flat_one = scene_of("locked", {}, output={"channels": ["displacement"]})
    moved = [float(np.ptp(physical(open_voice(one), 800))) for one in (round_one, flat_one)]
    assert moved[0] == pytest.approx(moved[1], rel=0.5)


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
    scene = scene_of("default", {"curvature": {}}, texture=texture, output=output, finger=SHORT)
    profile = profile_of(scene)
    touch = replace(equivalent_touch(profile), contact_length=scene.finger.contact_length)
    radius = radius_of(touch)

    def approach(theta: float, load: float) -> float:
        return float(domed_approach(scene.finger, profile, np.array([theta]), load, touch, radius, 40_000)[0])

    check_steady(scene, approach, 2 * PHASES)


def equivalent_touch(profile: Profile) -> Touch:
    """Return the default touch on the equivalent sinusoid of `profile`."""
    equal = profile.equivalent()
    return Touch(texture_period=equal.period, texture_amplitude=equal.amplitude)


def test_the_force_along_a_grating_under_a_round_finger_is_that_of_its_work() -> None:
    """Without loss the force is the derivative of the elastic energy over the position: dE = F_s dx."""
    texture = {"kind": "grating", "period": "1.5 mm", "height": "40 um", "duty": 0.4, "ramp": "0.2 mm"}
    scene = parse_scene({"texture": texture, "effects": {"curvature": {}}})
    contact = RoundContact.of(Geometry.of_scene(scene), Stiffness.of_scene(scene))
    geometry, step = contact.geometry_at(0.3), 1e-7
    grid = SegmentGrid.of_geometry(geometry, contact.dome)
    phases = np.random.default_rng(9).random(12)
    z = contact.approach(phases, 0.3)[0]
    energy = [0.5 * power_integrals(grid, phases + move, z, 2.0)[0] for move in (-step, step)]
    slope, _rise, depth, touching = slope_integrals(grid, geometry.contact_length, phases, z)
    wanted = -(energy[1] - energy[0]) / (2.0 * step * geometry.texture_period)
    allowed = 1e-4 * np.max(np.abs(wanted))  # the chords of the ridges move with the knots of the texture
    assert slope == pytest.approx(wanted, abs=allowed)
    assert depth == pytest.approx(contact.indentation(0.3), rel=1e-9)
    assert touching == pytest.approx(contact.measure(phases, z, 0.3)[1], rel=1e-9)
