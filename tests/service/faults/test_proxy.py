"""The proxy causes each promised fault and no other; all bytes that pass arrive in order."""

from __future__ import annotations

import random
import socket
import threading
import time
from collections.abc import Iterator

import pytest

from tests.service.faults.proxy import Proxy, proxied
from tests.service.harness import until

BYTES = random.Random(1).randbytes(200_000)
PATIENCE = 10.0


class Echo:
    """A server that echoes and keeps what each connection sends, and how the connection ended."""

    def __init__(self) -> None:
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.address: tuple[str, int] = self.listener.getsockname()
        self.received: list[bytes] = []
        self.sizes: list[int] = []
        self.ends: list[str] = []
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self) -> None:
        while True:
            try:
                connection, _ = self.listener.accept()
            except OSError:
                return
            threading.Thread(target=self._serve, args=(connection,), daemon=True).start()

    def _serve(self, connection: socket.socket) -> None:
        with connection:
            try:
                while chunk := connection.recv(1 << 16):
                    self.received.append(chunk)
                    self.sizes.append(len(chunk))
                    connection.sendall(chunk)
                self.ends.append("closed")
            except ConnectionResetError:
                self.ends.append("reset")

    def text(self) -> bytes:
        return b"".join(self.received)


@pytest.fixture
def echo() -> Iterator[Echo]:
    server = Echo()
    yield server
    server.listener.shutdown(socket.SHUT_RDWR)  # or its thread accepts on, and its port stays taken
    server.listener.close()


@pytest.fixture
def proxy(echo: Echo) -> Iterator[Proxy]:
    with proxied(echo.address) as made:
        yield made


def connected(proxy: Proxy) -> socket.socket:
    return socket.create_connection(("127.0.0.1", proxy.port), PATIENCE)


def exactly(client: socket.socket, count: int) -> bytes:
    parts, total = [], 0
    while total < count:
        chunk = client.recv(1 << 16)
        assert chunk, f"the connection ended after {total} of {count} bytes"
        parts.append(chunk)
        total += len(chunk)
    return b"".join(parts)


def sent_behind(client: socket.socket, text: bytes) -> threading.Thread:
    """Send in a thread, so that the test can read meanwhile."""
    thread = threading.Thread(target=client.sendall, args=(text,), daemon=True)
    thread.start()
    return thread


@pytest.mark.parametrize("splits", [0, 7, 300])
def test_bytes_pass_whole_and_in_order_however_they_are_split(proxy: Proxy, echo: Echo, splits: int) -> None:
    text = BYTES if splits != 7 else BYTES[:20_000]
    with connected(proxy) as client:
        until(lambda: len(proxy.links) == 1)
        proxy.links[0].treat("up", splits=splits)
        proxy.links[0].treat("down", splits=splits)
        sent_behind(client, text)
        assert exactly(client, len(text)) == text
        client.shutdown(socket.SHUT_WR)
        assert client.recv(1) == b""
    assert echo.text() == text
    until(lambda: echo.ends == ["closed"] and proxy.links[0].closed)


def test_split_bytes_arrive_in_more_than_one_piece(proxy: Proxy, echo: Echo) -> None:
    with connected(proxy) as client:
        until(lambda: len(proxy.links) == 1)
        proxy.links[0].treat("up", splits=50)
        sent = 0
        while len(echo.sizes) <= sent and sent < 1000:  # an echo that comes late finds the pieces joined again
            client.sendall(BYTES[:5000])
            assert exactly(client, 5000) == BYTES[:5000]
            sent += 1
    assert len(echo.sizes) > sent


def test_a_delay_shifts_what_passes_and_keeps_its_pace(proxy: Proxy) -> None:
    with connected(proxy) as client:
        until(lambda: len(proxy.links) == 1)
        proxy.links[0].treat("down", delay=0.2)
        began = time.monotonic()
        for number in range(10):
            client.sendall(bytes([number]))
        assert exactly(client, 10) == bytes(range(10))
        took = time.monotonic() - began
    assert took >= 0.2  # and 10 * 0.2 = 2 s if each piece had waited for the one before it
    until(lambda: proxy.links[0].passed == {"up": 10, "down": 10})  # counted when it is written, by another thread


def test_a_throttle_lets_no_more_pass_than_it_says(proxy: Proxy) -> None:
    with connected(proxy) as client:
        until(lambda: len(proxy.links) == 1)
        proxy.links[0].treat("down", bytes_per_second=50_000.0)
        began = time.monotonic()
        client.sendall(BYTES[:10_000])
        assert exactly(client, 10_000) == BYTES[:10_000]
        assert time.monotonic() - began >= 0.9 * 10_000 / 50_000


@pytest.mark.parametrize("direction", ["up", "down"])
def test_a_stall_holds_everything_and_its_end_lets_it_pass(proxy: Proxy, direction: str) -> None:
    with connected(proxy) as client:
        until(lambda: len(proxy.links) == 1)
        link = proxy.links[0]
        link.treat(direction, stalled=True)  # type: ignore[arg-type]
        client.sendall(b"held")
        client.settimeout(0.2)
        with pytest.raises(TimeoutError):
            client.recv(1)
        assert link.passed["down"] == 0
        link.treat(direction, stalled=False)  # type: ignore[arg-type]
        client.settimeout(PATIENCE)
        assert exactly(client, 4) == b"held"


def test_a_stall_is_felt_by_the_sender_soon(proxy: Proxy) -> None:
    with connected(proxy) as client:
        until(lambda: len(proxy.links) == 1)
        proxy.links[0].treat("up", stalled=True)
        client.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 1 << 14)
        client.settimeout(0.3)
        with pytest.raises(TimeoutError):
            client.sendall(bytes(8_000_000))


def test_a_reset_is_a_reset_on_both_sides(proxy: Proxy, echo: Echo) -> None:
    with connected(proxy) as client:
        client.sendall(b"x")
        assert exactly(client, 1) == b"x"
        proxy.links[0].reset()
        with pytest.raises(ConnectionResetError):
            client.recv(1)
    until(lambda: echo.ends == ["reset"])
    assert proxy.links[0].closed


def test_a_half_open_link_forwards_nothing_and_closes_nothing(proxy: Proxy, echo: Echo) -> None:
    client = connected(proxy)
    client.sendall(b"x")
    assert exactly(client, 1) == b"x"
    proxy.links[0].half_open()
    client.sendall(b"lost")
    client.settimeout(0.2)
    with pytest.raises(TimeoutError):
        client.recv(1)
    client.close()
    until(lambda: proxy.links[0].passed["up"] == 1)
    assert echo.text() == b"x" and echo.ends == []


def test_after_so_many_bytes_the_rest_is_dropped(proxy: Proxy, echo: Echo) -> None:
    with connected(proxy) as client:
        until(lambda: len(proxy.links) == 1)
        proxy.links[0].treat("up", cut_after=1000)
        client.sendall(BYTES[:5000])
        assert exactly(client, 1000) == BYTES[:1000]
        client.sendall(BYTES[5000:6000])
        client.settimeout(0.2)
        with pytest.raises(TimeoutError):
            client.recv(1)
    assert echo.text() == BYTES[:1000]


def test_one_links_fault_is_not_anothers(proxy: Proxy) -> None:
    with connected(proxy) as first:
        until(lambda: len(proxy.links) == 1)
        with connected(proxy) as second:
            until(lambda: len(proxy.links) == 2)
            proxy.links[0].treat("up", stalled=True)
            first.sendall(b"held")
            second.sendall(b"passes")
            assert exactly(second, 6) == b"passes"
            assert proxy.links[0].passed["up"] == 0
