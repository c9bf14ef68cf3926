"""Frames are read whole wherever the network splits them, and a turn reads a bounded amount."""

from __future__ import annotations

import random

import pytest
from websockets.frames import Frame, Opcode
from websockets.protocol import State
from websockets.server import ServerProtocol

from service.live import websocket_frames
from service.live.websocket_frames import TURN_WORK, FrameReader
from tests.bench.live_frames import BINARY, PING, PONG, TEXT, frame

CONTINUATION = 0x0
ENDLESS = 60.0  # s: a turn that its clock does not end


class Taken:
    """A receiver that keeps its messages, and a parser."""

    def __init__(self, room: int = 10**9) -> None:
        self.messages: list[str | bytes] = []
        self.sizes: list[int] = []
        self.room = room
        self.controls: list[tuple[int, bytes]] = []
        self.invalid = 0
        self.conn = ServerProtocol(max_size=1 << 16, state=State.OPEN)
        self.reader = FrameReader(self.conn, self._control, self._invalid)
        self.reader.receiver = self

    def message(self, message: str | bytes) -> None:
        self.messages.append(message)

    def frame(self, size: int) -> None:
        self.sizes.append(size)

    def pause(self) -> float:
        return 0.0 if len(self.sizes) < self.room else 0.5

    def behind(self, seconds: float) -> None:
        raise AssertionError("the reader knows no time")

    def _control(self, one: Frame) -> None:
        self.controls.append((int(one.opcode), bytes(one.data)))

    def _invalid(self) -> None:
        self.invalid += 1

    def all(self, data: bytes) -> int:
        """Read all of `data` and return the turns that it took."""
        turns, done = 1, self.reader.take_whole(data) or self.reader.take(data)
        while not done:
            turns, done = turns + 1, self.reader.read()
        return turns


@pytest.fixture(autouse=True)
def unhurried(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(websocket_frames, "TURN_SECONDS", ENDLESS)


def part(kind: int, payload: bytes, *, last: bool) -> bytes:
    """Return a masked frame of a message in several."""
    made = bytearray(frame(kind, payload))
    made[0] = kind | (0x80 if last else 0)
    return bytes(made)


def conversation(chance: random.Random) -> tuple[bytes, list[str | bytes], list[bytes]]:
    """Return the bytes of many frames, the messages in them, and what the pings among them say."""
    sent, messages, pings = b"", [], []
    sizes = (0, 1, 27, 28, 29, 125, 126, 127, 300, 65535, 65536)

    def ping() -> bytes:
        pings.append(chance.randbytes(chance.randrange(126)))
        return frame(PING, pings[-1])

    for _ in range(40):
        size = chance.choice(sizes) if chance.random() < 0.1 else chance.choice(sizes[:9])
        payload = bytes(chance.choices(b"abcdefgh", k=size)) if chance.random() < 0.5 else chance.randbytes(size)
        text = payload.isascii() and chance.random() < 0.5
        kind = TEXT if text else BINARY
        messages.append(payload.decode() if text else payload)
        if chance.random() < 0.3:
            cuts = sorted(chance.randrange(size + 1) for _ in range(chance.randrange(1, 4)))
            pieces = [payload[a:b] for a, b in zip([0, *cuts], [*cuts, size], strict=True)]
            for number, piece in enumerate(pieces):
                sent += part(CONTINUATION if number else kind, piece, last=number == len(pieces) - 1)
                sent += ping() if chance.random() < 0.2 and number < len(pieces) - 1 else b""
        else:
            sent += frame(kind, payload)
        sent += ping() if chance.random() < 0.3 else b""
    return sent, messages, pings


@pytest.mark.parametrize("seed", range(20))
def test_messages_and_pings_come_whole_wherever_they_are_cut(seed: int) -> None:
    chance = random.Random(seed)
    sent, messages, pings = conversation(chance)
    taken, place = Taken(), 0
    while place < len(sent):
        step = chance.choice([1, 2, 3, 7, 34, 1000, 70_000])
        for start in range(place, min(len(sent), place + 20 * step), step):
            taken.all(sent[start : min(len(sent), place + 20 * step, start + step)])
        place += 20 * step
    assert taken.messages == messages
    assert taken.controls == [(int(Opcode.PING), said) for said in pings]
    assert taken.conn.state is State.OPEN and taken.invalid == 0


@pytest.mark.parametrize(
    ("one", "most"),
    [
        (frame(BINARY, bytes(28)), TURN_WORK),
        (frame(TEXT, b"x" * 100), TURN_WORK),
        (frame(BINARY, bytes(1000)), TURN_WORK // 35 + 1),
        (frame(PING, b""), TURN_WORK // 4),
        (frame(PONG, b""), TURN_WORK),
        (part(CONTINUATION, b"", last=False), TURN_WORK // 4),
    ],
    ids=["contacts", "texts", "long messages", "pings", "pongs", "fragments"],
)
def test_a_turn_takes_so_many_frames_and_no_more(one: bytes, most: int) -> None:
    taken = Taken()
    if one[0] == CONTINUATION:
        taken.all(part(TEXT, b"", last=False))
    assert not taken.reader.take(one * 3 * TURN_WORK)
    left = len(taken.reader._held) // len(one)
    assert 3 * TURN_WORK - most <= left < 3 * TURN_WORK
    assert taken.all(b"") > 1 and taken.reader._held == b""


def test_a_turn_ends_by_its_clock_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(websocket_frames, "TURN_SECONDS", 0.0)
    taken = Taken()
    assert not taken.reader.take(2 * frame(BINARY, b"x"))
    assert taken.messages == []


def test_every_frame_is_counted_once_with_its_size_wherever_it_is_cut() -> None:
    contact, ping, part_of, large = frame(BINARY, bytes(28)), frame(PING, b"?"), part(TEXT, b"", last=False), 60_000
    sent = [contact, ping, part_of, frame(PONG, b""), part(CONTINUATION, b"", last=True), frame(BINARY, bytes(large))]
    for step in (1, 7, 1000, 70_000):
        taken, data = Taken(), b"".join(sent)
        for start in range(0, len(data), step):
            taken.all(data[start : start + step])
        assert taken.sizes == [len(one) for one in sent], step


def test_nothing_is_read_while_the_receiver_takes_no_more_and_nothing_is_lost() -> None:
    said = [bytes([number]) for number in range(9)]
    for at_once in (True, False):
        taken = Taken(room=0)
        pieces = [b"".join(frame(BINARY, one) for one in said)] if at_once else [frame(BINARY, one) for one in said]
        for piece in pieces:
            assert not taken.reader.take_whole(piece) and not taken.reader.take(piece)
        assert taken.messages == [] and taken.reader.pause == 0.5
        for room in range(1, 10):
            taken.room = room
            assert taken.reader.read() is (room == 9) and taken.messages == said[:room]
        assert taken.reader.pause == 0.0 and taken.reader.take_whole(frame(BINARY, b"x")) is False
        taken.room = 99
        assert taken.reader.take_whole(frame(BINARY, b"x")) and taken.messages[-1] == b"x"


def test_a_pong_that_nobody_asked_for_is_not_parsed() -> None:
    taken = Taken()
    taken.all(3 * frame(PING, b"!") + 50 * frame(PONG, b"?"))
    assert taken.controls == [(int(Opcode.PING), b"!")] * 3 and len(taken.sizes) == 53
    taken.reader.awaits_pong = True
    taken.all(frame(PONG, b"mine"))
    assert taken.controls[-1] == (int(Opcode.PONG), b"mine")


def test_a_message_of_endless_empty_parts_takes_no_memory() -> None:
    taken = Taken()
    taken.all(part(TEXT, b"abc", last=False))
    taken.all(10_000 * part(CONTINUATION, b"", last=False))
    assert taken.reader._parts == b"abc" and len(taken.sizes) == 10_001
    taken.all(part(CONTINUATION, b"d", last=True))
    assert taken.messages == ["abcd"]


@pytest.mark.parametrize(
    "wrong",
    [
        b"\x82\x05plain",
        b"\x83\x80abcd",
        b"\xc2\x80abcd",
        b"\x82\xff\x7f\xff\xff\xff\xff\xff\xff\xffabcd",
        b"\x82\xff\x00\x00\x00\x00\x00\x02\x00\x00abcd",
        b"\x80\x80abcd",
        b"\x89\xfe\x00\x80abcd" + bytes(128),
        part(PING, b"", last=False),
        part(TEXT, b"", last=False) + frame(BINARY, b"x"),
    ],
    ids=range(9),
)
def test_what_is_no_frame_fails_the_connection_and_nothing_behind_it_is_taken(wrong: bytes) -> None:
    behind = frame(BINARY, b"behind")
    for pieces in ([wrong + behind], [bytes([one]) for one in wrong + behind]):
        taken = Taken()
        for piece in pieces:
            taken.all(piece)
        assert taken.messages == [] and taken.conn.close_expected()


def test_text_that_is_not_utf8_is_told_of() -> None:
    taken = Taken()
    taken.all(frame(TEXT, b"\xff\xfe") + part(TEXT, b"\xc3", last=False) + part(CONTINUATION, b"\xa9", last=True))
    assert taken.invalid == 1 and taken.messages == ["é"]
