"""A stiffness that the scene gives: w / k replaces eqs 4-5, in every contact and in whole renders."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import ridgewave as rw
from synth import open_voice
from synth.contact.curved_contact import RoundContact
from synth.contact.geometry import Geometry
from synth.contact.growing_contact import GrowingContact
from synth.contact.scene_contact import contact_of
from synth.contact.stiffness import Stiffness
from synth.effects.simulation.steps import StiffnessLaw
from synth.errors import SceneError
from synth.scene.scene import Scene, parse_scene, scene_document
from synth.surfaces import profile_of
from tests.reference.kinds_oracle import DOMED_POINTS, approach, level
from tests.synth.engine_cases import Real, load_of
from tests.synth.response.shaped_cases import THETA, differences

K = 3.6e5
FULL = {"finger": {"stiffness": "36 kN/m"}, "scan": {"load": "20 N"}}
GRATING = {"kind": "grating", "period": "1.5 mm", "height": "40 um", "duty": 0.4, "ramp": "0.3 mm"}


def soft(texture: dict[str, Any] | None = None) -> Scene:
    return parse_scene({"finger": {"stiffness": K}, "texture": texture or {}})


def test_the_law_is_w_over_k_and_k_is_that_of_each_metre() -> None:
    law = Stiffness.of_scene(soft())
    for load in (1e-6, 0.3, 50.0):
        assert law.stiffness(load) == K
        assert law.indentation(load) == load / K
        assert load_of(law, law.indentation(load)) == pytest.approx(load, rel=1e-15)
    assert law.over(2.5e-3).stiffness(1.0) == pytest.approx(0.25 * K, rel=1e-15)
    assert law.over(2.5e-3).over(0.01).stiffness(1.0) == pytest.approx(K, rel=1e-15)


def test_moduli_beside_it_are_legal_and_change_nothing() -> None:
    stiff = {"finger": {"stiffness": K, "youngs_modulus": "2 MPa"}, "texture": {"youngs_modulus": "1 MPa"}}
    output = {"output": {"quantity": "displacement", "duration": 0.02}}
    ours, theirs = rw.render({**stiff, **output}), rw.render({"finger": {"stiffness": K}, **output})
    assert np.array_equal(ours.values, theirs.values)


def test_a_scene_tells_it_only_where_it_is_given() -> None:
    assert scene_document(soft())["finger"]["stiffness"] == K
    assert "stiffness" not in scene_document(Scene())["finger"]


@pytest.mark.parametrize("value", ["0 N/m", "0.5 N/m", "2e9 N/m", "3 Pa", -1, float("nan"), True])
def test_what_is_no_stiffness_is_refused(value: object) -> None:
    with pytest.raises(SceneError, match=r"finger\.stiffness: got .*; allowed: 1 N/m to 1e9 N/m\. .*(Write|write)"):
        parse_scene({"finger": {"stiffness": value}})


def test_pressed_flat_z_is_the_mean_height_less_the_indentation() -> None:
    """The closed form is a2 sinc(L / lambda2) cos(pi L / lambda2 + phi - 2 pi theta) - mean of the ridges - w / k."""
    scene = parse_scene(FULL)
    contact, theta = contact_of(scene), np.random.default_rng(1).random(20)
    periods = contact.geometry.texture_periods
    angle = math.pi * periods + contact.geometry.texture_phase - 2.0 * math.pi * theta
    ridges = contact.geometry.ridge_amplitude * np.sinc(2.0 * contact.geometry.ridges)
    wanted = contact.geometry.texture_amplitude * np.sinc(periods) * np.cos(angle) - ridges - 20.0 / 36e3
    z, slope = contact.approach(theta, 20.0)
    assert z == pytest.approx(wanted, abs=1e-13 * 20.0 / 36e3)
    assert slope == pytest.approx(np.full(20, -1.0 / 36e3), rel=1e-9)


@pytest.mark.parametrize("texture", [{}, GRATING], ids=["sinusoid", "grating"])
@pytest.mark.parametrize("load", [0.02, 0.3, 3.0])
def test_a_light_contact_is_the_quadrature_on_the_heights(texture: dict[str, Any], load: float) -> None:
    scene, theta = soft(texture), np.random.default_rng(2).random(8)
    contact = contact_of(scene)
    wanted = approach(scene.finger, profile_of(scene), theta, load / K)
    z = contact.approach(theta, load)[0]
    assert np.max(np.abs(z - wanted)) <= 5e-4 * np.ptp(contact.approach(np.arange(256) / 256, load)[0])
    assert contact.heights(theta, np.full(8, load)) == pytest.approx(z, abs=1e-12)


@pytest.mark.parametrize("load", [0.05, 0.7])
def test_slopes_over_the_load_are_differences_in_every_contact(load: float) -> None:
    scene = soft()
    geometry, law = Geometry.of_scene(scene), Stiffness.of_scene(scene)
    for contact in (contact_of(scene), GrowingContact.of(geometry, law), RoundContact.of(geometry, law)):
        slope = contact.approach(THETA, load)[1]
        apart = np.abs(differences(contact, load) - slope)
        assert np.median(apart) <= 1e-7 * np.max(np.abs(slope))
        z = contact.approach(THETA, load)[0]
        assert contact.heights(THETA, np.full(16, load)) == pytest.approx(z, abs=1e-11)
        depth = contact.measure(THETA, z, load)[0]
        assert contact.stiffness_at(load) * depth == pytest.approx(np.full(16, load), rel=1e-6)


def test_a_growing_contact_keeps_the_stiffness_of_a_metre() -> None:
    scene = soft()
    contact = GrowingContact.of(Geometry.of_scene(scene), Stiffness.of_scene(scene))
    length = contact.length(0.1)
    assert contact.stiffness_at(0.1) == pytest.approx(K * length / 0.01, rel=1e-14)


@pytest.mark.parametrize("radius", [None, 0.1])
def test_a_round_finger_is_the_parabola_on_a_foundation_of_k_over_the_length(radius: float | None) -> None:
    scene, load = soft(), 0.3
    contact = RoundContact.of(Geometry.of_scene(scene), Stiffness.of_scene(scene), radius=radius)
    foundation = K / 0.01
    fitting = 2.0 / 3.0 * foundation * 0.005**3  # w = (2/3) kappa b^3 / R with b = L0 / 2 at 1 N
    bend = radius or fitting
    assert contact.finger.radius == pytest.approx(bend, rel=1e-12)
    b = (1.5 * bend * load / foundation) ** (1.0 / 3.0)
    assert contact.finger.length_at(load) == pytest.approx(2.0 * b, rel=1e-12)
    theta = np.random.default_rng(3).random(6)
    wanted = domed(scene, theta, bend, load / foundation)
    z = contact.approach(theta, load)[0]
    assert np.max(np.abs(z - wanted)) <= 5e-4 * np.ptp(contact.approach(np.arange(256) / 256, load)[0])


def domed(scene: Scene, theta: Real, radius: float, area: float) -> Real:
    """Return z (m) where the integral of max(h - d - z, 0) is `area` (m^2), by quadrature over the possible contact."""
    finger, profile = scene.finger, profile_of(scene)
    half = math.sqrt(4.0 * radius * 60e-6 + (1.5 * radius * area) ** (2.0 / 3.0))
    off = np.linspace(-half, half, DOMED_POINTS + 1)
    x = 0.5 * finger.contact_length + off
    taken = finger.ridge_amplitude * np.cos(2.0 * math.pi * x / finger.ridge_period) + off**2 / (2.0 * radius)
    return np.array([level(profile.heights(x - one * profile.period) - taken, area / (2.0 * half)) for one in theta])


def test_a_simulation_presses_with_it_at_every_load() -> None:
    stiffness = StiffnessLaw.of(contact_of(soft()), 0.3, 0.01)
    assert stiffness.coefficient == pytest.approx(K) and stiffness.power == 0.0


@pytest.mark.parametrize("effect", ["inertia", "viscous_skin", "curvature", "contact_growth", "adhesion"])
def test_it_renders_with_every_effect(effect: str) -> None:
    finger = {"stiffness": K, "contact_length": "3 mm"}
    scene = {"finger": finger, "effects": {effect: {}}, "output": {"duration": 0.02}}
    sound = rw.render(scene)
    assert np.ptp(sound.values) > 0.0
    assert sound.plan is not None
    assert max(sound.plan.estimated_error.values()) <= 1e-3


def test_where_the_load_varies_each_load_has_its_z() -> None:
    """A recording at rest, in which the load rises: z falls as in the quadrature."""
    points = [[0.1 * i, 1e-4, 0.2 + 0.04 * i] for i in range(6)]
    output = {"quantity": "approach", "sample_rate": 8000, "full_scale": 1e-4}
    scene = parse_scene({"finger": {"stiffness": K}, "scan": {"trajectory": points}, "output": output})
    values = open_voice(scene).render(4000)[:, 0]
    profile, place = profile_of(scene), np.array([1e-4 / scene.texture.period])
    wanted = [approach(scene.finger, profile, place, load / K)[0] for load in (0.25, 0.35)]
    found = values[3000] - values[1000]
    assert found * 1e-4 == pytest.approx(wanted[1] - wanted[0], rel=2e-3)
