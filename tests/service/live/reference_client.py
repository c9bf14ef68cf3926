"""A client of the live protocol on a plain socket with no setting, written from docs/live.md and RFC 6455 alone.

Model: it pulls one block at a time, as a device does whose buffer holds one. `ways`: "one message" sends the credit in
    the contact; "two messages" sends a contact and a `more` in one write, "two writes" each in a write of its own.
    It answers pings, and raises at whatever the page does not promise.
"""

from __future__ import annotations

import base64
import json
import os
import socket
import struct
from typing import Any, Literal
from urllib.parse import urlsplit

TEXT, BINARY, CLOSE, PING, PONG = 1, 2, 8, 9, 10
Way = Literal["one message", "two messages", "two writes"]


class ReferenceClient:
    """One session. messages: the texts of the service; frames, seq: received and sent so far."""

    def __init__(self, url: str, block: int, scene: dict[str, Any] | None = None, patience: float = 60.0) -> None:
        place = urlsplit(url)
        self.socket = socket.create_connection((place.hostname or "", place.port or 80), patience)
        self.held, self.frames, self.seq, self.block = b"", 0, 0, block
        self.messages: list[dict[str, Any]] = []
        self._upgrade(place.netloc)
        self._send(TEXT, self._text(type="hello", scene=scene or {}, block=block))
        ready = json.loads(self._message()[1])
        assert ready["type"] == "ready", ready
        self.rate, self.frame_bytes = ready["sample_rate"], 4 * ready["channels"]

    def _upgrade(self, host: str) -> None:
        key = base64.b64encode(os.urandom(16)).decode()
        lines = ["GET /v1/live HTTP/1.1", f"Host: {host}", "Upgrade: websocket", "Connection: Upgrade"]
        lines += [f"Sec-WebSocket-Key: {key}", "Sec-WebSocket-Version: 13", "Sec-WebSocket-Protocol: ridgewave.v1"]
        self.socket.sendall("\r\n".join([*lines, "", ""]).encode())
        while b"\r\n\r\n" not in self.held:
            self._receive()
        head, _, self.held = self.held.partition(b"\r\n\r\n")
        assert head.startswith(b"HTTP/1.1 101 "), head

    def pull(self, way: Way, speed: float = 0.08, load: float = 0.3) -> bytes:
        """Send the motion and the credit of a block, and return its sound."""
        self.seq += 1
        contact = struct.pack("<BBHIddf", 1, 1, 0, self.seq, self.frames / self.rate, speed, load)
        if way == "one message":
            writes = [self._frame(BINARY, contact + struct.pack("<I", self.block))]
        else:
            writes = [self._frame(BINARY, contact), self._frame(TEXT, self._text(type="more", frames=self.block))]
        for write in writes if way == "two writes" else [b"".join(writes)]:
            self.socket.sendall(write)
        sound = b""
        while len(sound) < self.block * self.frame_bytes:
            kind, payload = self._message()
            if kind == BINARY:
                sound += payload
            else:
                self.messages.append(json.loads(payload))
        self.frames += len(sound) // self.frame_bytes
        return sound

    def _message(self) -> tuple[int, bytes]:
        while True:
            kind, payload = self._next()
            if kind == PING:
                self._send(PONG, payload)
            elif kind != PONG:
                assert kind in (TEXT, BINARY), f"closed: {payload!r}"
                return kind, payload

    def _next(self) -> tuple[int, bytes]:
        head = self._take(2)
        size = head[1] if head[1] < 126 else int.from_bytes(self._take(2 if head[1] == 126 else 8), "big")
        return head[0] & 0x0F, self._take(size)

    def _take(self, size: int) -> bytes:
        while len(self.held) < size:
            self._receive()
        taken, self.held = self.held[:size], self.held[size:]
        return taken

    def _receive(self) -> None:
        chunk = self.socket.recv(1 << 16)
        assert chunk, "the service ended the connection"
        self.held += chunk

    def _text(self, **message: Any) -> bytes:
        return json.dumps(message).encode()

    def _send(self, kind: int, payload: bytes) -> None:
        self.socket.sendall(self._frame(kind, payload))

    def _frame(self, kind: int, payload: bytes) -> bytes:
        size = len(payload)
        head = bytes([0x80 | kind, 0x80 | size]) if size < 126 else struct.pack("!BBH", 0x80 | kind, 0x80 | 126, size)
        return head + bytes(4) + payload  # masked with zeros
