"""Peers that send as fast as the server accepts data: one kind of frame, on one or several connections.

    python -m tests.bench.flood http://127.0.0.1:8000 pings --connections 8 --seconds 3

Model: each connection opens, sends a hello (realtime) and waits for `ready`. From then on all connections write one
    batch of frames after another into non-blocking sockets, and read the received data. Prints JSON with, for each
    connection, the bytes that the server accepted, the code and the time of its close, and the messages of the server.
    It ends when all connections are closed, or after the given time.
Limits: one process. On a machine of two cores, the flood shares them with the server and the disturbed streams.
"""

from __future__ import annotations

import argparse
import json
import selectors
import socket
import sys
import time
from collections.abc import Callable, Sequence
from time import perf_counter
from typing import Any
from urllib.parse import urlsplit

import numpy as np

from tests.bench.live_frames import (
    BINARY,
    CLOSE,
    PING,
    PONG,
    TEXT,
    FrameReader,
    contact_frames,
    frame,
    handshake,
    message,
)

BATCH = 4096  # frames that are made once and sent repeatedly
LARGE = 60_000  # bytes of a message, nearly the largest permitted one
PATIENCE = 20.0  # s for `ready`
CONTINUATION = b"\x00\x80abcd"  # empty, neither the first nor the last frame of its message
HELLO = {"format": "f32le", "block": 480, "pacing": "realtime"}
NETWORK_BYTES = 1 << 18  # requested size of the kernel's buffer: data in it has not reached the server


def contacts() -> bytes:
    """Return a hand's updates, each newer than the previous one."""
    steps = np.arange(1.0, 16.0 * BATCH, dtype=np.float64)
    return contact_frames(1, steps / 1e4, 1e-6 * steps, np.full(len(steps), 0.3), np.random.default_rng(1))


def texts() -> bytes:
    """Return the same updates as text."""
    return b"".join(message(type="contact", seq=seq, time=seq / 1e4, position=1e-6 * seq) for seq in range(BATCH))


def large() -> bytes:
    """Return messages that are refused, each nearly as large as permitted."""
    return 16 * message(type="contact", seq=1, time=0.0, position=0.0, note="x" * LARGE)


KINDS: dict[str, Callable[[], bytes]] = {
    "pings": lambda: BATCH * frame(PING, b""),
    "long pings": lambda: BATCH * frame(PING, bytes(125)),
    "pongs": lambda: BATCH * frame(PONG, b""),
    "contacts": contacts,
    "texts": texts,
    "fragments": lambda: BATCH * CONTINUATION,
    "tiny messages": lambda: BATCH * frame(BINARY, b"x"),
    "nonsense": lambda: BATCH * message(type="nonsense"),
    "large texts": large,
}
"""The kinds of flood, by name."""
BEGINNINGS = {"fragments": b"\x01\x81abcd\x1a"}  # the first frame of an endless message


class Peer:
    """One connection."""

    def __init__(self, url: str, kind: str, batch: bytes) -> None:
        place = urlsplit(url)
        self.connection = socket.socket()
        self.connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, NETWORK_BYTES)
        self.connection.settimeout(PATIENCE)
        self.connection.connect((place.hostname or "", place.port or 80))
        self.code: int | None = None
        self.over, self.sent = False, 0
        self.problems: list[str] = []
        self.blocks = self.pongs = 0
        self._batch, self._rest = memoryview(batch), memoryview(BEGINNINGS.get(kind, b""))
        self._reader = FrameReader()
        self._open(place.netloc)
        self.began = self.ended = perf_counter()

    def _open(self, host: str) -> None:
        self.connection.sendall(handshake(host))
        held = b""
        while b"\r\n\r\n" not in held:
            held += self._chunk()
        head, _, rest = held.partition(b"\r\n\r\n")
        if not head.startswith(b"HTTP/1.1 101"):
            raise RuntimeError(f"refused: {head[:100]!r}")
        self.connection.sendall(message(type="hello", **HELLO))
        self.take(rest)
        while not self.blocks:
            self.take(self._chunk())
        self.connection.setblocking(False)

    def _chunk(self) -> bytes:
        chunk = self.connection.recv(1 << 16)
        if not chunk:
            raise RuntimeError("the server ended the connection")
        return chunk

    def write(self) -> None:
        """Send as much as the network accepts."""
        if not self._rest:
            self._rest = self._batch
        try:
            taken = self.connection.send(self._rest)
        except BlockingIOError:
            return
        self.sent += taken
        self._rest = self._rest[taken:]

    def read(self) -> None:
        """Read the received data."""
        chunk = self.connection.recv(1 << 18)
        if not chunk:
            raise ConnectionError
        self.take(chunk)

    def take(self, chunk: bytes) -> None:
        """Process the received frames."""
        for kind, start, end, held in self._reader.frames(chunk):
            if kind == TEXT:
                said = json.loads(held[start:end])
                if said["type"] == "problem":
                    self.problems.append(said["problem"].rpartition("problem-")[2])
            elif kind == CLOSE:
                self.code = int.from_bytes(held[start : start + 2], "big")
                raise ConnectionError
            self.blocks += kind == BINARY
            self.pongs += kind == PONG

    def end(self) -> None:
        """Record the end of the connection."""
        self.over, self.ended = True, perf_counter()
        self.connection.close()

    def document(self) -> dict[str, Any]:
        """Return the result of the connection."""
        told = {name: self.problems.count(name) for name in sorted(set(self.problems))}
        return {
            "closed": self.over,
            "code": self.code,
            "seconds": round(self.ended - self.began, 3),
            "sent_bytes": self.sent,
            "pongs": self.pongs,
            "blocks": self.blocks,
            "problems": told,
        }


def flood(url: str, kind: str, connections: int, seconds: float) -> list[dict[str, Any]]:
    """Flood for `seconds`, or until all connections are closed; return the document of each connection."""
    batch = KINDS[kind]()
    peers = [Peer(url, kind, batch) for _ in range(connections)]
    with selectors.DefaultSelector() as selector:
        for peer in peers:
            selector.register(peer.connection, selectors.EVENT_READ | selectors.EVENT_WRITE, peer)
        print("flooding", file=sys.stderr, flush=True)
        until = perf_counter() + seconds
        while selector.get_map() and perf_counter() < until:
            for key, events in selector.select(0.1):
                peer = key.data
                try:
                    if events & selectors.EVENT_READ:
                        peer.read()
                    if events & selectors.EVENT_WRITE:
                        peer.write()
                except OSError:
                    selector.unregister(peer.connection)
                    peer.end()
    for peer in peers:
        if not peer.over:
            peer.ended = perf_counter()
            peer.connection.close()
    return [peer.document() for peer in peers]


def main(words: Sequence[str] | None = None) -> int:
    """Run with the arguments `words`; return 0."""
    made = argparse.ArgumentParser(prog="python -m tests.bench.flood", description="Flood a running service.")
    made.add_argument("url")
    made.add_argument("kind", choices=list(KINDS))
    made.add_argument("--connections", type=int, default=1)
    made.add_argument("--seconds", type=float, default=3.0)
    arguments = made.parse_args(words)
    began = time.process_time()
    found = flood(**vars(arguments))
    print(json.dumps({"peers": found, "own_seconds": round(time.process_time() - began, 3)}, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
