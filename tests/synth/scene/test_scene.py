"""The scene: defaults, units, derived fields, and reading a scene back from its document."""

from __future__ import annotations

import json
import math
import pickle
from typing import Any

import pytest
from hypothesis import given
from pydantic import ValidationError

from synth.errors import SceneError
from synth.scene.merge import merge_patch
from synth.scene.scan_section import Scan, Stroke
from synth.scene.scene import Scene, parse_scene, parse_scene_text, scene_document, scene_fields
from synth.scene.surface_sections import Texture
from tests.synth.scene.scene_cases import RISING, at, nested, scenes

DESIGN_EXAMPLE = """{
  "finger":  {"ridge_period": "0.5 mm", "ridge_amplitude": "40 um", "contact_length": "10 mm",
              "youngs_modulus": "101.2 kPa", "poisson_ratio": 0.5},
  "texture": {"kind": "sinusoid", "period": "0.8 mm", "amplitude": "20 um", "phase": 1.4142135623730951},
  "scan":    {"speed": "80 mm/s", "load": "0.3 N"},
  "effects": {},
  "output":  {"quantity": "acceleration", "sample_rate": 48000, "duration": 2.0, "full_scale": null,
              "bandwidth": "1 kHz"},
  "accuracy": {"tolerance": 0.001}
}"""


def test_an_empty_object_is_the_scene_of_the_design() -> None:
    assert parse_scene({}) == parse_scene_text(DESIGN_EXAMPLE)
    assert parse_scene({}) == Scene()


@pytest.mark.parametrize("section", ["finger", "texture", "scan", "effects", "output", "accuracy"])
def test_a_null_section_is_the_default(section: str) -> None:
    assert parse_scene({section: None}) == Scene()


@pytest.mark.parametrize("line", [line for line in scene_fields() if "[]" not in line.path], ids=lambda line: line.path)
def test_a_null_field_is_the_default(line: Any) -> None:
    if line.path.startswith("scan.stroke."):
        assert parse_scene(nested(line.path, None)) == parse_scene({"scan": {"stroke": {}}})
    else:
        assert parse_scene(nested(line.path, None)) == Scene()


@pytest.mark.parametrize(
    "path", ["texture.amplitude", "finger.ridge_amplitude", "scan.load", "scan.speed", "output.fade"]
)
@pytest.mark.parametrize("zero", [0, 0.0, -0.0, 5e-324])
def test_zero_is_plain_zero_where_it_is_allowed(path: str, zero: float) -> None:
    number = at(parse_scene(nested(path, zero)), path)
    assert isinstance(number, float)
    assert (number, math.copysign(1.0, number)) == (0.0, 1.0)


def test_roughness_becomes_an_amplitude_by_eq_3() -> None:
    scene = parse_scene({"finger": {"roughness": "20 um"}, "texture": {"roughness": 1e-5}})
    assert scene.finger.ridge_amplitude == pytest.approx(math.pi / 2 * 20e-6, rel=1e-15)
    assert scene.texture.amplitude == pytest.approx(math.pi / 2 * 10e-6, rel=1e-15)
    assert (scene.finger.roughness, scene.texture.roughness) == (None, None)


def test_whole_numbers_stay_whole() -> None:
    for written in (44100, 44100.0, "44.1 kHz", "44100 Hz"):
        rate = parse_scene({"output": {"sample_rate": written}}).output.sample_rate
        assert (rate, type(rate)) == (44100, int)


def test_the_band_is_1_khz_unless_one_is_named() -> None:
    for output in ({}, {"bandwidth": None}, {"bandwidth": "1 kHz"}, {"bandwidth": 1000}):
        scene = parse_scene({"output": output})
        assert scene == Scene()
        assert (scene.output.band_limit, scene_document(scene)["output"]["bandwidth"]) == (1000.0, 1000.0)
    assert parse_scene({"output": {"sample_rate": 2000}}).output.band_limit == 800.0  # the limit of the sample rate


@pytest.mark.parametrize("rate", [1000, 8000, 48000, 192000])
def test_full_is_all_that_the_rate_holds(rate: int) -> None:
    scene = parse_scene({"output": {"sample_rate": rate, "bandwidth": "full"}})
    assert scene.output.band_limit == 0.40 * rate
    assert scene_document(scene)["output"]["bandwidth"] == "full"


@pytest.mark.parametrize("tolerance", [1e-7, 0.03, 0.001, "exact", "imperceptible"])
def test_tolerances_are_numbers_or_names(tolerance: object) -> None:
    assert parse_scene({"accuracy": {"tolerance": tolerance}}).accuracy.tolerance == tolerance


def test_a_stroke_has_defaults_and_gives_the_scan_its_speed_and_load() -> None:
    scan = parse_scene({"scan": {"stroke": {"load": "0.5 N"}}}).scan
    assert scan.stroke == Stroke(length=0.05, speed=0.08, load=0.5, turn_time=0.1)
    assert (scan.speed, scan.load, scan.lift_load) == (0.08, 0.5, 0.001)


def test_a_stroke_covers_its_length_in_a_cruise_and_two_half_turns() -> None:
    stroke = Stroke(length=0.03, speed=0.2, turn_time=0.05)
    turn, steps = stroke.turn_time, 200_000
    half_turn = sum(
        0.2 * (1.0 - 2.0 * (3.0 * s * s - 2.0 * s**3)) * turn / steps
        for s in ((i + 0.5) / steps for i in range(steps // 2))
    )
    assert stroke.cruise_time * stroke.speed + 2.0 * half_turn == pytest.approx(stroke.length, rel=1e-9)
    assert stroke.period == pytest.approx(2.0 * (0.03 / 0.2 + 3.0 / 8.0 * 0.05), rel=1e-12)


def test_the_default_turn_shrinks_with_a_short_stroke() -> None:
    assert Stroke(length=0.001, speed=0.08).turn_time == pytest.approx(0.8 * 0.001 / 0.08)
    assert Stroke(length=0.0007, speed=1.0).turn_time == pytest.approx(0.001)


def test_a_trajectory_is_read_with_units_and_gives_the_scan_its_largest_speed_and_load() -> None:
    rows = [["0 s", "0 mm", "300 mN"], ["100 ms", "8 mm", 0.3], [0.2, 0.016, 0.4], [0.3, 0.02, 0.2]]
    scan = parse_scene({"scan": {"trajectory": rows, "lift_load": 0.002}}).scan
    assert scan.trajectory == tuple((float(t), float(p), float(w)) for t, p, w in RISING)
    assert (scan.load, scan.lift_load) == (0.4, 0.002)
    assert scan.speed == pytest.approx(0.08)


def test_one_quantity_is_one_channel() -> None:
    output = parse_scene({"output": {"quantity": "velocity", "full_scale": "50 mm/s"}}).output
    assert [(channel.quantity, channel.full_scale) for channel in output.channel_list] == [("velocity", 0.05)]


def test_each_channel_has_its_quantity_and_its_own_full_scale() -> None:
    channels = ["velocity", {"quantity": "displacement", "full_scale": "20 um"}, {"full_scale": "2 g"}, {}]
    output = parse_scene({"output": {"channels": channels}}).output
    assert [(channel.quantity, channel.full_scale) for channel in output.channel_list] == [
        ("velocity", None),
        ("displacement", 2e-05),
        ("acceleration", 19.6133),
        ("acceleration", None),
    ]
    assert (output.quantity, output.full_scale) == ("velocity", None)


def test_a_catalogue_name_is_a_scene_and_a_texture_kind() -> None:
    named = parse_scene("grating-1mm-31um")
    assert named == parse_scene({"texture": {"kind": "grating-1mm-31um"}})
    assert (named.texture.kind, named.texture.period) == ("sinusoid", 0.001)
    assert named.texture.amplitude == pytest.approx(15.708e-6, rel=1e-4)


def test_fields_beside_a_catalogue_name_override_it() -> None:
    texture = parse_scene({"texture": {"kind": "grating-1mm-31um", "amplitude": "5 um", "phase": 0}}).texture
    assert (texture.period, texture.amplitude, texture.phase) == (0.001, 5e-06, 0.0)
    rough = parse_scene({"texture": {"kind": "grating-5mm-200um", "roughness": "20 um"}}).texture
    assert rough.amplitude == pytest.approx(math.pi / 2 * 20e-6)


def test_effects_are_read_with_their_units_and_frozen() -> None:
    document = {"effects": {"inertia": {"mass": "7 g"}, "viscous_skin": "auto", "adhesion": None, "tangential": {}}}
    scene = parse_scene(document)
    assert scene.effects["inertia"].mass == 0.007
    assert scene.effects["viscous_skin"] == "auto"
    assert list(scene.effects) == ["inertia", "tangential", "viscous_skin"]
    complete = scene_document(scene)["effects"]
    assert complete["inertia"] == {"mass": 0.007, "damping": 2.4, "stiffness": 1e3}
    assert complete["viscous_skin"] == "auto"
    assert parse_scene(scene_document(scene)) == scene
    assert hash(scene) == hash(parse_scene(document))
    assert pickle.loads(pickle.dumps(scene)) == scene


def test_a_part_of_a_scene_changes_one_setting_of_an_effect() -> None:
    before = {"effects": {"inertia": {"mass": "7 g", "damping": 1}, "tangential": {}}}
    after = merge_patch(before, {"effects": {"inertia": {"mass": "9 g"}, "tangential": None, "curvature": "auto"}})
    assert after == {"effects": {"inertia": {"mass": "9 g", "damping": 1}, "curvature": "auto"}}


def test_a_finger_may_pull_where_something_holds_it() -> None:
    for scan in ({"load": "-20 mN"}, {"stroke": {"load": "-20 mN"}}, {"trajectory": [*RISING, [0.4, 0.03, -0.02]]}):
        scene = parse_scene({"scan": scan, "effects": {"adhesion": {}}})
        assert parse_scene(scene_document(scene)) == scene
        with pytest.raises(SceneError):
            parse_scene({"scan": scan})


def test_scenes_are_frozen_hashable_and_picklable() -> None:
    scene = parse_scene({"scan": {"trajectory": RISING}, "output": {"channels": ["velocity"]}})
    assert {scene: 1}[parse_scene(scene_document(scene))] == 1
    assert pickle.loads(pickle.dumps(scene)) == scene
    with pytest.raises(ValidationError):
        scene.finger.ridge_period = 1.0  # type: ignore[misc]
    assert parse_scene(scene) is scene


def test_building_a_section_in_python_is_checked_by_the_same_rules() -> None:
    assert Scene(scan=Scan(speed=0.1)).scan.speed == 0.1
    with pytest.raises(ValidationError):
        Texture(period=2.0)
    with pytest.raises(ValidationError):
        Texture(perod=0.1)  # type: ignore[call-arg]


@given(scenes())
def test_a_scene_reads_back_from_its_document_exactly(document: dict[str, Any]) -> None:
    scene = parse_scene(document)
    complete = scene_document(scene)
    assert parse_scene(complete) == scene
    assert scene_document(parse_scene(complete)) == complete
    assert parse_scene_text(json.dumps(complete, allow_nan=False)) == scene
