"""A request in absolute form is the same as in the usual form, and its Host is that of its target."""

from __future__ import annotations

import socket
from collections.abc import Iterator

import pytest

from tests.bench.live_frames import handshake
from tests.service.harness import PATIENCE, Running, serving
from tests.service.plain_engine import PlainEngine


@pytest.fixture(scope="module")
def served() -> Iterator[Running]:
    with serving(PlainEngine(), api_keys="secret") as running:
        yield running


def answer(served: Running, request: bytes) -> bytes:
    """Return the head of the answer to `request`."""
    host, _, port = served.url.removeprefix("http://").partition(":")
    with socket.create_connection((host, int(port)), PATIENCE) as connection:
        connection.sendall(request)
        head = b""
        while b"\r\n\r\n" not in head:
            chunk = connection.recv(4096)
            assert chunk, head
            head += chunk
    return head


def get(target: str, host: str = "localhost", **headers: str) -> bytes:
    lines = "".join(f"{name}: {value}\r\n" for name, value in headers.items())
    return f"GET {target} HTTP/1.1\r\nHost: {host}\r\n{lines}\r\n".encode()


@pytest.mark.parametrize(
    ("target", "status"),
    [
        ("http://localhost/healthz", 200),
        ("HTTP://LOCALHOST:8000/healthz?", 200),
        ("https://localhost/%68ealthz", 200),
        ("http://localhost", 307),  # to the page or to /docs
        ("http://localhost?x=1", 307),
        ("http://localhost/v1/textures", 401),
        ("http://localhost/nothing", 401),
        ("http://elsewhere/healthz", 403),
        ("http://localhost@elsewhere/healthz", 403),
        ("http://elsewhere:80@localhost/healthz", 403),
        ("ftp://localhost/healthz", 401),
        ("http:///healthz", 401),
        ("//localhost/healthz", 401),
    ],
)
def test_the_path_and_the_host_are_those_of_the_target(served: Running, target: str, status: int) -> None:
    assert answer(served, get(target)).startswith(b"HTTP/1.1 %d " % status)


def test_the_header_host_is_ignored(served: Running) -> None:
    assert answer(served, get("/healthz", "elsewhere")).startswith(b"HTTP/1.1 403 ")
    assert answer(served, get("http://localhost/healthz", "elsewhere")).startswith(b"HTTP/1.1 200 ")


def test_a_websocket_too(served: Running) -> None:
    request = handshake("localhost", key="secret")
    for target, status in (
        (b"http://localhost/v1/live", 101),
        (b"ws://localhost/v1/live", 101),
        (b"ws://a/v1/live", 403),
    ):
        head = answer(served, request.replace(b"/v1/live", target, 1))
        assert head.startswith(b"HTTP/1.1 %d " % status), head
