"""One connection from hello to end, sample for sample against the plain hand; no network, no time."""

from __future__ import annotations

import itertools
import json

import numpy as np
import pytest

from service.live.conversation import Limits, Phase
from service.live.stream import Options
from service.problems import Problem
from synth.scene import parse_scene
from tests.service.live.driver import BLOCK, RATE, Driver, contact
from tests.service.plain_hand import Applied, expected

SCENE = parse_scene({})


def started(pacing: str = "realtime", **fields: object) -> Driver:
    driver = Driver()
    driver.hello(pacing=pacing, **fields)
    return driver


def problem_of(driver: Driver) -> dict[str, object]:
    return driver.texts("problem")[-1]


# Hello


def test_hello_without_anything_is_the_default_scene_at_the_clients_pace() -> None:
    driver = Driver()
    ready = driver.hello()
    assert ready == {
        "type": "ready",
        "session": "s0",
        "protocol": "ridgewave.v1",
        "sample_rate": 48000,
        "channels": 1,
        "quantities": ["acceleration"],
        "full_scale": [12.5],
        "format": "f32le",
        "block": 480,
        "pacing": "pull",
        "recording": False,
        "frame": 0,
        "max_silence_ms": 250.0,
        "motion_delay_ms": 2.0,
        "plan": driver.hand.plan_document,
    }
    driver.run(10.0)
    assert driver.blocks() == []


@pytest.mark.parametrize(("rate", "block"), [(48000, 480), (1000, 16), (192000, 1920), (44100, 441)])
def test_a_block_is_10_ms_unless_it_is_asked_for(rate: int, block: int) -> None:
    assert started(scene={"output": {"sample_rate": rate}}).stream.block == block
    assert started(scene={"output": {"sample_rate": rate}}, block=77).stream.block == 77


def test_a_connection_without_hello_is_closed_after_ten_seconds_and_not_before() -> None:
    driver = Driver()
    driver.now += 10.0
    driver.machine.check(driver.now)
    driver.perform()
    assert driver.sent == [] and driver.closed is None
    driver.now += 0.01
    driver.machine.check(driver.now)
    driver.perform()
    assert driver.order() == ["problem", "end"]
    assert driver.closed is not None and driver.closed.code == 1008


@pytest.mark.parametrize("first", ['{"type":"stop"}', '{"type":"more","frames":1}', '{"type":"hello","x":1}', "[]"])
def test_anything_but_hello_first_closes_with_1008(first: str) -> None:
    driver = Driver()
    driver.text(first)
    assert driver.order() == ["problem", "end"] and driver.texts("end")[0] == {
        "type": "end",
        "reason": "policy",
        "frame": 0,
    }
    assert driver.closed is not None and driver.closed.code == 1008
    assert driver.engine.opened == []


def test_a_binary_message_first_closes_with_1008() -> None:
    driver = Driver()
    driver.binary(contact(1))
    assert driver.closed is not None and driver.closed.code == 1008


def test_hello_again_ends_the_stream_with_a_fade() -> None:
    driver = started()
    driver.run(0.1)
    driver.say("hello")
    driver.write()
    assert driver.closed is not None and driver.closed.code == 1008
    assert driver.pcm()[-1] == 0.0 and driver.order()[-2:] == ["pcm", "end"]


def test_a_refused_scene_in_hello_tells_every_fault_and_closes() -> None:
    driver = Driver()
    driver.say("hello", scene={"scan": {"load": -1, "speed": 99}})
    found = problem_of(driver)
    assert found["problem"] == "/docs#problem-scene-refused" and found["status"] == 422
    errors = found["errors"]
    assert isinstance(errors, list)
    assert {error["pointer"] for error in errors} == {"/scan/load", "/scan/speed"}
    assert driver.closed is not None and driver.closed.code == 1008


def test_what_comes_while_the_voice_is_opened_is_done_in_order_afterwards() -> None:
    driver = Driver()
    driver.holding = True
    driver.say("hello")
    driver.binary(contact(1, load=0.7))
    driver.say("more", frames=1000)
    driver.say("stop")
    assert driver.sent == []
    driver.release()
    assert driver.order() == ["ready", "end"]
    assert driver.closed is not None and driver.closed.code == 1000


def test_text_that_is_not_json_closes_with_1007_after_a_fade() -> None:
    driver = started()
    driver.run(0.1)
    driver.text("{nonsense")
    driver.write()
    assert driver.closed is not None and driver.closed.code == 1007
    assert driver.order()[-2:] == ["pcm", "end"] and driver.pcm()[-1] == 0.0


@pytest.mark.parametrize(
    ("text", "pointer"),
    [
        ('{"type":"contact","seq":1,"time":0}', ""),
        ('{"type":"contact","seq":1,"time":0,"position":0,"speed":0}', ""),
        ('{"type":"contact","seq":-1,"time":0,"position":0}', "/seq"),
        ('{"type":"contact","seq":4294967296,"time":0,"position":0}', "/seq"),
        ('{"type":"contact","seq":1,"time":NaN,"position":0}', "/time"),
        ('{"type":"contact","seq":1,"time":0,"position":1e999}', "/position"),
        ('{"type":"contact","seq":1,"time":0,"position":"1 mm"}', "/position"),
        ('{"type":"contact","seq":1,"time":0,"speed":10.1}', "/speed"),
        ('{"type":"contact","seq":1,"time":0,"speed":1,"load":-0.1}', "/load"),
        ('{"type":"contact","seq":1,"time":0,"speed":1,"load":1001}', "/load"),
        ('{"type":"contact","seq":1,"time":0,"speed":1,"finger":2}', "/finger"),
        ('{"type":"contact","seq":1,"seq":2,"time":0,"speed":1}', "/seq"),
        ('{"type":"more","frames":0}', "/frames"),
        ('{"type":"more","frames":1.5}', "/frames"),
        ('{"type":"more"}', "/frames"),
        ('{"type":"scene","scene":[]}', "/scene"),
        ('{"type":"dance"}', "/type"),
        ('{"type":["stop"]}', "/type"),
        ('{"frames":1}', "/type"),
        ("null", ""),
        ('{"type":"\\ud800"}', "/type"),
        ('{"type":"stop","\\ud800":1}', ""),
    ],
)
def test_a_message_that_does_not_fit_is_told_and_the_stream_goes_on(text: str, pointer: str) -> None:
    driver = started()
    driver.run(0.1)
    driver.text(text)
    (found,) = driver.texts("problem")
    assert found["problem"] == "/docs#problem-message-refused" and found["status"] == 422
    assert found["errors"][0]["pointer"] == pointer, found
    assert found["errors"][0]["allowed"] and found["errors"][0]["hint"] and found["errors"][0]["value"]
    before = len(driver.blocks())
    driver.run(1.0)
    assert len(driver.blocks()) >= before + 99 and driver.closed is None
    np.testing.assert_array_equal(driver.pcm(), expected(SCENE, Applied(), len(driver.pcm())))


@pytest.mark.parametrize(
    ("change", "pointer"),
    [
        ((0, 1, b"\x02"), "/version"),
        ((1, 2, b"\x04"), "/flags"),
        ((2, 4, b"\x01\x00"), "/contact"),
        ((8, 16, b"\x00\x00\x00\x00\x00\x00\xf8\x7f"), "/time"),
        ((16, 24, b"\x00\x00\x00\x00\x00\x00\xf0\x7f"), "/position"),
        ((24, 28, b"\x00\x00\xc0\x7f"), "/load"),
        ((24, 28, b"\x00\x00\x80\xbf"), "/load"),
        ((27, 28, b""), ""),
        ((0, 28, b""), ""),
        ((28, 28, b"\x00"), ""),
    ],
)
def test_a_binary_contact_that_is_wrong_is_told_by_field(change: tuple[int, int, bytes], pointer: str) -> None:
    driver = started()
    data, (begin, end, written) = bytearray(contact(1)), change
    data[begin:end] = written
    driver.binary(bytes(data))
    (found,) = driver.texts("problem")
    assert found["errors"][0]["pointer"] == pointer and driver.closed is None
    driver.run(0.1)
    assert driver.hand.applied.updates == []


def test_no_load_in_a_binary_contact_is_not_looked_at() -> None:
    driver = started()
    data = bytearray(contact(1, load=None))
    data[24:28] = b"\x00\x00\xc0\x7f"
    driver.binary(bytes(data))
    driver.run(0.02)
    assert driver.texts("problem") == [] and driver.hand.applied.updates[0][1].load is None


def test_with_adhesion_a_load_may_pull_as_far_as_the_scene_allows() -> None:
    driver = started()
    driver.stream.lowest_load = -0.5
    driver.binary(contact(1, load=-0.5))
    driver.say("contact", seq=2, time=0, speed=0.1, load=-0.25)
    assert driver.texts("problem") == []
    driver.binary(contact(3, load=-0.51))
    assert problem_of(driver)["errors"][0]["allowed"] == "-0.5 to 1000 N"  # type: ignore[index]


# Pull


def test_credit_is_exact_and_adds_up() -> None:
    driver = started("pull")
    for frames in (1, 479, 480, 481, 960, 10_000):
        before = len(driver.pcm())
        driver.pull(frames)
        assert len(driver.pcm()) == before + frames
        assert driver.write() == 0
    sizes = [len(block) // 4 for block in driver.blocks()]
    assert max(sizes) == BLOCK and sizes[:5] == [1, 479, 480, 480, 1]
    np.testing.assert_array_equal(driver.pcm(), expected(SCENE, Applied(), len(driver.pcm())))


def test_outstanding_credit_is_bounded_to_a_minute() -> None:
    driver = started("pull")
    driver.say("more", frames=60 * RATE - 10)
    driver.say("more", frames=11)
    assert problem_of(driver)["errors"][0]["pointer"] == "/frames"  # type: ignore[index]
    driver.say("more", frames=10)
    driver.write()
    assert len(driver.pcm()) == 60 * RATE and len(driver.texts("problem")) == 1


def test_there_is_no_credit_in_realtime() -> None:
    driver = started()
    driver.say("more", frames=48000)
    assert problem_of(driver)["errors"][0]["pointer"] == "/type"  # type: ignore[index]
    driver.run(0.1)
    assert len(driver.blocks()) == 11


# Realtime


def test_realtime_blocks_are_due_at_absolute_times_with_no_lead() -> None:
    driver = started(block=441)
    opened = driver.now
    driver.run(100.0)
    times = [at for at, message in zip(driver.times, driver.sent, strict=True) if isinstance(message, bytes)]
    assert len(times) == 1 + int(100.0 * RATE / 441)
    due = opened + np.arange(len(times)) * 441 / RATE
    assert (np.array(times) >= due).all() and np.abs(np.array(times) - due).max() < 1e-9


def test_a_late_block_does_not_move_those_after_it() -> None:
    driver = started()
    opened = driver.now
    driver.run(0.1)
    driver.now += 0.137
    driver.write()
    driver.run(1.0)
    assert len(driver.blocks()) == int((driver.now - opened) / 0.01 + 1e-9) + 1
    assert driver.texts("problem") == []


def test_late_by_our_own_fault_for_long_the_clock_starts_anew() -> None:
    driver = started()
    driver.run(0.1)
    before = len(driver.blocks())
    driver.now += 30.0
    driver.write()
    assert len(driver.blocks()) == before + 1 and driver.closed is None
    np.testing.assert_array_equal(driver.pcm(), expected(SCENE, Applied(), len(driver.pcm())))


# Updates


def test_an_update_is_applied_at_the_first_frame_of_the_next_block_and_told_just_before_it() -> None:
    driver = started()
    driver.run(0.055)
    driver.binary(contact(7, load=0.9))
    driver.run(0.1)
    at = driver.texts("applied")
    assert at == [{"type": "applied", "seq": 7, "frame": 2880}]
    place = driver.sent.index(at[0])
    sent_before = sum(len(message) // 4 for message in driver.sent[:place] if isinstance(message, bytes))
    assert sent_before == 2880 and isinstance(driver.sent[place + 1], bytes)
    pcm = driver.pcm()
    np.testing.assert_array_equal(pcm, expected(SCENE, Applied(levels=[(2880, float(np.float32(0.9)))]), len(pcm)))
    assert (pcm[:2880] == expected(SCENE, Applied(), 2880)).all() and pcm[2881] != expected(SCENE, Applied(), 2882)[-1]


def test_of_many_updates_between_two_blocks_the_newest_is_applied_once() -> None:
    driver = started()
    driver.run(0.015)
    for seq in (3, 9, 4, 9, 1):
        driver.binary(contact(seq, load=seq / 10))
    driver.run(0.01)
    driver.binary(contact(9, load=1.0))
    driver.binary(contact(8, load=1.0))
    driver.run(0.1)
    assert [message["seq"] for message in driver.texts("applied")] == [9]
    assert [update.load for _, update in driver.hand.applied.updates] == [pytest.approx(0.9)]


def test_applied_comes_at_most_once_a_block_in_any_schedule() -> None:
    generator = np.random.default_rng(5)
    driver = started(block=64)
    seq = 0
    for _ in range(2000):
        for _ in range(generator.integers(0, 3)):
            seq += 1
            if generator.random() < 0.5:
                driver.binary(contact(seq, load=float(generator.random())))
            else:
                driver.say("contact", seq=seq, time=0.0, speed=0.1, load=float(generator.random()))
        driver.run(float(generator.exponential(0.003)))
    order = driver.order()
    assert all(after == "pcm" for kind, after in itertools.pairwise(order) if kind == "applied")
    pcm = driver.pcm()
    np.testing.assert_array_equal(pcm, expected(SCENE, driver.hand.applied, len(pcm)))
    told = [(message["frame"], message["seq"]) for message in driver.texts("applied")]
    assert told == [(frame, update.seq) for frame, update in driver.hand.applied.updates]
    assert len(told) > 500


def test_json_and_binary_contacts_are_the_same_update() -> None:
    driver = started()
    driver.binary(contact(1, speed=-0.25, load=0.5))
    driver.run(0.02)
    driver.say("contact", seq=2, time=0, speed=-0.25, load=0.5)
    driver.run(0.02)
    (_, first), (_, second) = driver.hand.applied.updates
    assert (first.speed, first.position, first.load) == (second.speed, second.position, second.load)
    assert isinstance(second.time, float) and isinstance(second.seq, int)


# The watchdog


def test_without_updates_the_load_goes_after_the_silence_and_comes_back_with_the_next() -> None:
    driver = started()
    driver.run(2.0)
    assert driver.hand.applied.lifted == [], "a scene moves by itself until the first update"
    driver.binary(contact(1, load=0.8))
    driver.run(0.24)
    driver.binary(contact(2, load=None))
    driver.run(0.24)
    assert driver.hand.applied.lifted == []
    driver.run(0.5)
    (lifted,) = driver.hand.applied.lifted
    heard = 2.0 + 0.24
    assert heard + 0.25 < lifted / RATE <= heard + 0.25 + 0.0101
    driver.binary(contact(3, load=None))
    driver.run(0.1)
    pcm = driver.pcm()
    np.testing.assert_array_equal(pcm, expected(SCENE, driver.hand.applied, len(pcm)))
    assert not pcm[lifted + 96 : lifted + 480].any() and pcm[-480:].any()


def test_an_update_that_is_ignored_does_not_keep_the_hand_alive() -> None:
    driver = started()
    driver.binary(contact(5))
    for _ in range(100):
        driver.run(0.01)
        driver.binary(contact(5))
    assert len(driver.hand.applied.lifted) == 1


def test_a_client_that_stops_pulling_finds_its_hand_lifted() -> None:
    driver = started("pull")
    driver.binary(contact(1))
    driver.pull(480)
    driver.now += 3.0
    driver.pull(480)
    assert driver.hand.applied.lifted == [480]


# The limiter


def test_limited_is_told_at_most_once_a_second_with_the_largest_reduction() -> None:
    driver = started()
    for index in range(350):
        driver.hand.reduction_db = {20: 3.0, 21: 5.5, 22: 1.0, 60: 2.0, 150: 4.0}.get(index, 0.0)
        driver.now += 0.01
        driver.write()
    told = driver.texts("limited")
    assert [message["gain_reduction_db"] for message in told] == [3.0, 5.5, 4.0]
    frames = [message["frame"] for message in told]
    assert frames[1] - frames[0] == 480 and len(told) == 3
    times = [at for at, message in zip(driver.times, driver.sent, strict=True) if message in told]
    assert (np.diff(times) >= 1.0 - 1e-9).all()


# Scenes


def test_a_change_of_scene_is_told_just_before_its_first_block() -> None:
    driver = started()
    driver.run(0.055)
    driver.say("scene", scene={"scan": {"speed": "160 mm/s"}})
    driver.run(0.1)
    (told,) = driver.texts("scene")
    assert told["frame"] == 2880 and told["plan"] == driver.hand.plan_document
    assert driver.order()[driver.sent.index(told) + 1] == "pcm"
    pcm = driver.pcm()
    np.testing.assert_array_equal(pcm, expected(SCENE, driver.hand.applied, len(pcm)))
    assert driver.hand.applied.scenes[0][0] == 2880


def test_a_change_waits_for_the_cross_fade_before_it_and_the_newest_wins() -> None:
    driver = started()
    for speed in (0.1, 0.12, 0.14):
        driver.run(0.011)
        driver.say("scene", scene={"scan": {"speed": speed}})
    driver.run(0.2)
    first, second = driver.texts("scene")
    assert second["frame"] - first["frame"] > 0.05 * RATE
    assert [scene.scan.speed for _, scene in driver.hand.applied.scenes] == [0.1, 0.14]


@pytest.mark.parametrize(
    ("patch", "kind"),
    [
        ({"scan": {"load": -1}}, "scene-refused"),
        ({"output": {"sample_rate": 44100}}, "fixed"),
        ({"nonsense": 1}, "scene-refused"),
    ],
)
def test_a_refused_change_leaves_the_stream_going(patch: dict[str, object], kind: str) -> None:
    driver = started()
    driver.run(0.1)
    driver.say("scene", scene=patch)
    driver.run(0.5)
    (found,) = driver.texts("problem")
    assert found["problem"] == f"/docs#problem-{kind}"
    assert driver.texts("scene") == [] and driver.closed is None
    np.testing.assert_array_equal(driver.pcm(), expected(SCENE, Applied(), len(driver.pcm())))


def test_a_change_in_pull_is_heard_with_the_next_credit() -> None:
    driver = started("pull")
    driver.pull(500)
    driver.say("scene", scene={"scan": {"speed": 0.1}})
    driver.pull(500)
    assert [message["frame"] for message in driver.texts("scene")] == [500]


# Ends


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
    frames = driver.machine.begin_block(driver.now)
    pcm = driver.stream.render(frames)
    driver.machine.end("stopped")
    driver.sent += driver.machine.block_done(pcm, frames, driver.now)  # type: ignore[arg-type]
    driver.write()
    heard = driver.pcm()
    assert len(heard) == before + 480 and heard[-1] == 0.0 and heard[before + 5] != 0.0
    assert driver.closed is not None and driver.closed.code == 1000


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
        driver = Driver(Limits(longest_recording=0.5))
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
