"""Incomplete requests are closed after a time; complete ones are not, however long they take."""

from __future__ import annotations

import re
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from service.http import request_timeout
from tests.service.harness import Running, until
from tests.service.live.client import live

HEAD, BODY = 0.4, 0.8  # s, instead of 10 and 20
PATIENCE = 60.0
LENGTH = re.compile(rb"(?i)\r\ncontent-length: (\d+)\r\n")


@pytest.fixture(autouse=True)
def short_timeouts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(request_timeout, "HEAD_SECONDS", HEAD)
    monkeypatch.setattr(request_timeout, "BODY_SECONDS", BODY)


@contextmanager
def connected(running: Running) -> Iterator[socket.socket]:
    host, _, port = running.url.removeprefix("http://").rpartition(":")
    with socket.create_connection((host, int(port)), PATIENCE) as connection:
        yield connection


def ended(connection: socket.socket) -> tuple[float, bytes]:
    """Return the seconds until the server closed the connection, and what it sent."""
    began, said = time.monotonic(), b""
    while chunk := connection.recv(65536):
        said += chunk
    return time.monotonic() - began, said


def asked(connection: socket.socket, request: bytes) -> bytes:
    """Send a request; return the answer, read to its Content-Length."""
    connection.sendall(request)
    said = connection.recv(65536)
    while (found := LENGTH.search(said)) and len(said.partition(b"\r\n\r\n")[2]) < int(found[1]):
        said += connection.recv(65536)
    return said


GET = b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n"
HEAD_OF_JSON = b"POST /v1/explain HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
UPGRADE = b"GET /v1/live HTTP/1.1\r\nHost: localhost\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"


@pytest.mark.parametrize(
    ("first", "answer"),
    [(b"", b""), (b"G", b"HTTP/1.1 408"), (GET[:-2], b"HTTP/1.1 408"), (UPGRADE, b"HTTP/1.1 408")],
    ids=["nothing", "a byte", "all but the end", "an upgrade"],
)
def test_an_incomplete_head_is_closed(running: Running, first: bytes, answer: bytes) -> None:
    with connected(running) as connection:
        connection.sendall(first)
        took, said = ended(connection)
    assert HEAD - 0.1 < took < PATIENCE and said.startswith(answer) and bool(said) == bool(answer)
    until(lambda: not running.server.server_state.connections)


def test_more_bytes_do_not_stop_the_clock(running: Running) -> None:
    with connected(running) as connection:
        connection.sendall(GET[:-2])
        connection.settimeout(0.05)
        began, over = time.monotonic(), False
        while not over and time.monotonic() < began + PATIENCE:
            try:
                connection.sendall(b"A: b\r\n")
                over = b"408" in connection.recv(100)
            except TimeoutError:
                continue
            except ConnectionError:
                over = True
    assert HEAD - 0.1 < time.monotonic() - began < PATIENCE


def test_an_incomplete_second_request_is_closed_and_an_idle_connection_is_not(running: Running) -> None:
    with connected(running) as connection:
        assert b" 200 OK" in asked(connection, GET)
        time.sleep(1.5 * HEAD)
        assert b" 200 OK" in asked(connection, GET)
        connection.sendall(GET[:-10])
        took, said = ended(connection)
    assert HEAD - 0.1 < took < PATIENCE and said.startswith(b"HTTP/1.1 408")


@pytest.mark.parametrize("pause", [0.1, PATIENCE])
def test_an_incomplete_body_is_closed(running: Running, pause: float) -> None:
    with connected(running) as connection:
        connection.sendall(HEAD_OF_JSON + b"Content-Length: 90\r\n\r\n{")
        connection.settimeout(pause)
        began = time.monotonic()
        while time.monotonic() < began + PATIENCE:
            try:
                connection.sendall(b" ")
                if not connection.recv(100):
                    break
            except TimeoutError:
                continue
            except ConnectionError:
                break
    assert BODY - 0.1 < time.monotonic() - began < PATIENCE


def test_an_unread_body_is_not_waited_for(running: Running) -> None:
    with connected(running) as connection:
        answer = asked(connection, b"POST /nowhere HTTP/1.1\r\nHost: localhost\r\nContent-Length: 90\r\n\r\n{")
        assert b" 404 " in answer
        connection.sendall(b" ")
        took, _ = ended(connection)
    assert took < PATIENCE


def test_a_long_body_in_progress_is_waited_for(running: Running) -> None:
    piece = b" " * 1024
    with connected(running) as connection:
        connection.sendall(HEAD_OF_JSON + b"Content-Length: %d\r\n\r\n" % (12 * len(piece) + 2))
        for _ in range(12):
            time.sleep(0.1)
            connection.sendall(piece)
        assert b" 200 OK" in asked(connection, b"{}")


def test_an_endless_stream_and_a_websocket_continue(running: Running) -> None:
    with running.listening(running.open_session()) as listener, live(running) as client:
        client.hello(pacing="realtime")
        listener.frames(round(48000 * 2.0 * HEAD))
        client.frames(round(48000 * 2.0 * HEAD))


def test_a_body_of_tiny_chunks_is_read_in_turns(running: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    turns: list[float] = []
    parse = request_timeout.RequestTimeout._parse

    def timed(self: request_timeout.RequestTimeout) -> bool:
        began = time.thread_time()
        try:
            return parse(self)
        finally:
            turns.append(time.thread_time() - began)

    monkeypatch.setattr(request_timeout.RequestTimeout, "_parse", timed)
    chunks = b"1\r\n \r\n" * 50_000
    with connected(running) as connection:
        request = HEAD_OF_JSON + b"Transfer-Encoding: chunked\r\n\r\n" + chunks + b"2\r\n{}\r\n0\r\n\r\n"
        assert asked(connection, request).startswith(b"HTTP/1.1 200")
    assert len(turns) > 20
    assert sorted(turns)[len(turns) // 2] < 0.02  # s, of processor time: all of it at once takes a quarter of a second
