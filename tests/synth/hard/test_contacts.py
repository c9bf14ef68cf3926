"""Contacts at the ends of what a scene allows, one row a contact, against the oracle: from no load to a kilonewton."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import pytest

from synth.contact.exact_solver import Grid
from synth.contact.geometry import Geometry
from synth.contact.stiffness import Stiffness
from synth.scene.scene import Scene
from tests.reference.stiffness_oracle import contact_in_metres
from tests.synth.engine_cases import Real, scene_of, touch_of

PROMISED = 2e-12  # of a1 + a2: the error of z


@dataclass(frozen=True)
class Touching:
    """A contact: sections of its scene, loads (N), and by how much its z may miss the oracle, in parts of a1 + a2 (and
    1e-14 of z itself, which lies w / k deep: the rounding of the powers of eqs 4-5).
    """

    finger: dict[str, float] = field(default_factory=dict)
    texture: dict[str, float] = field(default_factory=dict)
    loads: tuple[float, ...] = (0.0, 1e-9, 1e-3, 0.3, 10.0, 1e3)
    allowed: float = PROMISED


CONTACTS: dict[str, Touching] = {
    "the default": Touching(),
    "a smooth finger": Touching(finger={"ridge_amplitude": 0.0}),
    "a smooth texture": Touching(texture={"amplitude": 0.0}),
    "a texture of a millionth of the ridges": Touching({"ridge_amplitude": 1e-3}, {"amplitude": 1e-9}),
    "a texture of a million times the ridges": Touching({"ridge_amplitude": 1e-9}, {"amplitude": 1e-3}),
    "locked: one period for both": Touching(texture={"period": 0.5e-3}),
    "a millionth off locked": Touching(texture={"period": 0.5e-3 * (1 + 1e-6)}),
    "locked and as high": Touching(texture={"period": 0.5e-3, "amplitude": 40e-6}),
    "locked, opposite and as high": Touching(texture={"period": 0.5e-3, "amplitude": 40e-6, "phase": math.pi}),
    "opposite, as high, a millionth off locked": Touching(
        texture={"period": 0.5e-3 * (1 + 1e-6), "amplitude": 40e-6, "phase": math.pi}
    ),
    "opposite and a billionth off as high": Touching(
        texture={"period": 0.5e-3, "amplitude": 40e-6 * (1 + 1e-9), "phase": math.pi}
    ),
    "10,000 texture periods": Touching(texture={"period": 1e-6, "amplitude": 1e-7}, loads=(1e-3, 0.3), allowed=2e-11),
    "a texture of a metre": Touching(texture={"period": 1.0, "amplitude": 1e-3}),
    "shorter than a ridge": Touching(finger={"contact_length": 1e-4}),
    "the shortest": Touching(finger={"contact_length": 1e-5, "ridge_period": 1e-2}, texture={"period": 1.0}),
    "1000 ridges": Touching(finger={"ridge_period": 1e-5}, loads=(1e-3, 0.3, 10.0)),
    "whole numbers of both periods": Touching(texture={"period": 1e-3}, loads=(0.3, 1.5, 3.0, 30.0)),
    "a ridge that just touches": Touching(texture={"period": 0.25e-3}, loads=(1e-12, 1e-10, 1e-8, 1e-6)),
    "the softest skin": Touching(finger={"youngs_modulus": 1e3}),
    "the highest of both": Touching({"ridge_amplitude": 1e-3}, {"amplitude": 1e-3}),
    "the lowest of both": Touching({"ridge_amplitude": 1e-9}, {"amplitude": 1e-9}),
}


def solved(scene: Scene, theta: Real, load: float) -> Real:
    """Return z (m) at each phase."""
    return Grid.of_geometry(Geometry.of_scene(scene)).solve(theta, Stiffness.of_scene(scene).indentation(load)).height


@pytest.mark.timeout(120)
@pytest.mark.parametrize("name", CONTACTS)
def test_a_hard_contact_is_that_of_the_oracle(name: str) -> None:
    case = CONTACTS[name]
    scene = scene_of(finger=case.finger, texture=case.texture)
    theta = (0.0, 0.25, 0.5, 0.1234567, 0.8765432)
    tall = scene.finger.ridge_amplitude + scene.texture.amplitude
    for load in case.loads:
        found = solved(scene, np.array(theta), load)
        wanted = contact_in_metres(touch_of(scene), np.array(theta), load).approach
        deep = float(np.max(np.abs(wanted)))
        assert np.max(np.abs(found - wanted)) <= case.allowed * tall + 1e-14 * deep, f"{load} N"


def test_two_flat_surfaces_have_no_contact_to_solve() -> None:
    """Eq. 5 has no radius then; nothing moves, so nothing is solved: the scans have a row of it."""
    scene = scene_of(finger={"ridge_amplitude": 0.0}, texture={"amplitude": 0.0})
    assert Geometry.of_scene(scene).texture_amplitude == 0.0
    assert Stiffness.of_scene(scene).ridge_radius == math.inf
