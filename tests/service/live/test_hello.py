"""The begin of a connection, and refused messages: the problem names the field, and the stream continues."""

from __future__ import annotations

import numpy as np
import pytest

from service.live.contact_update import Hand
from synth.scene.scene import parse_scene
from tests.service.live.driver import Driver, contact, problem_of, started
from tests.service.plain_hand import Applied, expected

SCENE = parse_scene({})


def test_hello_without_anything_is_the_default_scene_at_the_clients_pace() -> None:
    driver = Driver()
    ready = driver.hello()
    assert ready == {
        "type": "ready",
        "session": "s0",
        "resume_url": "/v1/live?session=s0",
        "protocol": "ridgewave.v1",
        "sample_rate": 48000,
        "channels": 1,
        "quantities": ["acceleration"],
        "full_scale": [12.5],
        "format": "f32le",
        "block": 480,
        "pacing": "pull",
        "recording": False,
        "frame": 0,
        "max_silence_ms": 250.0,
        "motion_delay_ms": 2.0,
        "plan": driver.hand.plan_document,
    }
    driver.run(10.0)
    assert driver.blocks() == []


@pytest.mark.parametrize(("rate", "block"), [(48000, 480), (1000, 16), (192000, 1920), (44100, 441)])
def test_a_block_is_10_ms_unless_it_is_asked_for(rate: int, block: int) -> None:
    assert started(scene={"output": {"sample_rate": rate}}).stream.block == block
    assert started(scene={"output": {"sample_rate": rate}}, block=77).stream.block == 77


def test_a_connection_without_hello_is_closed_after_ten_seconds_and_not_before() -> None:
    driver = Driver()
    driver.now += 10.0
    driver.machine.check(driver.now)
    driver.perform()
    assert driver.sent == [] and driver.closed is None
    driver.now += 0.01
    driver.machine.check(driver.now)
    driver.perform()
    assert driver.order() == ["problem", "end"]
    assert driver.closed is not None and driver.closed.code == 1008


@pytest.mark.parametrize("first", ['{"type":"stop"}', '{"type":"more","frames":1}', '{"type":"hello","x":1}', "[]"])
def test_anything_but_hello_first_closes_with_1008(first: str) -> None:
    driver = Driver()
    driver.text(first)
    assert driver.order() == ["problem", "end"] and driver.texts("end")[0] == {
        "type": "end",
        "reason": "policy",
        "frame": 0,
    }
    assert driver.closed is not None and driver.closed.code == 1008
    assert driver.plain.opened == []


def test_a_binary_message_first_closes_with_1008() -> None:
    driver = Driver()
    driver.binary(contact(1))
    assert driver.closed is not None and driver.closed.code == 1008


def test_hello_again_ends_the_stream_with_a_fade() -> None:
    driver = started()
    driver.run(0.1)
    driver.say("hello")
    driver.write()
    assert driver.closed is not None and driver.closed.code == 1008
    assert driver.pcm()[-1] == 0.0 and driver.order()[-2:] == ["pcm", "end"]


def test_a_refused_scene_in_hello_tells_every_fault_and_closes() -> None:
    driver = Driver()
    driver.say("hello", scene={"scan": {"load": -1, "speed": 99}})
    found = problem_of(driver)
    assert found["problem"] == "/docs#problem-scene-refused" and found["status"] == 422
    errors = found["errors"]
    assert isinstance(errors, list)
    assert {error["pointer"] for error in errors} == {"/scan/load", "/scan/speed"}
    assert driver.closed is not None and driver.closed.code == 1008


def test_what_comes_while_the_voice_is_opened_is_done_in_order_afterwards() -> None:
    driver = Driver()
    driver.holding = True
    driver.say("hello")
    driver.binary(contact(1, load=0.7))
    driver.say("more", frames=1000)
    driver.say("stop")
    assert driver.sent == []
    driver.release()
    assert driver.order() == ["ready", "end"]
    assert driver.closed is not None and driver.closed.code == 1000


def test_of_many_changes_before_the_voice_is_open_the_last_is_kept_and_no_credit_is_lost() -> None:
    driver = Driver()
    driver.holding = True
    driver.say("hello")
    driver.say("more", frames=480)
    for number in range(500):
        driver.say("scene", scene={"scan": {"speed": 0.05 + 1e-4 * number}})
    driver.release()
    driver.write()
    assert driver.hand.applied.scenes[-1][1].scan.speed == pytest.approx(0.05 + 1e-4 * 499)
    assert len(driver.pcm()) == 480


def test_text_that_is_not_json_closes_with_1007_after_a_fade() -> None:
    driver = started()
    driver.run(0.1)
    driver.text("{nonsense")
    driver.write()
    assert driver.closed is not None and driver.closed.code == 1007
    assert driver.order()[-2:] == ["pcm", "end"] and driver.pcm()[-1] == 0.0


def test_json_of_very_many_levels_is_refused_as_such_and_the_stream_goes_on() -> None:
    driver = started()
    driver.run(0.1)
    driver.text('{"type": "scene", "scene": ' + '{"a": ' * 2000 + "1" + "}" * 2001)
    driver.run(0.2)
    (found,) = driver.texts("problem")
    assert "nested too deeply" in found["detail"] and driver.closed is None


RANGE = "Write a number in this range."


@pytest.mark.parametrize(
    ("text", "allowed", "hint"),
    [
        ('{"type":"contact","seq":-1,"time":0,"speed":0}', "whole, 0 to 4294967295", RANGE),
        ('{"type":"contact","seq":1,"time":0,"speed":"9 mm/s"}', "-10 to 10 m/s", "Write a number without a unit."),
        (
            '{"type":"contact","seq":1,"time":0,"speed":0,"load":1e9}',
            "0 to 1000 N; below 0 N only with adhesion",
            "Write a number in this range.",
        ),
        ('{"type":"more","frames":1e9}', "whole, 1 to 10000000 frames", RANGE),
        ('{"type":"more"}', "whole, 1 to 10000000 frames", "Add frames."),
        ('{"type":"scene","scene":[]}', "an object", "Write an object."),
        ('{"type":"stop","now":1}', "type", "Leave it out."),
    ],
)
def test_a_fault_of_a_message_has_the_range_with_its_unit_and_what_to_write(text: str, allowed: str, hint: str) -> None:
    driver = started()
    driver.text(text)
    (found,) = driver.texts("problem")
    (fault,) = found["errors"]
    assert (fault["allowed"], fault["hint"]) == (allowed, hint)


@pytest.mark.parametrize(
    ("text", "pointer"),
    [
        ('{"type":"contact","seq":1,"time":0}', ""),
        ('{"type":"contact","seq":1,"time":0,"position":0,"speed":0}', ""),
        ('{"type":"contact","seq":-1,"time":0,"position":0}', "/seq"),
        ('{"type":"contact","seq":4294967296,"time":0,"position":0}', "/seq"),
        ('{"type":"contact","seq":1,"time":NaN,"position":0}', "/time"),
        ('{"type":"contact","seq":1,"time":0,"position":1e999}', "/position"),
        ('{"type":"contact","seq":1,"time":0,"position":"1 mm"}', "/position"),
        ('{"type":"contact","seq":1,"time":0,"speed":10.1}', "/speed"),
        ('{"type":"contact","seq":1,"time":0,"speed":1,"load":-0.1}', "/load"),
        ('{"type":"contact","seq":1,"time":0,"speed":1,"load":1001}', "/load"),
        ('{"type":"contact","seq":1,"time":0,"speed":1,"finger":2}', "/finger"),
        ('{"type":"contact","seq":1,"seq":2,"time":0,"speed":1}', "/seq"),
        ('{"type":"more","frames":0}', "/frames"),
        ('{"type":"more","frames":1.5}', "/frames"),
        ('{"type":"more"}', "/frames"),
        ('{"type":"scene","scene":[]}', "/scene"),
        ('{"type":"dance"}', "/type"),
        ('{"type":["stop"]}', "/type"),
        ('{"frames":1}', "/type"),
        ("null", ""),
        ('{"type":"\\ud800"}', "/type"),
        ('{"type":"stop","\\ud800":1}', ""),
    ],
)
def test_a_message_that_does_not_fit_is_told_and_the_stream_goes_on(text: str, pointer: str) -> None:
    driver = started()
    driver.run(0.1)
    driver.text(text)
    (found,) = driver.texts("problem")
    assert found["problem"] == "/docs#problem-message-refused" and found["status"] == 422
    assert found["errors"][0]["pointer"] == pointer, found
    assert found["errors"][0]["allowed"] and found["errors"][0]["hint"] and found["errors"][0]["value"]
    before = len(driver.blocks())
    driver.run(1.0)
    assert len(driver.blocks()) >= before + 99 and driver.closed is None
    np.testing.assert_array_equal(driver.pcm(), expected(SCENE, Applied(), len(driver.pcm())))


@pytest.mark.parametrize(
    ("change", "pointer"),
    [
        ((0, 1, b"\x02"), "/version"),
        ((1, 2, b"\x04"), "/flags"),
        ((2, 4, b"\x01\x00"), "/contact"),
        ((8, 16, b"\x00\x00\x00\x00\x00\x00\xf8\x7f"), "/time"),
        ((16, 24, b"\x00\x00\x00\x00\x00\x00\xf0\x7f"), "/position"),
        ((24, 28, b"\x00\x00\xc0\x7f"), "/load"),
        ((24, 28, b"\x00\x00\x80\xbf"), "/load"),
        ((27, 28, b""), ""),
        ((0, 28, b""), ""),
        ((28, 28, b"\x00"), ""),
    ],
)
def test_a_binary_contact_that_is_wrong_is_told_by_field(change: tuple[int, int, bytes], pointer: str) -> None:
    driver = started()
    data, (begin, end, written) = bytearray(contact(1)), change
    data[begin:end] = written
    driver.binary(bytes(data))
    (found,) = driver.texts("problem")
    assert found["errors"][0]["pointer"] == pointer and driver.closed is None
    driver.run(0.1)
    assert driver.hand.applied.updates == []


def test_no_load_in_a_binary_contact_is_not_looked_at() -> None:
    driver = started()
    data = bytearray(contact(1, load=None))
    data[24:28] = b"\x00\x00\xc0\x7f"
    driver.binary(bytes(data))
    driver.run(0.02)
    assert driver.texts("problem") == [] and driver.hand.applied.updates[0][1].load is None


def test_with_adhesion_a_load_may_pull_as_far_as_the_scene_allows() -> None:
    driver = started()
    driver.stream.hand = Hand(-0.5, over_area=False, simulated=False)
    driver.binary(contact(1, load=-0.5))
    driver.say("contact", seq=2, time=0, speed=0.1, load=-0.25)
    assert driver.texts("problem") == []
    driver.binary(contact(3, load=-0.51))
    assert problem_of(driver)["errors"][0]["allowed"] == "-0.5 to 1000 N"
