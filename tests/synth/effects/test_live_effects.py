"""Effects in a live voice: changes cross-fade without a step, added channels are refused, lifting is silence."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from synth import LiveVoice, Motion, open_voice
from synth.arrays import Block
from synth.errors import SceneError
from synth.response_cache import ResponseCache
from synth.scene.scene import Scene, parse_scene
from synth.voice.hand_voice import HandVoice
from tests.few import paired, thorough
from tests.synth.effects.whole_renders import SHORT
from tests.synth.engine_cases import largest_step

RATE = 8000
CACHE = ResponseCache()
QUICK = {"finger": SHORT, "accuracy": {"tolerance": 1e-2}}
OUTPUT = {"quantity": "displacement", "sample_rate": RATE, "bandwidth": "full"}

CHANGES: dict[str, dict[str, Any]] = {
    "inertia": {"inertia": {}},
    "viscous_skin": {"viscous_skin": {}},
    "adhesion": {"adhesion": {}},
    "curvature": {"curvature": {}},
    "contact_growth": {"contact_growth": {}},
    "inertia and viscous_skin": {"inertia": {}, "viscous_skin": {}},
}


def scene(effects: dict[str, Any] | None = None, **sections: Any) -> Scene:
    return parse_scene({**QUICK, "output": OUTPUT, **sections, "effects": effects or {}})


@pytest.mark.parametrize(("name", "adding"), paired(CHANGES, [True, False]))
def test_a_change_of_effects_makes_no_step(name: str, adding: bool) -> None:
    before, after = ({}, CHANGES[name]) if adding else (CHANGES[name], {})
    voice = LiveVoice(scene(before, finger={}), cache=CACHE)
    voice.render(RATE // 20)
    first = voice.render(RATE // 10)
    voice.apply(voice.prepare(scene(after, finger={})))
    crossing = np.concatenate([first[-1:], voice.render(RATE // 5)])
    steady = voice.render(RATE // 10)
    allowed = 1.02 * max(largest_step(first), largest_step(steady)) + abs(level(first) - level(steady)) / 40
    assert largest_step(crossing) <= allowed
    assert np.any(steady)


def level(block: Block) -> float:
    """Return the mean of a block. A cross-fade of 400 frames adds the change of the mean to the motion."""
    return float(np.mean(block[:, 0]))


@pytest.mark.parametrize("adding", [True, False])
def test_a_change_of_the_channels_is_refused(adding: bool) -> None:
    with_it, without = scene({"tangential": {}}), scene()
    first, second = (without, with_it) if adding else (with_it, without)
    voice = LiveVoice(first, cache=CACHE)
    with pytest.raises(SceneError) as refused:
        voice.prepare(second)
    (fault,) = refused.value.faults
    assert fault.pointer == "/effects"
    assert "tangential_force" in f"{fault.value} {fault.allowed}"
    assert "new session" in fault.hint


def test_a_setting_of_an_effect_changes_as_any_field_does() -> None:
    voice = LiveVoice(scene({"inertia": {"mass": "5 g"}}), cache=CACHE)
    voice.render(RATE // 10)
    voice.apply(voice.prepare(scene({"inertia": {"mass": "8 g"}})))
    voice.render(RATE // 5)
    assert voice.scene.effects["inertia"].mass == 8e-3
    changed = voice.render(400)
    assert np.any(changed) and np.all(np.isfinite(changed))


@pytest.mark.parametrize("name", [*list(CHANGES)[:-1], thorough("inertia and viscous_skin"), "tangential"])
def test_a_finger_that_lifts_in_a_recording_is_silence(name: str) -> None:
    effects = CHANGES.get(name, {name: {}})
    # the curve overshoots below 0 N between points, by a quarter of the last overshoot at each further point
    points = [[i / 200, 4e-4 * i, float(np.interp(i, [0, 10, 14, 46, 50, 60], [0.3, 0.3, 0, 0, 0.3, 0.3]))]
              for i in range(61)]  # fmt: skip
    voice = open_voice(scene(effects, scan={"trajectory": points}), cache=CACHE)
    block = voice.render(2400)
    assert np.max(np.abs(block[round(0.145 * RATE) : round(0.155 * RATE)])) <= 1e-12  # the curve rounds to some nN
    assert np.all(np.ptp(block[: round(0.045 * RATE)], axis=0) > 0.0)
    assert np.all(np.ptp(block[round(0.26 * RATE) :], axis=0) > 0.0)


@pytest.mark.parametrize("name", ["inertia", "viscous_skin", "adhesion", "tangential"])
def test_a_hand_that_lifts_is_exact_silence(name: str) -> None:
    voice = open_voice(scene({name: {}}), cache=CACHE)
    load = np.concatenate([np.full(400, 0.3), 0.15 * (1 + np.cos(np.pi * np.arange(80) / 80)), np.zeros(800)])
    block = voice.render(len(load), Motion.of(len(load), speed=0.08, load=load))
    assert np.any(block[:400])
    assert not np.any(block[-200:])


@pytest.mark.parametrize("name", ["inertia", "viscous_skin"])
def test_a_hand_that_gives_positions_moves_a_simulation_as_one_that_gives_speeds(name: str) -> None:
    count, blocks = 200, []
    for given in ("position", "speed"):
        voice = open_voice(scene({name: {}}), cache=CACHE)
        parts = []
        for begin in range(0, 1600, count):
            t = (begin + np.arange(count)) / RATE
            moved = {"position": 0.08 * t} if given == "position" else {"speed": 0.08}
            parts.append(voice.render(count, Motion.of(count, load=0.3, **moved)))
        blocks.append(np.concatenate(parts)[400:])
    assert np.ptp(blocks[1]) > 0.0
    assert np.max(np.abs(blocks[0] - blocks[1])) <= 1e-3 * np.ptp(blocks[1])


def test_ends_that_a_hand_would_move_under_skin_that_remembers_are_refused_at_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("synth.voice.live_voice.prepare", None)  # nothing is solved before the refusal
    monkeypatch.setattr("synth.voice.voice.prepare", None)
    both = parse_scene({"effects": {"contact_growth": {}, "viscous_skin": {}}})
    for opened in (lambda: HandVoice(both), lambda: open_voice(both, live=True)):
        with pytest.raises(SceneError, match="only at a constant load"):
            opened()


@pytest.mark.parametrize("silent", [{"speed": 0.0}, {"load": 0.0}], ids=str)
def test_the_same_two_effects_begin_a_silent_stream_whose_load_is_constant(silent: dict[str, Any]) -> None:
    both = {"effects": {"contact_growth": {}, "viscous_skin": {}}, "finger": SHORT}
    voice, heard = LiveVoice(parse_scene(both | {"scan": silent})), LiveVoice(parse_scene(both))
    assert not np.any(voice.render(800))
    assert voice.full_scale == pytest.approx(heard.full_scale, rel=1e-6)
