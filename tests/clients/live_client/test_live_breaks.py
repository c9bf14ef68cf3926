"""A live stream whose connection breaks: what is said again, where it goes on, and that no sample differs."""

from __future__ import annotations

import json
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st
from websockets.frames import Frame, Opcode
from websockets.protocol import Protocol, Side

from clients import ConnectionLost, ProtocolError, ResumeLost
from clients.live_client.live_protocol import LiveCore, Wish
from clients.live_client.reconnection import Backoff, Closure
from tests.clients.live_client.fake_live import Answer, Close, Message, Service
from tests.clients.live_client.protocol_cases import BROKEN, Clock, core_of, opened, ready, sent, told

# Going on after a break


def test_an_update_that_was_not_heard_of_is_said_again_unless_it_is_old() -> None:
    clock = Clock()
    core = opened(clock)
    core.touch(0.1, False, 0.2)
    first = sent(core)
    core.lost(BROKEN)
    core.hello()
    clock.now += 0.2
    core.receive(ready())
    assert sent(core) == first
    core.lost(BROKEN)
    core.hello()
    clock.now += 0.1
    core.receive(ready())
    assert sent(core) == []


def test_an_update_that_was_applied_is_not_said_again() -> None:
    core = opened()
    core.touch(0.1, False, 0.2)
    sent(core)
    core.receive('{"type":"applied","seq":0,"frame":0}')
    core.lost(BROKEN)
    core.hello()
    core.receive(ready())
    assert sent(core) == []


def test_changes_without_an_answer_are_said_again_and_a_slider_is_one_change() -> None:
    core = opened()
    core.change({"scan": {"load": 0.1}})
    core.change({"texture": {"period": "1 mm"}})
    assert len(sent(core)) == 2
    core.receive('{"type":"scene","frame":0,"plan":{"of":"load"}}')
    assert core.plan == {"of": "load"}
    core.lost(BROKEN)
    for load in (0.2, 0.3):
        core.change({"scan": {"load": load}})
    core.hello()
    core.receive(ready())
    changes = [json.loads(message)["scene"] for message in sent(core)]
    assert changes == [{"texture": {"period": "1 mm"}}, {"scan": {"load": 0.3}}]


def test_a_session_that_is_gone_is_said_to_be() -> None:
    core = opened()
    core.lost(BROKEN)
    core.hello()
    core.receive(told("not-found", 404))
    core.receive('{"type":"end","reason":"policy","frame":0}')
    core.lost(Closure(1008, "policy"))
    assert isinstance(core.over, ResumeLost)


def test_a_new_session_goes_on_with_the_numbers_and_flags_the_gap() -> None:
    core = opened(reconnect="new")
    core.change({"scan": {"load": 0.1}})
    core.change({"nonsense": 1})
    sent(core)
    core.receive('{"type":"scene","frame":0,"plan":{}}')
    core.receive(told("scene-refused", 422))
    core.receive(bytes(4 * 100))
    core.lost(BROKEN)
    core.hello()
    core.receive(told("not-found", 404))
    core.lost(Closure(1008, "policy"))
    assert core.next_try() == 0.0 and core.resume_url == ""
    assert json.loads(core.hello())["scene"] == {}
    core.receive(ready(session="s2", resume_url="/v1/live?session=s2"))
    assert [json.loads(message) for message in sent(core)] == [{"type": "scene", "scene": {"scan": {"load": 0.1}}}]
    core.receive('{"type":"applied","seq":7,"frame":80}')
    core.receive(bytes(4 * 160))
    assert core.gaps == (100,) and core.heard == 260
    assert core.applied == (7, 180)
    core.lost(BROKEN)
    assert core.resume_url == "/v1/live?session=s2"
    assert core.hello() == '{"type":"hello","resume":{"session":"s2","frame":160}}'


def test_a_new_session_with_another_scale_is_not_passed_off_as_the_old() -> None:
    core = opened(reconnect="new")
    core.lost(BROKEN)
    core.hello()
    core.receive(told("not-found", 404))
    core.lost(Closure(1008, "policy"))
    core.hello()
    core.receive(ready(session="s2", full_scale=[3.0]))
    assert isinstance(core.over, ProtocolError)


def test_tries_come_later_and_later_and_stop_when_nobody_would_wait() -> None:
    clock = Clock()
    core = LiveCore(Wish({}), clock, True, Backoff(uniform=lambda low, high: high))
    core.hello()
    core.receive(ready())
    core.lost(BROKEN)
    delays = []
    while (delay := core.next_try()) is not None:
        delays.append(delay)
        clock.now += delay
        core.lost(BROKEN)
    assert delays == [0.0, 0.1, 0.2, 0.4, 0.8, 1.6, 2.0, 2.0, 2.0]
    assert isinstance(core.over, ConnectionLost)


def test_tries_are_counted_anew_once_sound_has_come_and_not_before() -> None:
    core = LiveCore(Wish({}), Clock(), True, Backoff(uniform=lambda low, high: high))
    core.hello()
    core.receive(ready())
    delays = []
    for message in (None, None, bytes(4 * 80), None):
        core.lost(BROKEN)
        delays.append(core.next_try())
        core.hello()
        core.receive(ready(frame=core.heard))
        if message is not None:
            core.receive(message)
    assert delays == [0.0, 0.1, 0.2, 0.0]


def test_a_full_service_is_asked_again_when_it_says() -> None:
    core = opened()
    core.lost(Closure(None, "", 503, None, 3.0))
    assert core.next_try() == 3.0
    core.lost(Closure(1013))
    assert core.next_try() == 1.0


# Any chunks, any break


class Wire:
    """The service behind bytes: what it says becomes WebSocket frames, cut anywhere, and frames become messages."""

    def __init__(self, service: Service, cut: int | None, chunks: Iterator[int]) -> None:
        self.left, self._chunks = cut, chunks
        self._came: list[bytes] = []
        self.peer = service.connect(self._deliver)
        self._reader = Protocol(Side.CLIENT, max_size=None)
        self.broken = False

    def _deliver(self, answer: Answer) -> None:
        if isinstance(answer, Close):
            return
        opcode, data = (Opcode.TEXT, answer.encode()) if isinstance(answer, str) else (Opcode.BINARY, answer)
        self._came.append(Frame(opcode, data).serialize(mask=False))

    def messages(self) -> list[Message]:
        """Return what has arrived whole."""
        stream, self._came = b"".join(self._came), []
        if self.left is not None and len(stream) > self.left:
            stream, self.broken = stream[: self.left], True
        elif self.left is not None:
            self.left -= len(stream)
        while stream:
            size = next(self._chunks, len(stream))
            self._reader.receive_data(stream[:size])
            stream = stream[size:]
        frames = [event for event in self._reader.events_received() if isinstance(event, Frame)]
        return [bytes(frame.data).decode() if frame.opcode is Opcode.TEXT else bytes(frame.data) for frame in frames]


def played(
    reads: list[int], cuts: Iterator[int], chunks: Iterator[int], sample_format: str = "f32le"
) -> tuple[npt.NDArray[np.float32], LiveCore]:
    """Return what a hand that moves before each read gets over wires that break after `cuts` bytes each.

    The first wire counts from behind its `ready`: a first connection is not tried again.
    """
    service = Service()
    core = core_of(sample_format=sample_format)
    first = Wire(service, None, chunks)
    first.peer.receive(core.hello())
    for message in first.messages():
        core.receive(message)
    first.left = next(cuts, None)
    wire: Wire | None = first
    blocks = []

    def pump() -> None:
        nonlocal wire
        if wire is None:
            assert core.next_try() == 0.0
            wire = Wire(service, next(cuts, None), chunks)
            wire.peer.receive(core.hello())
        for message in wire.messages():
            core.receive(message)
        while not wire.broken and (outgoing := core.next_message()) is not None:
            wire.peer.receive(outgoing)
            for message in wire.messages():
                core.receive(message)
        if wire.broken:
            wire.peer.lost()
            core.lost(BROKEN)
            wire = None

    for number, frames in enumerate(reads):
        core.touch(0.001 * number, False, 0.3)
        core.want(frames)
        while not core.may_take(frames):
            pump()
        blocks.append(core.take(frames))
    return np.concatenate(blocks), core


READS = [80, 1, 200, 80, 37, 160]


@pytest.mark.parametrize("sample_format", ["f32le", "s16le"])
def test_a_break_at_every_byte_leaves_the_same_samples(sample_format: str) -> None:
    whole, core = played(READS, iter(()), iter(()), sample_format)
    assert core.reconnections == 0
    size = (4 if sample_format == "f32le" else 2) * sum(READS)  # and headers, and updates: every cut up to it breaks
    breaks = 0
    for cut in range(size):
        samples, core = played(READS, iter((cut,)), iter(()), sample_format)
        assert np.array_equal(samples, whole), cut
        breaks += core.reconnections
    assert breaks == size


@given(
    reads=st.lists(st.integers(1, 300), min_size=1, max_size=6),
    cuts=st.lists(st.integers(0, 3000), max_size=6),
    chunks=st.lists(st.integers(1, 700), max_size=40),
)
def test_random_chunks_and_breaks_leave_the_same_samples(reads: list[int], cuts: list[int], chunks: list[int]) -> None:
    whole, _ = played(reads, iter(()), iter(()))
    samples, _ = played(reads, iter(cuts), iter(chunks))
    assert np.array_equal(samples, whole)
