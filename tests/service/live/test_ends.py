"""Every end has its fade and its close code, and nothing follows it."""

from __future__ import annotations

import json

import numpy as np
import pytest

from service.live.conversation import Phase
from service.live.live_stream import Options
from service.problems import Problem
from service.synth_engine import SynthEngine
from synth.encode.samples import SoundFormat, block_bytes
from synth.scene.scene import parse_scene
from synth.voice.recording import Recording
from tests.service.harness import settings_of
from tests.service.live.driver import BLOCK, RATE, Driver, contact, started
from tests.service.plain_hand import Applied, expected

SCENE = parse_scene({})


def test_stop_fades_out_ends_and_closes_with_1000() -> None:
    driver = started()
    driver.run(0.1)
    sent = len(driver.pcm())
    driver.say("stop")
    driver.write()
    pcm = driver.pcm()
    np.testing.assert_array_equal(pcm, expected(SCENE, Applied(released=sent), len(pcm)))
    assert len(pcm) == sent + 480 and pcm[-1] == 0.0
    assert driver.sent[-1] == {"type": "end", "reason": "stopped", "frame": len(pcm)}
    assert driver.closed is not None and (driver.closed.code, driver.closed.reason) == (1000, "stopped")
    assert driver.finished and not driver.detached


def test_the_fade_needs_no_credit_and_no_due_time() -> None:
    driver = started("pull")
    driver.pull(480)
    driver.say("stop")
    driver.write()
    assert len(driver.pcm()) == 960 and driver.pcm()[-1] == 0.0 and driver.closed is not None
    slow = started(block=48000)
    slow.run(0.1)
    slow.say("stop")
    slow.write()
    assert len(slow.pcm()) == 48480 and slow.closed is not None


def test_a_stop_before_any_sound_has_no_fade() -> None:
    driver = started("pull")
    driver.say("stop")
    assert driver.order() == ["ready", "end"] and driver.texts("end")[0]["frame"] == 0


def test_small_blocks_fade_in_several() -> None:
    driver = started(block=16)
    driver.run(0.1)
    driver.say("stop")
    driver.write()
    sizes = {len(block) // 4 for block in driver.blocks()}
    assert sizes == {16} and driver.pcm()[-1] == 0.0


def test_nothing_is_applied_and_nothing_said_after_the_end() -> None:
    driver = started()
    driver.run(0.1)
    driver.say("stop")
    driver.binary(contact(1))
    driver.say("more", frames=1)
    driver.say("stop")
    driver.write()
    driver.binary(contact(2))
    driver.text("nonsense")
    assert driver.texts("applied") == driver.texts("problem") == [] and driver.order().count("end") == 1


def test_an_end_that_comes_while_a_block_is_rendered_fades_that_block() -> None:
    driver = started()
    driver.run(0.1)
    before = len(driver.pcm())
    driver.now += 0.01
    driver.stream.quick = False
    block = driver.machine.next_block(lambda: driver.now)
    assert block is not None and block.messages is None
    pcm = driver.stream.render(block.frames)
    driver.machine.end("stopped")
    driver.sent += driver.machine.messages(pcm, block.frames, driver.now)  # type: ignore[arg-type]
    driver.write()
    heard = driver.pcm()
    assert len(heard) == before + 480 and heard[-1] == 0.0 and heard[before + 5] != 0.0
    assert driver.closed is not None and driver.closed.code == 1000


@pytest.mark.parametrize("samples", ["f32le", "s16le"])
@pytest.mark.parametrize("block", [480, 4800])
def test_an_end_that_comes_while_a_block_is_rendered_is_in_the_recording(block: int, samples: str) -> None:
    driver = Driver(engine=SynthEngine(1 << 24))
    driver.hello(format=samples, block=block, record=True, scene={"scan": {"speed": "80 mm/s"}})
    driver.binary(contact(1))
    driver.pull(9600)
    driver.say("more", frames=block)
    driver.stream.quick = False
    due = driver.machine.next_block(lambda: driver.now)
    assert due is not None and due.messages is None
    pcm = driver.stream.render(due.frames)
    voice = driver.stream.voice
    driver.machine.end("stopped")
    driver.sent += driver.machine.messages(pcm, due.frames, driver.now)  # type: ignore[arg-type]
    driver.write()
    replay = Recording(voice.recording()).open()
    assert replay.frames == 9600 + 480 and voice.recording()["faded"] == 480
    sent = b"".join(driver.blocks())
    kind = SoundFormat.F32LE if samples == "f32le" else SoundFormat.WAV16
    assert sent == block_bytes(replay.render(replay.frames), kind)
    assert np.abs(np.frombuffer(sent[: len(sent) // 2], "<f4" if samples == "f32le" else "<i2")).max() > 0


@pytest.mark.parametrize(
    ("reason", "code"),
    [("shutting down", 1001), ("finished", 1000), ("expired", 1001), ("policy", 1008), ("our mistake", 1011)],
)
def test_every_end_has_its_code(reason: str, code: int) -> None:
    driver = started()
    driver.run(0.1)
    driver.machine.end(reason)
    driver.write()
    assert driver.texts("end")[0]["reason"] == reason
    assert driver.closed is not None and (driver.closed.code, driver.closed.reason) == (code, reason)


def test_a_voice_that_has_failed_ends_without_a_fade() -> None:
    driver = started()
    driver.run(0.1)
    before = len(driver.pcm())
    driver.machine.broken(Problem("internal", "Ours.", instance="urn:uuid:1"))
    driver.perform()
    driver.write()
    assert len(driver.pcm()) == before and driver.order()[-2:] == ["problem", "end"]
    assert driver.texts("problem")[0]["instance"] == "urn:uuid:1"
    assert driver.closed is not None and driver.closed.code == 1011 and driver.finished


def test_a_voice_that_never_fades_out_is_cut_off() -> None:
    driver = started()
    driver.run(0.1)
    released: list[int] = []
    driver.hand.release = lambda: released.append(1)  # type: ignore[method-assign]
    before = len(driver.pcm())
    driver.say("stop")
    driver.write()
    assert driver.closed is not None and released
    assert len(driver.pcm()) - before <= 0.1 * RATE + BLOCK


def test_a_voice_that_finishes_by_itself_ends_the_stream() -> None:
    driver = started()
    driver.run(0.1)
    driver.hand.applied.released = driver.hand.frame
    driver.run(0.1)
    assert driver.texts("end")[0]["reason"] == "finished"


def test_a_recording_that_is_too_long_ends_the_session() -> None:
    for record, ends in ((True, 1), (False, 0)):
        driver = Driver(settings_of(max_duration=0.5))
        driver.hello(pacing="realtime", record=record)
        driver.run(1.0)
        assert len(driver.texts("end")) == ends
    assert Options().record is False


def test_a_lost_connection_detaches_and_says_nothing() -> None:
    driver = started()
    driver.run(0.1)
    count = len(driver.sent)
    driver.machine.lost()
    driver.perform()
    driver.run(1.0)
    assert driver.detached and not driver.finished and len(driver.sent) == count
    assert driver.machine.phase is Phase.OVER


def test_samples_may_be_integers() -> None:
    driver = started(format="s16le")
    driver.run(0.1)
    got = np.frombuffer(b"".join(driver.blocks()), "<i2")
    wanted = np.clip(np.rint(expected(SCENE, Applied(), len(got)) * 32768.0), -32768, 32767)
    np.testing.assert_array_equal(got, wanted)


def test_channels_are_interleaved() -> None:
    channels = [{"quantity": "acceleration"}, {"quantity": "velocity"}]
    driver = started(scene={"output": {"channels": channels}})
    driver.run(0.05)
    got = np.frombuffer(driver.blocks()[1], "<f4").reshape(-1, 2)
    assert len(got) == BLOCK and (got[:, 0] == got[:, 1]).all() and got.any()


def test_a_day_of_updates_runs_in_no_time_and_loses_no_frame() -> None:
    driver = started(block=48000, scene={"output": {"sample_rate": 1000}})
    opened = driver.now
    for hour in range(24):
        driver.binary(contact(hour))
        driver.run(3600.0)
        driver.sent = driver.sent[-2:]
        driver.times = driver.times[-2:]
    assert driver.stream.frame == 48000 * (1 + int((driver.now - opened) / 48.0))
    assert json.dumps(driver.texts("end")) == "[]"
