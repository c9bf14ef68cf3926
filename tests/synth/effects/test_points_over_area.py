"""Effects of a finger over an area: against plain stepping over its points, limits, splits, and hard values."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from synth import Motion, open_voice, parse_scene
from synth.contact.scene_contact import contact_of
from synth.effects.simulation.skin_points import SkinPoints
from synth.motion.motion import Update
from synth.plan.prepare import prepare
from synth.scene.scene import Scene
from synth.voice.hand_voice import HandVoice
from synth.voice.voice import Voice
from tests.few import few, thorough
from tests.reference.area_stepping_oracle import KNOTS, AreaPoints, Path, Real
from tests.reference.fingertip_oracle import Print, footprint_depth
from tests.reference.stiffness_oracle import stiffness
from tests.synth.effects.whole_renders import below
from tests.synth.engine_cases import physical, touch_of

RATE, FINER, REACH = 8000, 4, 24  # Hz; steps of the oracle per frame; frames that its filter reads on each side
LOAD, SECONDS, BEGUN = 0.3, 0.035, 0.012  # N; s; s, after which the start is forgotten
OWN_ERROR = 4e-3  # of the oracle, of the peak-to-peak: with 110 columns it errs by up to 1.6e-2, with 340 by 1e-3
COLUMNS = 160  # points of the oracle along and across
DOTS = {"kind": "dots", "period": "1.5 mm", "row_distance": "1.5 mm", "stagger": 0.0, "phase": 0.0}
FINGERS: dict[str, dict[str, Any]] = {
    "comb": {"contact_length": "1.4 mm", "ridge_amplitude": "60 um"},
    "fingertip": {"kind": "fingertip", "contact_length": "1.4 mm", "contact_width": "1.4 mm"},
}
EFFECTS: dict[str, dict[str, Any]] = {
    "viscous_skin": {"viscous_skin": {}},
    "inertia": {"inertia": {"stiffness": 0}},
    "adhesion": {"adhesion": {}},
}


def turning(t: Any) -> tuple[Any, Any, Any]:
    """A path that bends, under a finger that turns."""
    return 0.06 * t, 0.02 * np.sin(40.0 * t) / 20.0 + 0.03 * t, 0.3 + 6.0 * t


def straight(t: Any) -> tuple[Any, Any, Any]:
    """The constant scan."""
    return 0.08 * t, 0.0 * t, 0.0 * t


def scene_of(finger: str, effects: dict[str, Any], path: Path | None, **sections: Any) -> Scene:
    """Return a scene over dots; path: None for the constant scan."""
    scan: dict[str, Any] = {"speed": "-80 mm/s", "load": LOAD}
    if path is not None:
        t = np.arange(round(SECONDS * 2000) + 1) / 2000
        scan = {"trajectory": np.stack([t, *path(t), np.full(len(t), LOAD)], axis=1).tolist()}
    output = {"quantity": "displacement", "sample_rate": RATE, "bandwidth": "full", "full_scale": 1e-5}
    document = {"finger": FINGERS[finger], "texture": DOTS, "scan": scan, "effects": effects, "output": output}
    return parse_scene({**document, "accuracy": {"tolerance": 1e-2}, **sections})


def points_of(finger: str, scene: Scene, columns: int = COLUMNS) -> AreaPoints:
    """Return the points of the oracle: the finger drawn anew, and the heights of the texture."""
    contact: Any = contact_of(scene)
    length = scene.finger.contact_length
    size = length if finger == "comb" else 1.6 * length
    row = (np.arange(columns) + 0.5) / columns * size - 0.5 * size
    x, y = (one.ravel() for one in np.meshgrid(row, row, indexing="ij"))
    if finger == "comb":
        heights = -60e-6 * np.cos(2.0 * np.pi * (x + 0.5 * length) / scene.finger.ridge_period)
    else:
        flat = replace(touch_of(scene), load=1.0, texture_amplitude=0.0, texture_period=scene.finger.ridge_period)
        depth = footprint_depth(scene.finger.ridge_amplitude, stiffness(flat).indentation)
        drawn = Print(scene.finger.ridge_period, scene.finger.ridge_amplitude, "loop", 0.3, 0.3, 0.3, 0)
        heights = drawn.heights(x, y) - depth * ((2 * x / length) ** 2 + (2 * y / length) ** 2)
    texture = contact.geometry.profile
    places = np.arange(KNOTS) / KNOTS
    field = texture.area(places * texture.period, places * texture.across)
    share = contact.stiffness_at(LOAD) * (size / columns) ** 2 / length**2
    return AreaPoints(
        x, y, heights, share, field, (texture.period, texture.across), 0.5 * length if finger == "comb" else 0.0
    )


def truth_of(effect: str, finger: str, scene: Scene, path: Path) -> Real:
    """Return z (m) of the oracle, FINER times a frame."""
    points, times = points_of(finger, scene), np.arange(round(SECONDS * RATE) * FINER) / (RATE * FINER)
    if effect == "viscous_skin":
        return points.skin(path, times, LOAD, 1.6e-3)
    if effect == "inertia":
        return points.massive(path, times, LOAD, 1e-4, 2.4)
    pull = 5e3 * scene.finger.contact_length**2 * points.share / contact_of(scene).stiffness_at(LOAD)
    return points.attracted(path, times, LOAD, pull, 5e-6)


def error_of(found: Real, truth: Real) -> float:
    """Return the largest difference after the start, about its mean, relative to the peak-to-peak."""
    ours, wanted = below(found, 1, reach=REACH), below(truth, FINER, reach=REACH)[: len(found) - 2 * REACH]
    apart = (ours - wanted)[round(BEGUN * RATE) :]
    return float(np.max(np.abs(apart - 0.5 * (np.max(apart) + np.min(apart)))) / np.ptp(wanted))


CASES = [(effect, finger, path) for effect in EFFECTS for finger in FINGERS for path in ("turning", "straight")]
QUICK = [
    ("viscous_skin", "fingertip", "straight"),
]


@pytest.mark.parametrize("case", [case if case in QUICK else thorough(case) for case in CASES], ids="-".join)
def test_a_finger_over_dots_is_plain_stepping_over_its_points(case: tuple[str, str, str]) -> None:
    effect, finger, name = case
    path = turning if name == "turning" else straight
    scene = scene_of(finger, EFFECTS[effect], path if name == "turning" else None)
    voice = open_voice(scene)
    error = error_of(physical(voice, round(SECONDS * RATE))[:, 0], truth_of(effect, finger, scene, path))
    told = voice.plan.estimated_error["displacement"]
    assert error <= min(0.03, told + OWN_ERROR), f"errs by {error:.2e}, told {told:.2e}"


@pytest.mark.thorough
@pytest.mark.parametrize("finger", FINGERS)
def test_skin_of_a_tiny_time_constant_is_the_quasi_static_finger(finger: str) -> None:
    skin, loose = {"viscous_skin": {"time_constant": "1 us"}}, {"accuracy": {"tolerance": 0.03}}
    voices = [open_voice(scene_of(finger, effects, turning, **loose)) for effects in (skin, {})]
    found, wanted = (physical(voice, round(SECONDS * RATE))[:, 0] for voice in voices)
    told = sum(voice.plan.estimated_error["displacement"] for voice in voices)
    apart = (found - wanted)[round(BEGUN * RATE) :]
    assert np.max(np.abs(apart - np.mean(apart))) <= (told + 1e-3) * np.ptp(wanted)


@pytest.mark.parametrize("effect", few(EFFECTS, 1))
def test_splits_do_not_matter_on_a_path_and_a_hand_has_no_click(effect: str) -> None:
    scene = scene_of("comb", EFFECTS[effect], turning, accuracy={"tolerance": 0.03})
    whole, parts = open_voice(scene).render(300), open_voice(scene)
    assert np.array_equal(np.concatenate([parts.render(count) for count in (1, 120, 179)]), whole)
    one, many = (hand_of(open_voice(scene_of("comb", EFFECTS[effect], None), live=True), split) for split in (400, 40))
    assert np.array_equal(one, many)


def hand_of(voice: Voice, split: int) -> Real:
    """Return 400 frames of a hand that leads the finger over the area, in blocks of `split` frames."""
    t = np.arange(400) / RATE
    along, across, direction = turning(t)
    blocks = []
    for first in range(0, 400, split):
        some = slice(first, first + split)
        motion = Motion.of(
            split, load=LOAD, load_rate=0.0, load_bend=0.0, speed=0.06, speed_rate=0.0, position=-along[some],
            across=-across[some], direction=direction[some],
        )  # fmt: skip
        blocks.append(voice.render(split, motion).astype(float)[:, 0] * voice.full_scale[0])
    return np.concatenate(blocks)


def led(effect: str, across: float) -> tuple[HandVoice, Real]:
    """Return a voice that updates lead, and 0.1 s of it; across: how far they move it across in that time (m)."""
    voice, blocks = HandVoice(scene_of("comb", {effect: {}}, None)), []
    for number in range(10):
        t = 0.01 * number
        voice.touch(Update(number, t, -0.08 * t, None, LOAD, across * number / 10, 0.05 * number))
        blocks.append(voice.render(80))
    return voice, np.concatenate(blocks)[:, 0].astype(float)


def test_updates_lead_viscous_skin_over_the_area_and_a_table_stays_on_its_line() -> None:
    voice, on_line = led("viscous_skin", 0.0)
    assert voice.over_area and np.ptp(led("viscous_skin", 1e-3)[1] - on_line) > 0.05 * np.ptp(on_line) > 0.0
    assert not led("inertia", 0.0)[0].over_area


@pytest.mark.parametrize("ridges", ["0.46 mm", "1.3 mm"])
def test_few_points_of_a_comb_are_not_all_between_its_ridges(ridges: str) -> None:
    scene = parse_scene({"finger": {"contact_length": "10 mm", "ridge_period": ridges}, "texture": DOTS})
    contact, crest = contact_of(scene), scene.finger.ridge_amplitude
    for count in range(20, 400, 7):
        points = SkinPoints.over_area(contact, 0.9 * crest, count)  # type: ignore[arg-type]
        assert points.count > 1 and np.any(points.weights > 0.0)


HARD: dict[str, dict[str, Any]] = {
    "skin that relaxes for 100 s": {"viscous_skin": {"time_constant": "100 s"}},
    "an attraction of 10 MPa": {"adhesion": {"stress": "10 MPa"}},
    "a heavy mass without damping": {"inertia": {"mass": "1 kg", "damping": 0, "stiffness": 0}},
}


@pytest.mark.parametrize("name", HARD)
def test_hard_values_and_loads_to_20_n_with_a_lift_stay_finite(name: str) -> None:
    points = [[0, 0, 0, 0, 0], [0.02, 0.001, 0, 0.1, 20], [0.03, 0.002, 0.001, 0.2, 0], [0.04, 0.003, 0.001, 0.2, 1]]
    scene = scene_of("comb", HARD[name], None, scan={"trajectory": points}, accuracy={"tolerance": 0.03})
    block = Voice(prepare(scene, paced=True), paced=True).render(480)
    assert np.all(np.isfinite(block)) and np.any(block)


def test_an_error_that_time_does_not_allow_is_told() -> None:
    voice = open_voice(scene_of("fingertip", {"viscous_skin": {}}, None), live=True)
    told = voice.plan.estimated_error["displacement"]
    assert told > 1e-3 and math.isfinite(told)
