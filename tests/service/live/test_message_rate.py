"""Past the rate messages are read more slowly, and none is lost."""

from __future__ import annotations

import json

import pytest

from service.live import websocket_frames
from service.live.message_limits import MOST_BYTES, MOST_MESSAGES, REFUSED, MessageRate
from service.live.websocket import LiveProtocol
from tests.bench.live_frames import BINARY, TEXT, frame
from tests.service.faults.caller import Caller
from tests.service.harness import Running, serving, until
from tests.service.live.driver import DEFAULTS, Driver, contact, started
from tests.service.plain_engine import PlainEngine


def readable(rate: MessageRate, seconds: float, size: int = 34) -> int:
    """Return how many frames of `size` bytes are read in `seconds` by a reader that waits as it is told."""
    now, count = 0.0, 0
    while True:
        now += rate.wait(lambda at=now: at)  # type: ignore[misc]
        if now >= seconds:
            return count
        rate.spend(size)
        count += 1


def test_as_many_as_allowed_are_read_per_second_after_those_of_one_second_at_once() -> None:
    for allowed in (10, 2000):
        assert readable(MessageRate(allowed, 0.0), 10.0) == pytest.approx(11 * allowed, abs=2)
    rate = MessageRate(2000, 0.0)
    for _ in range(1999):
        rate.spend(34)
    assert rate.wait(lambda: 0.0) == 0.0
    rate.spend(34)
    assert rate.wait(lambda: 0.0) == pytest.approx(1 / 2000)
    assert rate.wait(lambda: 100.0) == 0.0
    count = 0
    while rate.wait(lambda: 100.0) == 0.0:
        rate.spend(34)
        count += 1
    assert count == 2000, "a long pause saves up those of one second"


def test_long_frames_and_refused_messages_count_as_several() -> None:
    assert readable(MessageRate(2000, 0.0), 10.0, 63 * 1024) == pytest.approx(11 * 2000 / 64, abs=2)
    driver = started()
    for _ in range(2000 // REFUSED + 1):
        driver.say("nonsense")
    assert driver.machine.pause(lambda: driver.now) > 0.0
    assert {told["problem"] for told in driver.texts("problem")} == {"/docs#problem-message-refused"}


def test_no_more_is_read_before_the_voice_is_open_than_may_be_kept() -> None:
    for text, most in ((" " * 60_000, MOST_BYTES // 60_000 + 1), ("", MOST_MESSAGES)):
        driver = Driver()
        driver.holding = True
        driver.say("hello", pacing="realtime")
        count = 0
        while not driver.machine.pause(lambda driver=driver: driver.now):  # type: ignore[misc]
            driver.text(json.dumps({"type": "contact", "seq": count, "time": 0, "speed": 0.1}) + text)
            count += 1
        assert count == most
        driver.release()
        assert driver.machine.pause(lambda driver=driver: driver.now) == 0.0  # type: ignore[misc]
        driver.write()
        driver.run(0.1)
        assert driver.texts("applied")[0]["seq"] == count - 1 and driver.texts("problem") == []


def test_a_client_whose_messages_wait_for_long_is_told_once() -> None:
    driver = started()
    driver.machine.behind(0.9)
    assert driver.machine.take_actions() == []
    for seconds in (1.1, 2.0):
        driver.machine.behind(seconds)
        driver.perform()
    (told,) = driver.texts("problem")
    assert told["problem"] == "/docs#problem-too-fast" and str(DEFAULTS.max_updates) in told["detail"]
    assert driver.closed is None


def connection_of(running: Running) -> LiveProtocol:
    (found,) = [one for one in list(running.server.server_state.connections) if isinstance(one, LiveProtocol)]
    return found


def port_of(running: Running) -> int:
    return int(running.url.rpartition(":")[2])


def test_all_of_a_burst_is_read_in_order_and_the_credit_at_its_end_is_granted() -> None:
    """Ten times the rate at once: contacts and credit in turn, as text and as bytes, then a stop."""
    with serving(PlainEngine(), max_updates=200) as running, Caller(port_of(running)) as caller:
        caller.hello(pacing="pull", block=48)
        more, said = json.dumps({"type": "more", "frames": 48}).encode(), b""
        for seq in range(500):
            said += frame(BINARY, contact(seq)) + frame(TEXT, more)
        caller.connection.sendall(said)
        caller.read(lambda: len(caller.sound) >= 4 * 48 * 500)
        assert caller.named("applied")[-1]["seq"] == 499 and not caller.over
        assert [told["problem"] for told in caller.named("problem")] == ["/docs#problem-too-fast"]
        caller.say(type="stop")
        caller.read()
        assert caller.code == 1000


def test_a_flood_waits_in_the_network_in_bounded_memory_and_is_not_closed() -> None:
    with serving(PlainEngine(), max_updates=10) as running, Caller(port_of(running)) as caller:
        caller.hello(pacing="pull")
        flood, sent = 1000 * frame(BINARY, contact(1)), 0
        caller.connection.setblocking(False)
        connection = connection_of(running)
        for _ in range(1000):
            try:
                sent += caller.connection.send(flood)
            except BlockingIOError:
                until(lambda: connection._behind)
        assert sent > 0
        until(lambda: connection._behind)
        held = len(connection._frames._held)
        assert 0 < held <= (1 << 18) + websocket_frames.TURN_WORK, "one read of the event loop"
        assert connection._open and not caller.over


def test_a_peer_with_unread_messages_is_not_taken_for_dead() -> None:
    with serving(PlainEngine(), max_updates=10) as running, Caller(port_of(running)) as caller:
        caller.hello(pacing="pull")
        caller.connection.sendall(200 * frame(BINARY, contact(1)))
        connection = connection_of(running)
        until(lambda: connection._behind)

        done: list[bool] = []

        def beats() -> None:
            for _ in range(4):
                connection._beat()
                assert connection._timer is not None
                connection._timer.cancel()
            done.append(connection._open)

        connection.loop.call_soon_threadsafe(beats)
        until(lambda: bool(done))
        assert done == [True] and connection._ping is not None
