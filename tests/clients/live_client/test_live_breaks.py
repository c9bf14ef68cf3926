"""A live stream whose connection breaks: what is sent again, where it resumes, and that no sample differs."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st
from websockets.frames import Frame, Opcode
from websockets.protocol import Protocol, Side

from clients import ConnectionLost, ProtocolError, ResumeLost
from clients.live_client.live_protocol import LiveProtocol
from clients.live_client.reconnection import Backoff, Closure
from clients.live_client.stream_request import StreamRequest
from synth.errors import InvalidRequest
from tests.clients.live_client.fake_live import Answer, Close, Message, Service
from tests.clients.live_client.protocol_cases import BROKEN, Clock, opened, protocol_of, ready, sent, told
from tests.few import thorough

# Going on after a break


def test_an_update_that_was_not_applied_is_sent_again_unless_it_is_old() -> None:
    clock = Clock()
    protocol = opened(clock)
    protocol.update_contact(0.1, False, 0.2)
    first = sent(protocol)
    protocol.lost(BROKEN)
    protocol.hello()
    clock.now += 0.2
    protocol.receive(ready())
    assert sent(protocol) == first
    protocol.lost(BROKEN)
    protocol.hello()
    clock.now += 0.1
    protocol.receive(ready())
    assert sent(protocol) == []


def test_an_update_that_was_applied_is_not_sent_again() -> None:
    protocol = opened()
    protocol.update_contact(0.1, False, 0.2)
    sent(protocol)
    protocol.receive('{"type":"applied","seq":0,"frame":0}')
    protocol.lost(BROKEN)
    protocol.hello()
    protocol.receive(ready())
    assert sent(protocol) == []


def test_unanswered_changes_are_sent_again_and_a_slider_is_one_change() -> None:
    protocol = opened()
    protocol.change({"scan": {"load": 0.1}})
    protocol.change({"texture": {"period": "1 mm"}})
    assert len(sent(protocol)) == 2
    protocol.receive('{"type":"scene","frame":0,"plan":{"of":"load"}}')
    assert protocol.plan == {"of": "load"}
    protocol.lost(BROKEN)
    for load in (0.2, 0.3):
        protocol.change({"scan": {"load": load}})
    protocol.hello()
    protocol.receive(ready())
    changes = [json.loads(message)["scene"] for message in sent(protocol)]
    assert changes == [{"texture": {"period": "1 mm"}}, {"scan": {"load": 0.3}}]


def test_a_lost_session_raises_resume_lost() -> None:
    protocol = opened()
    protocol.lost(BROKEN)
    protocol.hello()
    protocol.receive(told("not-found", 404))
    protocol.receive('{"type":"end","reason":"policy","frame":0}')
    protocol.lost(Closure(1008, "policy"))
    assert isinstance(protocol.over, ResumeLost)


def test_a_new_session_continues_the_frame_numbers_and_reports_the_gap() -> None:
    protocol = opened(reconnect="new")
    protocol.change({"scan": {"load": 0.1}})
    protocol.change({"nonsense": 1})
    sent(protocol)
    protocol.receive('{"type":"scene","frame":0,"plan":{}}')
    protocol.receive(told("scene-refused", 422))
    protocol.receive(bytes(4 * 100))
    protocol.lost(BROKEN)
    protocol.hello()
    protocol.receive(told("not-found", 404))
    protocol.lost(Closure(1008, "policy"))
    assert protocol.next_try() == 0.0 and protocol.resume_url == ""
    assert json.loads(protocol.hello())["scene"] == {}
    protocol.receive(ready(session="s2", resume_url="/v1/live?session=s2"))
    assert [json.loads(message) for message in sent(protocol)] == [{"type": "scene", "scene": {"scan": {"load": 0.1}}}]
    protocol.receive('{"type":"applied","seq":7,"frame":80}')
    protocol.receive(bytes(4 * 160))
    assert protocol.gaps == (100,) and protocol.received == 260
    assert protocol.applied == (7, 180)
    protocol.lost(BROKEN)
    assert protocol.resume_url == "/v1/live?session=s2"
    assert protocol.hello() == '{"type":"hello","resume":{"session":"s2","frame":160}}'


def changes_of_a_new_session(protocol: LiveProtocol) -> list[object]:
    """Lose the session, begin another, and return the changes that it is sent."""
    protocol.receive(bytes(4))
    protocol.lost(BROKEN)
    protocol.hello()
    protocol.receive(told("not-found", 404))
    protocol.lost(Closure(1008, "policy"))
    protocol.next_try()
    protocol.hello()
    protocol.receive(ready(session="s2", resume_url="/v1/live?session=s2"))
    return [json.loads(message)["scene"] for message in sent(protocol)]


def test_a_refused_change_does_not_replace_the_accepted_one_of_the_same_field() -> None:
    protocol = opened(reconnect="new")
    protocol.change({"scan": {"load": 0.1}})
    sent(protocol)
    protocol.receive('{"type":"scene","frame":0,"plan":{}}')
    protocol.change({"scan": {"load": -1}})
    sent(protocol)
    protocol.receive(told("scene-refused", 422))
    assert changes_of_a_new_session(protocol) == [{"scan": {"load": 0.1}}]


def test_a_refusal_after_changes_that_were_answered_together_is_of_the_refused_field() -> None:
    protocol = opened(reconnect="new")
    for change in ({"scan": {"load": 0.1}}, {"texture": {"period": "1 mm"}}):
        protocol.change(change)
    sent(protocol)
    protocol.receive('{"type":"scene","frame":0,"plan":{}}')  # the service applied both, and answered once
    protocol.change({"finger": {"ridge_period": "-1 mm"}})
    sent(protocol)
    fault = {"pointer": "/finger/ridge_period", "value": "-1 mm", "allowed": "10 um to 10 mm", "hint": ""}
    protocol.receive(json.dumps({**json.loads(told("scene-refused", 422)), "errors": [fault]}))
    assert changes_of_a_new_session(protocol) == [{"scan": {"load": 0.1}}, {"texture": {"period": "1 mm"}}]


def test_a_new_session_with_another_full_scale_is_an_error() -> None:
    protocol = opened(reconnect="new")
    protocol.lost(BROKEN)
    protocol.hello()
    protocol.receive(told("not-found", 404))
    protocol.lost(Closure(1008, "policy"))
    protocol.hello()
    protocol.receive(ready(session="s2", full_scale=[3.0]))
    assert isinstance(protocol.over, ProtocolError)


@pytest.mark.parametrize("wrong", [-1.0, float("nan"), "2 s"])
def test_a_backoff_of_no_time_is_refused_with_every_field(wrong: Any) -> None:
    with pytest.raises(InvalidRequest) as refused:
        Backoff(first=wrong, largest=wrong, patience=wrong)
    assert [fault.pointer for fault in refused.value.faults] == ["/first", "/largest", "/patience"]
    assert Backoff(first=0, largest=0.0, patience=float("inf")).delay(1.0) == 0.0


def test_a_patient_client_tries_for_hours() -> None:
    backoff = Backoff(patience=1e5, uniform=lambda _low, high: high)
    assert [backoff.delay(2.0 * number) for number in range(3000)][-1] == 2.0


def test_delays_between_tries_grow_and_the_tries_end() -> None:
    clock = Clock()
    protocol = LiveProtocol(StreamRequest({}), clock, True, Backoff(uniform=lambda low, high: high))
    protocol.hello()
    protocol.receive(ready())
    protocol.lost(BROKEN)
    delays = []
    while (delay := protocol.next_try()) is not None:
        delays.append(delay)
        clock.now += delay
        protocol.lost(BROKEN)
    assert delays == [0.0, 0.1, 0.2, 0.4, 0.8, 1.6, 2.0, 2.0, 2.0]
    assert isinstance(protocol.over, ConnectionLost)


def test_the_delays_start_again_once_sound_was_received() -> None:
    protocol = LiveProtocol(StreamRequest({}), Clock(), True, Backoff(uniform=lambda low, high: high))
    protocol.hello()
    protocol.receive(ready())
    delays = []
    for message in (None, None, bytes(4 * 80), None):
        protocol.lost(BROKEN)
        delays.append(protocol.next_try())
        protocol.hello()
        protocol.receive(ready(frame=protocol.received))
        if message is not None:
            protocol.receive(message)
    assert delays == [0.0, 0.1, 0.2, 0.0]


def test_a_full_service_is_tried_again_after_its_retry_after() -> None:
    protocol = opened()
    protocol.lost(Closure(None, "", 503, None, 3.0))
    assert protocol.next_try() == 3.0
    protocol.lost(Closure(1013))
    assert protocol.next_try() == 1.0


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
) -> tuple[npt.NDArray[np.float32], LiveProtocol]:
    """Return what a hand that moves before each read gets over wires that break after `cuts` bytes each.

    The first wire counts from behind its `ready`: a first connection is not tried again.
    """
    service = Service()
    protocol = protocol_of(sample_format=sample_format)
    first = Wire(service, None, chunks)
    first.peer.receive(protocol.hello())
    for message in first.messages():
        protocol.receive(message)
    first.left = next(cuts, None)
    wire: Wire | None = first
    blocks = []

    def pump() -> None:
        nonlocal wire
        if wire is None:
            assert protocol.next_try() == 0.0
            wire = Wire(service, next(cuts, None), chunks)
            wire.peer.receive(protocol.hello())
        for message in wire.messages():
            protocol.receive(message)
        while not wire.broken and (outgoing := protocol.next_message()) is not None:
            wire.peer.receive(outgoing)
            for message in wire.messages():
                protocol.receive(message)
        if wire.broken:
            wire.peer.lost()
            protocol.lost(BROKEN)
            wire = None

    for number, frames in enumerate(reads):
        protocol.update_contact(0.001 * number, False, 0.3)
        protocol.want(frames)
        while not protocol.may_take(frames):
            pump()
        blocks.append(protocol.take(frames))
    return np.concatenate(blocks), protocol


READS = [80, 1, 200, 80, 37, 160]


@pytest.mark.parametrize("sample_format", [thorough("f32le"), "s16le"])
def test_a_break_at_every_byte_leaves_the_same_samples(sample_format: str) -> None:
    whole, protocol = played(READS, iter(()), iter(()), sample_format)
    assert protocol.reconnections == 0
    size = (4 if sample_format == "f32le" else 2) * sum(READS)  # and headers, and updates: every cut up to it breaks
    breaks = 0
    for cut in range(size):
        samples, protocol = played(READS, iter((cut,)), iter(()), sample_format)
        assert np.array_equal(samples, whole), cut
        breaks += protocol.reconnections
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
