"""Pings are answered; a peer that does not read gets only the newest pong."""

from __future__ import annotations

import time

import pytest

from service.live import websocket
from service.server import LIVE_OPTIONS
from tests.bench.live_frames import PING, PONG, FrameReader, frame
from tests.service.faults.caller import Caller
from tests.service.harness import Running, serving, until
from tests.service.plain_engine import PlainEngine

MANY = 1500  # pings: fewer than a second may have, more than a turn takes


def test_a_ping_is_answered_with_what_it_says(running: Running) -> None:
    with Caller(int(running.url.rpartition(":")[2])) as caller:
        caller.hello(pacing="pull").send(PING, b"who is there")
        pongs: list[bytes] = []
        reader = FrameReader()
        while not pongs:
            for kind, start, end, held in reader.frames(caller.connection.recv(65536)):
                pongs += [held[start:end]] if kind == PONG else []
    assert pongs == [b"who is there"]


def test_a_peer_that_reads_nothing_is_owed_one_pong(running: Running) -> None:
    with Caller(int(running.url.rpartition(":")[2])) as caller:
        caller.hello(pacing="pull")
        (connection,) = [
            one for one in running.server.server_state.connections if isinstance(one, websocket.LiveProtocol)
        ]
        connection.loop.call_soon_threadsafe(connection.pause_writing)
        until(lambda: not connection._writable.is_set())
        before = connection.transport.get_write_buffer_size()
        caller.connection.sendall(b"".join(frame(PING, b"%d" % number) for number in range(MANY)))
        until(lambda: connection._owed_pong.endswith(b"%d" % (MANY - 1)))
        assert connection.transport.get_write_buffer_size() == before and len(connection._owed_pong) < 10
        connection.loop.call_soon_threadsafe(connection.resume_writing)
        pongs: list[bytes] = []
        reader = FrameReader()
        while not pongs:
            for kind, start, end, held in reader.frames(caller.connection.recv(65536)):
                pongs += [held[start:end]] if kind == PONG else []
    assert pongs == [b"%d" % (MANY - 1)]


def test_a_peer_that_answers_no_ping_or_sends_half_a_frame_is_dropped(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(LIVE_OPTIONS, "ws_ping_interval", 1.0)
    monkeypatch.setattr(websocket, "DOUBT_SECONDS", 1.5)
    with serving(PlainEngine()) as running:
        port = int(running.url.rpartition(":")[2])
        with Caller(port) as silent, Caller(port) as half, Caller(port) as well:
            for caller in (silent, half, well):
                caller.hello(pacing="pull")
            half.connection.sendall(frame(PING, b"!")[:5])
            silent.answers = half.answers = False  # a busy machine may let them read a ping before they are dropped
            began = time.monotonic()
            well.connection.settimeout(0.05)
            while time.monotonic() < began + 3.5:
                try:
                    well.read(lambda: time.monotonic() >= began + 3.5)
                except TimeoutError:
                    continue
            assert not well.over
            for caller in (silent, half):
                caller.read()
                assert caller.over and caller.code in (1011, None)
