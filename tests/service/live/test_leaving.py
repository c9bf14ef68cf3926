"""A peer that reads late still receives its close code; one that never leaves is dropped and costs little."""

from __future__ import annotations

import contextlib
import time

import pytest

from service.live import websocket, websocket_leaving
from tests.bench.live_frames import BINARY, frame
from tests.service.faults.caller import Caller
from tests.service.harness import Running, serving, until, warmed_up
from tests.service.live.driver import contact
from tests.service.plain_engine import PlainEngine

WIDE = {"output": {"sample_rate": 192000, "channels": [{"quantity": "acceleration"}] * 4}}  # fills a socket soon
PIECE = 256 * 1024  # bytes that asyncio reads at a time
ROOM_OF_SOCKETS = 16 << 20  # bytes that the kernel may hold between two sockets


def port_of(running: Running) -> int:
    return int(running.url.rpartition(":")[2])


def asleep(running: Running, slept: float) -> Caller:
    """Return a reader that was too slow and slept for `slept` s after the end, sending updates meanwhile."""
    caller = Caller(port_of(running))
    caller.hello(scene=WIDE)
    name = caller.named("ready")[0]["session"]
    until(lambda: name not in running.service.sessions._sessions)
    awake = time.monotonic() + slept
    while time.monotonic() < awake:
        caller.say(type="contact", seq=1, time=0.0, position=0.0)
        time.sleep(0.05)
    return caller


def test_a_slow_reader_that_wakes_late_hears_all_it_is_owed_and_its_code(engine: PlainEngine) -> None:
    with serving(engine, slow_reader=0.2) as running:
        warmed_up(running, engine)
        with asleep(running, 2.0 * websocket_leaving.CLOSE_SECONDS) as caller:
            caller.read()
            assert caller.code == 4408, caller.messages
            (end,) = caller.named("end")
            assert end["reason"] == "slow reader"
            assert end["frame"] == len(caller.sound) // 16


def connections(running: Running) -> list[websocket.LiveProtocol]:
    return [one for one in list(running.server.server_state.connections) if isinstance(one, websocket.LiveProtocol)]


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(websocket_leaving, "CLOSE_SECONDS", 0.1)
    monkeypatch.setattr(websocket_leaving, "LINGER_SECONDS", 0.4)


@pytest.mark.usefixtures("impatient")
def test_one_that_never_wakes_is_dropped(engine: PlainEngine) -> None:
    with serving(engine, slow_reader=0.2) as running:
        warmed_up(running, engine)
        with asleep(running, 0.0):
            assert connections(running)
            until(lambda: not connections(running))


@pytest.mark.usefixtures("impatient")
def test_one_that_floods_and_never_closes_is_dropped_and_not_listened_to(running: Running) -> None:
    flood, sent = frame(BINARY, contact(1)) * 1000, 0
    with Caller(port_of(running)) as caller:
        caller.hello()
        (connection,) = connections(running)
        caller.say(type="stop")
        until(lambda: connection._leaving.lingers)
        parsed = 0

        def counted(data: bytes | bytearray) -> None:
            nonlocal parsed
            parsed += len(data)

        connection.conn.receive_data = counted  # type: ignore[method-assign]
        began = time.monotonic()
        with contextlib.suppress(ConnectionError):
            while time.monotonic() < began + 60.0:
                caller.connection.sendall(flood)
                sent += len(flood)
        assert time.monotonic() < began + 60.0, "it was let go on"
    assert sent > 0 and parsed == 0
    most = PIECE * (websocket_leaving.LINGER_SECONDS / websocket_leaving.DISCARD_SECONDS + 2) + ROOM_OF_SOCKETS
    assert sent <= most


def test_one_that_closes_late_is_let_go_at_once(running: Running) -> None:
    with Caller(port_of(running)) as caller:
        caller.hello().say(type="stop")
        (connection,) = connections(running)
        until(lambda: connection._leaving.lingers)
        caller.read()
        assert caller.code == 1000
    until(lambda: not connections(running), 0.9 * websocket_leaving.LINGER_SECONDS)
