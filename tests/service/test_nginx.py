"""docs/nginx.conf, run by a real nginx: what passes through it, and how soon a stop is heard behind it."""

from __future__ import annotations

import socket
import time
from collections.abc import Iterator
from pathlib import Path

import httpx
import numpy as np
import pytest

from tests.service.faults.caller import Caller
from tests.service.harness import PATIENCE, Running
from tests.service.nginx import nginx

RATE = 48000
STALE_SECONDS = 1.5  # the bound that docs/operations.md states, for float32 mono at 48 kHz
ASLEEP_SECONDS = 2.5  # longer than the buffers on the way hold
READER_BUFFER = 1 << 16  # bytes; set, so that the reader's system does not increase it, as it may otherwise


@pytest.fixture
def port(running: Running, tmp_path: Path) -> Iterator[int]:
    with nginx(tmp_path, int(httpx.URL(running.url).port or 0)) as port:
        yield port


def test_a_render_a_session_and_its_change_pass(port: int) -> None:
    with httpx.Client(base_url=f"http://127.0.0.1:{port}", timeout=PATIENCE) as client:
        answer = client.post("/v1/render?format=f32le", json={"output": {"duration": 2}})
        assert len(answer.content) == 2 * RATE * 4
        session = client.post("/v1/sessions", json={}).json()["id"]
        assert client.patch(f"/v1/sessions/{session}", json={"scan": {"load": 0.2}}).status_code == 200
        answer = client.get(f"/v1/sessions/{session}/stream?format=f32le&duration=0.2")
        assert len(answer.content) == RATE // 5 * 4


@pytest.mark.usefixtures("unhurried")
def test_a_stop_is_heard_at_once_by_who_reads(running: Running, port: int) -> None:
    session = running.open_session()
    stream = f"http://127.0.0.1:{port}/v1/sessions/{session}/stream?format=f32le"
    with httpx.stream("GET", stream, timeout=PATIENCE) as answer:
        parts = answer.iter_raw()
        next(parts)
        httpx.post(f"http://127.0.0.1:{port}/v1/stop", timeout=PATIENCE)
        rest = np.frombuffer(b"".join(parts)[-4:], "<f4")
    assert rest[-1] == 0.0


@pytest.mark.alone  # on a busy machine the system lets nginx's receive buffer grow
def test_a_reader_that_sleeps_through_a_stop_hears_little_of_what_was_before(running: Running, port: int) -> None:
    session = running.open_session()
    with socket.create_connection(("127.0.0.1", port)) as reader:
        reader.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, READER_BUFFER)
        reader.sendall(f"GET /v1/sessions/{session}/stream?format=f32le HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n".encode())
        _read_for(reader, 0.3)
        time.sleep(ASLEEP_SECONDS)
        httpx.post(f"http://127.0.0.1:{port}/v1/stop", timeout=PATIENCE)
        stale = _read_all(reader)
    assert 0 < stale / 4 / RATE < STALE_SECONDS


@pytest.mark.alone  # on a busy machine the system lets nginx's receive buffer grow
def test_a_live_connection_that_sleeps_through_a_stop_hears_little_too(port: int) -> None:
    with Caller(port) as caller:
        caller.connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, READER_BUFFER)
        caller.hello()
        caller.read(lambda: len(caller.sound) > RATE)
        heard = len(caller.sound)
        time.sleep(ASLEEP_SECONDS)
        httpx.post(f"http://127.0.0.1:{port}/v1/stop", timeout=PATIENCE)
        caller.read()
    assert 0 < (len(caller.sound) - heard) / 4 / RATE < STALE_SECONDS


def _read_for(reader: socket.socket, seconds: float) -> None:
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        assert reader.recv(1 << 16)


def _read_all(reader: socket.socket) -> int:
    """Return how many bytes come until the connection ends, or nothing comes any more for a second."""
    reader.settimeout(1.0)
    size = 0
    try:
        while chunk := reader.recv(1 << 16):
            size += len(chunk)
    except (TimeoutError, ConnectionError):
        pass
    return size
