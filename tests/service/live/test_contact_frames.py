"""Binary contacts however the network splits them: alone, in pieces, several at once, and between other frames.

Model: the test builds masked frames and passes them to the server in pieces. The hand must then have applied what was
    sent.
"""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from websockets.frames import Frame, Opcode

from service.live import websocket_frames
from tests.service.harness import PATIENCE, Running
from tests.service.live.client import LiveClient, live
from tests.service.live.driver import contact
from tests.service.plain_engine import PlainEngine

MASK = bytes([0x5A, 0x00, 0xFF, 0x81])
TEXT, BINARY, PING, CONTINUATION = 0x1, 0x2, 0x9, 0x0


def frame(kind: int, payload: bytes, *, last: bool = True) -> bytes:
    """Return a masked frame of less than 126 bytes (RFC 6455, section 5.2)."""
    head = bytes([kind | (0x80 if last else 0), 0x80 | len(payload)])
    return head + MASK + masked(payload)


def masked(payload: bytes) -> bytes:
    return bytes(byte ^ key for byte, key in zip(payload, itertools.cycle(MASK), strict=False))


Feed = Callable[..., None]


@contextmanager
def pulling(running: Running) -> Iterator[tuple[LiveClient, Feed]]:
    """Yield a stream that renders nothing until it is granted frames, and what gives the server pieces from it."""
    with live(running) as client:
        name = client.hello()["session"]
        wire: Any = running.service.sessions._sessions[name].peer._wire  # type: ignore[union-attr]

        def feed(*pieces: bytes) -> None:
            """Return once the server has taken all of them, with nothing from the client's socket between them."""
            taken = threading.Event()

            def take() -> None:
                for piece in pieces:
                    wire.data_received(piece)
                taken.set()

            wire.loop.call_soon_threadsafe(take)
            assert taken.wait(PATIENCE)

        yield client, feed


def applied(client: LiveClient) -> int:
    """Return the update that the next block has."""
    client.say("more", frames=480)
    seq = client.until("applied")["seq"]
    assert isinstance(seq, int)
    return seq


def test_a_contact_in_two_pieces_is_one(running: Running) -> None:
    whole = frame(BINARY, contact(7))
    assert len(whole) == 34
    for at in range(1, 34):
        with pulling(running) as (client, feed):
            feed(whole[:at], whole[at:], frame(BINARY, contact(8)))
            assert applied(client) == 8, at


def test_a_piece_as_long_as_a_contact_that_begins_like_one_within_another_message_is_not_one(running: Running) -> None:
    inner = frame(BINARY, contact(99))
    outer = frame(BINARY, contact(3) + masked(inner) + b"the rest")
    assert outer[34:68] == inner
    with pulling(running) as (client, feed):
        feed(outer[:34], inner, outer[68:], frame(BINARY, contact(5)))
        assert applied(client) == 5


def test_several_at_once_and_a_ping_between_them(running: Running) -> None:
    with pulling(running) as (client, feed):
        feed(frame(BINARY, contact(1)) + frame(PING, b"?") + frame(BINARY, contact(2)))
        assert applied(client) == 2


def test_several_at_once_and_the_last_in_two_pieces(running: Running, engine: PlainEngine) -> None:
    three = b"".join(frame(BINARY, contact(seq)) for seq in (1, 2, 3))
    for at in (34, 35, 40, 67, 68, 101):
        with pulling(running) as (client, feed):
            feed(three[:at], three[at:])
            assert applied(client) == 3, at
            assert engine.hands[-1].applied.updates[-1][1].seq == 3


def test_what_comes_in_one_piece_with_a_close_is_not_taken_behind_it(running: Running, engine: PlainEngine) -> None:
    with pulling(running) as (client, feed):
        close = frame(0x8, (1000).to_bytes(2, "big"))
        feed(frame(BINARY, contact(1)) + frame(BINARY, contact(2)) + close + frame(BINARY, contact(3)))
        client.rest()
    assert all(update.seq != 3 for hand in engine.hands for _, update in hand.applied.updates)


def test_a_contact_in_the_midst_of_a_fragmented_message_is_a_protocol_error(running: Running) -> None:
    with pulling(running) as (client, feed):
        feed(frame(TEXT, b'{"type":', last=False), frame(BINARY, contact(1)))
        client.rest()
        assert client.code == 1002


def test_a_fragmented_contact_is_whole_in_the_end(running: Running) -> None:
    with pulling(running) as (client, feed):
        one = contact(4)
        feed(frame(BINARY, one[:10], last=False), frame(CONTINUATION, one[10:]), frame(BINARY, contact(6)))
        assert applied(client) == 6


def test_nothing_is_taken_after_the_close(running: Running, engine: PlainEngine) -> None:
    with pulling(running) as (client, feed):
        feed(frame(BINARY, contact(1)), frame(0x8, (1000).to_bytes(2, "big")), frame(BINARY, contact(2)))
        client.rest()
    assert all(update.seq != 2 for hand in engine.hands for _, update in hand.applied.updates)


def test_nothing_can_be_sent_once_the_peer_has_closed_though_the_stream_has_not_heard_of_it(running: Running) -> None:
    with live(running) as client:
        name = client.hello(pacing="realtime")["session"]
        wire: Any = running.service.sessions._sessions[name].peer._wire  # type: ignore[union-attr]
        seen: list[bool] = []

        def close() -> None:
            seen.append(wire.can_send())
            wire.data_received(frame(0x8, (1000).to_bytes(2, "big")))
            seen.append(wire.can_send())

        wire.loop.call_soon_threadsafe(close)
        client.rest()
    assert seen == [True, False]


@pytest.mark.parametrize("size", [0, 1, 125, 126, 127, 65535, 65536, 70000])
@pytest.mark.parametrize(
    ("kind", "opcode"), [(websocket_frames.WHOLE_TEXT, Opcode.TEXT), (websocket_frames.WHOLE_BINARY, Opcode.BINARY)]
)
def test_whole_messages_are_framed_as_the_library_frames_them(size: int, kind: int, opcode: Opcode) -> None:
    payload = bytes(size)
    assert websocket_frames.frame_head(kind, size) + payload == Frame(opcode, payload).serialize(mask=False)
