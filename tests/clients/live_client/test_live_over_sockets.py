"""`Live` and `AsyncLive` over real sockets: the opening handshake, keys, resets, silence, the recording."""

from __future__ import annotations

import asyncio
import socket
import threading
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clients import AsyncLive, Client, ConnectionLost, Live, RefusedError
from clients.live_client.reconnection import Closed
from clients.live_client.sync_live import open_connection
from clients.live_client.websocket_connection import Address
from synth.errors import InvalidRequest
from tests.clients.live_client.fake_live import Service, sound
from tests.clients.live_client.live_services import LIVE_SERVICES, READS, WebSocketPlace, at_once, serving_live, stroke
from tests.clients.live_client.loopback import LoopbackService, silenced


@pytest.fixture(scope="module")
def loopback() -> Iterator[LoopbackService]:
    with LoopbackService(Service()) as service:
        yield service


def test_the_opening_handshake_is_that_of_the_protocol_to_the_byte() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
        heads: list[bytes] = []

        def answer() -> None:
            client, _ = listener.accept()
            with client:
                head = b""
                while not head.endswith(b"\r\n\r\n"):
                    head += client.recv(65536)
                heads.append(head)
                client.sendall(b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\nConnection: close\r\n\r\n")

        thread = threading.Thread(target=answer, daemon=True)
        thread.start()
        with pytest.raises(RefusedError) as refused, Live(url=f"ws://127.0.0.1:{port}/v1/live", key="se/cr+et"):
            pass
        thread.join(60.0)
    assert refused.value.problem.status == 404
    lines = heads[0].decode().split("\r\n")
    assert lines[0] == "GET /v1/live HTTP/1.1"
    assert "Sec-WebSocket-Protocol: ridgewave.v2, ridgewave.v1, ridgewave.key.c2UvY3IrZXQ" in lines
    assert not any(line.lower().startswith(("sec-websocket-extensions", "authorization")) for line in lines)


def test_a_key_is_accepted_and_a_missing_one_is_a_problem() -> None:
    with LoopbackService(Service(), key="a2V5") as service:
        with Live(url=service.url, key="key") as touch:
            touch.read(10, timeout=60.0)
        with pytest.raises(RefusedError) as refused, Live(url=service.url):
            pass
    assert refused.value.problem.kind == "key-required"


def test_a_service_of_version_1_is_touched_by_position_only() -> None:
    with LoopbackService(Service(protocol="ridgewave.v1")) as service, Live(url=service.url) as touch:
        with pytest.raises(InvalidRequest, match=r"ridgewave\.v1 only"):
            touch.move(x=0.1, y=0.2)
        seq = touch.move(position=-0.1, load=0.3)
        touch.read(100, timeout=60.0)
        assert touch.applied == (seq, 0)
        assert [contact[5] for contact in service.service.contacts()] == [-0.1]


def test_another_service_is_a_protocol_error() -> None:
    from websockets.sync.server import serve

    with serve(lambda connection: None, "127.0.0.1", 0) as server:
        thread = threading.Thread(target=server.serve_forever, daemon=True)
        thread.start()
        port = server.socket.getsockname()[1]
        with pytest.raises(ConnectionLost, match=r"does not speak ridgewave\.v2"), Live(url=f"ws://127.0.0.1:{port}/"):
            pass
        server.shutdown()
        thread.join(60.0)


@pytest.mark.parametrize(
    ("url", "told", "there"),
    [
        ("ws://h:1/v1/live", "/v1/live?session=a.x", "ws://h:1/v1/live?session=a.x"),
        ("wss://h/lab/v1/live?x=1", "/v1/live?session=a.x", "wss://h/lab/v1/live?x=1&session=a.x"),
        ("ws://h:1/v1/live", "", "ws://h:1/v1/live"),
        ("wss://h/v1/live", "ws://other/v1/live?session=a.x", "wss://h/v1/live?session=a.x"),
    ],
)
def test_a_session_is_resumed_at_the_url_of_ready_on_the_same_host(url: str, told: str, there: str) -> None:
    address = Address.of(url, "key")
    assert (address.resuming(told).url, address.resuming(told).subprotocols) == (there, address.subprotocols)


def test_a_refused_connection_is_reported_at_once() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
    with pytest.raises(ConnectionLost), Live(url=f"ws://127.0.0.1:{port}/v1/live"):
        pass

    async def opened() -> None:
        async with AsyncLive(url=f"ws://127.0.0.1:{port}/v1/live"):
            pass

    with pytest.raises(ConnectionLost):
        asyncio.run(opened())


def test_a_lost_peer_is_detected_by_a_ping(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("clients.live_client.websocket_connection.PING_SECONDS", 0.1)
    monkeypatch.setattr("clients.live_client.websocket_connection.CLOSE_SECONDS", 0.1)
    with (
        LoopbackService(Service()) as service,
        silenced(service.url) as (url, silence),
        Live(url=url, backoff=at_once()) as touch,
    ):
        first = touch.read(100, timeout=60.0)
        silence.set()
        assert np.array_equal(touch.read(100, timeout=60.0), sound(100, 100, 1))
        assert touch.reconnections == 1
    assert np.array_equal(first, sound(0, 100, 1))


def test_a_peer_that_reads_nothing_does_not_block_close(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("clients.live_client.sync_live.STALL_SECONDS", 0.2)
    monkeypatch.setattr("clients.live_client.websocket_connection.CLOSE_SECONDS", 0.2)
    with LoopbackService(Service()) as service, silenced(service.url, stalled=True) as (url, silence):
        connection = open_connection(Address.of(url, None))
        silence.set()
        with pytest.raises(Closed) as closed:
            for _ in range(10_000):
                connection.send(bytes(65536))
        connection.close()
    assert closed.value.closure.worth_another_try


def test_a_service_that_is_never_ready_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("clients.live_client.sync_live.READY_SECONDS", 0.05)
    monkeypatch.setattr("clients.live_client.async_live.READY_SECONDS", 0.05)
    with LoopbackService(Service()) as service:
        monkeypatch.setattr(Service, "connect", lambda *_: Mute())
        with pytest.raises(ConnectionLost, match="not ready"), Live(url=service.url):
            pass

        async def opened() -> None:
            async with AsyncLive(url=service.url):
                pass

        with pytest.raises(ConnectionLost, match="not ready"):
            asyncio.run(opened())


class Mute:
    """A peer that sends nothing."""

    session = None

    def receive(self, _: object) -> None:
        """Ignore the message."""

    def lost(self) -> None:
        """Ignore the break."""


def test_the_recording_is_fetched_from_the_same_service(loopback: LoopbackService) -> None:
    with Live(url=loopback.url, record=True) as touch:
        touch.move(0.25, 0.1)
        touch.read(80, timeout=60.0)
        assert touch.recording() == {"contacts": [{"seq": 0, "value": 0.25}]}
        with Client(loopback.http) as client:
            assert client.recording(touch.session) == touch.recording()

    async def recorded() -> dict[str, Any]:
        async with AsyncLive(url=loopback.url, record=True) as touch:
            touch.slide(0.5, 0.1)
            await touch.read(80)
            return await touch.recording()

    assert asyncio.run(recorded()) == {"contacts": [{"seq": 0, "value": 0.5}]}


@pytest.fixture(scope="module")
def live_urls() -> Iterator[dict[str, str]]:
    with serving_live() as urls:
        yield urls


@pytest.mark.parametrize("name", LIVE_SERVICES)
@settings(max_examples=12)
@given(cuts=st.lists(st.integers(1500, 4000), min_size=1, max_size=4))
def test_resets_at_any_byte_of_a_real_socket_leave_the_same_samples(
    live_urls: dict[str, str], name: str, cuts: list[int]
) -> None:
    place = WebSocketPlace(live_urls[name])
    with place.live() as touch:
        whole = stroke(touch, READS)
    with place.live(cuts=tuple(cuts)) as touch:
        assert np.array_equal(stroke(touch, READS), whole)
