"""Recordings give the same samples again from the document alone, in any blocks and whenever a response was ready."""

from __future__ import annotations

import json
from functools import cache
from typing import Any

import numpy as np
import pytest

from synth.arrays import Block
from synth.errors import SceneError
from synth.motion.motion import Update
from synth.motion.update_smoothing import Follower
from synth.response_cache import ResponseCache
from synth.scene.scene import parse_scene
from synth.voice.hand_log import EVENT_BYTES
from synth.voice.hand_voice import HandVoice
from synth.voice.limiter import look_ahead
from synth.voice.recording import Recording
from synth.voice.voice import open_voice
from tests.few import few
from tests.reference.synthesis_oracle import direct
from tests.synth.engine_cases import touch_of

RATE = 8000
SCENES: dict[str, dict[str, Any]] = {
    "displacement": {"output": {"quantity": "displacement"}},
    "acceleration": {"output": {"quantity": "acceleration"}},
    "two channels": {"output": {"channels": [{"quantity": "velocity"}, {"quantity": "displacement"}]}},
    "stroke": {"scan": {"stroke": {"speed": "60 mm/s", "length": "20 mm", "load": "0.2 N"}}},
    "tangential": {"effects": {"tangential": {}}},
    "propagation": {"effects": {"propagation": {"place": "wrist"}}},
    "inertia": {"effects": {"inertia": {}}},
}


def document_of(name: str) -> dict[str, Any]:
    scene = SCENES[name]
    output = {"sample_rate": RATE, "bandwidth": 800} | scene.get("output", {})
    return {"finger": {"contact_length": "1.5 mm"}} | scene | {"output": output}  # few ridges: quick to solve


def session(scene: dict[str, Any], seed: int, cache: ResponseCache | None = None) -> tuple[Block, dict[str, Any]]:
    """Return the samples and the recording of a hand that strokes, presses, jumps, lifts and changes the texture."""
    random = np.random.default_rng(seed)
    voice = HandVoice(parse_scene(scene), cache=cache, record=True)
    blocks = [voice.render(700)]
    for number in range(220):
        time = 0.01 * number
        where = 0.02 * np.sin(7.0 * time) + (0.3 if 90 < number < 140 else 0.0)
        load = None if number % 3 else 0.3 + 0.2 * np.sin(3.0 * time)
        if not 150 < number < 170:
            voice.touch(Update(number, time, where, None, load))
        if number == 155:
            voice.lift()
        if number == 60:
            voice.apply(voice.prepare(parse_scene(scene | {"texture": {"period": "0.7 mm"}})))
        if number == 215:
            voice.release()
        blocks.append(voice.render(int(random.integers(1, 160))))
    return np.concatenate(blocks), json.loads(json.dumps(voice.recording()))


HUGE = 10**400  # a whole number of JSON that no float can hold


def played(document: dict[str, Any], seed: int) -> Block:
    random = np.random.default_rng(seed)
    replay = Recording(document).open()
    parts = []
    while replay.voice.frame < replay.frames:
        parts.append(replay.render(min(int(random.integers(1, 3000)), replay.frames - replay.voice.frame)))
    return np.concatenate(parts)


@cache
def of_scene(name: str) -> tuple[Block, str]:
    """Return the samples of such a session with one of the scenes, and its recording as text."""
    heard, document = session(document_of(name), 1)
    return heard, json.dumps(document)


@pytest.mark.parametrize("name", few(SCENES, 3))
def test_a_recording_plays_the_same_samples(name: str) -> None:
    heard, document = of_scene(name)[0], json.loads(of_scene(name)[1])
    assert np.abs(heard).max() > 0.1
    assert np.array_equal(played(document, 2), heard)


def test_a_recording_of_a_scan_that_nobody_touched_is_the_scan() -> None:
    voice = HandVoice(parse_scene(document_of("stroke")), record=True)
    heard = voice.render(5000)
    assert np.array_equal(played(voice.recording(), 6), heard)


@pytest.mark.parametrize("kept", [480, 80, 1])
@pytest.mark.parametrize("rendered", [480, 7000])
def test_an_end_that_came_while_a_block_was_rendered_is_part_of_the_recording(kept: int, rendered: int) -> None:
    voice = HandVoice(parse_scene(document_of("acceleration")), record=True)
    voice.touch(Update(1, 0.0, None, 0.08, 0.3))
    before, latest = voice.render(1500), voice.render(rendered)
    end = voice.cut(latest, kept)
    assert len(end) == kept and end[-1] == 0.0 and voice.frame == 1500 + kept
    as_in_a_file = open_voice(parse_scene(document_of("acceleration"))).full_scale[0] / voice.full_scale[0]
    assert kept < 80 or np.abs(end).max() > 0.1 * as_in_a_file
    assert np.array_equal(played(voice.recording(), 7), np.concatenate([before, end]))


def test_a_recording_of_version_1_plays_in_the_full_band() -> None:
    """A scene with null or no bandwidth meant the full band; a given bandwidth is kept."""
    scene = document_of("displacement")
    heard, document = session(scene | {"output": scene["output"] | {"bandwidth": "full"}}, 9)
    assert document["version"] == 6
    before = json.loads(json.dumps(document).replace('"bandwidth": "full"', '"bandwidth": null'))
    assert np.array_equal(played(before | {"version": 1}, 10), heard)
    assert not np.array_equal(played(before, 10), heard)
    named, document = of_scene("displacement")[0], json.loads(of_scene("displacement")[1])
    assert np.array_equal(played(document | {"version": 1}, 10), named)


@pytest.mark.parametrize(
    ("version", "told"),
    [(3, ["first second", "paused", "stood still"]), (4, ["paused", "stood still"]), (5, ["stood still"]), (6, [])],
)
def test_a_recording_of_an_earlier_version_says_where_it_differs(version: int, told: list[str]) -> None:
    voice = HandVoice(parse_scene({}), record=True)
    voice.render(80)
    warnings = Recording(voice.recording() | {"version": version}).open().warnings
    warned = [words for words in warnings if "earlier version" in words]
    assert len(warned) == len(told) and all(part in words for part, words in zip(told, warned, strict=True))


@pytest.mark.parametrize("version", [1, 2])
def test_a_recording_made_before_tables_is_played_and_says_that_it_differs(version: int) -> None:
    heard, document = of_scene("displacement")[0], json.loads(of_scene("displacement")[1])
    first = [[0, "rows", 0, 0, "all", [0.0, 0.5]], [700, "refine"], [700, "rows", 0, 0, "more", [0.25]]]
    old = document | {"version": version, "events": sorted(first + document["events"], key=lambda event: event[0])}
    assert np.array_equal(played(old, 12), heard)
    assert any("before response tables" in words for words in Recording(old).open().warnings)
    assert not any("before response tables" in words for words in Recording(document).open().warnings)


@pytest.mark.parametrize(
    ("change", "pointer"),
    [
        ({"version": 7}, "/version"),
        ({"version": "3"}, "/version"),
        ({"version": True}, "/version"),
        ({"version": None}, "/version"),
        ({"frames": -1}, "/frames"),
        ({"frames": True}, "/frames"),
        ({"faded": -1}, "/faded"),
        ({"faded": 11}, "/faded"),
        ({"faded": "all"}, "/faded"),
        ({"full_scale": [0.0]}, "/full_scale"),
        ({"full_scale": []}, "/full_scale"),
        ({"full_scale": "1"}, "/full_scale"),
        ({"full_scale": [1e-300]}, "/full_scale"),
        ({"full_scale": [HUGE]}, "/full_scale"),
        ({"frames": HUGE}, "/frames"),
        ({"faded": HUGE}, "/faded"),
        ({"events": [[HUGE, "lift"]]}, "/events/0/0"),
        ({"events": [[0, "contact", 1, HUGE, 0.0, None, 0.1]]}, "/events/0"),
        ({"events": [[0, "contact", 1, 0.0, None, 0.1, -HUGE]]}, "/events/0"),
        ({"events": {}}, "/events"),
        ({"events": [[0, "touch"]]}, "/events/0"),
        ({"events": [[0, "lift"], [5, "contact", 1, 0.0, None, None, 0.1]]}, "/events/1"),
        ({"events": [[0, "contact", 1, float("nan"), 0.0, None, 0.1]]}, "/events/0"),
        ({"events": [[5, "lift"], [4, "lift"]]}, "/events/1/0"),
        ({"events": ["lift"]}, "/events/0"),
        ({"scene": {"texture": {"period": -1}}}, "/texture/period"),
    ],
)
def test_what_is_no_recording_is_refused_with_its_place(change: dict[str, Any], pointer: str) -> None:
    document = {
        "format": "ridgewave-recording",
        "version": 6,
        "scene": {},
        "full_scale": [1.0],
        "frames": 10,
        "events": [],
    }
    Recording(document)
    with pytest.raises(SceneError) as refused:
        Recording(document | change)
    assert refused.value.faults[0].pointer == pointer


def test_a_change_to_other_channels_is_refused_when_it_is_played() -> None:
    scene = {"output": {"channels": ["acceleration", "velocity"]}}
    events = [[5, "scene", scene]]
    head = {"format": "ridgewave-recording", "version": 6, "scene": {}, "full_scale": [1.0], "frames": 10}
    with pytest.raises(SceneError, match="acceleration, velocity; allowed: acceleration, as at the start"):
        Recording(head | {"events": events}).open().render(10)


def test_an_exact_replay_keeps_the_tolerance_and_the_one_that_was_heard_what_its_table_told() -> None:
    """Against the oracle over places and loads, so slowly that every significant harmonic is in the band."""
    scene = parse_scene(
        document_of("displacement")
        | {"scan": {"speed": 0.01}, "output": {"quantity": "displacement", "sample_rate": RATE}}
    )
    voice = HandVoice(scene, record=True)
    for number in range(60):
        time = 0.01 * number
        voice.touch(Update(number, time, 0.008 * time, None, 0.3 + 0.15 * np.sin(6.0 * time)))
        voice.render(80)
    recording = Recording(voice.recording())
    heard, exact = recording.open(), recording.open(exact=True)
    follower, ahead = Follower(RATE), look_ahead(RATE)
    motions = []
    for number in range(60):
        time = 0.01 * number
        update = Update(number, time, 0.008 * time, None, 0.3 + 0.15 * np.sin(6.0 * time))
        if number == 0:
            follower.begin(0.0, 0.0, 0.3)
        follower.apply(update)
        motions.append(follower.motion(80))
    places, loads = (np.concatenate(part) for part in zip(*((m.position, m.samples[2]) for m in motions), strict=True))
    some = np.arange(2000, 4000, 29)
    wanted = direct(touch_of(scene), places[some], loads[some], mean_phases=96)
    for replay, allowed in ((heard, None), (exact, 1e-3)):
        sound = replay.render(replay.frames)[:, 0].astype(float) * replay.full_scale[0]
        late = replay.voice.late + ahead
        told = replay.voice.plan.estimated_error["displacement"]
        error = np.max(np.abs(sound[some + late] - wanted)) / np.ptp(wanted)
        assert error <= told, (error, told)
        assert allowed is None or told <= allowed


def test_a_full_log_holds_the_beginning(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("synth.voice.hand_log.LARGEST_BYTES", 60 * EVENT_BYTES)
    heard, document = session(document_of("displacement"), 7)
    assert not document["complete"]
    found = played(document, 8)
    assert 0 < len(found) < len(heard)
    assert np.array_equal(found, heard[: len(found)])
