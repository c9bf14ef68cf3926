"""The tangential force of a finger over an area, and along paths, against sums over the points of the finger."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from synth import Motion, open_voice, parse_scene
from synth.contact.scene_contact import contact_of
from synth.plan.prepare import prepare
from synth.scene.scene import Scene
from synth.voice.voice import Voice
from tests.few import thorough
from tests.reference.area_stepping_oracle import KNOTS, AreaPoints, Real
from tests.synth.effects import test_points_over_area as over_area
from tests.synth.effects.whole_renders import below
from tests.synth.engine_cases import physical

RATE, FINER, REACH, LOAD = over_area.RATE, 2, 40, over_area.LOAD
SECONDS, BELOW = 0.025, 0.12  # s; part of the rate below which forces are compared: well within the band
BEGUN = 0.004  # s after the first frame that is compared, when the start is forgotten
COLUMNS, LENGTH = 130, "1.1 mm"  # points of the oracle along and across; of the fingers
FORCES = ("tangential_force", "tangential_force_y")
OWN_ERROR = 4e-3  # of the oracle, of the peak-to-peak
FINGERS: dict[str, dict[str, Any]] = {
    "comb": {"contact_length": LENGTH, "ridge_amplitude": "60 um"},
    "fingertip": {"kind": "fingertip", "contact_length": LENGTH, "contact_width": LENGTH},
    "probe": {"kind": "probe", "tip_radius": "1.5 mm"},
}
SLOPES = {"tangential": {"friction_coefficient": 0, "components": "xy"}}
MU, U0 = 0.5, 1e-3


def beside(t: Any) -> tuple[Any, Any, Any]:
    """The constant scan along x, on a line beside the middle of the dots."""
    return 0.08 * t, 0.0 * t + 0.3e-3, 0.0 * t + 0.4


PATHS = {"turning": over_area.turning, "beside": beside}


def scene_of(finger: str, name: str, effects: dict[str, Any], **sections: Any) -> Scene:
    """Return a scene over dots, along one of PATHS."""
    scan: dict[str, Any] = {"speed": "-80 mm/s", "load": LOAD, "y": 0.3e-3, "direction": 0.4}
    if name == "turning":
        t = np.arange(round(SECONDS * 2000) + 1) / 2000
        scan = {"trajectory": np.stack([t, *PATHS[name](t), np.full(len(t), LOAD)], axis=1).tolist()}
    output = {"quantity": "displacement", "sample_rate": RATE, "bandwidth": 1500.0, "full_scale": 1e-5}
    document = {"finger": FINGERS[finger], "texture": over_area.DOTS, "scan": scan, "effects": effects}
    return parse_scene({**document, "output": output, "accuracy": {"tolerance": 3e-2}, **sections})


def points_of(finger: str, scene: Scene) -> AreaPoints:
    """Return the points of the oracle."""
    if finger != "probe":
        return over_area.points_of(finger, scene, COLUMNS)
    contact: Any = contact_of(scene)
    radius, size = 1.5e-3, 0.9e-3  # of FINGERS; a square that holds what touches
    row = (np.arange(COLUMNS) + 0.5) / COLUMNS * size - 0.5 * size
    x, y = (one.ravel() for one in np.meshgrid(row, row, indexing="ij"))
    texture = contact.geometry.profile
    places = np.arange(KNOTS) / KNOTS
    field = texture.area(places * texture.period, places * texture.across)
    share = contact.stiffness_at(LOAD) * (size / COLUMNS) ** 2 / radius**2
    middle = 0.5 * contact.geometry.contact_length
    return AreaPoints(x, y, -(x**2 + y**2) / (2 * radius), share, field, (texture.period, texture.across), middle)


def times_of() -> Real:
    """Return the times (s) of the oracle."""
    return np.arange(round(SECONDS * RATE) * FINER) / (RATE * FINER)


def errors_of(found: Real, truth: Real, begun: float = 0.0) -> Real:
    """Return the largest difference of each force after `begun` (s), over the largest peak-to-peak.

    found: [frames, forces]; truth: FINER times a frame [forces, times].
    """
    both = zip(found.T, truth, strict=True)
    pairs = [(below(one, 1, BELOW, REACH), below(two, FINER, BELOW, REACH)) for one, two in both]
    extent = max(float(np.ptp(wanted)) for _ours, wanted in pairs)
    first = round(begun * RATE)
    return np.array([np.max(np.abs((ours - wanted[: len(ours)])[first:])) for ours, wanted in pairs]) / extent


def forces_of(voice: Voice, frames: int = round(SECONDS * RATE)) -> Real:
    """Return both forces (N) of the first frames."""
    columns = [voice.quantities.index(name) for name in FORCES]
    return physical(voice, frames)[:, columns]


def check(voice: Voice, found: Real, truth: Real, begun: float = 0.0, most: float = 0.2) -> None:
    """Assert that the forces err by no more than the plan of `voice` reports, and that this is less than `most`."""
    for name, error in zip(FORCES, errors_of(found, truth, begun), strict=True):
        told = voice.plan.estimated_error[name]
        assert error <= told + OWN_ERROR, f"{name} errs by {error:.2e}, told {told:.2e}"
        assert told < most


CASES = [(finger, name) for finger in FINGERS for name in PATHS]


@pytest.mark.parametrize(
    ("finger", "name"), [case if case in CASES[3::3] else thorough(*case) for case in CASES], ids=str
)
def test_the_forces_of_the_slopes_are_the_sums_over_the_points(finger: str, name: str) -> None:
    scene = scene_of(finger, name, SLOPES)
    voice = open_voice(scene)
    points = points_of(finger, scene)
    truth = points.forces(PATHS[name], times_of(), points.elastic(PATHS[name], times_of(), LOAD))[:2]
    assert np.all(np.ptp(truth, axis=1) > 1e-3)
    check(voice, forces_of(voice), truth)


def direction_of(name: str) -> Real:
    """Return the direction of friction on the finger at the times of the oracle [2, times]."""
    step = 1e-6
    ends = [np.array(PATHS[name](times_of() + way * step)[:2]) for way in (-1, 1)]
    speeds = -(ends[1] - ends[0]) / (2 * step)  # of the surface under the finger
    size = np.hypot(*speeds)
    return np.asarray(speeds / size * np.tanh(size / U0))


@pytest.mark.parametrize(("finger", "exponent"), [thorough("comb", 0.8), thorough("fingertip", 1.3), ("probe", 0.8)])
def test_friction_is_against_the_motion_and_of_the_power_of_the_pressure(finger: str, exponent: float) -> None:
    law = {"friction_coefficient": MU, "pressure_exponent": exponent, "components": "xy"}
    scene = scene_of(finger, "turning", {"tangential": law})
    voice, points = open_voice(scene), points_of(finger, scene)
    *slopes, power = points.forces(
        PATHS["turning"], times_of(), points.elastic(PATHS["turning"], times_of(), LOAD), exponent
    )
    size = float(points.x.max() - points.x.min()) / (COLUMNS - 1)
    friction = MU * (1e4 * size**2 / points.share) ** (1.0 - exponent) * power
    check(voice, forces_of(voice), np.array(slopes) + direction_of("turning") * friction)


@pytest.mark.parametrize("finger", [thorough("comb"), thorough("fingertip"), "probe"])
def test_coulombs_friction_has_the_size_mu_w(finger: str) -> None:
    plain, whole = (
        forces_of(
            open_voice(scene_of(finger, "turning", {"tangential": {"friction_coefficient": mu, "components": "xy"}}))
        )
        for mu in (0.0, MU)
    )
    added = (whole - plain)[5:-5]
    assert np.hypot(*added.T) == pytest.approx(MU * LOAD, rel=1e-3)
    assert added == pytest.approx((MU * LOAD * direction_of("turning")[:, ::FINER]).T[5:-5], abs=2e-3 * MU * LOAD)


@pytest.mark.parametrize("finger", ["comb", thorough("fingertip")])
@pytest.mark.parametrize("effect", [thorough("viscous_skin"), "inertia"])
def test_the_forces_of_a_simulation_are_the_sums_over_the_points(finger: str, effect: str) -> None:
    scene = scene_of(finger, "turning", {**over_area.EFFECTS[effect], **SLOPES})
    voice, points, path = open_voice(scene), points_of(finger, scene), PATHS["turning"]
    if effect == "viscous_skin":
        truth = points.skin_with_forces(path, times_of(), LOAD, 1.6e-3)[1:]
    else:
        truth = points.forces(path, times_of(), points.massive(path, times_of(), LOAD, 1e-4, 2.4))[:2]
    check(voice, forces_of(voice), truth, BEGUN, 0.3)


def hand_of(voice: Voice, split: int, frames: int = 400) -> Real:
    """Return the forces (N) of a hand on the turning path, in blocks of `split` frames."""
    along, across, direction = PATHS["turning"](np.arange(frames) / RATE)
    blocks = []
    for first in range(0, frames, split):
        some = slice(first, first + split)
        motion = Motion.of(
            split, load=LOAD, load_rate=0.0, load_bend=0.0, speed=0.06, speed_rate=0.0, position=-along[some],
            across=-across[some], direction=direction[some],
        )  # fmt: skip
        blocks.append(voice.render(split, motion).astype(float))
    columns = [voice.quantities.index(name) for name in FORCES]
    return np.asarray(np.concatenate(blocks)[:, columns] * np.array(voice.full_scale)[columns])


@pytest.mark.thorough
@pytest.mark.parametrize("effects", [{}, thorough({"viscous_skin": {}})], ids=str)
def test_a_hand_feels_the_forces_of_its_path_late(effects: dict[str, Any]) -> None:
    scene = scene_of("comb", "beside", {**effects, **SLOPES}, scan={"speed": "80 mm/s", "load": LOAD})
    voice, points, path = open_voice(scene, live=True), points_of("comb", scene), PATHS["turning"]
    found = hand_of(voice, 40)
    assert np.array_equal(found, hand_of(open_voice(scene, live=True), 400))
    if effects:
        return
    assert voice.told.effects is not None and voice.told.effects.channels[0].work > 0.0
    truth = points.forces(path, times_of(), points.elastic(path, times_of(), LOAD))[:2]
    late = voice.late
    frames = truth.shape[1] // FINER - late
    check(voice, found[late : late + frames], truth[:, : frames * FINER], BEGUN, 1.0)  # a hand that turns: few cells


@pytest.mark.thorough
def test_splits_of_a_file_do_not_matter() -> None:
    scene = scene_of("comb", "turning", {"tangential": {"components": "xy"}})
    whole, parts = open_voice(scene).render(300), open_voice(scene)
    assert np.array_equal(np.concatenate([parts.render(count) for count in (1, 120, 179)]), whole)


@pytest.mark.parametrize("paced", [False, True])
def test_a_stroke_on_a_line_of_an_area_turns_its_friction_round(paced: bool) -> None:
    stroke = {"speed": "80 mm/s", "length": "8 mm", "turn_time": "40 ms", "load": LOAD}
    scan = {"stroke": stroke, "y": 0.3e-3, "heading": 0.5}
    scene = scene_of("comb", "beside", {"tangential": {"components": "xy"}}, scan=scan)
    voice = Voice(prepare(scene, paced=paced), paced=paced)
    found = forces_of(voice, 1600)
    away = found @ [math.cos(0.5), math.sin(0.5)]
    assert np.max(away) > 0.9 * MU * LOAD and np.min(away) < -0.9 * MU * LOAD
    across = found @ [-math.sin(0.5), math.cos(0.5)]
    assert abs(np.mean(across)) < 0.1 * MU * LOAD


@pytest.mark.parametrize("turned", [0.0, thorough(0.3)])
def test_along_a_line_friction_has_both_parts_of_the_heading(turned: float) -> None:
    scan = {"speed": "80 mm/s", "load": LOAD, "heading": 1.0, "direction": turned}
    document = {"finger": FINGERS["comb"], "scan": scan, "effects": {"tangential": {"components": "xy"}}}
    voice = open_voice(parse_scene({**document, "output": {"sample_rate": RATE}, "accuracy": {"tolerance": 1e-2}}))
    found = forces_of(voice, 4000)
    assert np.mean(found, axis=0) == pytest.approx([MU * LOAD * math.cos(1.0), MU * LOAD * math.sin(1.0)], rel=5e-3)
    assert np.ptp(found[:, 1]) < 1e-3 * MU * LOAD < np.ptp(found[:, 0]), "grooves have no slope across"
