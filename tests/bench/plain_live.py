"""A server of the part of the live protocol that the load generator uses. It sends zeros, and can make faults on
request.

    python -m tests.bench.plain_live PORT

Model: plain asyncio, one timer for all streams, so its cost is that of the protocol's bytes. `Faults` are those that
    the tests of the load generator require it to find.
Limits: not the service. Realtime, f32le, mono; only zeros, no checks of ranges, no problem messages; contact updates in
    their binary form.
"""

from __future__ import annotations

import asyncio
import base64
import hashlib
import json
import struct
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from time import perf_counter
from typing import Any

from tests.bench.live_frames import BINARY, CLOSE, TEXT

MAGIC = b"258EAFA5-E914-47DA-95CA-C5AB0DC85B11"  # RFC 6455, section 1.3
EARLIEST = 0.0005  # s: shortest sleep of the server's timer


@dataclass(frozen=True, slots=True)
class Faults:
    """Faults on request: drop or delay (s) the block of a number, apply updates backwards, speed up the clock."""

    lost_block: int | None = None
    backwards: bool = False
    late_block: int | None = None
    late_by: float = 0.0
    faster_by: float = 0.0  # of its clock, relative


def opening(kind: int, size: int) -> bytes:
    """Return the head of a server's frame."""
    return struct.pack("!BB", 0x80 | kind, size) if size < 126 else struct.pack("!BBH", 0x80 | kind, 126, size)


class Peer(asyncio.Protocol):
    """One connection."""

    def __init__(self, server: PlainLive) -> None:
        self.server = server
        self.held = b""
        self.open = False
        self.sent = 0
        self.newest = self.applied = -1
        self.block = self.rate = 0
        self.began = 0.0
        self.sound = b""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self.transport = transport

    def connection_lost(self, error: Exception | None) -> None:
        self.server.peers.discard(self)

    def data_received(self, chunk: bytes) -> None:
        self.held += chunk
        if not self.open:
            head, found, rest = self.held.partition(b"\r\n\r\n")
            if not found:
                return
            self._accept(head)
            self.held, self.open = rest, True
        self._take()

    def _accept(self, head: bytes) -> None:
        key = next(line for line in head.split(b"\r\n") if line.lower().startswith(b"sec-websocket-key:"))
        digest = hashlib.sha1(key.partition(b":")[2].strip() + MAGIC).digest()
        lines = [
            b"HTTP/1.1 101 Switching Protocols",
            b"Upgrade: websocket",
            b"Connection: Upgrade",
            b"Sec-WebSocket-Accept: " + base64.b64encode(digest),
            b"Sec-WebSocket-Protocol: ridgewave.v1",
        ]
        self.transport.write(b"\r\n".join([*lines, b"", b""]))

    def _take(self) -> None:
        """Read the frames of a client that sends whole frames of less than 64 KiB."""
        held, place = self.held, 0
        while len(held) - place >= 2:
            kind, size, start = held[place] & 15, held[place + 1] & 127, place + 6
            if size == 126:
                size, start = int.from_bytes(held[place + 2 : place + 4], "big"), place + 8
            if len(held) < start + size:
                break
            mask, coded = held[start - 4 : start], held[start : start + size]
            place = start + size
            if kind == BINARY:
                self.newest = int.from_bytes(bytes(coded[i] ^ mask[i % 4] for i in range(4, 8)), "little")
            elif kind == TEXT:
                self._message(json.loads(bytes(one ^ mask[i % 4] for i, one in enumerate(coded))))
        self.held = held[place:]

    def _message(self, said: dict[str, Any]) -> None:
        if said["type"] == "hello":
            self.block, self.rate = said["block"], said["scene"]["output"]["sample_rate"]
            self.sound = opening(BINARY, 4 * self.block) + bytes(4 * self.block)
            told = {"sample_rate": self.rate, "channels": 1, "block": self.block, "frame": 0}
            self.say(type="ready", **told)
            self.began = perf_counter()
            self.server.peers.add(self)
        elif said["type"] == "stop":
            self.server.peers.discard(self)
            self.say(type="end", reason="stopped", frame=self.sent * self.block)
            self.transport.write(opening(CLOSE, 2) + (1000).to_bytes(2, "big"))
            self.transport.close()

    def say(self, **fields: object) -> None:
        text = json.dumps(fields).encode()
        self.transport.write(opening(TEXT, len(text)) + text)

    def due(self, faults: Faults) -> float:
        """Return the time at which the next block is due, perf_counter."""
        late = faults.late_by if self.sent == faults.late_block else 0.0
        return self.began + self.sent * self.block / self.rate * (1.0 - faults.faster_by) + late

    def play(self, faults: Faults) -> None:
        """Send the next block."""
        parts = []
        if self.newest > self.applied:
            seq = self.newest if not faults.backwards or self.applied < 0 else self.applied - 1
            self.applied = self.newest
            text = b'{"type":"applied","seq":%d,"frame":%d}' % (seq, self.sent * self.block)
            parts += [opening(TEXT, len(text)), text]
        if self.sent != faults.lost_block:
            parts.append(self.sound)
        self.sent += 1
        self.transport.write(b"".join(parts))


class PlainLive:
    """The server; `serve` runs until it is cancelled."""

    def __init__(self, faults: Faults) -> None:
        self.faults = faults
        self.peers: set[Peer] = set()
        self.port = 0
        self.listening = threading.Event()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._task: asyncio.Task[None] | None = None

    async def serve(self, port: int = 0) -> None:
        """Listen on loopback, and play to every client that sends a hello."""
        self._loop, self._task = asyncio.get_running_loop(), asyncio.current_task()
        server = await self._loop.create_server(lambda: Peer(self), "127.0.0.1", port, backlog=512)
        self.port = server.sockets[0].getsockname()[1]
        self.listening.set()
        async with server:
            while True:
                now = perf_counter()
                for peer in tuple(self.peers):
                    while peer.due(self.faults) <= now and not peer.transport.is_closing():
                        peer.play(self.faults)
                next_due = min((peer.due(self.faults) for peer in self.peers), default=now + 0.01)
                await asyncio.sleep(max(EARLIEST, next_due - perf_counter()))

    def end(self) -> None:
        """Make `serve` return; for another thread."""
        assert self._loop is not None and self._task is not None
        self._loop.call_soon_threadsafe(self._task.cancel)


@contextmanager
def plain_live(faults: Faults | None = None) -> Iterator[str]:
    """Yield the URL of such a server in a thread of this process."""
    server = PlainLive(faults or Faults())

    def work() -> None:
        try:
            asyncio.run(server.serve())
        except asyncio.CancelledError:
            return

    thread = threading.Thread(target=work)
    thread.start()
    assert server.listening.wait(10.0)
    try:
        yield f"http://127.0.0.1:{server.port}"
    finally:
        server.end()
        thread.join(10.0)


if __name__ == "__main__":
    asyncio.run(PlainLive(Faults()).serve(int(sys.argv[1])))
