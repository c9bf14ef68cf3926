"""The live protocol without a connection: messages to the byte, the hand, credit, ends."""

from __future__ import annotations

import json

import numpy as np
import pytest

from clients import ConnectionLost, ProtocolError, RefusedError, ServiceError, StreamEnded
from clients.live_client.reconnection import Closure
from clients.live_client.stream_request import StreamRequest
from clients.live_client.wire_messages import subprotocols
from synth.errors import InvalidRequest
from tests.clients.live_client import fake_live
from tests.clients.live_client.fake_live import RATE, Message, sound
from tests.clients.live_client.protocol_cases import BROKEN, Clock, opened, protocol_of, ready, sent, told

# What is said, to the byte


def test_a_position_is_28_bytes() -> None:
    protocol = opened()
    assert protocol.update_contact(0.0125, False, 0.5) == 0
    assert protocol.update_contact(-2.0, False, 0.25) == 1
    (message,) = sent(protocol)
    assert message == bytes.fromhex("01 00 0000 01000000 0000000000005940 00000000000000c0 0000803e")


def test_a_speed_without_load_sets_both_flags() -> None:
    protocol = opened()
    protocol.update_contact(0.5, True, None)
    (message,) = sent(protocol)
    assert message == bytes.fromhex("01 03 0000 00000000 0000000000005940 000000000000e03f 00000000")


def test_a_place_is_40_bytes() -> None:
    protocol = opened()
    protocol.update_place((0.125, -0.25), 1.5, 0.5)
    assert sent(protocol) == [
        bytes.fromhex("02 00 0000 00000000 0000000000005940 000000000000c03f 000000000000d0bf 0000c03f 0000003f")
    ]
    protocol.update_place((0.125, -0.25), None, None)
    assert sent(protocol) == [
        bytes.fromhex("02 06 0000 01000000 0000000000005940 000000000000c03f 000000000000d0bf 00000000 00000000")
    ]


def test_lifting_keeps_the_place_and_the_direction() -> None:
    protocol = opened()
    protocol.update_place((0.125, -0.25), 1.5, 0.5)
    protocol.lift()
    assert sent(protocol) == [
        bytes.fromhex("02 00 0000 01000000 0000000000005940 000000000000c03f 000000000000d0bf 0000c03f 00000000")
    ]


def test_lifting_keeps_the_position_and_removes_the_load() -> None:
    protocol = opened()
    protocol.update_contact(1.0, False, 0.5)
    protocol.lift()
    assert sent(protocol) == [bytes.fromhex("01 00 0000 01000000 0000000000005940 000000000000f03f 00000000")]


def test_lifting_before_any_move_is_a_finger_at_rest_without_load() -> None:
    protocol = opened()
    protocol.lift()
    assert sent(protocol) == [bytes.fromhex("01 01 0000 00000000 0000000000005940 0000000000000000 00000000")]


def test_the_text_messages_of_the_client() -> None:
    protocol = protocol_of(block=64, record=True, sample_format="s16le", pacing="pull")
    assert protocol.hello() == ('{"type":"hello","scene":{},"format":"s16le","pacing":"pull","block":64,"record":true}')
    protocol.receive(ready(frame=0))
    protocol.want(480)
    protocol.change({"scan": {"load": "0.2 N"}})
    assert sent(protocol) == [
        '{"type":"scene","scene":{"scan":{"load":"0.2 N"}}}',
        '{"type":"more","frames":480}',
    ]
    protocol.receive(bytes(2 * 80))
    protocol.lost(BROKEN)
    assert protocol.next_try() == 0.0
    assert protocol.hello() == '{"type":"hello","resume":{"session":"s1","frame":80}}'
    protocol.receive(ready(frame=80))
    protocol.stop()
    assert sent(protocol)[0] == '{"type":"stop"}'


def test_the_default_hello_has_only_the_required_fields() -> None:
    assert protocol_of().hello() == '{"type":"hello","scene":{},"format":"f32le","pacing":"pull"}'


def test_a_key_is_offered_in_base64url_without_padding() -> None:
    assert subprotocols(None) == ("ridgewave.v2", "ridgewave.v1")
    assert subprotocols("k?>~") == ("ridgewave.v2", "ridgewave.v1", "ridgewave.key.az8-fg")


def test_a_scene_that_is_not_json_is_refused_before_anything_is_sent() -> None:
    with pytest.raises(InvalidRequest):
        StreamRequest({"scan": {"load": float("nan")}})
    with pytest.raises(InvalidRequest):
        opened().change({"scan": {"load": object()}})


# Credit


def test_credit_is_exactly_what_the_read_lacks() -> None:
    protocol = opened()
    protocol.want(100)
    assert sent(protocol) == ['{"type":"more","frames":100}']
    protocol.want(150)
    assert sent(protocol) == ['{"type":"more","frames":50}']
    protocol.receive(bytes(4 * 150))
    assert protocol.take(100).shape == (100, 1)
    protocol.want(60)
    assert sent(protocol) == ['{"type":"more","frames":10}']


def test_frames_ahead_are_granted_before_they_are_read() -> None:
    protocol = opened(ahead=40)
    protocol.want(0)
    assert sent(protocol) == ['{"type":"more","frames":40}']


def test_a_long_read_is_granted_in_bounded_parts() -> None:
    protocol = opened()
    protocol.want(100 * RATE)
    outstanding = 0
    grants = 0
    while not protocol.may_take(100 * RATE):
        for message in sent(protocol):
            outstanding += json.loads(message)["frames"]
            grants += 1
        assert 0 < outstanding <= 10 * RATE
        protocol.receive(bytes(4 * 800))
        outstanding -= 800
    assert grants < 30


def test_realtime_grants_no_credit_and_stops_receiving_if_nobody_reads() -> None:
    protocol = opened(pacing="realtime")
    protocol.want(480)
    assert sent(protocol) == []
    protocol.receive(bytes(4 * (RATE - 1)))
    assert not protocol.congested
    protocol.receive(bytes(4))
    assert protocol.congested
    protocol.take(480)
    assert not protocol.congested


# Underruns


def test_a_late_read_is_an_underrun() -> None:
    clock = Clock()
    protocol = opened(clock)
    protocol.receive(bytes(4 * 800))
    for _ in range(4):
        protocol.take(80)
        clock.now += 0.010
    assert protocol.underrun_counter.underruns == 0
    clock.now += 0.005
    protocol.take(80)
    assert protocol.underrun_counter.underruns == 1
    clock.now += 0.010
    protocol.take(80)
    assert protocol.underrun_counter.underruns == 1


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
    protocol = protocol_of()
    assert protocol.next_try() == 0.0
    protocol.lost(closure)
    assert protocol.next_try() is None
    assert type(protocol.over) is error


def test_a_refused_scene_names_its_faults() -> None:
    fault = {"pointer": "/scan/load", "value": "'-1 N'", "allowed": "0 N to 1000 N", "hint": "Write a load."}
    protocol = protocol_of()
    protocol.hello()
    protocol.receive(fake_live.problem("scene-refused", 422, "", [fault]))
    protocol.receive('{"type":"end","reason":"policy","frame":0}')
    protocol.lost(Closure(1008, "policy"))
    assert isinstance(protocol.over, RefusedError)
    assert protocol.over.problem.kind == "scene-refused"
    assert "scan.load: got '-1 N'; allowed: 0 N to 1000 N" in str(protocol.over)


def test_the_end_is_raised_after_all_sound_and_holds_the_rest() -> None:
    protocol = opened()
    protocol.receive(sound(0, 100, 1).tobytes())
    protocol.receive('{"type":"end","reason":"finished","frame":100}')
    protocol.lost(Closure(1000))
    assert np.array_equal(protocol.take(60), sound(0, 60, 1))
    with pytest.raises(StreamEnded) as ended:
        protocol.take(60)
    assert (ended.value.reason, ended.value.frame) == ("finished", 100)
    assert np.array_equal(ended.value.rest, sound(60, 40, 1))
    with pytest.raises(StreamEnded) as again:
        protocol.take(1)
    assert again.value.rest.shape == (0, 1)


@pytest.mark.parametrize(("code", "reason"), [(4408, "slow reader"), (1008, "policy"), (1001, "shutting down")])
def test_a_closed_connection_is_not_tried_again(code: int, reason: str) -> None:
    protocol = opened()
    protocol.lost(Closure(code))
    assert protocol.next_try() is None
    assert isinstance(protocol.over, StreamEnded) and protocol.over.reason == reason


@pytest.mark.parametrize("closure", [BROKEN, Closure(1006), Closure(1011), Closure(1012)])
def test_a_broken_connection_is_tried_again_unless_reconnect_is_false(closure: Closure) -> None:
    protocol = opened()
    protocol.lost(closure)
    assert protocol.next_try() == 0.0 and protocol.over is None
    protocol = opened(reconnect=False)
    protocol.lost(closure)
    assert protocol.next_try() is None and isinstance(protocol.over, ConnectionLost)


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
def test_an_invalid_message_ends_the_stream(message: Message) -> None:
    protocol = opened()
    protocol.lost(BROKEN)
    protocol.hello()
    protocol.receive(message)
    assert isinstance(protocol.over, ProtocolError)


def test_unknown_messages_are_ignored() -> None:
    protocol = opened()
    protocol.receive('{"type":"weather","sun":true}')
    assert protocol.over is None


def test_problems_during_the_stream_are_kept_and_the_sound_continues() -> None:
    protocol = opened()
    protocol.change({"nonsense": 1})
    sent(protocol)
    protocol.receive(told("scene-refused", 422))
    protocol.receive(bytes(4 * 80))
    assert [problem.kind for problem in protocol.problems] == ["scene-refused"]
    assert protocol.over is None and protocol.waiting == 80


def test_skipped_time_adds_up() -> None:
    protocol = opened(pacing="realtime")
    for seconds in (2.5, 1.25):
        protocol.receive(json.dumps({"type": "skipped", "frame": 480, "seconds": seconds}))
    assert protocol.skipped == 3.75 and protocol.over is None
