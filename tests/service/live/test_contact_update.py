"""Contacts at a place of a texture over an area: version 2 of the protocol, in JSON and in binary.

Model: a finger at (x, y) has the surface moved by (-x, -y) under it (eq. 2: h2(x - p)).
"""

from __future__ import annotations

import math
import struct
from typing import Any

import numpy as np
import pytest

from service.live.messages import V1, V2
from synth.motion.motion import Update
from tests.service.live.driver import Driver, contact, place, problem_of, started

DOTS = {"texture": {"kind": "dots"}}
LINE = {"texture": {"kind": "sinusoid"}}
AT = {"seq": 1, "time": 0}


def over_area() -> Driver:
    """Return a connection of version 2 whose texture is over an area."""
    return started(version=V2, scene=DOTS)


def updates(driver: Driver) -> list[Update]:
    """Return what the hand has applied."""
    driver.run(0.02)
    return [update for _, update in driver.hand.applied.updates]


def refused(driver: Driver) -> dict[str, Any]:
    """Return the only fault of the only problem. Nothing was applied, and the stream goes on."""
    (found,) = driver.texts("problem")
    (fault,) = found["errors"]
    assert found["problem"] == "/docs#problem-message-refused" and updates(driver) == []
    assert driver.closed is None and isinstance(fault, dict)
    return fault


def test_the_binary_form_is_the_bytes_of_the_page() -> None:
    driver = over_area()
    driver.binary(bytes.fromhex(
        "02 00 00 00 07 00 00 00"  # version, flags, contact, seq
        "00 00 00 00 00 00 29 40"  # 12.5 s
        "00 00 00 00 00 00 c0 3f"  # x = 0.125 m
        "00 00 00 00 00 00 d0 bf"  # y = -0.25 m
        "00 00 c0 3f 00 00 00 3f"  # 1.5 rad, 0.5 N
    ))  # fmt: skip
    assert updates(driver) == [Update(7, 12.5, -0.125, None, 0.5, 0.25, 1.5)]


def test_json_and_binary_places_are_the_same_update() -> None:
    driver = over_area()
    cases: list[dict[str, float]] = [{}, {"load": 0.5}, {"direction": -0.75}, {"load": 0.5, "direction": 0.0}]
    for seq, rest in enumerate(cases):
        driver.say("contact", seq=2 * seq, time=3, x=-0.5, y=0.25, **rest)
        first = updates(driver)[-1]
        driver.binary(place(2 * seq + 1, -0.5, 0.25, time=3.0, load=rest.get("load"), direction=rest.get("direction")))
        second = updates(driver)[-1]
        assert first == Update(2 * seq, 3.0, 0.5, None, rest.get("load"), -0.25, rest.get("direction"))
        assert second == first._replace(seq=2 * seq + 1)
        assert all(isinstance(value, float) for value in first[1:] if value is not None)


def test_a_place_of_zero_is_a_position_of_zero_without_a_sign() -> None:
    driver = over_area()
    driver.binary(place(1, 0.0, 0.0))
    (update,) = updates(driver)
    assert update.position is not None and update.across is not None
    assert math.copysign(1.0, update.position) == math.copysign(1.0, update.across) == 1.0


def test_positions_and_speeds_are_the_same_in_both_versions() -> None:
    found = []
    for version in (V1, V2):
        driver = started(version=version)
        driver.binary(contact(1, position=0.25, load=0.5))
        driver.run(0.02)
        driver.say("contact", seq=2, time=1, speed=-0.125)
        driver.run(0.02)
        driver.binary(contact(3, speed=0.5, load=None))
        found.append(updates(driver))
        assert driver.texts("problem") == []
    assert found[0] == found[1] and len(found[0]) == 3
    assert all(update.across is None and update.direction is None for update in found[0])


@pytest.mark.parametrize(
    ("fields", "value"),
    [
        ({}, "no position, speed, x or y"),
        ({"x": 0.1}, "x"),
        ({"y": 0.1}, "y"),
        ({"direction": 0.1}, "direction"),
        ({"x": 0.1, "y": 0.1, "position": 0.1}, "position and x and y"),
        ({"x": 0.1, "y": 0.1, "speed": 0.1}, "speed and x and y"),
        ({"position": 0.1, "speed": 0.1}, "position and speed"),
        ({"position": 0.1, "direction": 0.1}, "position and direction"),
        ({"speed": 0.1, "direction": 0.0}, "speed and direction"),
        ({"x": 0.1, "direction": 0.1}, "x and direction"),
        ({"speed": 0.1, "y": 0.1}, "speed and y"),
    ],
)
def test_a_contact_says_in_one_way_where_the_finger_is(fields: dict[str, float], value: str) -> None:
    driver = over_area()
    driver.say("contact", **AT, **fields)
    fault = refused(driver)
    assert (fault["pointer"], fault["value"]) == ("", value)
    assert fault["allowed"] == "position, or speed, or x and y; direction only with x and y"


@pytest.mark.parametrize(
    ("fields", "pointer", "allowed"),
    [
        ({"x": 1000.1, "y": 0}, "/x", "-1000 to 1000 m"),
        ({"x": 0, "y": -1e9}, "/y", "-1000 to 1000 m"),
        ({"x": 0, "y": float("nan")}, "/y", ""),
        ({"x": 0, "y": 0, "direction": 1000.1}, "/direction", "-1000 to 1000 rad"),
        ({"x": 0, "y": 0, "direction": "90 deg"}, "/direction", "-1000 to 1000 rad"),
        ({"x": 0, "y": 0, "load": -0.1}, "/load", "0 to 1000 N"),
        ({"x": 0, "y": 0, "z": 0}, "/z", "type, seq, time, position, speed, load, more, x, y, direction"),
    ],
)
def test_a_place_out_of_range_is_told_by_field(fields: dict[str, Any], pointer: str, allowed: str) -> None:
    driver = over_area()
    driver.say("contact", **AT, **fields)
    fault = refused(driver)
    assert fault["pointer"] == pointer and allowed in fault["allowed"] and fault["hint"]


@pytest.mark.parametrize(
    ("change", "pointer"),
    [
        ((0, 1, b"\x01"), "/version"),
        ((0, 1, b"\x03"), "/version"),
        ((1, 2, b"\x01"), "/flags"),
        ((1, 2, b"\x08"), "/flags"),
        ((2, 4, b"\x01\x00"), "/contact"),
        ((8, 16, struct.pack("<d", math.nan)), "/time"),
        ((16, 24, struct.pack("<d", -1000.1)), "/x"),
        ((24, 32, struct.pack("<d", math.inf)), "/y"),
        ((32, 36, struct.pack("<f", 1000.1)), "/direction"),
        ((32, 36, struct.pack("<f", math.nan)), "/direction"),
        ((36, 40, struct.pack("<f", -0.1)), "/load"),
        ((36, 40, struct.pack("<f", math.nan)), "/load"),
        ((39, 40, b""), ""),
        ((40, 40, b"\x00"), ""),
    ],
)
def test_a_binary_place_that_is_wrong_is_told_by_field(change: tuple[int, int, bytes], pointer: str) -> None:
    driver = over_area()
    data, (begin, end, written) = bytearray(place(1, 0.1, 0.2, direction=0.5)), change
    data[begin:end] = written
    driver.binary(bytes(data))
    fault = refused(driver)
    assert fault["pointer"] == pointer and fault["allowed"] and fault["hint"]


@pytest.mark.parametrize("time", [math.nan, math.inf, -math.inf])
def test_a_binary_position_at_no_time_is_refused(time: float) -> None:
    driver = over_area()
    driver.binary(struct.pack("<BBHIddf", 1, 0, 0, 1, time, 0.1, 0.5))
    assert refused(driver)["pointer"] == "/time"


def test_a_place_without_load_and_direction_is_not_looked_at_there() -> None:
    driver = over_area()
    data = bytearray(place(1, 0.0, 0.0, load=None))
    data[32:40] = struct.pack("<ff", math.nan, math.nan)
    driver.binary(bytes(data))
    assert updates(driver) == [Update(1, 0.0, 0.0, None, None, 0.0, None)]


def test_the_range_of_a_place_includes_its_ends() -> None:
    driver = over_area()
    driver.binary(place(1, 1e3, -1e3, direction=-1e3))
    assert updates(driver) == [Update(1, 0.0, -1e3, None, float(np.float32(0.3)), 1e3, -1e3)]
    driver.say("contact", seq=2, time=0, x=-1000, y=1000, direction=1000)
    assert updates(driver)[1:] == [Update(2, 0.0, 1e3, None, None, -1e3, 1e3)]


def test_version_1_refuses_a_place_and_says_which_version_has_it() -> None:
    driver = started(scene=DOTS)
    driver.say("contact", **AT, x=0.1, y=0.2)
    fault = refused(driver)
    assert (fault["pointer"], fault["value"]) == ("/x", "x and y") and "ridgewave.v2" in fault["hint"]
    driver = started(scene=DOTS)
    driver.say("contact", **AT, position=0.1, direction=0.2)
    assert "ridgewave.v2" in refused(driver)["hint"]
    driver = started(scene=DOTS)
    driver.binary(place(1, 0.1, 0.2))
    fault = refused(driver)
    assert (fault["value"], fault["allowed"]) == ("40 bytes", "28 bytes, and 4 more with credit")
    assert "ridgewave.v2" in fault["hint"]


# The texture decides


def test_on_a_line_y_is_taken_and_an_effect_along_x_keeps_the_finger_from_turning() -> None:
    driver = started(version=V2, scene=LINE | {"effects": {"inertia": {}}})
    driver.say("contact", seq=1, time=0, x=0.5, y=0.25)
    driver.run(0.02)
    driver.binary(place(2, 0.5, 0.25, direction=0.0, load=None))
    assert [update[2:] for update in updates(driver)] == [(-0.5, None, None, -0.25, None), (-0.5, None, None, -0.25, 0)]
    for seq, send in enumerate(("json", "binary"), 3):
        if send == "json":
            driver.say("contact", seq=seq, time=0, x=0, y=0, direction=0.5)
        else:
            driver.binary(place(seq, 0.0, 0.0, direction=0.5))
        (fault,) = problem_of(driver)["errors"]
        assert (fault["pointer"], fault["value"], fault["allowed"]) == ("/direction", "0.5 rad", "0 rad")
        assert "simulated along x" in fault["hint"]
    assert len(updates(driver)) == 2 and len(driver.texts("problem")) == 2


def test_a_finger_that_turns_on_a_line_changes_the_scene_once() -> None:
    driver = started(version=V2, scene=LINE | {"scan": {"stroke": {"load": 0.4}}})
    assert driver.texts("ready")[0]["over_area"] is False
    driver.binary(place(1, 0.0, 0.0, direction=0.0))
    driver.binary(place(2, 0.0, 0.0, direction=2.0 * math.pi))
    assert [update.seq for update in updates(driver)] == [2] and driver.texts("scene") == []
    for seq in range(3, 6):
        driver.binary(place(seq, 0.0, 0.0, direction=1.0))
    assert [update.seq for update in updates(driver)] == [2, 5] and driver.texts("problem") == []
    (told,) = driver.texts("scene")
    assert told["over_area"] is True
    (_frame, scene), *rest = driver.hand.applied.scenes
    assert (scene.scan.direction, scene.scan.stroke, scene.scan.load, rest) == (1.0, None, 0.4, [])
    driver.say("contact", seq=6, time=0, x=0, y=0, direction=2.0)
    driver.run(0.2)
    driver.say("scene", scene={"scan": {"direction": 0.0}})
    driver.run(0.2)
    driver.say("contact", seq=7, time=0, x=0, y=0, direction=2.0)
    driver.run(0.2)
    assert [message["over_area"] for message in driver.texts("scene")] == [True, False, True]
    assert driver.hand.applied.scenes[-1][1].scan.direction == 2.0


@pytest.mark.parametrize("texture", [LINE, DOTS])
def test_the_direction_of_a_probe_is_taken_and_changes_no_scene(texture: dict[str, Any]) -> None:
    driver = started(version=V2, scene=texture | {"finger": {"kind": "probe"}})
    driver.binary(place(1, 0.0, 0.0, direction=1.0))
    assert [update.direction for update in updates(driver)] == [1.0]
    assert driver.texts("problem") == driver.texts("scene") == []


def test_places_on_another_texture_wait_for_its_message_scene() -> None:
    driver = started(version=V2, scene=LINE)
    driver.say("scene", scene=DOTS)
    driver.run(0.02)
    assert driver.texts("scene")[0]["over_area"] is True
    driver.say("scene", scene=LINE)
    driver.run(0.2)
    assert driver.texts("scene")[1]["over_area"] is False


def test_a_client_of_version_1_is_told_nothing_of_areas() -> None:
    driver = started(version=V1, scene=DOTS)
    driver.say("scene", scene=LINE)
    driver.run(0.1)
    assert not any("over_area" in message for message in (*driver.texts("ready"), *driver.texts("scene")))


# What a session does with it


def test_the_newest_contact_counts_in_whatever_form_it_came() -> None:
    driver = over_area()
    driver.run(0.015)
    driver.binary(place(3, 0.1, 0.1))
    driver.binary(contact(5, position=0.75))
    driver.say("contact", seq=4, time=0, x=0.2, y=0.2)
    driver.binary(place(5, 0.3, 0.3))
    assert [(update.seq, update.position, update.across) for update in updates(driver)] == [(5, 0.75, None)]
    assert [message["seq"] for message in driver.texts("applied")] == [5]


def test_a_place_keeps_the_finger_down_and_a_refused_one_does_not() -> None:
    driver = over_area()
    for seq in range(100):
        driver.binary(place(seq, 1e-3 * seq, 0.0))
        driver.run(0.01)
    assert driver.hand.applied.lifted == []
    for seq in range(100, 200):
        driver.binary(place(seq, 2e3, 0.0))
        driver.run(0.01)
    assert len(driver.hand.applied.lifted) == 1


def test_a_session_is_resumed_in_the_version_of_the_new_connection() -> None:
    earlier = started(scene=DOTS)
    assert earlier.texts("ready")[0]["protocol"] == "ridgewave.v1"
    earlier.run(0.1)
    earlier.machine.lost()
    earlier.perform()
    driver = Driver(streams=earlier.streams, now=earlier.now, version=V2)
    driver.say("hello", resume={"session": "s0", "frame": len(earlier.pcm())})
    assert driver.texts("ready")[0]["protocol"] == "ridgewave.v2" and driver.texts("ready")[0]["over_area"] is True
    driver.binary(place(1, 0.5, 0.5))
    driver.run(0.05)
    assert [message["seq"] for message in driver.texts("applied")] == [1] and driver.texts("problem") == []


def test_an_effect_that_is_simulated_along_a_line_keeps_the_finger_on_it() -> None:
    driver = started(
        version=V2, scene={"texture": {"kind": "dots"}, "finger": {"kind": "fingertip"}, "effects": {"inertia": {}}}
    )
    driver.say("contact", **AT, x=0.01, y=0.001)
    fault = refused(driver)
    assert (fault["pointer"], fault["allowed"]) == ("/y", "0 m")
    assert "simulated along the line y = 0" in fault["hint"]
