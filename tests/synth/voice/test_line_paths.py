"""Paths over textures that vary along one line only: files, streams and hands, straight and turned."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import pytest

import ridgewave as rw
from synth.motion.motion import Motion, Update
from synth.plan.prepare import prepare
from synth.response_cache import ResponseCache
from synth.scene.scene import Scene, parse_scene
from synth.voice.hand_voice import HandVoice
from synth.voice.recording import Recording
from synth.voice.voice import Voice, open_voice
from tests.few import thorough
from tests.reference import area_oracle
from tests.synth.contact.test_turned_on_lines import points, turned

RATE, BLOCK = 4000, 40
CHANNELS = ["displacement", "velocity", "acceleration"]
SCALED = [{"quantity": quantity, "full_scale": 1.0} for quantity in CHANNELS]
OUTPUT = {"channels": SCALED, "sample_rate": RATE, "bandwidth": 450, "duration": 0.05}
FINGERS: dict[str, dict[str, Any]] = {
    "comb": {"kind": "comb", "contact_length": "2.2 mm", "ridge_amplitude": "60 um"},
    "fingertip": {"kind": "fingertip", "contact_length": "2.2 mm", "ridge_amplitude": "60 um", "seed": 3},
    "probe": {"kind": "probe"},
}
WAVE = {"kind": "sinusoid", "period": "0.9 mm", "amplitude": "15 um", "phase": 0.0}
TIMES = [0.0, 0.011, 0.02, 0.03, 0.04, 0.05]
CACHE = ResponseCache()


def document(finger: str, scan: dict[str, Any], **sections: Any) -> dict[str, Any]:
    """Return a quick scene on a wave."""
    quick = {"accuracy": {"tolerance": 0.01}}
    return {"finger": FINGERS[finger], "texture": WAVE, "scan": scan, "output": OUTPUT} | quick | sections


def values(finger: str, scan: dict[str, Any], **sections: Any) -> Any:
    """Return the values of a file [frames, channels]."""
    return rw.render(document(finger, scan, **sections)).values


def recorded(direction: float = 0.0, rising: float = 1.0) -> dict[str, Any]:
    """Return a recorded path, its load `rising` by so many N/s. The finger goes against the surface."""
    return {"trajectory": [[t, -0.05 * t, 0.02 * math.sin(40.0 * t), direction, 0.2 + rising * t] for t in TIMES]}


def along(rising: float = 1.0) -> dict[str, Any]:
    """Return the same along x."""
    return {"trajectory": [[t, 0.05 * t, 0.2 + rising * t] for t in TIMES]}


@pytest.mark.parametrize("finger", FINGERS)
def test_a_recorded_path_is_the_recording_of_its_places_along_x(finger: str) -> None:
    rising = 0.0 if finger == "fingertip" else 1.0  # a landing of a fingertip takes long
    wanted = values(finger, along(rising))
    assert np.all(np.ptp(wanted, axis=0) > 0.0)
    assert np.array_equal(values(finger, recorded(rising=rising)), wanted)
    assert np.array_equal(values(finger, recorded(-2.0 * math.pi, rising)), wanted), "a whole turn makes no difference"


@pytest.mark.parametrize("finger", FINGERS)
@pytest.mark.parametrize("heading", ["40 deg", "130 deg"])
def test_a_heading_is_the_cosine_of_the_speed(finger: str, heading: str) -> None:
    angle = math.radians(float(heading.split()[0]))
    wanted = values(finger, {"speed": 0.08 * math.cos(angle)})
    assert np.all(np.ptp(wanted, axis=0) > 0.0)
    assert np.array_equal(values(finger, {"heading": angle, "y": "3 mm"}), wanted)


@pytest.mark.parametrize("finger", ["comb", "fingertip"])
def test_a_heading_of_a_turned_finger_is_the_cosine_of_the_speed_and_its_path(finger: str) -> None:
    """A path over an area has no period: its file had tones at full level where every harmonic is above the band."""
    speed, heading, direction, load = 0.08, 0.6, 0.5, 0.3
    scan = {"heading": heading, "direction": direction, "y": "0.3 mm", "load": load}
    found = values(finger, {"speed": speed, **scan})
    assert np.array_equal(
        found, values(finger, {"speed": speed * math.cos(heading), "direction": direction, "load": load})
    )
    way = np.array([math.cos(heading), math.sin(heading)]) * -speed
    points = [[t, *(way * t), direction, load] for t in (0.0, 0.02, 0.04, 0.06)]
    path = values(finger, {"trajectory": points}, output=OUTPUT | {"duration": 0.05})
    inside = slice(80, 320)  # a recording begins and ends with a landing and a lift
    assert np.max(np.abs(found - path)[inside], axis=0) == pytest.approx([0.0] * 3, abs=0.03 * np.ptp(found[:, 2]))
    assert np.all(np.max(np.abs(found - path)[inside], axis=0) < 0.03 * np.ptp(found[inside], axis=0))
    quiet = rw.render(document(finger, {"speed": 0.14, **scan}, output={"bandwidth": 100, "duration": 0.1}))
    assert quiet.plan is not None and any("above the band" in text for text in quiet.plan.warnings)
    assert not quiet.values.any()


def test_a_heading_of_a_stroke_is_the_cosine_of_its_length_and_speed() -> None:
    stroke = {"length": "10 mm", "speed": "50 mm/s", "turn_time": "20 ms"}
    shorter = {"length": "5 mm", "speed": "25 mm/s", "turn_time": "20 ms"}
    wanted = values("comb", {"stroke": shorter})
    found = values("comb", {"stroke": stroke, "heading": math.acos(0.5)})
    assert np.max(np.abs(found - wanted)) < 1e-9 * np.ptp(wanted)
    even = WAVE | {"phase": -2.0 * math.pi * 0.5 / 0.9}  # about the middle of the probe, at half of its radius
    there, back = (values("probe", {"stroke": stroke, "heading": heading}, texture=even) for heading in (0.0, math.pi))
    assert np.ptp(there) > 0.0
    assert np.max(np.abs(there - back), axis=0) == pytest.approx([0.0] * 3, abs=1e-6 * np.ptp(there[:, 2]))
    assert not values("comb", {"stroke": stroke, "heading": "90 deg"})[:, 1:].any(), "along the grooves nothing moves"


@pytest.mark.parametrize("scan", [{"heading": 0.6, "direction": 1.0}, {"direction": 2.0}, recorded(0.7)])
def test_a_probe_is_round(scan: dict[str, Any]) -> None:
    straight = {"heading": scan.get("heading", 0.0)} if "trajectory" not in scan else recorded()
    assert np.array_equal(values("probe", scan), values("probe", straight))


@pytest.mark.parametrize(
    "effects",
    [
        *({name: {}} for name in ("curvature", "viscous_skin", "inertia", "contact_growth")),
        {"tangential": {"friction_coefficient": 0}},  # friction is against the motion across too
    ],
)
def test_every_effect_works_on_a_path_that_does_not_turn(effects: dict[str, Any]) -> None:
    found = rw.render(document("comb", {"heading": math.pi / 3.0}, effects=effects)).frames
    wanted = rw.render(document("comb", {"speed": 0.08 * math.cos(math.pi / 3.0)}, effects=effects)).frames
    assert np.array_equal(found, wanted)


@pytest.mark.parametrize("effect", ["curvature", "tangential"])
def test_an_effect_works_where_the_finger_turns(effect: str) -> None:
    found = values("comb", {"direction": 0.5}, effects={effect: {}})
    assert np.all(np.isfinite(found)) and np.all(np.ptp(found, axis=0) > 0.0)


@pytest.mark.thorough
@pytest.mark.parametrize("kind", ["comb", "fingertip"])
def test_skin_without_memory_changes_nothing_where_the_finger_turns(kind: str) -> None:
    scan = {"direction": 0.5, "heading": 0.1}
    quick = {
        "finger": {**FINGERS[kind], "contact_length": "1.5 mm"},
        "output": {**OUTPUT, "channels": SCALED[:1]},
        "accuracy": {"tolerance": 0.03},
    }
    skin = {"viscous_skin": {"time_constant": 1e-6}}
    plain, other = (rw.render({**document(kind, scan, effects=one), **quick}).values for one in ({}, skin))
    assert np.max(np.abs(plain - other)) <= 0.03 * np.ptp(plain)


def test_the_scene_of_the_sound_and_of_the_plan_is_the_one_that_was_written() -> None:
    for scan in (recorded(), {"heading": 0.5, "y": 0.001}, {"stroke": {"length": 0.01}, "heading": math.pi}):
        scene = parse_scene(document("comb", scan))
        sound = rw.render(scene)
        assert sound.scene == scene
        assert Scene.model_validate(rw.explain(scene).scene) == scene


@pytest.mark.parametrize("kind", ["comb", thorough("fingertip")])
@pytest.mark.parametrize("seed", [0, *(thorough(seed) for seed in range(1, 8))])
def test_a_turned_finger_is_brute_force_within_the_told_error(kind: str, seed: int) -> None:
    """Its lines below 450 Hz: 1 to 4 times 100 Hz."""
    random = np.random.default_rng([23, seed])
    direction, load = float(random.uniform(-3.0, 3.0)), float(random.uniform(0.1, 0.8))
    heading = float(random.uniform(-1.2, 1.2))
    scan = {"speed": 0.09 / math.cos(heading), "heading": heading, "direction": direction, "load": load}
    sound = rw.render(document(kind, scan, output=OUTPUT | {"duration": 0.14}))
    cruise = sound.values[80:480].T  # 10 periods
    assert sound.plan is not None
    lines = 2.0 * np.fft.rfft(cruise)[:, 10:50:10] / 400.0
    phases = np.arange(48) / 48
    found = turned(kind)
    z = area_oracle.approach(
        *points(found, direction, 1400),  # with half as many it errs by 5e-3 of the acceleration
        lambda x, _y: np.asarray(15e-6 * np.cos(2.0 * np.pi * x / 0.9e-3)),
        np.stack([phases * 0.9e-3, np.zeros(48)], axis=1),
        found.indentation(load),
    )
    n, at = np.arange(1, 5), np.arange(200) / 200
    own = 2.0 * np.fft.rfft(z)[1:5] / 48.0
    for order, name in enumerate(CHANNELS):
        rate = (2j * math.pi * 100.0 * n) ** order
        waves = np.exp(2j * np.pi * np.outer(at, n))
        wanted = (waves @ (own * rate)).real
        heard = (waves @ lines[order]).real
        told = sound.plan.estimated_error[name]
        assert np.max(np.abs(heard - wanted)) < (told + 1e-3) * np.ptp(wanted)
        assert told < 0.1


@pytest.mark.thorough
def test_a_finger_that_turns_on_its_way_passes_from_one_line_to_the_other() -> None:
    turning = {"trajectory": [[t, -0.05 * t, 0.0, 12.0 * t, 0.3] for t in TIMES]}
    found, straight = (
        values("fingertip", turning),
        values("fingertip", {"trajectory": [[t, 0.05 * t, 0.3] for t in TIMES]}),
    )
    assert np.max(np.abs(found[:8] - straight[:8])[:, 0]) < 0.02 * np.ptp(straight[:, 0])
    assert np.ptp(found[-80:, 0] - straight[-80:, 0]) > 0.05 * np.ptp(straight[:, 0])


@cache
def led() -> Voice:
    """Return a voice for a hand that may turn."""
    return open_voice(document("fingertip", {"direction": 0.3}), live=True, cache=CACHE)


def test_blocks_of_any_size_give_the_samples_of_one() -> None:
    t = np.arange(600) / RATE
    motion = Motion.of(600, position=0.05 * t, across=4e-3 * np.sin(15.0 * t), direction=0.3 + 0.4 * t, load=0.3)
    whole, parts, first = led().twin().render(600, motion), led().twin(), 0
    for frames in (1, 7, 40, 213, 339):
        block = parts.render(frames, motion.part(first, first + frames))
        assert np.array_equal(block, whole[first : first + frames])
        first += frames


@pytest.mark.parametrize("direction", [0.3, 0.9])
def test_a_hand_is_the_line_of_the_file_within_the_told_error(direction: float) -> None:
    voice, frames = led().twin(), 600
    p = 0.08 * np.arange(frames) / RATE
    motion = Motion.of(frames, position=p * math.cos(0.5), across=p * math.sin(0.5), direction=direction, load=0.3)
    heard = voice.render(frames, motion)[voice.late + 100 :] * voice.full_scale
    output = OUTPUT | {"duration": frames / RATE}
    wanted = values("fingertip", {"heading": 0.5, "direction": direction}, output=output)[100 : frames - voice.late]
    plan = voice._for_hand
    assert plan is not None and plan.direct is not None and plan.direct.turning is not None
    told = np.array([channel.error for channel in plan.channels])
    told += np.array(plan.direct.turning) * (direction != 0.3)
    window, hertz = np.hanning(len(heard))[:, np.newaxis], np.fft.rfftfreq(len(heard), 1.0 / RATE)
    lines = np.fft.rfft(np.stack([heard - wanted, wanted]) * window, axis=1)
    lines[:, (hertz > 400.0) | (hertz < 20.0)] = 0.0
    change, kept = np.fft.irfft(lines, len(heard), axis=1)
    assert np.all(np.max(np.abs(change), axis=0) < (2.0 * told + 0.01) * np.ptp(kept, axis=0))


def test_updates_turn_the_finger_and_a_recording_repeats_them() -> None:
    scene = parse_scene(document("comb", {"direction": 0.2}))
    voice, heard = HandVoice(scene, cache=CACHE, record=True), []
    assert voice.over_area
    for block in range(30):
        t = block * 0.01
        voice.touch(Update(block, t, 0.05 * t, None, 0.3, 3e-3 * math.sin(9.0 * t), 0.2 + 0.3 * t))
        heard.append(voice.render(BLOCK))
    replay = Recording(voice.recording()).open(CACHE)
    assert np.array_equal(np.concatenate([replay.render(n) for n in (1, 333, 866)]), np.concatenate(heard))
    assert np.ptp(np.concatenate(heard)[400:, 0]) > 0.0


def test_a_hand_that_begins_to_turn_goes_on_in_the_turned_scene() -> None:
    line = parse_scene(document("comb", {}))
    voice = HandVoice(line, cache=CACHE, record=True)
    assert not voice.over_area
    scaled = line.model_copy(update={"scan": line.scan.model_copy(update={"direction": 0.2})})
    change, heard = voice.prepare(scaled), []
    for block in range(30):
        t = block * 0.01
        voice.touch(Update(block, t, 0.05 * t, None, 0.3, 0.0, 0.2))
        if block == 10:
            voice.apply(change)
        heard.append(voice.render(BLOCK))
    assert voice.over_area
    sound = np.concatenate(heard)
    replay = Recording(voice.recording()).open(CACHE)
    assert np.array_equal(replay.render(len(sound)), sound)


def test_a_stream_of_a_path_that_turns_is_its_file_within_the_told_error() -> None:
    points = [[t, -0.08 * t, 0.01 * t, 4.0 * t, 0.3] for t in np.linspace(0.0, 0.15, 7).tolist()]
    scene = parse_scene(document("fingertip", {"trajectory": points}, output=OUTPUT | {"duration": 0.15}))
    solved = prepare(scene, CACHE, paced=True)
    voice = Voice(solved, paced=True)
    heard = voice.render(600)[60:540] * voice.full_scale
    assert solved.direct is not None and solved.direct.turning is not None
    told = np.array([channel.error for channel in solved.channels]) + np.array(solved.direct.turning)
    wanted = values("fingertip", {"trajectory": points}, output=OUTPUT | {"duration": 0.15})[60:540]
    window, hertz = np.hanning(480)[:, np.newaxis], np.fft.rfftfreq(480, 1.0 / RATE)
    lines = np.fft.rfft(np.stack([heard - wanted, wanted]) * window, axis=1)
    lines[:, (hertz > 400.0) | (hertz < 20.0)] = 0.0
    change, kept = np.fft.irfft(lines, 480, axis=1)
    assert np.all(np.max(np.abs(change), axis=0) < (2.0 * told + 0.01) * np.ptp(kept, axis=0))


def test_a_turned_finger_on_a_long_surface_is_brute_force_along_its_way() -> None:
    """The surface has waves of 1 to 4 mm, which pass at 80 Hz at most: the band keeps z."""
    random, count, spacing = np.random.default_rng(8), 65_536, 12e-6
    waves = np.fft.rfftfreq(count, spacing)
    series = np.exp(2j * np.pi * random.random(len(waves))) * ((waves > 250.0) & (waves < 1000.0))
    heights = np.fft.irfft(series, count)
    heights *= 10e-6 / np.std(heights)
    long = {"kind": "profile", "heights": heights.tolist(), "spacing": spacing, "phase": 0.0}
    scan = {"direction": 0.5, "heading": 0.3}
    scene = parse_scene(document("fingertip", scan, texture=long, output=OUTPUT | {"duration": 0.06}))
    assert prepare(scene).stretch is not None
    sound = rw.render(scene)
    frames = np.arange(40, 200, 4)
    places = 0.08 * frames / RATE * math.cos(0.3)
    found = turned("fingertip", texture=long)
    z = area_oracle.approach(
        *points(found, 0.5),
        lambda x, _y: np.asarray(np.interp(x / spacing % count, np.arange(count + 1), [*heights, heights[0]])),
        np.stack([places, np.zeros(len(places))], axis=1),
        found.indentation(0.3),
    )
    heard = sound.values[frames, 0]
    off = (heard - heard.mean()) - (z - z.mean())
    assert np.max(np.abs(off)) < 0.01 * np.ptp(z)
