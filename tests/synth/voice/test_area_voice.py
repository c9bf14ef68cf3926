"""Voices over an area: a line at any angle, recorded paths, and hands that lead and turn the finger."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import pytest

import ridgewave as rw
from synth.motion.motion import Motion, Update
from synth.response_cache import ResponseCache
from synth.scene.scene import parse_scene
from synth.voice.hand_voice import HandVoice
from synth.voice.recording import Recording
from synth.voice.voice import Voice, open_voice

RATE, BLOCK = 4000, 40  # frames a second, and in 10 ms
SQUARE = {"kind": "dots", "period": "2 mm", "row_distance": "2 mm", "stagger": 0.0, "phase": 0.0}
CHANNELS = ["displacement", "velocity", "acceleration"]
OUTPUT = {"channels": CHANNELS, "sample_rate": RATE, "bandwidth": 500, "duration": 0.15}  # quick to solve
CACHE = ResponseCache()


def document(scan: dict[str, Any] | None = None, **sections: Any) -> dict[str, Any]:
    """Return a scene of a small fingertip on square dots."""
    finger = {"kind": "fingertip", "contact_length": "3 mm", "ridge_amplitude": "60 um"}
    return {"finger": finger, "texture": SQUARE, "scan": scan, "output": OUTPUT} | sections


@cache
def exact(**scan: Any) -> Any:
    """Return the values of a file [frames, channels], of a given full scale: to find one takes longer than the file."""
    scaled = [{"quantity": quantity, "full_scale": 1.0} for quantity in CHANNELS]
    return rw.render(document(scan, output=OUTPUT | {"channels": scaled})).values


def differing(one: Any, other: Any) -> Any:
    """Return the largest change of each channel from `one` to `other`, below 450 Hz, over its peak-to-peak.

    Scans that are solved along their motion fade from the end of the band on, and series end there.
    """
    window = np.hanning(len(one))[:, np.newaxis]
    lines = np.fft.rfft(np.stack([one - other, other]) * window, axis=1)
    hertz = np.fft.rfftfreq(len(one), 1.0 / RATE)
    lines[:, (hertz > 450.0) | (hertz < 20.0)] = 0.0
    change, kept = np.fft.irfft(lines, len(one), axis=1)
    return np.max(np.abs(change), axis=0) / np.ptp(kept, axis=0)


def test_a_line_along_x_is_the_scan_that_it_was() -> None:
    assert np.all(differing(exact(heading=1e-12, y="0.4 mm"), exact(y="0.4 mm")) < 3e-3)


def test_a_line_across_on_square_dots_under_a_turned_finger_is_the_line_along() -> None:
    turned = exact(heading="90 deg", direction="90 deg")
    assert np.all(differing(turned, exact()) < [0.02, 0.05, 0.15])  # the lattice lies otherwise on the ridges
    assert np.all(differing(exact(heading="90 deg"), exact()) > 0.05)


def test_rows_repeat_across() -> None:
    assert np.all(differing(exact(y="2 mm"), exact()) < 1e-6)
    assert np.all(differing(exact(y="1 mm"), exact()) > 0.1)


def test_a_recorded_path_is_the_line_that_it_follows() -> None:
    t = np.linspace(0.0, 0.15, 10)
    x, y = -0.08 * t * math.cos(0.5), -0.08 * t * math.sin(0.5)  # the finger goes against the surface
    points = tuple((float(a), float(b), float(c), 0.2, 0.3) for a, b, c in zip(t, x, y, strict=True))
    found, line = exact(trajectory=points), exact(heading=0.5, direction=0.2)
    cruise = slice(100, 500)
    assert np.all(differing(found[cruise], line[cruise]) < 1e-3)


@pytest.mark.thorough
def test_a_finger_that_turns_on_its_way_feels_something_else() -> None:
    t = np.linspace(0.0, 0.15, 10)
    turning = exact(trajectory=tuple((float(a), float(-0.08 * a), 0.0, float(2.0 * a), 0.3) for a in t))
    cruise = slice(100, 500)
    assert np.all(differing(turning[cruise], exact()[cruise]) > 0.05)


@cache
def led() -> Voice:
    """Return a voice for a hand."""
    return open_voice(document(), live=True, cache=CACHE)


def path(frames: int) -> Motion:
    """Return a motion along a curve, with a finger that turns."""
    t = np.arange(frames) / RATE
    load = 0.3 + 0.1 * np.sin(20.0 * t)
    return Motion.of(frames, position=0.05 * t, across=4e-3 * np.sin(15.0 * t), direction=0.4 * t, load=load)


def test_blocks_of_any_size_give_the_samples_of_one() -> None:
    whole, motion, parts, first = led().twin().render(900, path(900)), path(900), led().twin(), 0
    for frames in (1, 7, 40, 213, 500, 139):
        block = parts.render(frames, motion.part(first, first + frames))
        assert np.array_equal(block, whole[first : first + frames])
        first += frames


@pytest.mark.parametrize(
    ("line", "angle", "turned"),
    [({"heading": "90 deg"}, 0.5 * math.pi, 0.0), ({"heading": 0.5, "direction": 0.2}, 0.5, 0.2)],
    ids=["across", "turned"],
)
def test_a_hand_is_the_line_of_the_file_within_the_told_error(
    line: dict[str, Any], angle: float, turned: float
) -> None:
    voice, frames = led().twin(), 500
    p = 0.08 * np.arange(frames) / RATE
    motion = Motion.of(frames, position=p * math.cos(angle), across=p * math.sin(angle), direction=turned, load=0.3)
    late = voice.late
    found = voice.render(frames, motion)[late + 100 :] * voice.full_scale
    wanted = exact(**line)[100 : frames - late]
    plan = voice._for_hand
    assert plan is not None and plan.direct is not None
    told = np.array([channel.error for channel in plan.channels])
    assert plan.direct.turning is not None
    told += np.array(plan.direct.turning) * (turned != 0.0)
    assert np.all(differing(found, wanted) < 2.0 * told)
    assert told[0] < 0.02
    assert max(told) < 0.15


def test_a_hand_without_a_path_is_on_the_line_of_the_scan() -> None:
    t = np.arange(600) / RATE
    line = open_voice(document({"y": "0.4 mm", "direction": "30 deg"}), live=True, cache=CACHE)
    plain = Motion.of(600, position=0.05 * t, load=0.3)
    led_there = Motion.of(600, position=0.05 * t, across=-0.4e-3, direction=math.radians(30.0), load=0.3)
    assert np.allclose(line.twin().render(600, plain)[200:], line.twin().render(600, led_there)[200:], atol=1e-6)


def test_updates_lead_and_turn_the_finger_and_a_recording_repeats_them() -> None:
    voice, heard = HandVoice(parse_scene(document()), cache=CACHE, record=True), []
    assert voice.over_area
    for block in range(40):
        t = block * 0.01
        across, direction = (None, None) if block < 10 else (3e-3 * math.sin(9.0 * t), 0.3 * t)
        voice.touch(Update(block, t, 0.05 * t, None, 0.3, across, direction))
        heard.append(voice.render(BLOCK))
    sound = np.concatenate(heard)
    replay = Recording(voice.recording()).open(CACHE)
    assert np.array_equal(np.concatenate([replay.render(n) for n in (1, 333, 1266)]), sound)
    assert np.max(np.abs(np.diff(sound[:, 0]))) < 0.2  # the jump to the path is a cross-fade
    events = [event for event in voice.recording()["events"] if event[1] == "contact"]
    assert {len(event) for event in events} == {7, 9}


def test_updates_without_a_load_keep_the_load_of_the_scene() -> None:
    def heard(load: float | None) -> Any:
        voice, blocks = HandVoice(parse_scene(document()), cache=CACHE), []
        for block in range(20):
            t = block * 0.01
            voice.touch(Update(block, t, 0.05 * t, None, load, 3e-3 * math.sin(9.0 * t), 0.3 * t))
            blocks.append(voice.render(BLOCK))
        return np.concatenate(blocks)

    assert np.array_equal(heard(None), heard(parse_scene(document()).scan.load))


def test_a_finger_turns_the_short_way_round() -> None:
    voice = HandVoice(parse_scene(document()), cache=CACHE)
    jumps = []
    for block, direction in enumerate([3.1, 3.12, 3.14, -3.12, -3.1, -3.08, 0.5]):
        voice.touch(Update(block, 0.01 * block, 0.0, None, 0.3, 0.0, direction))
        voice.render(BLOCK)
        jumps.append(voice._jump is not None or voice._leaving is not None)
    assert jumps == [False] * 6 + [True], "the wrap is no jump, and half a turn is one"


def test_a_scene_of_lines_does_not_vary_across() -> None:
    voice = HandVoice(parse_scene({"output": {"sample_rate": RATE}}), cache=CACHE)
    other = HandVoice(parse_scene({"output": {"sample_rate": RATE}}), cache=CACHE)
    assert not voice.over_area
    for block in range(20):
        place = 0.0008 * block
        voice.touch(Update(block, 0.01 * block, place, None, 0.3, 0.001 * block))
        other.touch(Update(block, 0.01 * block, place, None, 0.3))
        assert np.allclose(voice.render(BLOCK), other.render(BLOCK), atol=0.0 if block > 12 else 1.0)
