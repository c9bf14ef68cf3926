"""Denormal numbers in every field of a scene and of a motion: refused, or read as nothing; none of them comes out."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
import pytest

from synth.errors import SceneError
from synth.motion.motion import Motion
from synth.response_cache import ResponseCache
from synth.scene.scene import parse_scene
from synth.voice.voice import open_voice
from tests.few import paired
from tests.synth.engine_cases import scene_of
from tests.synth.hard.bounds import ALL, check_fit, finite, merged
from tests.synth.hard.ranges import FIELDS, Field
from tests.synth.scene.scene_cases import RISING, faults_of

SMALLEST = (5e-324, 1e-310, sys.float_info.min * (1 - 2**-52), -5e-324, -1e-310)
NORMAL = (sys.float_info.min, 1e-300, 1e-200)
BASE: dict[str, Any] = {
    "finger": {"contact_length": 2.5e-3},
    "output": {**ALL, "sample_rate": 8000, "bandwidth": 600.0},
    "accuracy": {"tolerance": 1e-2},
}


@pytest.mark.parametrize(("field", "value"), paired(FIELDS, SMALLEST))
def test_a_denormal_field_is_refused_or_is_zero(field: Field, value: float) -> None:
    document = merged(BASE, field.document(value))
    if not field.rule.low <= 0.0 <= field.rule.high:
        faults = faults_of(document)
        assert [fault.pointer for fault in faults] == [field.pointer]
        return
    scene = parse_scene(document)
    assert scene == parse_scene(merged(BASE, field.document(0.0)))
    voice = open_voice(scene)
    check_fit(voice, voice.render(300))


@pytest.mark.parametrize(("field", "value"), paired(FIELDS, NORMAL))
def test_the_smallest_normal_numbers_make_no_denormals(field: Field, value: float) -> None:
    """What a field makes of them inside may be denormal; the samples are not."""
    try:
        scene = parse_scene(merged(BASE, field.document(value)))
    except SceneError as error:
        assert field.rule.low > value
        assert [fault.pointer for fault in error.faults] == [field.pointer]
        return
    voice = open_voice(scene)
    check_fit(voice, voice.render(300))


@pytest.mark.parametrize(("value", "place"), paired((*SMALLEST, *NORMAL), range(3)))
def test_the_points_of_a_trajectory_may_be_denormal(place: int, value: float) -> None:
    points = [list(point) for point in RISING]
    points[0][place] = value
    document = merged(BASE, {"scan": {"trajectory": points}, "output": {"bandwidth": 300.0}})
    if value < 0.0 and place != 1 and abs(value) >= sys.float_info.min:
        assert faults_of(document)
        return
    voice = open_voice(parse_scene(document))
    assert finite(voice.render(300))


@pytest.mark.parametrize("fine", [{"ridge_amplitude": 0.0}, {"ridge_amplitude": sys.float_info.min}], ids=str)
@pytest.mark.parametrize("load", [0.0, sys.float_info.min, 1e-9, 0.3, 1e3])
def test_two_surfaces_of_next_to_no_height(fine: dict[str, float], load: float) -> None:
    """a1 + a2 is the scale of the contact: here it is as small as a normal number can be."""
    document = merged(BASE, {"finger": fine, "texture": {"amplitude": sys.float_info.min}, "scan": {"load": load}})
    voice = open_voice(parse_scene(document))
    check_fit(voice, voice.render(300))


FRAMES = 600
HAND: dict[str, Any] = {"speed": 0.04, "speed_rate": 0.1, "load": 0.3, "load_rate": 0.2, "load_bend": 1.0}


@pytest.mark.parametrize(
    ("value", "name"), paired((*SMALLEST, *NORMAL, -sys.float_info.min), [*HAND, "position", "all"])
)
def test_a_denormal_field_of_a_motion_is_as_good_as_zero(name: str, value: float) -> None:
    """Compared with zero in its place: no more than a rounding of the largest sample apart, and nothing denormal."""

    cache = ResponseCache()

    def rendered(number: float) -> Any:
        fields = dict.fromkeys(HAND, number) if name == "all" else {**HAND, name: number}
        voice = open_voice(scene_of(**BASE), cache=cache)
        blocks = [voice.render(FRAMES, Motion.of(FRAMES, **fields)), voice.render(FRAMES)]
        return np.concatenate(blocks)

    found, wanted = rendered(value), rendered(0.0)
    assert finite(found)
    assert np.max(np.abs(found - wanted)) <= 1e-6 * np.max(np.abs(wanted))


@pytest.mark.parametrize("name", [*HAND, "position"])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_motion_that_is_not_finite_is_refused(name: str, value: float) -> None:
    with pytest.raises(ValueError, match="finite"):
        Motion.of(FRAMES, **{**HAND, name: value})
