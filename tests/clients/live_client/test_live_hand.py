"""The hand of a live stream, without a connection: which update is sent, when, and what it has."""

from __future__ import annotations

from typing import Any

import pytest

from clients.live_client import wire_messages
from synth.errors import InvalidRequest
from tests.clients.live_client import fake_live
from tests.clients.live_client.protocol_cases import BROKEN, Clock, opened, protocol_of, ready, sent


def test_only_the_newest_unsent_update_is_sent() -> None:
    protocol = opened()
    for step in range(100):
        protocol.update_contact(0.001 * step, False, 0.1)
    (message,) = sent(protocol)
    assert fake_live.CONTACT.unpack(message)[3] == 99  # type: ignore[arg-type]


def test_an_update_that_replaces_another_keeps_the_load_and_the_direction_that_it_lacks() -> None:
    protocol = opened()
    protocol.update_place((0.1, 0.2), 0.5, 0.25)
    protocol.update_place((0.3, 0.4), None, None)
    assert sent(protocol) == [wire_messages.place(1, protocol.clock(), (0.3, 0.4), 0.5, 0.25).message()]
    protocol.update_place((0.5, 0.6), None, None)
    assert sent(protocol) == [wire_messages.place(2, protocol.clock(), (0.5, 0.6), None, None).message()]
    protocol.update_contact(0.1, False, 0.75)
    protocol.update_contact(0.2, False, None)
    assert sent(protocol) == [wire_messages.contact(4, protocol.clock(), 0.2, False, 0.75).message()]


def test_an_update_is_sent_with_the_credit_of_the_next_read() -> None:
    protocol = opened()
    protocol.update_contact(0.1, False, 0.1)
    protocol.want(80)
    assert sent(protocol) == [wire_messages.contact(0, protocol.clock(), 0.1, False, 0.1).message(80)]
    protocol.update_place((0.1, 0.2), 0.5, 0.25)
    protocol.want(100)
    assert sent(protocol) == [wire_messages.place(1, protocol.clock(), (0.1, 0.2), 0.5, 0.25).message(20)]


def test_a_change_is_sent_between_an_update_and_the_credit() -> None:
    protocol = opened()
    protocol.update_contact(0.1, False, 0.1)
    protocol.change({"scan": {"load": 0.5}})
    protocol.want(80)
    contact, change, more = sent(protocol)
    assert isinstance(contact, bytes) and len(contact) == fake_live.CONTACT.size
    assert change == '{"type":"scene","scene":{"scan":{"load":0.5}}}' and more == '{"type":"more","frames":80}'


def test_a_flood_of_updates_does_not_delay_the_credit() -> None:
    protocol = opened()
    protocol.update_contact(0.1, False, 0.1)
    protocol.want(80)
    credits = []
    for step in range(3):
        message = protocol.next_message()
        assert isinstance(message, bytes)
        credits.append(fake_live.unpacked(message)[1])
        protocol.update_contact(0.1 * step, False, 0.1)
    assert credits == [80, 0, 0]


@pytest.mark.parametrize(
    ("value", "load", "field"),
    [
        (float("nan"), 0.1, "/position"),
        (float("inf"), 0.1, "/position"),
        (10**400, 0.1, "/position"),
        (1001.0, 0.1, "/position"),
        ("1 mm", 0.1, "/position"),
        (0.0, float("nan"), "/load"),
        (0.0, 1e4, "/load"),
    ],
)
def test_an_invalid_update_is_refused_with_its_field(value: Any, load: Any, field: str) -> None:
    with pytest.raises(InvalidRequest) as refused:
        opened().update_contact(value, False, load)
    assert [fault.pointer for fault in refused.value.faults] == [field]


@pytest.mark.parametrize(
    ("x", "y", "direction", "load", "field"),
    [
        (float("nan"), 0.0, None, None, "/x"),
        (0.0, 1000.1, None, None, "/y"),
        (0.0, "1 mm", None, None, "/y"),
        (0.0, 0.0, 1000.1, None, "/direction"),
        (0.0, 0.0, float("inf"), None, "/direction"),
        (0.0, 0.0, 0.0, 1e4, "/load"),
    ],
)
def test_an_invalid_place_is_refused_with_its_field(x: Any, y: Any, direction: Any, load: Any, field: str) -> None:
    protocol = opened()
    with pytest.raises(InvalidRequest) as refused:
        protocol.update_place((x, y), direction, load)
    assert [fault.pointer for fault in refused.value.faults] == [field]
    assert sent(protocol) == []


def test_a_place_is_refused_where_the_service_speaks_version_1_only() -> None:
    protocol = protocol_of()
    protocol.hello()
    protocol.receive(ready(protocol="ridgewave.v1"))
    with pytest.raises(InvalidRequest, match=r"this service speaks ridgewave\.v1 only"):
        protocol.update_place((0.1, 0.2), None, None)
    assert sent(protocol) == []
    protocol.update_contact(-0.1, False, 0.5)
    assert len(sent(protocol)) == 1


def test_a_place_that_waits_is_not_sent_to_a_service_of_version_1() -> None:
    """It was made before the first `ready`, or while the connection was broken."""
    protocol = protocol_of()
    protocol.update_place((0.1, 0.2), None, None)
    protocol.hello()
    protocol.receive(ready(protocol="ridgewave.v1"))
    assert sent(protocol) == []
    protocol = opened()
    protocol.lost(BROKEN)
    protocol.update_place((0.1, 0.2), None, None)
    protocol.hello()
    protocol.receive(ready(protocol="ridgewave.v1"))
    assert sent(protocol) == []


def test_a_place_is_sent_again_after_a_break() -> None:
    protocol = opened()
    protocol.update_place((0.125, -0.25), None, None)
    first = sent(protocol)
    protocol.lost(BROKEN)
    protocol.hello()
    protocol.receive(ready())
    assert sent(protocol) == first and len(first) == 1


def test_whether_the_texture_is_over_an_area_is_told_by_ready_and_by_scene() -> None:
    protocol = protocol_of()
    protocol.hello()
    protocol.receive(ready(over_area=True))
    assert protocol.over_area
    protocol.receive('{"type":"scene","frame":80,"plan":{},"over_area":false}')
    assert not protocol.over_area
    protocol.receive('{"type":"scene","frame":160,"plan":{},"over_area":true}')
    assert protocol.over_area


def test_the_first_update_after_a_break_has_the_load_that_may_be_lost() -> None:
    clock = Clock()
    protocol = opened(clock)
    protocol.update_contact(0.1, False, 0.5)
    sent(protocol)
    protocol.lost(BROKEN)
    protocol.update_contact(0.2, False, None)
    protocol.hello()
    protocol.receive(ready())
    assert sent(protocol) == [wire_messages.contact(1, clock(), 0.2, False, 0.5).message()]
    protocol.lost(BROKEN)
    protocol.hello()
    clock.now += 1.0  # too old to be sent again
    protocol.receive(ready())
    assert sent(protocol) == []
    for seq, load in ((2, 0.5), (3, None)):
        protocol.update_contact(0.3, False, None)
        assert sent(protocol) == [wire_messages.contact(seq, clock(), 0.3, False, load).message()]
