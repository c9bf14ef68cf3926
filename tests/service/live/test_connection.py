"""`Connection` in process: a client that does not read, mistakes of the service, too many connections."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Awaitable, Callable
from typing import Any

import numpy as np
import pytest
from starlette.types import Send

from service.compute.threads import BlockThreads, Solves
from service.compute.work_places import Places
from service.lifespan import WATCH_SECONDS
from service.live.connection import Connection
from service.live.live_connections import LiveConnections
from service.live.messages import V1
from service.live.transport import PlainWire
from service.operations.metrics import Metrics
from service.problems import Problem
from service.sessions.session_registry import Sessions
from tests.service.harness import settings_of
from tests.service.plain_engine import PlainEngine

RATE = 48000


class Taking(PlainWire):
    """A server whose `unblock` lets messages pass."""

    def __init__(self, send: Send, taking: asyncio.Event) -> None:
        super().__init__(send)
        self._taking = taking

    def unblock(self) -> None:
        self._taking.set()


class Wire:
    """One WebSocket. While `taking` is cleared, nothing is sent, as with a full buffer."""

    def __init__(self, live: LiveConnections) -> None:
        self.written: list[tuple[float, dict[str, Any]]] = []
        self.offered = 0
        self.taking = asyncio.Event()
        self.taking.set()
        self.inbox: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
        scope = {"type": "websocket", "path": "/v1/live"}
        self.connection = Connection(scope, self.inbox.get, self.send, live, V1, wire=Taking(self.send, self.taking))
        self.task = asyncio.create_task(self.connection.run())

    async def send(self, message: Any) -> None:
        self.offered += 1
        await self.taking.wait()
        self.written.append((time.perf_counter(), message))
        if message["type"] == "websocket.close":
            self.inbox.put_nowait({"type": "websocket.disconnect", "code": message["code"]})

    def say(self, kind: str, **fields: Any) -> None:
        self.inbox.put_nowait({"type": "websocket.receive", "text": json.dumps({"type": kind, **fields})})

    def sound(self, since: float = 0.0) -> bytes:
        return b"".join(message["bytes"] for at, message in self.written if at >= since and "bytes" in message)

    def last(self) -> list[str]:
        """Return the type of the last text, and that of the last ASGI message."""
        texts = [json.loads(message["text"])["type"] for _, message in self.written if "text" in message]
        return [texts[-1], self.written[-1][1]["type"]]


async def eventually(happened: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 60.0
    while not happened():
        assert time.monotonic() < deadline, "it never happened"
        await asyncio.sleep(0.001)


def scenario(act: Callable[[LiveConnections, PlainEngine], Awaitable[None]], **changes: object) -> None:
    """Run `act` with the live sessions of a process."""

    async def run() -> None:
        engine = PlainEngine()
        solves = Solves(Places(4, 8, lambda _seconds: None))
        settings = settings_of(**changes)
        sessions = Sessions(engine, settings, solves, Metrics())
        live = LiveConnections(sessions, settings, BlockThreads(2, lambda _seconds: None))
        watch = asyncio.create_task(watched(live))
        await act(live, engine)
        watch.cancel()
        sessions.close()
        live.end_all("shutting down")

    async def watched(live: LiveConnections) -> None:
        while True:
            await asyncio.sleep(WATCH_SECONDS)
            live.check(time.perf_counter())
            live.sessions.look()

    asyncio.run(run())


def test_after_a_stop_no_more_than_20_ms_are_written_whatever_the_block() -> None:
    async def act(live: LiveConnections, engine: PlainEngine) -> None:
        wire = Wire(live)
        wire.say("hello", pacing="realtime", block=48000)
        await eventually(lambda: bool(wire.sound()))
        stopped = time.perf_counter()
        live.end_all("stopped", at_once=True)
        await wire.task
        after = np.frombuffer(wire.sound(stopped), "<f4")
        assert 0 < len(after) <= 0.02 * RATE and after[-1] == 0.0
        assert wire.last() == ["end", "websocket.close"]

    scenario(act)


def test_a_peer_that_slept_through_a_stop_is_not_sent_the_block_that_waited() -> None:
    async def act(live: LiveConnections, engine: PlainEngine) -> None:
        wire = Wire(live)
        wire.say("hello", pacing="realtime")
        await eventually(lambda: len(wire.written) > 5)
        wire.taking.clear()
        offered = wire.offered
        await eventually(lambda: wire.offered > offered)
        sound = wire.sound()
        live.end_all("stopped", at_once=True)
        await wire.task
        assert wire.sound() == sound, "what waited was rendered before the stop"
        assert wire.last() == ["end", "websocket.close"] and wire.written[-1][1]["code"] == 1000
        assert len(live.sessions) == 0

    scenario(act)


def test_a_realtime_peer_that_takes_nothing_is_closed_with_4408() -> None:
    async def act(live: LiveConnections, engine: PlainEngine) -> None:
        wire = Wire(live)
        wire.say("hello", pacing="realtime")
        await eventually(lambda: len(wire.written) > 5)
        wire.taking.clear()
        await wire.task
        assert wire.written[-1][1]["code"] == 4408 and wire.last() == ["end", "websocket.close"]
        assert len(live.sessions) == 0

    scenario(act, slow_reader=0.2)


def test_a_peer_that_was_slow_for_a_moment_is_told_and_hears_everything() -> None:
    async def act(live: LiveConnections, engine: PlainEngine) -> None:
        wire = Wire(live)
        wire.say("hello", pacing="realtime")
        await eventually(lambda: len(wire.written) > 5)
        wire.taking.clear()
        pace = wire.connection.conversation.blocks.pace
        await eventually(lambda: time.perf_counter() - pace.due > 0.7)
        wire.taking.set()
        await eventually(lambda: time.perf_counter() < pace.due)
        kinds = [json.loads(message["text"])["type"] for _, message in wire.written if "text" in message]
        assert kinds == ["ready", "problem"]
        stream = wire.connection.conversation.stream
        assert stream is not None and len(wire.sound()) == 4 * stream.frame

    scenario(act, slow_reader=1.0)


def test_connections_without_a_session_are_bounded_too() -> None:
    async def act(live: LiveConnections, engine: PlainEngine) -> None:
        wires = []
        for _ in range(4):
            live.admit()
            wires.append(Wire(live))
            await asyncio.sleep(0)
        with pytest.raises(Problem) as refused:
            live.admit()
        assert refused.value.kind == "full"
        live.sessions.close()
        live.end_all("shutting down")
        with pytest.raises(Problem) as closing:
            live.admit()
        assert closing.value.kind == "closing"
        await asyncio.gather(*(wire.task for wire in wires))

    scenario(act, max_sessions=2)


def test_a_hello_that_never_comes_is_found_by_the_watch(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("service.live.conversation.HELLO_SECONDS", 0.05)

    async def act(live: LiveConnections, engine: PlainEngine) -> None:
        wire = Wire(live)
        await wire.task
        assert wire.written[-1][1]["code"] == 1008 and wire.last() == ["end", "websocket.close"]

    scenario(act)


def test_our_own_mistake_in_a_message_ends_that_connection_only(monkeypatch: pytest.MonkeyPatch) -> None:
    async def act(live: LiveConnections, engine: PlainEngine) -> None:
        wire, other = Wire(live), Wire(live)
        for each in (wire, other):
            each.say("hello", pacing="realtime")
        await eventually(lambda: bool(wire.sound()) and bool(other.sound()))

        def mistaken(text: str, now: float) -> None:
            raise RuntimeError("a secret that no peer may learn")

        monkeypatch.setattr(wire.connection.conversation, "text", mistaken)
        wire.say("stop")
        await wire.task
        assert wire.written[-1][1]["code"] == 1011
        assert "secret" not in str([message.get("text") for _, message in wire.written])
        count = len(other.written)
        await eventually(lambda: len(other.written) > count + 5)

    scenario(act)
