"""A live voice: it ramps in, cross-fades between scenes without a step, keeps its fixed values, and fades out."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from synth.arrays import Block
from synth.errors import SceneError
from synth.response_cache import ResponseCache
from synth.scene.scene import Scene
from synth.voice.live_voice import LiveVoice
from synth.voice.voice import open_voice
from tests.few import paired
from tests.synth.engine_cases import QUANTITIES, Real, largest_step, scene_of

RATE = 48000
CACHE = ResponseCache()

CHANGES: dict[str, dict[str, Any]] = {
    "speed": {"scan": {"speed": 0.053}},
    "direction": {"scan": {"speed": -0.08}},
    "load": {"scan": {"load": 0.7}},
    "texture": {"texture": {"period": 1.1e-3, "amplitude": 15e-6}},
    "stop": {"scan": {"speed": 0.0}},
    "lift": {"scan": {"load": 0.0}},
    "stroke": {"scan": {"stroke": {"length": "10 mm", "turn_time": "50 ms"}}},
}


def scene(quantity: str = "displacement", full_scale: float | None = None, **sections: Any) -> Scene:
    return scene_of(output={"quantity": quantity, "full_scale": full_scale}, **sections)


def running(quantity: str = "displacement") -> LiveVoice:
    """Return a voice that has ramped in."""
    voice = LiveVoice(scene(quantity), cache=CACHE)
    voice.render(RATE // 20)
    return voice


@pytest.mark.parametrize(("quantity", "name"), paired(QUANTITIES, CHANGES))
def test_a_change_makes_no_step_larger_than_the_steady_ones(quantity: str, name: str) -> None:
    voice = running(quantity)
    before = voice.render(RATE // 10)
    voice.apply(voice.prepare(scene(quantity, **CHANGES[name])))
    crossing = np.concatenate([before[-1:], voice.render(RATE // 10)])
    after = voice.render(RATE) if name == "stroke" else voice.render(RATE // 10)
    steady = max(largest_step(before), largest_step(after))
    assert largest_step(crossing) <= 1.02 * steady
    assert voice.reduction_db == 0.0


def test_after_the_crossing_the_new_scene_sounds_from_where_the_texture_stood() -> None:
    voice = running()
    voice.apply(voice.prepare(scene(scan={"speed": 0.053, "load": 0.5})))
    after = voice.render(RATE)[RATE // 2 :, 0]
    wanted = open_voice(scene("displacement", voice.full_scale[0], scan={"speed": 0.053, "load": 0.5}))
    period = round(RATE / (0.053 / 0.8e-3))
    one = wanted.render(3 * period)[:, 0]
    match = min(float(np.max(np.abs(one[k : k + period] - after[:period]))) for k in range(period + 1))
    assert match <= 0.02 * float(np.ptp(one))
    assert voice.scene.scan.speed == 0.053


def test_a_change_during_a_change_waits_and_the_newest_wins() -> None:
    voice = running("acceleration")
    before = voice.render(RATE // 10)
    voice.apply(voice.prepare(scene("acceleration", scan={"speed": 0.05})))
    first = voice.render(400)
    voice.apply(voice.prepare(scene("acceleration", scan={"speed": 0.12})))
    second = voice.render(300)
    voice.apply(voice.prepare(scene("acceleration", scan={"speed": 0.03})))
    rest = voice.render(RATE // 2)
    whole = np.concatenate([before[-1:], first, second, rest])
    assert largest_step(whole) <= 1.02 * max(largest_step(before), largest_step(rest[RATE // 4 :]))
    assert voice.scene.scan.speed == 0.03
    period = round(RATE * 0.8e-3 / 0.03)
    assert np.max(np.abs(rest[-4 * period : -period] - rest[-3 * period :])) <= 1e-3


@pytest.mark.parametrize("block", [1, 17, 480, 5000])
def test_a_change_and_a_release_take_the_same_time_in_any_blocks(block: int) -> None:
    def played(size: int) -> Block:
        voice = LiveVoice(scene(), cache=CACHE)
        parts = [voice.render(960)]
        voice.apply(voice.prepare(scene(scan={"load": 0.7})))
        parts += [voice.render(min(size, 5000 - done)) for done in range(0, 5000, size)]
        voice.release()
        parts += [voice.render(min(size, 2500 - done)) for done in range(0, 2500, size)]
        return np.concatenate(parts)

    assert np.array_equal(played(block), played(2500))


@pytest.mark.parametrize(
    ("output", "fields"),
    [
        ({"quantity": "displacement", "sample_rate": 44100}, {"sample_rate"}),
        ({"quantity": "velocity"}, {"quantity"}),
        ({"channels": ["displacement", "velocity"]}, {"channels"}),
        ({"quantity": "displacement", "full_scale": "1 mm"}, {"full_scale"}),
        ({"quantity": "velocity", "sample_rate": 8000, "full_scale": 1.0}, {"sample_rate", "quantity", "full_scale"}),
    ],
)
def test_what_is_fixed_is_refused_by_name_all_of_it_at_once(output: dict[str, Any], fields: set[str]) -> None:
    voice = running()
    with pytest.raises(SceneError) as refused:
        voice.prepare(scene_of(output=output))
    assert {fault.pointer for fault in refused.value.faults} == {f"/output/{name}" for name in fields}
    assert voice.render(100).shape == (100, 1)


def test_the_full_scale_stays_that_of_the_beginning() -> None:
    voice = running()
    scale = voice.full_scale
    voice.apply(voice.prepare(scene(scan={"load": 0.05})))
    after = voice.render(RATE // 2)[-4800:, 0]
    assert voice.full_scale == scale
    alone = open_voice(scene(scan={"load": 0.05}))
    louder = alone.full_scale[0] / scale[0]
    assert np.max(np.abs(after)) == pytest.approx(0.8 * louder, rel=0.01)


def test_a_stream_ramps_in() -> None:
    block = LiveVoice(scene(), cache=CACHE).render(RATE // 20)
    steady = open_voice(scene()).render(RATE // 20)
    assert abs(block[0, 0]) < 1e-3
    envelope = np.abs(block[:, 0]) / np.maximum(np.abs(steady[:, 0]), 1e-3)
    assert np.all(envelope <= 1.001)
    assert np.array_equal(block[480:], steady[480:])


@pytest.mark.parametrize("frames", [7, 480, 4800])
def test_a_release_fades_within_20_ms_to_exact_zeros(frames: int) -> None:
    voice = running()
    last = voice.render(480)
    voice.release()
    assert not voice.finished
    blocks = [voice.render(frames) for _ in range(4800 // frames)]
    tail = np.concatenate(blocks)
    within = round(0.02 * RATE)
    assert not tail[within:].any()
    assert tail[:20].any()
    assert largest_step(np.concatenate([last, tail])) <= 1.02 * largest_step(last)
    assert voice.finished
    assert not voice.render(100).any()


def test_a_release_during_the_ramp_in_turns_round() -> None:
    voice = LiveVoice(scene(), cache=CACHE)
    up = voice.render(200)
    voice.release()
    down = voice.render(2000)
    assert largest_step(np.concatenate([up, down])) <= 1.02 * largest_step(open_voice(scene()).render(2000))
    assert not down[960:].any()
    assert voice.finished


def test_what_is_louder_than_full_scale_is_limited_and_within() -> None:
    voice = running("acceleration")
    voice.apply(voice.prepare(scene("acceleration", scan={"load": 0.3, "speed": 0.6})))
    block = voice.render(RATE // 2)
    assert np.max(np.abs(block)) <= 1.0
    assert voice.reduction_db > 3.0


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_frames_within_full_scale_are_those_of_the_voice_bit_for_bit(quantity: str) -> None:
    live, plain = LiveVoice(scene(quantity), cache=CACHE), open_voice(scene(quantity))
    assert np.array_equal(live.render(5000)[480:], plain.render(5000)[480:])


@pytest.mark.parametrize(
    "silent", [{"scan": {"load": 0}}, {"scan": {"speed": 0}}, {"texture": {"amplitude": 0}}], ids=str
)
def test_a_stream_that_begins_in_silence_is_heard_when_it_is_touched(silent: dict[str, Any]) -> None:
    voice = LiveVoice(scene("acceleration", **silent), cache=CACHE)
    assert not voice.render(RATE // 10).any()
    voice.apply(voice.prepare(scene("acceleration")))
    assert 0.5 <= np.max(np.abs(voice.render(RATE // 2)[-4800:])) <= 1.0


def test_a_change_is_solved_when_it_is_prepared_not_when_it_is_heard(monkeypatch: pytest.MonkeyPatch) -> None:
    from synth.contact.exact_solver import Approaches, Grid

    voice = LiveVoice(scene())
    voice.render(960)
    points = [[0, 0, 0.3], [0.1, 6e-3, 0.4], [0.2, 1e-2, 0.25], [0.3, 8e-3, 0.3]]
    change = voice.prepare(scene(scan={"trajectory": points}))
    solved = Grid.solve
    calls: list[int] = []

    def counted(grid: Grid, phases: Real, *rest: Any) -> Approaches:
        calls.append(len(phases))
        return solved(grid, phases, *rest)

    monkeypatch.setattr(Grid, "solve", counted)
    voice.apply(change)
    assert voice.render(4800).any()
    assert sum(calls) < 20000  # rows for a lifting finger, not those of the recorded loads


def test_a_change_that_was_applied_before_can_be_applied_again() -> None:
    voice = LiveVoice(scene())
    first, second = voice.prepare(scene(scan={"speed": 0.05})), voice.prepare(scene(scan={"speed": 0.1}))
    for change in (first, second, first):
        voice.apply(change)
        block = voice.render(4800)
        assert block.any() and np.isfinite(block).all()
        assert voice.scene is change.scene
