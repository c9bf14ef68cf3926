"""A client of the live protocol over a real WebSocket, for tests. It keeps all messages in order."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import numpy.typing as npt
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

from tests.service.harness import PATIENCE, Running
from tests.service.live.driver import contact

PROTOCOL = Subprotocol("ridgewave.v1")


class LiveClient:
    """One connection; `received` holds texts as documents and PCM as bytes."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.received: list[dict[str, Any] | bytes] = []
        self.code: int | None = None
        self.reason = ""

    def say(self, kind: str, **fields: Any) -> None:
        self.socket.send(json.dumps({"type": kind, **fields}))

    def contact(self, seq: int, **rest: Any) -> None:
        self.socket.send(contact(seq, **rest))

    def next(self) -> dict[str, Any] | bytes | None:
        """Return the next message; None once the connection is closed."""
        try:
            message = self.socket.recv(PATIENCE)
        except ConnectionClosed as closed:
            self.code = closed.rcvd.code if closed.rcvd else None
            self.reason = closed.rcvd.reason if closed.rcvd else ""
            return None
        self.received.append(json.loads(message) if isinstance(message, str) else message)
        return self.received[-1]

    def until(self, kind: str) -> dict[str, Any]:
        """Return the next message of that kind."""
        while (message := self.next()) is not None:
            if isinstance(message, dict) and message["type"] == kind:
                return message
        raise AssertionError(f"closed ({self.code} {self.reason}) before {kind}")

    def hello(self, **fields: Any) -> dict[str, Any]:
        self.say("hello", **fields)
        return self.until("ready")

    def frames(self, count: int) -> npt.NDArray[np.float32]:
        """Return all of the sound (f32le, mono) once at least `count` frames have arrived."""
        while self.sound < 4 * count:
            assert self.next() is not None, f"closed: {self.code} {self.reason}"
        return self.pcm()

    @property
    def sound(self) -> int:
        return sum(len(message) for message in self.received if isinstance(message, bytes))

    def rest(self) -> npt.NDArray[np.float32]:
        """Read until the close; return all of the sound."""
        while self.next() is not None:
            pass
        return self.pcm()

    def pcm(self) -> npt.NDArray[np.float32]:
        return np.frombuffer(b"".join(message for message in self.received if isinstance(message, bytes)), "<f4")

    def texts(self, kind: str) -> list[dict[str, Any]]:
        return [message for message in self.received if isinstance(message, dict) and message["type"] == kind]

    def break_off(self) -> None:
        """Break the connection without a close frame."""
        linger = struct.pack("ii", 1, 0)
        import socket

        self.socket.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, linger)
        self.socket.socket.close()


@contextmanager
def live(running: Running | str, *, path: str = "/v1/live", **options: Any) -> Iterator[LiveClient]:
    """Yield a connection to the service."""
    base = running if isinstance(running, str) else running.url
    url = base.replace("http://", "ws://") + path
    settings: dict[str, Any] = {
        "subprotocols": [PROTOCOL],
        "compression": None,
        "max_size": None,
        "open_timeout": PATIENCE,
        "close_timeout": 1.0,
        "max_queue": None,
        "ping_interval": None,
        "proxy": None,
    }
    with connect(url, **(settings | options)) as socket:
        yield LiveClient(socket)
