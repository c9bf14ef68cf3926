"""Stick-slip: against an exact solver, with every scan and a hand, recordings, silence, and what is told."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest

from synth import Motion, open_voice, parse_scene
from synth.effects.stick_slip import SURFACES
from synth.errors import SceneError
from synth.motion.motion import ACROSS, Update
from synth.motion.scan_motion import ScanMotion
from synth.plan.plan import plan_of
from synth.plan.prepare import prepare
from synth.response_cache import ResponseCache
from synth.voice.hand_voice import HandVoice
from synth.voice.recording import Recording
from tests.reference.stick_slip_oracle import Finger, exact

CACHE = ResponseCache()
RATE = 8000
SLOW: dict[str, Any] = {"speed": "10 mm/s", "load": "0.5 N"}
WAVES = {"period": "4 mm", "amplitude": "20 um"}
GLASS = {"surface": "wet_glass"}


def scene_of(
    scan: Any = None, settings: Any = None, output: Any = None, others: dict[str, Any] | None = None, **sections: Any
) -> Any:
    """Return a quick scene with the effect on a coarse texture."""
    document = {
        "finger": {"contact_length": "2.5 mm"},
        "texture": WAVES,
        "scan": scan or SLOW,
        "effects": {"stick_slip": {} if settings is None else settings} | (others or {}),
        "output": {"quantity": "displacement", "sample_rate": RATE, "bandwidth": "full", "duration": 0.5}
        | (output or {}),
        "accuracy": {"tolerance": 1e-3},
    }
    return parse_scene(document | sections)


def rendered(scene: Any, frames: int) -> tuple[Any, Any]:
    """Return SI values [frames, channels], and the plan."""
    voice = open_voice(scene, cache=CACHE)
    return voice.render(frames).astype(float) * voice.full_scale, voice.plan


def test_z_is_that_of_the_texture_where_an_exact_solver_puts_the_skin() -> None:
    """The oracle moves the skin by SciPy's Radau, and reads z at its place from a fast scan without the effect."""
    frames, speed, finger = 1000, 0.01, Finger()
    drawn, plan = rendered(scene_of(), frames)
    found, slips = exact(finger, lambda _t: speed, lambda _t: 0.5, 0.63, 3.0 * speed, 1e-8)
    t = np.arange(frames) / RATE + 0.5
    lag, _speed, bend = found.sol(t)
    places = speed * t - lag - bend / finger.bristle - speed * 0.5
    plain, _plan = rendered(scene_of(settings={}, effects={}, scan={"speed": "0.8 m/s", "load": "0.5 N"}), 40)
    turns = np.arange(41) / 40.0  # a period of 40 frames, which the full band holds
    z = np.interp(places / 4e-3, *_finer(turns, plain[:, 0]), period=1.0)
    assert np.max(np.abs(drawn[:, 0] - z)) < 0.01 * np.ptp(z)
    force = [finger.friction(0.5, v, f)[1] for _d, v, f in found.sol(t).T]
    assert drawn[:, 1] == pytest.approx(force, abs=5e-3 * max(force))  # a slip is steep
    told = plan.response["motion"]
    assert told["frequency_hz"] == pytest.approx(1.0 / np.diff(slips)[-1], rel=1e-3)
    assert not told["sliding_is_stable"]


def _finer(turns: Any, values: Any) -> tuple[Any, Any]:
    """Return a period, from its samples, at many more places."""
    spectrum = np.fft.rfft(values)
    more = 64 * len(values)
    padded = np.zeros(more // 2 + 1, complex)
    padded[: len(spectrum)] = spectrum
    return np.arange(more) / more, np.fft.irfft(padded, more) * 64


SCANS: dict[str, Any] = {
    "constant": SLOW,
    "backwards": {"speed": "-10 mm/s", "load": "0.5 N"},
    "stroke": {"stroke": {"length": "10 mm", "speed": "10 mm/s", "load": "0.5 N"}},
    "recording": {"trajectory": [[0.0, 0.0, 0.2], [0.2, 0.002, 0.6], [0.35, 0.004, 0.3], [0.45, 0.004, 0.3]]},
    "lifted": {"trajectory": [[0.0, 0.0, 0.2], [0.1, 0.002, 0.0], [0.2, 0.003, 0.0], [0.45, 0.006, 0.5]]},
}


@pytest.mark.parametrize("name", SCANS)
def test_every_scan_sticks_and_slips_in_any_blocks(name: str) -> None:
    scene = scene_of(SCANS[name], GLASS)
    whole = open_voice(scene, cache=CACHE).render(3600)
    voice = open_voice(scene, cache=CACHE)
    sizes = np.random.default_rng(3).multinomial(3600, np.ones(9) / 9)
    assert np.array_equal(np.concatenate([voice.render(int(size)) for size in sizes]), whole)
    assert np.all(np.isfinite(whole)) and np.ptp(whole[:, 0]) > 0.1
    motion = ScanMotion(scene).at(0, 3600)
    steps = np.abs(np.diff(motion.position))
    pressed = motion.samples[2, 1:] > 0.05
    assert np.mean(steps[pressed] < 1e-9) > 0.2  # it stands
    assert np.max(steps) > 2.0 * np.max(np.abs(np.diff(ScanMotion(scene, hand=True).at(0, 3600).position)))  # it leaps


def test_the_motion_of_the_skin_is_one_at_every_rate() -> None:
    scene = scene_of(SCANS["recording"], GLASS)
    usual, finer = ScanMotion(scene).at(0, 400), ScanMotion(scene, 3.0 * RATE).at(0, 1200)
    assert finer.position[::3] == pytest.approx(usual.position, abs=1e-15)
    assert finer.samples[:, ::3][0] == pytest.approx(usual.samples[0], abs=1e-12)
    later = ScanMotion(scene).at(137, 100)
    assert np.array_equal(later.position, usual.position[137:237])
    assert np.all(np.diff(ScanMotion(scene, 64000.0).at(0, 3200).position) > -1e-8)


def test_a_line_in_any_direction_is_dragged_as_along_x() -> None:
    straight = ScanMotion(scene_of(settings=GLASS)).at(0, 3000)
    area = {"kind": "dots"}
    for heading in (0.5, 2.0, -1.5):
        turned = ScanMotion(scene_of(SLOW | {"heading": heading}, GLASS, texture=area)).at(0, 3000)
        along = turned.position * math.cos(heading) + turned.path[ACROSS] * math.sin(heading)
        assert along == pytest.approx(straight.position, abs=1e-6)
        force = turned.force[0] * math.cos(heading) + turned.force[1] * math.sin(heading)
        assert force == pytest.approx(straight.force[0], abs=2e-3)
        on_line = ScanMotion(prepare(scene_of(SLOW | {"heading": heading}, GLASS), CACHE).scene).at(0, 3000)
        assert on_line.position == pytest.approx(straight.position * math.cos(heading), abs=1e-6)


def hand(frames: int, begin: int = 0, *, by_place: bool = False) -> Motion:
    """Return frames of a hand that speeds up and slows down."""
    t = (begin + np.arange(frames)) / RATE
    speed, bend = 0.012 + 0.004 * np.sin(30.0 * t), 0.12 * np.cos(30.0 * t)
    place = 0.012 * t - 0.004 / 30.0 * np.cos(30.0 * t)
    where = {"position": place} if by_place else {}
    return Motion.of(frames, speed=speed, speed_rate=bend, load=0.5, load_rate=0.0, load_bend=0.0, **where)


@pytest.mark.parametrize("by_place", [False, True])
def test_a_hand_sticks_and_slips_in_any_blocks(by_place: bool) -> None:
    scene = scene_of(settings=GLASS)
    voice = open_voice(scene, cache=CACHE, live=True)
    whole = voice.render(2400, hand(2400, by_place=by_place))
    again, parts, begun = open_voice(scene, cache=CACHE, live=True), [], 0
    for size in (1, 99, 500, 7, 193, 1600):
        parts.append(again.render(size, hand(size, begun, by_place=by_place)))
        begun += size
    assert np.array_equal(np.concatenate(parts), whole)
    assert np.ptp(whole[1200:, 1]) > 0.1
    other = open_voice(scene, cache=CACHE, live=True).render(2400, hand(2400, by_place=not by_place))
    assert other[:, 1] == pytest.approx(whole[:, 1], abs=1e-5)


def test_a_recording_of_a_live_session_renders_to_the_same_samples() -> None:
    live = HandVoice(
        scene_of(settings=GLASS | {"moisture_rise": 3.0, "moisture_time": "1 s"}), cache=CACHE, record=True
    )
    heard = []
    for number in range(40):
        if number % 2 == 0 and number < 30:
            live.touch(Update(number + 1, number * 0.01, number * 1e-4, None, 0.6))
        if number == 34:
            live.lift()
        heard.append(live.render(80))
    document = json.loads(json.dumps(live.recording()))
    replay = Recording(document).open(CACHE)
    played = [replay.render(size) for size in (1, 999, 2200)]
    assert np.array_equal(np.concatenate(played), np.concatenate(heard))
    assert np.ptp(np.concatenate(heard)[:2400, 1]) > 0.05


def test_it_is_silent_where_it_should_be() -> None:
    sliding = {"speed": "0.2 m/s", "load": "0.5 N"}
    drawn, plan = rendered(scene_of(sliding, others={}), 2400)
    plain, _plan = rendered(scene_of(sliding, effects={}), 2400)
    assert np.ptp(drawn[:, 1]) <= 1e-7 and drawn[0, 1] == pytest.approx(0.25, rel=1e-6)
    late = (0.5 * 0.5 / 1e3 + 0.25 / 1e4) / 0.2 * RATE  # the skin is behind the hand by its stretch, and no more
    assert plan.response["motion"]["sliding_is_stable"] and plan.response["motion"]["frequency_hz"] == 0.0
    whole = np.arange(200, 2400)
    shifted = np.interp(whole - late, np.arange(2400), plain[:, 0])
    assert drawn[200:, 0] == pytest.approx(shifted, abs=0.01 * np.ptp(plain))
    rest, _plan = rendered(scene_of({"speed": 0.0, "load": "0.5 N"}), 500)
    assert not np.any(rest[:, 1]) and np.ptp(rest[:, 0]) == 0.0
    none, _plan = rendered(scene_of({"speed": "10 mm/s", "load": 0.0}), 500)
    assert not np.any(none)


def test_smooth_glass_has_the_force_alone_in_files_and_under_a_hand() -> None:
    smooth = scene_of(settings=GLASS, texture={"amplitude": 0.0}, others={"tangential": {}})
    voice = open_voice(smooth, cache=CACHE, live=True)
    assert voice.quantities == ("displacement", "friction_force", "tangential_force")
    own = voice.render(1600)
    led = voice.render(2400, hand(2400))
    for block in (own, led):
        assert np.ptp(block[:, 1]) > 0.1 and not np.any(block[:, [0, 2]])
    assert [part["name"] for part in voice.plan.document()["simulated"]][-2:] != []


def test_auto_simulates_what_may_slip_and_always_has_the_channel() -> None:
    fast = {"speed": "0.2 m/s", "load": "0.5 N"}
    for scan, simulated in ((SLOW, True), (fast, False), ({"stroke": {"speed": "0.2 m/s", "load": "0.5 N"}}, True)):
        drawn, plan = rendered(scene_of(scan, "auto"), 400)
        assert ("stick_slip" in {part.name for part in plan.simulated}) == simulated
        assert drawn.shape[1] == 2
        if not simulated:
            (left,) = [one for one in plan.left_out if one.name == "stick_slip"]
            assert "is stable" in left.reason
            assert drawn[:, 1] == pytest.approx(0.5 * 0.5, rel=1e-6)
    by_hand = open_voice(scene_of(fast, "auto"), cache=CACHE, live=True)
    assert np.ptp(by_hand.render(2400, hand(2400))[1200:, 1]) > 0.05
    damped = scene_of({"stroke": {"load": "0.1 N"}}, "auto", accuracy={})
    assert "stick_slip" in {part.name for part in plan_of(prepare(damped, CACHE)).simulated}


def test_the_plan_tells_onset_frequency_slip_share_and_error() -> None:
    _drawn, plan = rendered(scene_of(settings=GLASS), 10)
    told = plan.response["motion"]
    assert 0.0 < told["slip_share"] < 1.0 and 5.0 < told["frequency_hz"] < 200.0
    assert 0.0 < told["error"] < 1e-3
    assert told["fall_of_friction"] == pytest.approx(0.5 * 0.45 * 2.0 / 0.01 * math.exp(-1.0))
    assert told["damping_above_which_every_speed_slides"] == pytest.approx(0.8578 * 0.5 * 0.45 / 0.01, rel=1e-3)
    assert told["error"] < plan.estimated_error["friction_force"] == pytest.approx(told["force_error"], rel=1e-3)


def test_moisture_is_off_unless_asked_and_raises_friction_on_glass() -> None:
    fast = {"speed": "0.2 m/s", "load": "0.5 N"}
    for settings, factor in (
        ({}, 1.0),
        ({"moisture_rise": 5.0, "moisture_time": "0.4 s"}, 1.0 + 4.0 * (1 - math.exp(-2.5))),
    ):
        drawn, _plan = rendered(scene_of(fast, settings, {"duration": 1.0}), 4001)
        assert drawn[4000, 1] == pytest.approx(0.25 * factor, rel=5e-3)  # 0.5 s, and 0.5 s before the first frame


@pytest.mark.parametrize(
    ("settings", "pointer", "says"),
    [
        ({"static_friction": 0.3, "kinetic_friction": 0.4}, "static_friction", "at least the kinetic friction, 0.4"),
        ({"surface": "wet glas"}, "surface", "wet_glass"),
        ({"mass": 0.0}, "mass", "1 mg"),
        ({"stiffness": math.nan}, "stiffness", "N/m"),
    ],
)
def test_bad_settings_are_refused_with_what_to_write(settings: dict[str, Any], pointer: str, says: str) -> None:
    with pytest.raises(SceneError) as refused:
        scene_of(settings=settings)
    (fault,) = refused.value.faults
    assert fault.pointer == f"/effects/stick_slip/{pointer}"
    assert says in f"{fault.allowed} {fault.hint}" and fault.hint


def test_a_coefficient_that_is_given_alone_moves_the_other_where_it_must() -> None:
    for given, wanted in (
        ({}, (0.9, 0.5)),
        ({"static_friction": 0.3}, (0.3, 0.3)),
        ({"kinetic_friction": 2.0}, (2.0, 2.0)),
        ({"static_friction": 0.6, "kinetic_friction": 0.2}, (0.6, 0.2)),
    ):
        settings = scene_of(settings=given).effects["stick_slip"]
        assert settings.friction[:2] == wanted


@pytest.mark.parametrize("surface", SURFACES)
def test_a_finger_sticks_and_slips_on_every_surface(surface: str) -> None:
    scene = scene_of({"speed": "10 mm/s", "load": "0.5 N"}, {"surface": surface})
    static, kinetic, _speed = SURFACES[surface]
    drawn, _plan = rendered(scene, 4000)
    force = drawn[:, 1] / 0.5
    assert kinetic - 2.0 * (static - kinetic) < np.min(force) <= np.max(force) <= static * 1.02


@pytest.mark.parametrize("quantity", ["displacement", "acceleration"])
def test_a_file_errs_by_no_more_than_the_plan_says(quantity: str) -> None:
    """Against the same file at twelve times the rate, whose steps are as much finer; 1 kHz of band."""
    for settings, speed in (({}, "10 mm/s"), ({}, "20 mm/s"), (GLASS, "10 mm/s")):
        found = []
        for rate in (RATE, 12 * RATE):
            output = {"quantity": quantity, "sample_rate": rate, "bandwidth": "1 kHz"}
            scene = scene_of({"speed": speed, "load": "0.5 N"}, settings, output, texture={"period": "0.8 mm"})
            drawn, plan = rendered(scene, round(0.2 * rate))
            found.append((drawn[:: rate // RATE, 0], plan.estimated_error[quantity]))
        (usual, told), (finer, _told) = found
        assert np.max(np.abs(usual - finer)) <= told * np.ptp(finer)
        assert told < 0.05, "at 8 kHz, at any time of half a second"
