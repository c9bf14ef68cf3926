"""A reader that reads at once is never called slow, even if the service is late."""

from __future__ import annotations

import time
from collections.abc import Callable

import pytest

from service.live.transport import Messages
from service.sessions.pacer import Behind, Pacer
from tests.service.harness import Running, serving, warmed_up
from tests.service.live.client import LiveClient, live
from tests.service.plain_engine import PlainEngine

SLOW_READER = 0.2  # s
STALL = 0.1  # s, ten blocks


def slow_voice(engine: PlainEngine, running: Running) -> None:
    """Make each block of the newest stream take ten times its length, in the event loop while it is quick."""
    hand = engine.hands[-1]
    render = hand.render

    def slowly(frames: int) -> object:
        time.sleep(STALL)
        return render(frames)

    hand.render = slowly  # type: ignore[method-assign, assignment]


def busy_loop(engine: PlainEngine, running: Running) -> None:
    """Block the event loop repeatedly."""
    peer = running.service.sessions._sessions[next(iter(running.service.sessions._sessions))].peer
    loop = peer._wire.loop  # type: ignore[union-attr]

    def stall(times: int) -> None:
        time.sleep(2.0 * STALL)
        if times:
            loop.call_later(0.01, stall, times - 1)

    loop.call_soon_threadsafe(stall, 6)


def interrupted_writes(engine: PlainEngine, running: Running) -> None:
    """Block the event loop repeatedly, and interrupt each write as a busy machine does: none waits for the reader."""
    wire = next(iter(running.service.sessions._sessions.values())).peer._wire  # type: ignore[union-attr]
    send_now = wire.send_now

    def interrupted(messages: Messages) -> None:
        time.sleep(0.006)
        send_now(messages)

    wire.send_now = interrupted
    busy_loop(engine, running)


@pytest.mark.parametrize("fault", [slow_voice, busy_loop, interrupted_writes])
def test_a_healthy_reader_of_a_late_service_stays(fault: Callable[[PlainEngine, Running], None]) -> None:
    engine = PlainEngine()
    with serving(engine, slow_reader=SLOW_READER) as running:
        warmed_up(running, engine)
        with live(running) as client:
            client.hello(pacing="realtime", block=480)
            client.frames(480)
            fault(engine, running)
            _listen(client, 1.6)
            assert client.code is None and client.texts("problem") == []


def _listen(client: LiveClient, seconds: float) -> None:
    until = time.monotonic() + seconds
    while time.monotonic() < until and client.next() is not None:
        pass


def test_a_service_that_stalls_while_a_write_waits_does_not_blame_the_reader_for_it() -> None:
    pace = Pacer(1000, 0.0, slow_reader=1.0)
    pace.advance(10)
    pace.writing(0.01)
    assert pace.behind(0.05) is Behind.FINE
    assert pace.behind(3.0) is Behind.FINE, "nobody looked for three seconds"
    pace.written(3.0)


def test_a_reader_that_makes_a_write_wait_is_slow_though_the_service_looks_late_now_and_then() -> None:
    pace, now = Pacer(1000, 0.0, slow_reader=1.0), 0.01
    pace.advance(10)
    pace.writing(now)
    found: list[Behind] = []
    while now < 1.2:
        now += 0.15 if len(found) % 4 == 3 else 0.05
        found.append(pace.behind(now))
    assert found[-1] is Behind.TOO_SLOW
