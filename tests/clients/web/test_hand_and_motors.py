"""Pointers, the automatic stroke, and the strengths that motors play."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import pytest

from synth.perception.threshold import threshold_displacement
from synth.scene.scene import parse_scene
from synth.voice.voice import open_voice

if TYPE_CHECKING:
    from playwright.sync_api import Page

FOLLOW = """() => {
  const pad = document.querySelector("#pad");
  Object.assign(pad.style, {position: "absolute", left: "100px", top: "50px", width: "400px", height: "200px"});
  window.said = [];
  window.unfollow = modules.followPointers(pad, {
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


def test_a_mouse_gives_positions_while_its_button_is_down(modules: Page) -> None:
    modules.evaluate(FOLLOW)
    modules.mouse.move(120, 100)
    assert modules.evaluate("() => said") == []
    modules.mouse.down()
    modules.mouse.move(300, 120, steps=5)
    modules.mouse.move(700, 120)  # beyond the edge: the stroke goes on
    modules.mouse.up()
    modules.mouse.move(150, 100)
    modules.wait_for_function("() => said.length > 0 && said.at(-1)[1] === null")
    *moves, last = modules.evaluate("() => said")
    heights = [contact["y"] for _, contact in moves]
    assert heights[0] == pytest.approx(50e-4) and heights[-1] == pytest.approx(30e-4), "upwards from the middle"
    positions = [contact["position"] for _, contact in moves]
    assert positions[0] == pytest.approx(20e-4) and positions[-1] == pytest.approx(600e-4)
    assert positions == sorted(positions)
    times = [contact["time"] for _, contact in moves]
    assert times == sorted(set(times)), "each report once, in order"
    assert all(contact["load"] == 0.3 for _, contact in moves)
    assert last[1] is None
    assert abs(times[-1] - modules.evaluate("() => performance.now() / 1e3")) < 60.0, "seconds, on the page's clock"


def test_several_pointers_are_told_apart_and_a_pen_has_its_pressure(modules: Page) -> None:
    modules.evaluate(FOLLOW)
    events = [
        pointer("pointerdown", 11, 10, pressure=0.5),
        pointer("pointerdown", 12, 200, pressure=0.25, pointerType="pen"),
    ]
    modules.evaluate(DISPATCH, events)
    modules.evaluate(DISPATCH, [pointer("pointermove", 12, 210, pressure=0.75, pointerType="pen")])
    said = modules.evaluate(DISPATCH, [pointer("pointercancel", 11, 10), pointer("pointermove", 11, 50)])
    assert [number for number, _ in said] == [11, 12, 12, 11]
    assert [contact and round(contact["position"], 6) for _, contact in said] == [1e-3, 20e-3, 21e-3, None]
    assert [contact and contact["load"] for _, contact in said] == [0.3, 0.5, 1.5, None]


def test_who_ends_the_following_lifts_what_still_touches(modules: Page) -> None:
    modules.evaluate(FOLLOW)
    modules.evaluate(DISPATCH, [pointer("pointerdown", 11, 10), pointer("pointerdown", 12, 20)])
    modules.evaluate("() => unfollow()")
    said = modules.evaluate(DISPATCH, [pointer("pointerdown", 13, 10)])
    assert [(number, contact is None) for number, contact in said] == [(11, False), (12, False), (11, True), (12, True)]


STROKE = """({length, speed, load, times}) => {
  const said = [];
  let time = 100;
  const automaticStroke = new modules.AutomaticStroke({length, speed, load, clock: () => time,
    onMove: (contact) => said.push(contact), onLift: () => said.push(null)});
  automaticStroke.start();
  for (const since of times) {
    time = 100 + since;
    automaticStroke.step();
  }
  automaticStroke.speed = 2 * speed;
  time += 0.1;
  automaticStroke.step();
  automaticStroke.stop();
  automaticStroke.stop();
  return said;
}"""


def test_the_stroker_goes_back_and_forth_at_its_speed(functions: Page) -> None:
    times = [0.1, 0.2, 0.25, 0.4, 0.5, 0.7]
    said = functions.evaluate(STROKE, {"length": 0.02, "speed": 0.08, "load": 0.4, "times": times})
    positions = [contact["position"] for contact in said[:-1]]
    assert positions == pytest.approx([0, 0.008, 0.016, 0.02, 0.008, 0, 0.016, 0.008])
    assert [contact["time"] for contact in said[:-1]] == pytest.approx([100, *(100 + time for time in [*times, 0.8])])
    assert {contact["load"] for contact in said[:-1]} == {0.4}
    assert said[-1] is None and said.count(None) == 1


ENVELOPE = """async ({blocks, rate, quantities, fullScale}) => {
  const threshold = await modules.call("GET", "/v1/threshold?low=1&high=5000&points=100");
  const envelope = new modules.MotorStrength({rate, quantities, fullScale, threshold});
  return blocks.flatMap((block) => envelope.levels(Float32Array.from(block)));
}"""
CURVE = ((-15.0, 0.0), (-5.0, 0.25), (40.0, 0.8), (60.0, 1.0))  # docs/touch-page.md, Motors
ORDERS = {"displacement": 0, "velocity": 1, "acceleration": 2}


def felt_levels(samples: npt.NDArray[np.float32], rate: int, quantity: str, full_scale: float) -> list[float]:
    """Return the sensation level (dB) of each 10 ms, from the last 2048 samples at 48 kHz, by the definition."""
    size = 2 ** round(np.log2(0.0427 * rate))
    window = np.hanning(size + 1)[:-1]
    frequencies = np.arange(1, size // 2) * rate / size
    frequencies = frequencies[frequencies <= 1000.0]
    felt = threshold_displacement(frequencies) * (2 * np.pi * frequencies) ** ORDERS[quantity]
    padded = np.concatenate([np.zeros(size), samples.astype(np.float64)])
    levels = []
    for end in range(size + rate // 100, len(padded) + 1, rate // 100):
        newest = padded[end - size : end]
        lines = np.fft.rfft((newest - newest.mean()) * window)[1 : len(frequencies) + 1]
        power = 4 * full_scale**2 * np.abs(lines) ** 2 / (size * np.sum(window**2))
        levels.append(float(10 * np.log10(np.sum(power / felt**2))))
    return levels


def strengths(levels: list[float]) -> npt.NDArray[np.float64]:
    """Return what the documented curve makes of levels."""
    return np.asarray(np.interp(levels, *np.transpose(CURVE)))


@pytest.mark.parametrize(("quantity", "rate"), [("acceleration", 48000), ("displacement", 44100), ("velocity", 8000)])
def test_the_sensation_level_is_that_of_its_definition(functions: Page, quantity: str, rate: int) -> None:
    n = np.arange(rate // 5)
    samples = (0.3 + 0.4 * np.sin(2 * np.pi * 180 * n / rate) + 0.1 * np.sin(2 * np.pi * 61 * n / rate)).astype(
        np.float32
    )
    blocks = [block.tolist() for block in np.split(samples, [7, 1000, 1001, 1500])]
    asked = {"blocks": blocks, "rate": rate, "quantities": [quantity], "fullScale": [1e-4]}
    assert functions.evaluate(ENVELOPE, asked) == pytest.approx(felt_levels(samples, rate, quantity, 1e-4), abs=0.1)


def test_a_sinusoid_at_its_threshold_has_0_db_and_silence_has_no_strength(functions: Page) -> None:
    felt = float(threshold_displacement(np.array([250.0]))[0])
    sine = np.sin(2 * np.pi * 250 * np.arange(4800) / 48000)
    blocks = [(10 * sine).tolist(), sine.tolist(), [0.0] * 4800]
    asked = {"blocks": blocks, "rate": 48000, "quantities": ["displacement"], "fullScale": [felt]}
    levels = functions.evaluate(ENVELOPE, asked)
    assert (levels[9], levels[19]) == (pytest.approx(20.0, abs=0.5), pytest.approx(0.0, abs=0.5))
    wanted = [-60.0, -15.0, -10.0, -5.0, 17.5, 40.0, 50.0, 60.0, 90.0]
    found = functions.evaluate("(levels) => [-Infinity, NaN, ...levels].map(modules.strengthOf)", wanted)
    assert found == pytest.approx([0.0, 0.0, *strengths(wanted)])
    assert functions.evaluate("() => modules.strengthOf(10 * Math.log10(0))") == 0
    assert levels[29] is None or levels[29] == -np.inf


def test_of_several_channels_the_first_with_a_threshold_is_heeded(functions: Page) -> None:
    sine = 0.5 * np.sin(2 * np.pi * 200 * np.arange(4800) / 48000)
    both = np.stack([np.ones(4800), sine], axis=1).ravel().tolist()
    asked = {"rate": 48000, "quantities": ["tangential_force", "acceleration"], "fullScale": [1.0, 10.0]}
    two = functions.evaluate(ENVELOPE, {**asked, "blocks": [both]})
    one = functions.evaluate(
        ENVELOPE, {"rate": 48000, "quantities": ["acceleration"], "fullScale": [10.0], "blocks": [sine.tolist()]}
    )
    assert two == one


@pytest.mark.parametrize("texture", [{}, {"kind": "grating-1mm-31um"}])
@pytest.mark.parametrize("scan", [{"speed": 0.08, "load": 0.3}, {"speed": 0.2, "load": 1.0}])
def test_an_everyday_stroke_uses_the_middle_of_a_motor(functions: Page, texture: Any, scan: Any) -> None:
    asked = {"texture": texture, "scan": scan, "accuracy": {"tolerance": 0.01}}
    voice = open_voice(parse_scene(asked))
    samples = voice.render(12000)[:, 0]
    blocks = {"blocks": [samples.tolist()], "rate": 48000, "quantities": ["acceleration"]}
    levels = functions.evaluate(ENVELOPE, {**blocks, "fullScale": list(voice.full_scale)})
    assert levels == pytest.approx(felt_levels(samples, 48000, "acceleration", voice.full_scale[0]), abs=0.1)
    assert 0.3 < np.median(strengths(levels[5:])) < 0.8


MOTORS = """async (strengths) => {
  const said = [];
  const effect = (kind, {duration, strongMagnitude}) => Promise.resolve(said.push([kind, strongMagnitude, duration]));
  const pads = [null, {id: "pad", vibrationActuator: {playEffect: effect}}, {id: "plain", vibrationActuator: null}];
  const pulse = (strength, duration) => {
    said.push(["pulse", strength, duration]);
    return Promise.reject(new Error("unplugged"));
  };
  const motors = new modules.Motors({gamepads: () => pads});
  const alone = motors.motors().map(({name, form}) => [name, form]);
  const left = {handedness: "left", gamepad: {id: "touch", hapticActuators: [{pulse}]}};
  motors.follow({inputSources: [left, {handedness: "none"}]});
  const all = motors.motors().map(({name, form, hand}) => [name, form, hand]);
  motors.push(strengths, "right");
  const right = said.splice(0);
  motors.push(strengths);
  await modules.pause(20);
  return {alone, all, right, both: said};
}"""


def test_motors_get_the_strongest_of_each_period_and_nothing_for_silence(functions: Page) -> None:
    strengths = [0.0] * 10 + [0.1, 0.7, 0.2, 0.0, 0.0] + [0.0] * 10
    report = functions.evaluate(MOTORS, strengths)
    assert report["alone"] == [["pad", "dual-rumble"]]
    assert report["all"] == [["pad", "dual-rumble", ""], ["touch", "pulse", "left"]]
    assert report["right"] == [["dual-rumble", 0.7, 80], ["dual-rumble", 0, 80]]
    pulses = [["pulse", 0.7, 80], ["pulse", 0, 80]]
    assert report["both"] == [one for pair in zip(report["right"], pulses, strict=True) for one in pair]


def test_without_a_motor_nothing_is_pretended(functions: Page) -> None:
    assert functions.evaluate("() => new modules.Motors({gamepads: () => [null]}).motors()") == []
