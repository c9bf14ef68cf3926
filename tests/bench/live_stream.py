"""One connection of the load generator, from the handshake to the end, with the arrival time of each block.

Model: blocks are counted, and only their arrival times are kept. `applied` and `end` name the frame of the stream,
    which must be the number of received frames: so a block that was lost, sent twice or out of order is detected,
    whatever its size.
"""

from __future__ import annotations

import json
import socket
from array import array
from time import perf_counter
from typing import Any

import numpy as np

from tests.bench.live_frames import (
    BINARY,
    CLOSE,
    CONTACT_FRAME_BYTES,
    PING,
    PONG,
    TEXT,
    FrameReader,
    contact_frames,
    frame,
    handshake,
    message,
)
from tests.bench.live_hand import Hand

CHUNK = 1 << 16  # bytes read at a time: never more than a second of a stream's blocks is waiting
AHEAD = 100  # updates built at a time
SAMPLE_BYTES = 4  # f32le
KEPT_MISTAKES = 5  # per stream: the first mistakes show the fault, the rest follow from them


class Stream:
    """One live connection; `act` and `touch` are called by the loop that owns the socket, which does not block."""

    def __init__(
        self, index: int, connection: socket.socket, hello: dict[str, Any], host: str, key: str | None
    ) -> None:
        self.connection, self.hello, self.block = connection, hello, int(hello["block"])
        self.ready: dict[str, Any] | None = None
        self.began = 0.0  # perf_counter at `ready`
        self.frames = 0  # first frame of the next block
        self.ended: dict[str, Any] | None = None
        self.closed = False
        self.arrivals = array("d")  # perf_counter of each block
        self.sent = array("d")  # perf_counter of each update, by seq
        self.felt = array("d")  # the same of the first block with the update applied
        self.received_bytes = 0
        self.mistakes: list[str] = []
        self.told: list[dict[str, Any]] = []  # problems of the server
        self.blocked = 0  # number of times that the network accepted no more data of this stream
        self._hand, self._random = Hand(index, smooth=bool(index % 2)), np.random.default_rng(index)
        self._waiting = handshake(host, key=key)
        self._reader: FrameReader | None = None
        self._answer = b""
        self._updates, self._updates_from = b"", 0
        self._applied = -1
        self._frame_bytes = 0
        self._stopping = False

    @property
    def mistaken(self) -> int:
        """Return the number of mistakes."""
        return len(self.mistakes)

    @property
    def waiting(self) -> bool:
        """Return whether data waits to be sent."""
        return bool(self._waiting)

    def act(self, now: float) -> None:
        """Read the received data; `now` is its arrival time."""
        try:
            chunk = self.connection.recv(CHUNK)
        except BlockingIOError:
            return
        except OSError as error:
            self._mistake(f"the connection broke: {type(error).__name__}")
            self.closed = True
            return
        if not chunk:
            if self.ended is None:
                self._mistake("the connection ended without `end`")
            self.closed = True
            return
        self.received_bytes += len(chunk)
        if self._reader is None:
            chunk = self._opened(chunk)
            if self._reader is None:
                return
        for kind, start, end, held in self._reader.frames(chunk):
            if kind == BINARY:
                self._sound(end - start, now)
            else:
                self._word(kind, held[start:end], now)

    def flush(self) -> None:
        """Send the waiting data."""
        if not self._waiting or self.closed:
            return
        try:
            taken = self.connection.send(self._waiting)
        except BlockingIOError:
            self.blocked += 1
            return
        except OSError as error:
            self._mistake(f"the connection broke: {type(error).__name__}")
            self.closed = True
            return
        self._waiting = self._waiting[taken:]

    def touch(self, rate_hz: float) -> None:
        """Send the next update of the hand, which makes `rate_hz` of them per second."""
        if self.closed or self._stopping:
            return
        seq = len(self.sent)
        place = (seq - self._updates_from) * CONTACT_FRAME_BYTES
        if place >= len(self._updates):
            times = np.arange(seq, seq + AHEAD) / rate_hz
            hand = self._hand
            self._updates = contact_frames(seq, times, hand.position(times), hand.load(times), self._random)
            self._updates_from, place = seq, 0
        self._waiting += self._updates[place : place + CONTACT_FRAME_BYTES]
        self.sent.append(perf_counter())
        self.flush()

    def stop(self) -> None:
        """Request the end."""
        self._stopping = True
        self._waiting += message(type="stop")
        self.flush()

    def _opened(self, chunk: bytes) -> bytes:
        """Return the data after the server's answer to the handshake."""
        self._answer += chunk
        head, found, rest = self._answer.partition(b"\r\n\r\n")
        if not found:
            return b""
        if not head.startswith(b"HTTP/1.1 101"):
            self._mistake(f"the server refused: {head.splitlines()[0].decode('latin-1')} {rest[:300]!r}")
            self.closed = True
            return b""
        self._reader = FrameReader()
        self._waiting += message(type="hello", **self.hello)
        self.flush()
        return rest

    def _sound(self, size: int, now: float) -> None:
        frames = size // self._frame_bytes if self._frame_bytes else 0
        if self.ready is None or size != self.block * self._frame_bytes:
            last = self._stopping and frames <= self.block
            if self.ready is None or size % self._frame_bytes or not last:
                self._mistake(f"a block of {size} bytes at frame {self.frames}")
        self.arrivals.append(now)
        self.frames += frames
        for _ in range(len(self.felt), self._applied + 1):
            self.felt.append(now)

    def _word(self, kind: int, payload: bytes, now: float) -> None:
        if kind == PING:
            self._waiting += frame(PONG, payload)
            self.flush()
        elif kind == CLOSE:
            if self.ended is None:
                self._mistake(f"closed with {int.from_bytes(payload[:2], 'big')} without `end`")
            self.closed = True
        elif kind == TEXT:
            self._message(json.loads(payload), now)
        elif kind != PONG:
            self._mistake(f"a frame of kind {kind}")

    def _message(self, said: dict[str, Any], now: float) -> None:
        kind = said.get("type")
        if kind == "applied":
            self._newer(said["seq"])
            self._check_place(said)
        elif kind == "ready" and self.ready is None:
            self.ready, self.began, self.frames = said, now, said["frame"]
            self._frame_bytes = SAMPLE_BYTES * said["channels"]
            self.block = said["block"]
        elif kind == "end":
            self.ended = said
            self._check_place(said)
        elif kind not in ("limited", "scene"):
            self.told.append(said)

    def _newer(self, seq: int) -> None:
        if seq <= self._applied:
            self._mistake(f"applied {seq} after {self._applied}")
        elif seq >= len(self.sent):
            self._mistake(f"applied {seq}, which was not sent")
        else:
            self._applied = seq

    def _check_place(self, said: dict[str, Any]) -> None:
        if said["frame"] != self.frames:
            self._mistake(f"{said['type']} says frame {said['frame']}, but {self.frames} came")

    def _mistake(self, what: str) -> None:
        if len(self.mistakes) < KEPT_MISTAKES:
            self.mistakes.append(what)
