"""A client of the live protocol on a plain socket, which sends exactly what a test asks for."""

from __future__ import annotations

import json
import socket
import struct
from dataclasses import dataclass, field
from typing import Any

from tests.bench.live_frames import BINARY, CLOSE, PING, PONG, TEXT, FrameReader, frame, handshake, message

PATIENCE = 60.0  # s for an answer
HELLO: dict[str, Any] = {"format": "f32le", "block": 480, "pacing": "realtime"}


@dataclass
class Caller:
    """One connection; `read` collects what comes: messages, sound, and the code of the close frame."""

    port: int
    host: str = "127.0.0.1"
    messages: list[dict[str, Any]] = field(default_factory=list)
    sound: bytes = b""
    code: int | None = None

    def __post_init__(self) -> None:
        self.connection = socket.create_connection((self.host, self.port), PATIENCE)
        self.connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._reader = FrameReader()
        self.over = False
        self.answers = True  # pings

    def __enter__(self) -> Caller:
        return self

    def __exit__(self, *_: object) -> None:
        self.connection.close()

    def request(self) -> bytes:
        """Return the bytes of the handshake."""
        return handshake(f"{self.host}:{self.port}")

    def open(self) -> Caller:
        """Shake hands."""
        self.connection.sendall(self.request())
        head = b""
        while b"\r\n\r\n" not in head:
            chunk = self.connection.recv(4096)
            assert chunk, f"the server ended the handshake: {head!r}"
            head += chunk
        assert head.startswith(b"HTTP/1.1 101"), head
        self._take(head.partition(b"\r\n\r\n")[2])
        return self

    def hello(self, **changes: object) -> Caller:
        """Open, say hello, and return with `ready` among the messages."""
        self.open().say(type="hello", **(HELLO | changes))
        self.read(lambda: bool(self.named("ready")))
        return self

    def say(self, **fields: object) -> None:
        """Send a message."""
        self.connection.sendall(message(**fields))

    def send(self, kind: int, payload: bytes) -> None:
        """Send a frame."""
        self.connection.sendall(frame(kind, payload))

    def named(self, kind: str) -> list[dict[str, Any]]:
        """Return the messages of a type that have come."""
        return [said for said in self.messages if said["type"] == kind]

    def read(self, enough: Any = lambda: False) -> None:
        """Take what comes until `enough()` or the end of the connection; TimeoutError after `PATIENCE` of silence."""
        while not self.over and not enough():
            try:
                chunk = self.connection.recv(1 << 16)
            except ConnectionError:
                chunk = b""
            self.over = self.over or not chunk
            self._take(chunk)

    def break_off(self) -> None:
        """End with a reset."""
        self.connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        self.connection.close()

    def _take(self, chunk: bytes) -> None:
        for kind, start, end, held in self._reader.frames(chunk):
            payload = held[start:end]
            if kind == TEXT:
                self.messages.append(json.loads(payload))
            elif kind == BINARY:
                self.sound += payload
            elif kind == PING and self.answers:
                self.send(PONG, payload)
            elif kind == CLOSE:
                self.code = int.from_bytes(payload[:2], "big") if payload else 1005
                self.over = True
