"""A plan warns of unusual values, motions too weak to be felt, and accelerations beyond any actuator."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from synth import open_voice, parse_scene
from synth.encode.sound import render
from synth.perception.threshold import threshold_displacement
from synth.plan.warnings import IMPULSE
from synth.scene.doubtful_values import bare_doubts, doubts


def warned(scene: Any) -> str:
    return " ".join(open_voice(scene).plan.document()["warnings"])


@pytest.mark.parametrize(
    ("sections", "told"),
    [
        ({"texture": {"period": 0.6}}, 'texture.period is 0.6 m, and more than 50 mm is unusual. .* write "0.6 mm"'),
        ({"texture": {"period": "0.6 m"}}, "texture.period is 0.6 m"),
        ({"finger": {"ridge_period": 5e-3}}, "finger.ridge_period is 0.005 m"),
        ({"finger": {"ridge_amplitude": 9e-4}}, "finger.ridge_amplitude is 0.0009 m"),
        ({"finger": {"contact_length": 0.1}}, "finger.contact_length is 0.1 m"),
        ({"scan": {"load": 300}}, 'scan.load is 300 N, .* write "300 mN"'),
        ({"scan": {"speed": -8}}, 'scan.speed is -8 m/s, .* write "-8 mm/s"'),
        ({"scan": {"stroke": {"speed": 5}}}, "^scan.stroke.speed is 5 m/s"),
    ],
)
def test_what_no_finger_has_is_questioned(sections: dict[str, Any], told: str) -> None:
    (sentence,) = doubts(parse_scene(sections))
    assert re.search(told, sentence), sentence


@pytest.mark.parametrize(
    "sections", [{}, {"texture": {"period": "20 mm"}}, {"scan": {"stroke": {}}}, {"scan": {"load": 5}}]
)
def test_what_is_usual_is_not(sections: dict[str, Any]) -> None:
    assert not doubts(parse_scene(sections))


def test_a_bare_number_of_a_change_is_questioned_and_one_with_a_unit_is_not() -> None:
    (fault,) = bare_doubts({"texture": {"period": 0.6, "amplitude": 2e-5}, "scan": {"load": 1.0}, "no": {"such": 1}})
    assert fault.pointer == "/texture/period" and '"0.6 mm"' in fault.hint and '"0.6 m"' in fault.hint
    assert not bare_doubts({"texture": {"period": "0.6 m"}, "output": {"duration": 600}})
    assert [fault.pointer for fault in bare_doubts({"scan": {"stroke": {"length": 5}}})] == ["/scan/stroke/length"]


def test_a_motion_below_the_threshold_is_told_and_one_above_is_not() -> None:
    assert "This is not felt: the strongest harmonic, at 100 Hz, is 83 dB below" in warned(
        {"texture": {"amplitude": "1 nm"}, "output": {"full_scale": 1}}
    )
    slow = {"texture": {"period": "50 mm"}, "scan": {"speed": "10 mm/s"}, "output": {"bandwidth": 1}}
    assert "all of it is below 1 Hz" in warned(slow)
    assert not warned({})


def test_the_threshold_of_the_scene_decides() -> None:
    weak = {"texture": {"amplitude": "3 um"}, "scan": {"load": "3 N"}, "output": {"quantity": "displacement"}}
    told = {name: warned(weak | {"accuracy": {"threshold": name}}) for name in ("fingertip", "pen")}
    assert 'the detection threshold "fingertip"' in told["fingertip"]
    assert told["pen"] != told["fingertip"]


def test_a_stroke_is_judged_at_the_lower_frequencies_that_it_passes() -> None:
    weak = {"texture": {"period": "0.5 mm", "amplitude": "2 um"}, "output": {"bandwidth": "full"}}
    assert "is not felt" in warned(weak | {"scan": {"speed": 1}})
    assert "is not felt" not in warned(weak | {"scan": {"stroke": {"speed": 1}}})


def test_a_stroke_is_judged_with_the_harmonics_that_are_in_the_band_only_when_it_is_slow() -> None:
    """The fifth harmonic is at 500 Hz of a band of 120 Hz, until the finger slows down for its turn."""
    stroke = {"scan": {"stroke": {"speed": "80 mm/s", "length": "40 mm"}}}
    output = {"bandwidth": 120, "quantity": "displacement", "full_scale": "1 um", "duration": 1.2}
    for amplitude, felt in ((20e-6, True), (5e-9, False)):
        texture = {"kind": "harmonics", "period": "0.8 mm", "amplitudes": [1e-9, 0, 0, 0, amplitude]}
        sound = render(stroke | {"finger": {"contact_length": "2 mm"}, "texture": texture, "output": output})
        peak = float(np.max(np.abs(sound.values)))
        assert (peak > threshold_displacement(np.array([120.0]))[0]) == felt
        assert sound.plan is not None
        assert any("This is not felt" in warning for warning in sound.plan.warnings) is not felt


def test_what_is_known_of_the_scans_own_speed_only_is_said_of_that() -> None:
    weak = {"texture": {"amplitude": "1 nm"}, "scan": {"stroke": {}}, "output": {"full_scale": 1}}
    assert "At the scan's own speed this is not felt" in warned(weak | {"effects": {"inertia": {}}})
    assert "This is not felt" in warned(weak)


def test_a_stroke_above_the_band_is_heard_and_judged_by_its_turns() -> None:
    scan, output = {"stroke": {"speed": "200 mm/s"}}, {"bandwidth": 100, "duration": "1 s"}
    scene = {"texture": {"period": "0.5 mm"}, "scan": scan, "output": output}
    sound = render({**scene, "accuracy": {"tolerance": 5e-4}})  # of the steady motion, which is much larger
    assert float(np.max(np.abs(sound.frames))) == pytest.approx(0.8, rel=0.05)
    assert sound.plan is not None and not sound.plan.warnings


def test_a_simulated_motion_is_judged_too() -> None:
    quick = {"finger": {"contact_length": "2 mm"}, "texture": {"amplitude": "1 nm"}, "effects": {"inertia": {}}}
    assert "This is not felt" in warned(quick | {"output": {"full_scale": 1}})


def test_an_acceleration_beyond_every_actuator_is_told() -> None:
    strong: dict[str, Any] = {"texture": {"period": "0.25 mm", "amplitude": "15 um"}, "output": {"bandwidth": "full"}}
    voice = open_voice(strong)
    assert voice.full_scale[0] * 0.8 > IMPULSE
    assert "This is beyond any known actuator: the acceleration peaks at" in warned(strong)
    assert "actuator" not in warned(strong | {"output": {"quantity": "displacement"}})
    assert "actuator" not in warned(strong | {"output": {"bandwidth": 200}})
