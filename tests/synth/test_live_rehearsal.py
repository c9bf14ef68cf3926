"""No live voice meets a loop that numba has not compiled: one of its kind has rehearsed it."""

from __future__ import annotations

import json
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import pytest

from synth.errors import CannotRender
from synth.scene.scene import parse_scene
from synth.voice import live_voice as live
from synth.voice.hand_voice import HandVoice
from synth.voice.live_voice import LiveVoice
from synth.voice.moving import MovingReader
from synth.voice.rehearsal import Rehearsals, kind_of, stand_in

ROOT = Path(__file__).resolve().parents[2]


def met_late(*words: str) -> dict[str, list[str]]:
    """Return which loops voices met while they were heard, in a new process."""
    command = [sys.executable, "-m", "tests.synth.rehearsal_probe", *words]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=170, check=False)
    assert done.returncode == 0, done.stderr
    found: dict[str, list[str]] = json.loads(done.stdout)
    return found


SOME = ("acceleration", "acceleration, exact", "displacement", "three channels", "at rest", "stroke", "tangential")


@pytest.mark.parametrize("kinds", [SOME, pytest.param((), marks=pytest.mark.thorough)], ids=["some", "all"])
def test_no_voice_meets_a_new_loop_while_it_is_heard(kinds: tuple[str, ...]) -> None:
    assert met_late(*kinds) == {}


def test_without_a_rehearsal_it_would() -> None:
    late = met_late("--unrehearsed", "acceleration", "displacement")
    assert "synth.voice.hand_block.rate_block" in late["acceleration, a hand"]
    assert "synth.voice.hand_block.displacement_block" in late["displacement, a hand"]


def kind(**sections: Any) -> Any:
    scene = parse_scene({"output": {"sample_rate": 8000, "bandwidth": 1000} | sections.pop("output", {}), **sections})
    return kind_of(scene, LiveVoice(scene).plan)


def test_scenes_that_differ_in_numbers_are_of_a_kind() -> None:
    assert kind() == kind(texture={"period": "1 mm"}, scan={"speed": 0.05, "load": 0.2}, accuracy={"tolerance": 0.01})
    path = [[0.1 * t, 0.004 * t, 0.3] for t in range(30)]
    assert kind(scan={"trajectory": path}) == kind(scan={"trajectory": path[:20]})


@pytest.mark.parametrize(
    "sections",
    [
        {"output": {"quantity": "displacement"}},
        {"output": {"channels": ["acceleration", "velocity"]}},
        {"scan": {"stroke": {}}},
        {"scan": {"speed": 0}},
        {"effects": {"tangential": {}}},
        {"accuracy": {"tolerance": 1e-6}},
    ],
    ids=str,
)
def test_scenes_that_differ_otherwise_are_not(sections: dict[str, Any]) -> None:
    assert kind(**sections) != kind()


def test_a_kind_rehearses_once_though_many_come_at_a_time() -> None:
    rehearsals, gate, played, passed = Rehearsals(), threading.Event(), [], []

    def play() -> None:
        assert gate.wait(20.0)
        played.append(1)

    def come() -> None:
        rehearsals.once("kind", play)
        passed.append(len(played))

    threads = [threading.Thread(target=come) for _ in range(5)]
    for thread in threads:
        thread.start()
    rehearsals.once("another", lambda: None)
    assert not passed
    gate.set()
    for thread in threads:
        thread.join(20.0)
    assert played == [1] and passed == [1] * 5


def test_one_that_fails_is_tried_again_by_the_next() -> None:
    rehearsals, tries = Rehearsals(), []

    def fail() -> None:
        tries.append(1)
        raise ValueError

    for _ in range(2):
        with pytest.raises(ValueError):
            rehearsals.once("kind", fail)
    rehearsals.once("kind", lambda: tries.append(2))
    rehearsals.once("kind", fail)
    assert tries == [1, 1, 2]


@pytest.mark.parametrize("make", [LiveVoice, HandVoice])
def test_a_recorded_scan_rehearses_its_beginning_at_one_load(make: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    points = [[0.1 * t, 0.004 * t, 0.05 + 0.02 * t] for t in range(30)]
    scene = parse_scene({"scan": {"trajectory": points}, "output": {"sample_rate": 8000, "bandwidth": 1000}})
    covered: list[tuple[float, float]] = []
    cover = MovingReader.cover

    def watched(reader: MovingReader, low: float, high: float) -> None:
        covered.append((low, high))
        cover(reader, low, high)

    voice = make(scene)
    monkeypatch.setattr(MovingReader, "cover", watched)
    monkeypatch.setattr(live, "REHEARSALS", Rehearsals())
    voice.rehearse()
    voice.close()
    assert len(covered) >= 2 and all(0.998 * high < low <= high for low, high in covered)


def test_what_stands_in_for_a_scene_is_of_its_kind() -> None:
    path = [[0.1 * t, 0.004 * t, 0.05 + 0.02 * t] for t in range(30)]
    scans: tuple[dict[str, Any], ...] = ({"trajectory": path}, {"stroke": {}}, {})
    for scan in scans:
        scene = parse_scene({"scan": scan, "output": {"sample_rate": 8000, "bandwidth": 1000}})
        assert kind_of(stand_in(scene), LiveVoice(stand_in(scene)).plan) == kind_of(scene, LiveVoice(scene).plan)


def test_a_rehearsal_that_fails_leaves_no_thread_behind(monkeypatch: pytest.MonkeyPatch) -> None:
    closed: list[HandVoice] = []

    def fail(_voice: HandVoice) -> None:
        raise CannotRender("It cannot.")

    monkeypatch.setattr(live, "REHEARSALS", Rehearsals())
    monkeypatch.setattr(HandVoice, "lift", fail)
    monkeypatch.setattr(HandVoice, "close", lambda voice: closed.append(voice))
    voice = HandVoice(parse_scene({"output": {"sample_rate": 8000, "bandwidth": 1000}}))
    with pytest.raises(CannotRender):
        voice.rehearse()
    monkeypatch.undo()
    assert len(closed) == 1 and closed[0] is not voice
    closed[0].close()


def test_a_rehearsal_leaves_the_voice_where_it_was() -> None:
    scene = parse_scene({"output": {"sample_rate": 8000, "bandwidth": 1000}})
    voice, plain = HandVoice(scene, record=True), HandVoice(scene, record=True)
    voice.rehearse()
    assert voice.frame == 0 and voice.recording() == plain.recording()
    assert (voice.render(400) == plain.render(400)).all()
    voice.close()
    plain.close()
