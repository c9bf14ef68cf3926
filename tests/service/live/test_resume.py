"""A resumed session sends any kept frame again, bit for bit, and then the stream continues."""

from __future__ import annotations

import numpy as np
import pytest

from service.live.live_stream import LiveStream
from service.live.replay_buffer import ReplayBuffer
from synth.scene.scene import parse_scene
from tests.service.live.driver import RATE, Driver, contact
from tests.service.plain_hand import Applied, PlainHand, expected

SCENE = parse_scene({})


def broken(seconds: float, **fields: object) -> Driver:
    """Return a connection that broke after `seconds`."""
    driver = Driver()
    driver.hello(pacing="realtime", **fields)
    driver.run(seconds)
    driver.machine.lost()
    driver.perform()
    return driver


def resumed(earlier: Driver, frame: int, later: float = 0.0) -> Driver:
    driver = Driver(streams=earlier.streams, now=earlier.now + later)
    driver.say("hello", resume={"session": "s0", "frame": frame})
    return driver


def hand_of(streams: dict[str, LiveStream]) -> PlainHand:
    hand = streams["s0"].voice
    assert isinstance(hand, PlainHand)
    return hand


@pytest.mark.parametrize("back", [0, 1, 479, 480, 481, 12_345, 47_999, 48_000])
def test_any_frame_of_the_last_second_is_resumed_bit_for_bit(back: int) -> None:
    earlier = broken(1.5)
    end = len(earlier.pcm())
    driver = resumed(earlier, end - back)
    assert driver.texts("ready")[0]["frame"] == end - back
    driver.run(2.0)
    heard = np.concatenate([earlier.pcm()[: end - back], driver.pcm()])
    assert len(heard) >= end - back + 2 * RATE
    np.testing.assert_array_equal(heard, expected(SCENE, hand_of(driver.streams).applied, len(heard)))


@pytest.mark.parametrize("frame", [-1, 1])
def test_a_frame_that_is_not_kept_is_not_found_and_the_session_stays(frame: int) -> None:
    earlier = broken(1.5)
    stream = earlier.streams["s0"]
    asked = stream.replay.begin - 1 if frame < 0 else stream.frame + 1
    driver = resumed(earlier, asked)
    assert driver.texts("problem")[0]["problem"] == "/docs#problem-not-found"
    assert driver.closed is not None and driver.closed.code == 1008 and driver.detached and not driver.finished
    assert resumed(earlier, stream.frame).texts("ready")


def test_an_unknown_session_is_not_found() -> None:
    driver = Driver()
    driver.say("hello", resume={"session": "nobody", "frame": 0})
    assert driver.order() == ["problem", "end"]
    assert driver.closed is not None and driver.closed.code == 1008


@pytest.mark.parametrize("name", ["scene", "format", "block", "pacing", "record"])
def test_a_resumed_session_keeps_what_its_hello_said(name: str) -> None:
    value = {"scene": {}, "format": "f32le", "block": 480, "pacing": "pull", "record": False}[name]
    driver = Driver()
    driver.say("hello", resume={"session": "s0", "frame": 0}, **{name: value})
    assert driver.texts("problem")[0]["errors"][0]["pointer"] == f"/{name}"
    assert driver.closed is not None and driver.closed.code == 1008
    earlier = broken(0.5, format="s16le", block=100, record=True)
    ready, again = earlier.texts("ready")[0], resumed(earlier, 0).texts("ready")[0]
    assert again == ready


def test_the_clock_of_a_resumed_stream_begins_with_its_first_frame() -> None:
    driver = resumed(broken(1.5), 30_000, later=5.0)
    driver.run(1.0)
    past = driver.stream.frame - 30_000
    assert [len(block) // 4 for block in driver.blocks()].count(480) == 100, "one is shorter, where the past ends"
    assert 48_000 <= len(driver.pcm()) < 48_000 + 480 <= past + 480


def test_credit_begins_at_none() -> None:
    first = Driver()
    first.hello()
    first.pull(10_000)
    first.say("more", frames=5)
    first.machine.lost()
    driver = resumed(first, 9_000)
    driver.run(1.0)
    assert driver.blocks() == []
    driver.pull(700)
    driver.pull(600)
    sizes = [len(block) // 4 for block in driver.blocks()]
    assert sizes == [480, 220, 300, 300], "kept frames, the end of the past, and then new ones"
    assert sum(sizes) == 1300


def test_the_hand_of_a_resumed_stream_is_lifted_until_it_is_heard_again() -> None:
    earlier = Driver()
    earlier.hello(pacing="realtime")
    earlier.binary(contact(1, load=0.8))
    earlier.run(0.1)
    earlier.machine.lost()
    driver = resumed(earlier, len(earlier.pcm()), later=5.0)
    driver.run(0.1)
    assert hand_of(driver.streams).applied.lifted == [len(earlier.pcm())]
    driver.binary(contact(1, load=0.1))
    driver.binary(contact(2, load=None))
    driver.run(0.1)
    assert [message["seq"] for message in driver.texts("applied")] == [2], "seq goes on rising"
    heard = np.concatenate([earlier.pcm(), driver.pcm()])
    np.testing.assert_array_equal(heard, expected(SCENE, hand_of(driver.streams).applied, len(heard)))


def test_a_stop_while_the_past_is_sent_fades_at_once() -> None:
    driver = resumed(broken(1.5), 30_000)
    driver.run(0.1)
    driver.say("stop")
    driver.write()
    pcm = driver.pcm()
    plain = expected(SCENE, Applied(), 30_000 + len(pcm))[30_000:]
    np.testing.assert_array_equal(pcm[:-480], plain[:-480])
    assert pcm[-1] == 0.0 and np.abs(pcm[-480:]).max() <= np.abs(plain[-480:]).max() > 0
    assert driver.sent[-1] == {"type": "end", "reason": "stopped", "frame": 30_000 + len(pcm)}


def test_a_connection_that_is_taken_over_is_told_and_closed_and_the_stream_goes_on() -> None:
    earlier = Driver()
    earlier.hello(pacing="realtime")
    earlier.run(0.5)
    earlier.machine.displaced()
    earlier.perform()
    assert earlier.closed is not None and earlier.closed.code == 1008 and not earlier.finished
    assert earlier.order()[-2:] == ["problem", "end"]
    driver = resumed(earlier, len(earlier.pcm()))
    driver.run(0.5)
    earlier.run(0.5)
    heard = np.concatenate([earlier.pcm(), driver.pcm()])
    np.testing.assert_array_equal(heard, expected(SCENE, Applied(), len(heard)))


def test_the_past_holds_a_second_or_eight_blocks_within_its_bytes() -> None:
    for block, kept in ((480, 48_000), (16, 48_000), (12_000, 96_000), (48_000, 262_144)):
        driver = Driver()
        driver.hello(block=block)
        driver.pull(800_000)
        past = driver.stream.replay
        assert past.end - past.begin == kept


def test_the_ring_gives_back_what_it_was_given() -> None:
    generator = np.random.default_rng(3)
    past, whole = ReplayBuffer(1000, 6), b""
    for size in generator.integers(1, 1001, 200):
        pcm = generator.bytes(6 * int(size))
        past.keep(pcm)
        whole += pcm
        begin = int(generator.integers(past.begin, past.end))
        frames = int(generator.integers(0, past.end - begin + 1))
        assert past.read(begin, frames) == whole[6 * begin : 6 * (begin + frames)]
    assert past.begin == past.end - 1000
    with pytest.raises(AssertionError):
        past.read(past.begin - 1, 2)
