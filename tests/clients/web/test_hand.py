"""Pointers, the hand that strokes by itself, and what motors are told."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from playwright.sync_api import Page

FOLLOW = """() => {
  const pad = document.querySelector("#pad");
  Object.assign(pad.style, {position: "absolute", left: "100px", top: "50px", width: "400px", height: "200px"});
  window.said = [];
  window.unfollow = house.followPointers(pad, {
    metresPerPixel: 1e-4,
    loadOf: (pressure) => (pressure === null ? 0.3 : 2 * pressure),
    onMove: (id, contact) => said.push([id, contact]),
    onLift: (id) => said.push([id, null]),
  });
}"""
DISPATCH = """(events) => {
  const pad = document.querySelector("#pad");
  for (const [type, init] of events) pad.dispatchEvent(new PointerEvent(type, {bubbles: true, ...init}));
  return said;
}"""


def pointer(kind: str, number: int, x: float, **more: Any) -> tuple[str, dict[str, Any]]:
    """Return a pointer event over the pad, at `x` pixels from its left edge."""
    return kind, {"pointerId": number, "pointerType": "touch", "clientX": 100 + x, "clientY": 60, "button": 0, **more}


def test_a_mouse_gives_positions_while_its_button_is_down(house: Page) -> None:
    house.evaluate(FOLLOW)
    house.mouse.move(120, 100)
    assert house.evaluate("() => said") == []
    house.mouse.down()
    house.mouse.move(300, 120, steps=5)
    house.mouse.move(700, 120)  # beyond the edge: the stroke goes on
    house.mouse.up()
    house.mouse.move(150, 100)
    house.wait_for_function("() => said.length > 0 && said.at(-1)[1] === null")
    *moves, last = house.evaluate("() => said")
    positions = [contact["position"] for _, contact in moves]
    assert positions[0] == pytest.approx(20e-4) and positions[-1] == pytest.approx(600e-4)
    assert positions == sorted(positions)
    times = [contact["time"] for _, contact in moves]
    assert times == sorted(set(times)), "each report once, in order"
    assert all(contact["load"] == 0.3 for _, contact in moves)
    assert last[1] is None
    assert abs(times[-1] - house.evaluate("() => performance.now() / 1e3")) < 60.0, "seconds, on the page's clock"


def test_several_pointers_are_told_apart_and_a_pen_has_its_pressure(house: Page) -> None:
    house.evaluate(FOLLOW)
    events = [
        pointer("pointerdown", 11, 10, pressure=0.5),
        pointer("pointerdown", 12, 200, pressure=0.25, pointerType="pen"),
    ]
    house.evaluate(DISPATCH, events)
    house.evaluate(DISPATCH, [pointer("pointermove", 12, 210, pressure=0.75, pointerType="pen")])
    said = house.evaluate(DISPATCH, [pointer("pointercancel", 11, 10), pointer("pointermove", 11, 50)])
    assert [number for number, _ in said] == [11, 12, 12, 11]
    assert [contact and round(contact["position"], 6) for _, contact in said] == [1e-3, 20e-3, 21e-3, None]
    assert [contact and contact["load"] for _, contact in said] == [0.3, 0.5, 1.5, None]


def test_who_ends_the_following_lifts_what_still_touches(house: Page) -> None:
    house.evaluate(FOLLOW)
    house.evaluate(DISPATCH, [pointer("pointerdown", 11, 10), pointer("pointerdown", 12, 20)])
    house.evaluate("() => unfollow()")
    said = house.evaluate(DISPATCH, [pointer("pointerdown", 13, 10)])
    assert [(number, contact is None) for number, contact in said] == [(11, False), (12, False), (11, True), (12, True)]


STROKE = """({length, speed, load, times}) => {
  const said = [];
  let time = 100;
  const stroker = new house.Stroker({length, speed, load, clock: () => time,
    onMove: (contact) => said.push(contact), onLift: () => said.push(null)});
  stroker.start();
  for (const since of times) {
    time = 100 + since;
    stroker.step();
  }
  stroker.speed = 2 * speed;
  time += 0.1;
  stroker.step();
  stroker.stop();
  stroker.stop();
  return said;
}"""


def test_the_stroker_goes_back_and_forth_at_its_speed(house: Page) -> None:
    times = [0.1, 0.2, 0.25, 0.4, 0.5, 0.7]
    said = house.evaluate(STROKE, {"length": 0.02, "speed": 0.08, "load": 0.4, "times": times})
    positions = [contact["position"] for contact in said[:-1]]
    assert positions == pytest.approx([0, 0.008, 0.016, 0.02, 0.008, 0, 0.016, 0.008])
    assert [contact["time"] for contact in said[:-1]] == pytest.approx([100, *(100 + time for time in [*times, 0.8])])
    assert {contact["load"] for contact in said[:-1]} == {0.4}
    assert said[-1] is None and said.count(None) == 1


ENVELOPE = """({rate, threshold, fullScale, amplitudes}) => {
  const envelope = new house.Envelope({rate, channels: 2, threshold, fullScale});
  const strengths = [];
  let frame = 0;
  for (const amplitude of amplitudes) {
    for (const frames of [7, rate / 50 - 7]) {
      strengths.push(...envelope.push(Float32Array.from({length: 2 * frames}, (_, place) => (
        place % 2 ? 1 : amplitude * Math.sin(2 * Math.PI * 300 * (frame + (place >> 1)) / rate)))));
      frame += frames;
    }
  }
  return strengths;
}"""


def test_the_envelope_is_the_amplitude_above_the_threshold(house: Page) -> None:
    asked = {"rate": 48000, "threshold": 0.5, "fullScale": 10.0, "amplitudes": [0.0, 1.0, 0.5, 0.04, 0.06, 4.0]}
    strengths = house.evaluate(ENVELOPE, asked)
    expected = [value for value in (0.0, 1.0, 0.5, 0.0, 0.06, 1.0) for _ in range(2)]  # two spans of 10 ms each
    assert strengths == pytest.approx(expected, abs=1e-6)


MOTORS = """async (strengths) => {
  const said = [];
  const effect = (kind, {duration, strongMagnitude}) => Promise.resolve(said.push([kind, strongMagnitude, duration]));
  const pads = [null, {id: "pad", vibrationActuator: {playEffect: effect}}, {id: "plain", vibrationActuator: null}];
  const pulse = (strength, duration) => {
    said.push(["pulse", strength, duration]);
    return Promise.reject(new Error("unplugged"));
  };
  const actuators = new house.Actuators({gamepads: () => pads});
  const alone = actuators.motors().map(({name, form}) => [name, form]);
  const left = {handedness: "left", gamepad: {id: "touch", hapticActuators: [{pulse}]}};
  actuators.follow({inputSources: [left, {handedness: "none"}]});
  const all = actuators.motors().map(({name, form, hand}) => [name, form, hand]);
  actuators.push(strengths, "right");
  const right = said.splice(0);
  actuators.push(strengths);
  await house.pause(20);
  return {alone, all, right, both: said};
}"""


def test_motors_get_the_strongest_of_each_period_and_nothing_for_silence(house: Page) -> None:
    strengths = [0.0] * 10 + [0.1, 0.7, 0.2, 0.0, 0.0] + [0.0] * 10
    report = house.evaluate(MOTORS, strengths)
    assert report["alone"] == [["pad", "dual-rumble"]]
    assert report["all"] == [["pad", "dual-rumble", ""], ["touch", "pulse", "left"]]
    assert report["right"] == [["dual-rumble", 0.7, 80], ["dual-rumble", 0, 80]]
    pulses = [["pulse", 0.7, 80], ["pulse", 0, 80]]
    assert report["both"] == [one for pair in zip(report["right"], pulses, strict=True) for one in pair]


def test_without_a_motor_nothing_is_pretended(house: Page) -> None:
    assert house.evaluate("() => new house.Actuators({gamepads: () => [null]}).motors()") == []
