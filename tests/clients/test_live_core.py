"""The protocol of a live stream without its connection: wire frames to the byte, and breaks at every byte."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st
from websockets.frames import Frame, Opcode
from websockets.protocol import Protocol, Side

from clients import ConnectionLost, ProtocolError, RefusedError, ResumeLost, ServiceError, StreamEnded
from clients.live_core import LiveCore, Reconnect, Wish
from clients.live_reconnect import Backoff, Closure
from clients.live_wire import subprotocols
from synth.errors import AskedWrong
from tests.clients import fake_live
from tests.clients.fake_live import RATE, Answer, Close, Message, Service, sound

BROKEN = Closure(None, "reset")


class Clock:
    """Seconds that a test sets."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


def core_of(clock: Callable[[], float] | None = None, reconnect: Reconnect = True, **wish: Any) -> LiveCore:
    return LiveCore(Wish({}, **wish), clock or Clock(), reconnect, Backoff(0.0, 0.0))


def ready(**changes: Any) -> str:
    document = {
        "type": "ready", "session": "s1", "sample_rate": RATE, "channels": 1, "quantities": ["velocity"],
        "full_scale": [2.5], "block": 80, "frame": 0, "plan": {"simulated": []}, "max_silence_ms": 250.0,
        "motion_delay_ms": 8.0, "format": "f32le", "pacing": "pull", "recording": False, "protocol": "ridgewave.v1",
    }  # fmt: skip
    return json.dumps({**document, **changes})


def opened(clock: Callable[[], float] | None = None, reconnect: Reconnect = True, **wish: Any) -> LiveCore:
    core = core_of(clock, reconnect, **wish)
    core.hello()
    core.receive(ready())
    assert core.over is None
    return core


def sent(core: LiveCore) -> list[Message]:
    messages = []
    while (message := core.next_message()) is not None:
        messages.append(message)
    return messages


def told(kind: str, status: int) -> str:
    return fake_live.problem(kind, status, f"{kind} it is")


# What is said, to the byte


def test_a_position_is_28_bytes() -> None:
    core = opened()
    assert core.touch(0.0125, False, 0.5) == 0
    assert core.touch(-2.0, False, 0.25) == 1
    (message,) = sent(core)
    assert message == bytes.fromhex("01 00 0000 01000000 0000000000005940 00000000000000c0 0000803e")


def test_a_speed_without_load_sets_both_flags() -> None:
    core = opened()
    core.touch(0.5, True, None)
    (message,) = sent(core)
    assert message == bytes.fromhex("01 03 0000 00000000 0000000000005940 000000000000e03f 00000000")


def test_lifting_keeps_the_place_and_takes_the_load_away() -> None:
    core = opened()
    core.touch(1.0, False, 0.5)
    core.lift()
    assert sent(core) == [bytes.fromhex("01 00 0000 01000000 0000000000005940 000000000000f03f 00000000")]


def test_lifting_before_any_move_is_a_finger_at_rest_without_load() -> None:
    core = opened()
    core.lift()
    assert sent(core) == [bytes.fromhex("01 01 0000 00000000 0000000000005940 0000000000000000 00000000")]


def test_the_texts_that_are_said() -> None:
    core = core_of(block=64, record=True, sample_format="s16le", pacing="pull")
    assert core.hello() == ('{"type":"hello","scene":{},"format":"s16le","pacing":"pull","block":64,"record":true}')
    core.receive(ready(frame=0))
    core.want(480)
    core.change({"scan": {"load": "0.2 N"}})
    assert sent(core) == [
        '{"type":"scene","scene":{"scan":{"load":"0.2 N"}}}',
        '{"type":"more","frames":480}',
    ]
    core.receive(bytes(2 * 80))
    core.lost(BROKEN)
    assert core.next_try() == 0.0
    assert core.hello() == '{"type":"hello","resume":{"session":"s1","frame":80}}'
    core.receive(ready(frame=80))
    core.stop()
    assert sent(core)[0] == '{"type":"stop"}'


def test_the_default_hello_names_no_more_than_it_must() -> None:
    assert core_of().hello() == '{"type":"hello","scene":{},"format":"f32le","pacing":"pull"}'


def test_a_key_is_offered_in_base64url_without_padding() -> None:
    assert subprotocols(None) == ("ridgewave.v1",)
    assert subprotocols("k?>~") == ("ridgewave.v1", "ridgewave.key.az8-fg")


# The hand


def test_only_the_newest_of_unsent_updates_is_said() -> None:
    core = opened()
    for step in range(100):
        core.touch(0.001 * step, False, 0.1)
    (message,) = sent(core)
    assert fake_live.CONTACT.unpack(message)[3] == 99  # type: ignore[arg-type]


def test_an_update_goes_ahead_of_the_credit_of_the_read_after_it() -> None:
    core = opened()
    core.touch(0.1, False, 0.1)
    core.want(80)
    assert [isinstance(message, bytes) for message in sent(core)] == [True, False]


def test_updates_that_never_end_do_not_hold_up_the_credit() -> None:
    core = opened()
    core.touch(0.1, False, 0.1)
    core.want(80)
    kinds = []
    for step in range(3):
        message = core.next_message()
        kinds.append(isinstance(message, bytes))
        core.touch(0.1 * step, False, 0.1)
    assert kinds == [True, False, True]


@pytest.mark.parametrize(
    ("value", "load", "field"),
    [
        (float("nan"), 0.1, "/position"),
        (float("inf"), 0.1, "/position"),
        (1001.0, 0.1, "/position"),
        ("1 mm", 0.1, "/position"),
        (0.0, float("nan"), "/load"),
        (0.0, 1e4, "/load"),
    ],
)
def test_an_update_that_cannot_be_is_refused_with_its_field(value: Any, load: Any, field: str) -> None:
    with pytest.raises(AskedWrong) as refused:
        opened().touch(value, False, load)
    assert [fault.pointer for fault in refused.value.faults] == [field]


def test_a_scene_that_is_not_json_is_refused_before_anything_is_sent() -> None:
    with pytest.raises(AskedWrong):
        Wish({"scan": {"load": float("nan")}})
    with pytest.raises(AskedWrong):
        opened().change({"scan": {"load": object()}})


# Credit


def test_credit_is_what_the_read_lacks_and_no_more() -> None:
    core = opened()
    core.want(100)
    assert sent(core) == ['{"type":"more","frames":100}']
    core.want(150)
    assert sent(core) == ['{"type":"more","frames":50}']
    core.receive(bytes(4 * 150))
    assert core.take(100).shape == (100, 1)
    core.want(60)
    assert sent(core) == ['{"type":"more","frames":10}']


def test_frames_ahead_are_granted_before_they_are_read() -> None:
    core = opened(ahead=40)
    core.want(0)
    assert sent(core) == ['{"type":"more","frames":40}']


def test_a_long_read_is_granted_in_bounded_parts() -> None:
    core = opened()
    core.want(100 * RATE)
    outstanding = 0
    grants = 0
    while not core.may_take(100 * RATE):
        for message in sent(core):
            outstanding += json.loads(message)["frames"]
            grants += 1
        assert 0 < outstanding <= 10 * RATE
        core.receive(bytes(4 * 800))
        outstanding -= 800
    assert grants < 30


def test_realtime_grants_nothing_and_stops_listening_when_nobody_reads() -> None:
    core = opened(pacing="realtime")
    core.want(480)
    assert sent(core) == []
    core.receive(bytes(4 * (RATE - 1)))
    assert not core.congested
    core.receive(bytes(4))
    assert core.congested
    core.take(480)
    assert not core.congested


# Underruns


def test_a_device_that_is_fed_in_time_never_runs_dry_and_one_that_is_not_does() -> None:
    clock = Clock()
    core = opened(clock)
    core.receive(bytes(4 * 800))
    for _ in range(4):
        core.take(80)
        clock.now += 0.010
    assert core.playout.underruns == 0
    clock.now += 0.005
    core.take(80)
    assert core.playout.underruns == 1
    clock.now += 0.010
    core.take(80)
    assert core.playout.underruns == 1


# What ends a stream


@pytest.mark.parametrize(
    ("closure", "error"),
    [
        (Closure(None, "refused"), ConnectionLost),
        (Closure(1013), ServiceError),
        (Closure(None, "", 503, None, 3.0), ServiceError),
        (Closure(1008), ConnectionLost),
    ],
)
def test_a_first_connection_that_fails_is_not_tried_again(closure: Closure, error: type[Exception]) -> None:
    core = core_of()
    assert core.next_try() == 0.0
    core.lost(closure)
    assert core.next_try() is None
    assert type(core.over) is error


def test_a_refused_scene_names_its_faults() -> None:
    fault = {"pointer": "/scan/load", "value": "'-1 N'", "allowed": "0 N to 1000 N", "hint": "Write a load."}
    core = core_of()
    core.hello()
    core.receive(fake_live.problem("scene-refused", 422, "", [fault]))
    core.receive('{"type":"end","reason":"policy","frame":0}')
    core.lost(Closure(1008, "policy"))
    assert isinstance(core.over, RefusedError)
    assert core.over.problem.kind == "scene-refused"
    assert "scan.load: got '-1 N'; allowed: 0 N to 1000 N" in str(core.over)


def test_the_end_comes_after_all_the_sound_and_gives_what_is_left() -> None:
    core = opened()
    core.receive(sound(0, 100, 1).tobytes())
    core.receive('{"type":"end","reason":"finished","frame":100}')
    core.lost(Closure(1000))
    assert np.array_equal(core.take(60), sound(0, 60, 1))
    with pytest.raises(StreamEnded) as ended:
        core.take(60)
    assert (ended.value.reason, ended.value.frame) == ("finished", 100)
    assert ended.value.rest is not None
    assert np.array_equal(ended.value.rest, sound(60, 40, 1))
    with pytest.raises(StreamEnded) as again:
        core.take(1)
    assert again.value.rest is not None and again.value.rest.shape == (0, 1)


@pytest.mark.parametrize(("code", "reason"), [(4408, "slow reader"), (1008, "policy"), (1001, "shutting down")])
def test_what_somebody_closed_is_not_tried_again(code: int, reason: str) -> None:
    core = opened()
    core.lost(Closure(code))
    assert core.next_try() is None
    assert isinstance(core.over, StreamEnded) and core.over.reason == reason


@pytest.mark.parametrize("closure", [BROKEN, Closure(1006), Closure(1011), Closure(1012)])
def test_what_broke_is_tried_again_unless_that_is_not_wanted(closure: Closure) -> None:
    core = opened()
    core.lost(closure)
    assert core.next_try() == 0.0 and core.over is None
    core = opened(reconnect=False)
    core.lost(closure)
    assert core.next_try() is None and isinstance(core.over, ConnectionLost)


@pytest.mark.parametrize(
    "message",
    [
        "not json",
        "[]",
        '{"type": 1}',
        '{"type":"ready"}',
        '{"type":"applied","seq":1}',
        ready(session="s1", channels=2),
        b"\0\0\0",
    ],
)
def test_what_cannot_be_right_ends_the_stream(message: Message) -> None:
    core = opened()
    core.lost(BROKEN)
    core.hello()
    core.receive(message)
    assert isinstance(core.over, ProtocolError)


def test_messages_of_a_later_protocol_are_left_alone() -> None:
    core = opened()
    core.receive('{"type":"weather","sun":true}')
    assert core.over is None


def test_problems_on_the_way_are_kept_and_the_sound_goes_on() -> None:
    core = opened()
    core.change({"nonsense": 1})
    sent(core)
    core.receive(told("scene-refused", 422))
    core.receive(bytes(4 * 80))
    assert [problem.kind for problem in core.problems] == ["scene-refused"]
    assert core.over is None and core.waiting == 80


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
    assert core.next_try() == 0.0
    assert json.loads(core.hello())["scene"] == {}
    core.receive(ready(session="s2"))
    assert [json.loads(message) for message in sent(core)] == [{"type": "scene", "scene": {"scan": {"load": 0.1}}}]
    core.receive('{"type":"applied","seq":7,"frame":80}')
    core.receive(bytes(4 * 160))
    assert core.gaps == (100,) and core.heard == 260
    assert core.applied == (7, 180)
    core.lost(BROKEN)
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
    wire: Wire | None = Wire(service, None, chunks)
    wire.peer.receive(core.hello())
    for message in wire.messages():
        core.receive(message)
    wire.left = next(cuts, None)
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
