"""Reads the frames of one WebSocket peer, a bounded amount in each turn of the event loop; and the heads of our own.

Model: the head of a frame gives its length, so the frames are separated without the parser. A short message in one
    whole frame, as nearly all are, goes straight to the receiver. Every other frame goes through the parser of
    websockets (`ServerProtocol`, its public interface), one at a time. A turn ends after TURN_WORK or TURN_SECONDS,
    control frames included, or when the receiver takes no more for some time. The rest waits for one of the shared
    `read_turns.Turns`; the socket is not read meanwhile.
Source: RFC 6455, 5.2 (frames), 5.3 (masks), 5.5.2 and 5.5.3 (the newest pong may answer all pings; an unsolicited pong
    needs no answer).
Limits: the last message of a turn may exceed TURN_SECONDS. At most one read of the event loop (256 kB in uvloop) waits,
    beside one message of at most `max_size` in the parser.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from time import perf_counter

from websockets.frames import Frame, Opcode
from websockets.protocol import State
from websockets.server import ServerProtocol

from service.http.read_turns import TURN_SECONDS
from service.live.transport import Receiver

TURN_WORK = 512  # short messages per turn, or equal work; more delays other connections, less needs more turns
PARSED_WORK = 4  # of a frame in the parser, 6 us; a short message takes 1.5 us
BYTES_OF_WORK = 32  # bytes of payload that count as one more short message: a text of 64 kB takes 1 to 3 ms
WHOLE_TEXT, WHOLE_BINARY, PING, PONG = 0x81, 0x82, 0x89, 0x8A  # first byte of a frame that is a whole message
MASKED, SHORT = 0x80, 126  # second byte: the bit of the mask; sizes from here on follow the byte
MASK_BYTES = 4


def frame_head(kind: int, size: int) -> bytes:
    """Return the head of an unmasked frame with a payload of `size` bytes (RFC 6455, 5.2)."""
    if size < 126:
        return bytes((kind, size))
    return struct.pack("!BBH", kind, 126, size) if size < 1 << 16 else struct.pack("!BBQ", kind, 127, size)


def frame_size(held: bytes, place: int) -> int:
    """Return the bytes of the frame at `place`, head included; 0 if the head is incomplete."""
    room = len(held) - place
    if room < 2:
        return 0
    size, head = held[place + 1] & ~MASKED, 2 + (MASK_BYTES if held[place + 1] & MASKED else 0)
    if size < SHORT:
        return head + size
    more = 2 if size == SHORT else 8
    return head + more + int.from_bytes(held[place + 2 : place + 2 + more], "big") if room >= 2 + more else 0


def unmasked(frame: bytes) -> bytes:
    """Return the payload of a short masked frame."""
    size = len(frame) - 2 - MASK_BYTES
    key = (frame[2 : 2 + MASK_BYTES] * (size // MASK_BYTES + 1))[:size]
    return (int.from_bytes(frame[2 + MASK_BYTES :], "big") ^ int.from_bytes(key, "big")).to_bytes(size, "big")


class FrameReader:
    """The reading half of one connection.

    control: called with each control frame from the parser.
    invalid: called for text that is not UTF-8.
    receiver: receives the messages; None discards them.
    awaits_pong: pongs are passed to the parser.
    pause: seconds for which the receiver takes no more, as it was when a turn ended.
    """

    def __init__(self, conn: ServerProtocol, control: Callable[[Frame], None], invalid: Callable[[], None]) -> None:
        self.receiver: Receiver | None = None
        self.awaits_pong = False
        self.pause = 0.0
        self._conn, self._control, self._invalid = conn, control, invalid
        self._held = b""
        self._left = 0  # missing bytes of the frame that the parser has begun
        self._opcode: Opcode | None = None  # of a fragmented message that is incomplete
        self._parts = bytearray()

    def take_whole(self, data: bytes) -> bool:
        """Pass on `data` if it is exactly one short binary message, as most contacts are; return whether it was."""
        size, receiver = len(data) - 2 - MASK_BYTES, self.receiver
        if not 0 <= size < SHORT or data[0] != WHOLE_BINARY or data[1] != MASKED + size or receiver is None:
            return False
        if self._held or self._left or self._opcode is not None or self._conn.state is not State.OPEN:
            return False
        if receiver.pause():
            return False
        receiver.frame(len(data))
        receiver.message(unmasked(data))
        return True

    def hold(self, data: bytes) -> None:
        """Keep `data` for a later turn."""
        self._held = self._held + data if self._held else data

    def take(self, data: bytes) -> bool:
        """Read `data`; return whether all of it has been read, except for an incomplete frame."""
        self.hold(data)
        return self.read()

    def read(self) -> bool:
        """Read what waits, for one turn; returns the same as `take`."""
        held, place, work = self._held, 0, 0
        until = perf_counter() + TURN_SECONDS
        while place < len(held):
            self.pause = 0.0 if self.receiver is None else self.receiver.pause()
            if self.pause or work >= TURN_WORK or perf_counter() >= until:
                self._held = held[place:]
                return False
            taken, cost = self._next(held, place)
            if not taken:
                break
            place, work = place + taken, work + cost
        self._held = held[place:]
        return True

    def _next(self, held: bytes, place: int) -> tuple[int, int]:
        """Read the received part of the frame at `place`; return the bytes read (0: more are needed) and the work."""
        if not self._left:
            size = frame_size(held, place)
            whole = 0 < size <= len(held) - place
            kind, short = held[place], whole and MASKED <= held[place + 1] < MASKED + SHORT
            if not size or (kind in (PING, PONG) and not whole and size <= SHORT + 2 + MASK_BYTES):
                return 0, 0
            if self.receiver is not None:
                self.receiver.frame(size)
            if short and kind in (WHOLE_TEXT, WHOLE_BINARY) and self._opcode is None and self._conn.state is State.OPEN:
                self._message(kind == WHOLE_TEXT, unmasked(held[place : place + size]))
                return size, 1
            if short and kind == PONG and not self.awaits_pong:
                return size, 1
            self._left = size
        piece = held[place : place + self._left]
        self._left -= len(piece)
        self._parse(piece)
        return len(piece), PARSED_WORK + len(piece) // BYTES_OF_WORK

    def _parse(self, piece: bytes) -> None:
        self._conn.receive_data(piece)
        for event in self._conn.events_received():
            assert isinstance(event, Frame)
            if event.opcode in (Opcode.TEXT, Opcode.BINARY, Opcode.CONT):
                self._data(event)
            else:
                self._control(event)

    def _data(self, frame: Frame) -> None:
        """Read a frame of a message."""
        if frame.opcode is not Opcode.CONT:
            self._opcode = frame.opcode
        self._parts += frame.data
        if frame.fin:
            opcode, parts, self._opcode, self._parts = self._opcode, self._parts, None, bytearray()
            self._message(opcode is Opcode.TEXT, bytes(parts))

    def _message(self, is_text: bool, message: bytes) -> None:
        receiver = self.receiver
        if receiver is None:
            return
        if not is_text:
            receiver.message(message)
            return
        try:
            text = message.decode()
        except UnicodeDecodeError:
            self._invalid()
        else:
            receiver.message(text)
