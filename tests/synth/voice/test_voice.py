"""A voice: blocks do not matter, nothing moving is nothing heard, samples are finite."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from synth.arrays import Block
from synth.encode.sound import render
from synth.motion.motion import Motion
from synth.scene.scene import parse_scene
from synth.voice.live_voice import LiveVoice
from synth.voice.voice import Voice, blocks, open_voice, total_frames
from tests.synth.engine_cases import QUANTITIES, Real, physical, scene_of

ALL = {"channels": list(QUANTITIES)}
NARROW = {**ALL, "bandwidth": 400, "sample_rate": 8000}  # few harmonics: rows of load are solved in no time
TRAJECTORY = [[0, 0, 0.3], [0.1, 6e-3, 0.4], [0.2, 1e-2, 0.25], [0.3, 8e-3, 0.3], [0.4, 0.0, 0.35]]
TINY = float(np.finfo(np.float32).tiny)


def cuts(frames: int, seed: int, most: int = 400) -> list[int]:
    """Return random sizes of blocks that add up to `frames`, empty ones among them."""
    random = np.random.default_rng(seed)
    sizes: list[int] = []
    while sum(sizes) < frames:
        sizes.append(min(int(random.integers(0, most)), frames - sum(sizes)))
    return sizes


def hand(frames: int, *, derivatives: bool, position: bool = False, rate: int = 8000) -> Motion:
    t = np.arange(frames) / rate
    fields: dict[str, Any] = {"load": 0.3 + 0.1 * np.sin(9 * t), "speed": 0.05 + 0.04 * np.sin(13 * t)}
    if derivatives:
        fields |= {"speed_rate": 0.52 * np.cos(13 * t), "load_rate": 0.9 * np.cos(9 * t)}
        fields["load_bend"] = -8.1 * np.sin(9 * t)
    if position:
        fields["position"] = 0.05 * t + 0.04 / 13 * (1 - np.cos(13 * t))
        if not derivatives:
            del fields["speed"]
    return Motion.of(frames, **fields)


def part_of(motion: Motion, first: int, frames: int) -> Motion:
    places = motion.position[first : first + frames] if len(motion.position) else motion.position
    return Motion(motion.samples[:, first : first + frames], places, motion.complete)


@pytest.mark.parametrize(
    "document",
    [
        {"output": ALL},
        {"output": ALL, "scan": {"speed": -0.031}},
        {"output": NARROW, "scan": {"stroke": {"length": "10 mm", "turn_time": "50 ms"}}},
        {"output": NARROW, "scan": {"trajectory": TRAJECTORY}},
        {"output": ALL, "scan": {"load": 60}},
    ],
    ids=["steady", "backwards", "stroke", "trajectory", "full contact"],
)
def test_random_blocks_equal_one_block(document: dict[str, Any]) -> None:
    scene = parse_scene(document)
    whole = open_voice(scene).render(4000)
    voice = open_voice(scene)
    parts = np.concatenate([voice.render(size) for size in cuts(4000, 1)])
    assert np.array_equal(whole, parts)
    assert np.abs(whole).max() > 0.1
    assert voice.frame == 4000


@pytest.mark.parametrize("derivatives", [True, False])
@pytest.mark.parametrize("position", [True, False])
def test_random_blocks_of_a_hand_equal_one_block(derivatives: bool, position: bool) -> None:
    scene = scene_of(output=NARROW)
    motion = hand(3000, derivatives=derivatives, position=position)
    whole = open_voice(scene).render(3000, motion)
    voice, parts, done = open_voice(scene), [], 0
    for size in cuts(3000, 2):
        parts.append(voice.render(size, part_of(motion, done, size)))
        done += size
    assert np.array_equal(whole, np.concatenate(parts))
    assert np.abs(whole).max() > 0.1


def test_random_blocks_of_a_live_voice_equal_one_block_between_its_events() -> None:
    scene, other = scene_of(output=ALL), scene_of(output=ALL, scan={"speed": 0.11, "load": 0.5})

    def played(seed: int | None) -> Block:
        voice, parts = LiveVoice(scene), []
        for frames, event in ((1000, "change"), (3500, "release"), (1500, "")):
            sizes = [frames] if seed is None else cuts(frames, seed)
            parts += [voice.render(size) for size in sizes]
            if event == "change":
                voice.apply(voice.prepare(other))
            elif event == "release":
                voice.release()
        return np.concatenate(parts)

    assert np.array_equal(played(None), played(5))
    assert np.array_equal(played(None), played(6))


@pytest.mark.parametrize("scan", [{}, {"speed": -0.0123}, {"stroke": {"length": "10 mm", "turn_time": "50 ms"}}])
def test_a_frame_by_seek_is_the_frame_streamed(scan: dict[str, Any]) -> None:
    scene = scene_of(scan=scan, output=NARROW)
    streamed, sought = open_voice(scene), open_voice(scene)
    whole = streamed.render(9000)
    for frame in (1, 77, 4096, 8990):
        sought.seek(frame)
        assert np.array_equal(sought.render(10), whole[frame : frame + 10])


def test_a_stroke_returns_along_the_same_heights() -> None:
    scene = scene_of(
        scan={"stroke": {"length": 5e-3, "speed": 0.04, "turn_time": 0.0625}},
        output={"quantity": "displacement", "sample_rate": 48000},
    )
    assert scene.scan.stroke is not None
    voice = open_voice(scene)
    frames = round(scene.scan.stroke.period * 48000)
    position = voice._motion.at(0, frames).position
    heights = physical(voice, frames)[:, 0]
    half = frames // 2
    forth, back = slice(0, half), slice(half, frames)
    there = np.interp(position[back][::-1], position[forth], heights[forth])
    assert np.max(np.abs(there - heights[back][::-1])[50:-50]) <= 2e-4 * np.ptp(heights)
    assert np.ptp(heights[half // 3 : half // 2]) > 0.1 * np.ptp(heights)


SILENT: dict[str, dict[str, Any]] = {
    "no height": {"texture": {"amplitude": 0}},
    "0 N": {"scan": {"load": 0}},
    "above the band": {"scan": {"speed": 10}, "texture": {"period": 1e-4}},
}


@pytest.mark.parametrize("reason", SILENT)
def test_nothing_moving_is_exactly_nothing_and_says_why(reason: str) -> None:
    voice = open_voice(parse_scene({**SILENT[reason], "output": ALL}))
    assert not voice.render(1000).any()
    assert any(reason in warning for warning in voice.warnings)
    assert any(reason in part.reason for part in voice.plan.left_out)
    assert not voice.plan.simulated


def test_a_finger_that_stands_still_has_no_velocity_and_stays_where_it_stands() -> None:
    voice = open_voice(scene_of(scan={"speed": 0}, output=ALL))
    block = voice.render(2000)
    assert not block[:, 1:].any()
    assert np.ptp(block[:, 0]) == 0.0
    moving = open_voice(scene_of(output={"quantity": "displacement"}))
    assert physical(voice, 1)[0, 0] == pytest.approx(physical(moving, 1)[0, 0], rel=1e-3)


def test_below_a_nanometre_an_automatic_scale_gives_silence_and_a_warning() -> None:
    faint = {"texture": {"amplitude": "0.3 nm"}, "output": {"quantity": "acceleration"}}
    voice = open_voice(parse_scene(faint))
    assert not voice.render(1000).any()
    assert any("less than 1 nm" in warning for warning in voice.warnings)
    asked = open_voice(parse_scene({**faint, "output": {"quantity": "displacement", "full_scale": "1 nm"}}))
    assert np.abs(asked.render(1000)).max() > 0.005
    assert not any("1 nm" in warning for warning in asked.warnings)


def test_a_contact_that_cancels_is_not_blown_up() -> None:
    scene = scene_of(texture={"period": "0.5 mm"}, scan={"load": 60}, output=ALL)  # 20 whole periods, full contact
    voice = open_voice(scene)
    assert not voice.render(2000).any()
    assert voice.warnings


@pytest.mark.parametrize("quantity", QUANTITIES)
@pytest.mark.parametrize("load", [0.01, 0.3, 60.0])
def test_the_automatic_full_scale_puts_the_steady_peak_at_08(quantity: str, load: float) -> None:
    voice = open_voice(scene_of(scan={"speed": 0.0801, "load": load}, output={"quantity": quantity}))
    # 2e-3 of the peak is the tolerance, a part of the peak-to-peak; the rest is what lies between two frames
    assert np.abs(voice.render(60_000)).max() == pytest.approx(0.8, rel=3e-3)


def test_a_given_full_scale_only_scales() -> None:
    automatic = open_voice(scene_of(output={"quantity": "velocity"}))
    given_one = open_voice(scene_of(output={"quantity": "velocity", "full_scale": "0.5 m/s"}))
    assert given_one.full_scale == (0.5,)
    assert np.max(np.abs(physical(automatic, 900) - physical(given_one, 900))) <= 1e-6 * automatic.full_scale[0]


def test_a_light_touch_is_faded_by_the_gate() -> None:
    output = {"quantity": "displacement", "full_scale": 1e-5}
    load, lift = 4e-4, 1e-3
    gated = physical(open_voice(scene_of(scan={"load": load, "lift_load": lift}, output=output)), 2000)
    free = physical(open_voice(scene_of(scan={"load": load, "lift_load": 1e-5}, output=output)), 2000)
    s = load / lift
    assert np.max(np.abs(gated - (10 * s**3 - 15 * s**4 + 6 * s**5) * free)) <= 2e-3 * np.ptp(gated)


def test_fades_are_there_only_when_asked_for() -> None:
    plain, faded = (
        render(scene_of(output={"quantity": "acceleration", "duration": 0.05, "fade": fade})).frames
        for fade in (0.0, 0.01)
    )
    assert plain.shape == faded.shape == (2400, 1)
    assert np.array_equal(plain[480:1920], faded[480:1920])
    assert np.abs(faded[:20]).max() < 0.01 * np.abs(plain).max()
    assert np.array_equal(plain, open_voice(scene_of(output={"quantity": "acceleration"})).render(2400))


def test_blocks_of_the_whole_duration_add_up() -> None:
    scene = scene_of(output={"duration": 0.1234, "fade": 0.02})
    whole = render(scene).frames
    assert len(whole) == total_frames(scene) == round(0.1234 * 48000)
    assert np.array_equal(np.concatenate(list(blocks(open_voice(scene), 333))), whole)


def test_a_motion_of_another_length_is_refused() -> None:
    voice = open_voice(scene_of())
    with pytest.raises(ValueError, match="480"):
        voice.render(480, Motion.of(479, speed=0.1, load=0.3))


def test_a_voice_that_a_hand_moved_cannot_seek() -> None:
    voice = open_voice(scene_of(output=NARROW))
    voice.render(64, hand(64, derivatives=True))
    with pytest.raises(ValueError, match="seek"):
        voice.seek(0)


def fit_for_an_actuator(block: Real | Block) -> bool:
    """Return whether every sample is finite and none is denormal."""
    size = np.abs(block)
    return bool(np.isfinite(block).all() and not ((size > 0) & (size < TINY)).any())


def logarithmic(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(np.log(low), np.log(high)).map(lambda power: float(np.clip(np.exp(power), low, high)))


@settings(max_examples=40, suppress_health_check=[HealthCheck.too_slow])
@given(
    ridge=st.fixed_dictionaries(
        {"ridge_period": logarithmic(1e-4, 1e-2), "ridge_amplitude": st.just(0.0) | logarithmic(1e-9, 1e-3),
         "contact_length": logarithmic(1e-5, 2e-2)}
    ),
    texture=st.fixed_dictionaries(
        {"period": logarithmic(3e-5, 1.0), "amplitude": st.just(0.0) | logarithmic(1e-12, 1e-3),
         "phase": st.floats(-10, 10)}
    ),
    scan=st.fixed_dictionaries(
        {"speed": st.just(0.0) | st.builds(float.__mul__, st.sampled_from([-1.0, 1.0]), logarithmic(1e-6, 10)),
         "load": st.just(0.0) | logarithmic(1e-9, 1e3), "lift_load": logarithmic(1e-6, 1)}
    ),
    rate=st.sampled_from([1000, 8000, 48000, 192000]),
    full_scale=st.none() | logarithmic(1e-9, 1e3),
)  # fmt: skip
def test_whatever_the_scene_the_samples_are_finite(
    ridge: dict[str, float], texture: dict[str, float], scan: dict[str, float], rate: int, full_scale: float | None
) -> None:
    channels = [{"quantity": quantity, "full_scale": full_scale} for quantity in QUANTITIES]
    fundamental = abs(scan["speed"] / texture["period"])
    few = {"bandwidth": 100 * fundamental + 1} if fundamental < 900 else {}  # so that an example takes no seconds
    output = {"channels": channels, "sample_rate": rate, **few}
    scene = scene_of(finger=ridge, texture=texture, scan=scan, output=output, accuracy={"tolerance": 1e-2})
    voice = open_voice(scene)
    block = voice.render(256)
    assert block.dtype == np.float32 and block.shape == (256, 3)
    assert fit_for_an_actuator(block)
    voice.seek(10**12)
    assert fit_for_an_actuator(voice.render(64))
    if full_scale is None:
        assert np.abs(block).max() <= 0.81


@settings(max_examples=20, suppress_health_check=[HealthCheck.too_slow])
@given(
    speeds=st.lists(st.floats(-10, 10), min_size=2, max_size=6),
    loads=st.lists(st.just(0.0) | logarithmic(1e-6, 5), min_size=2, max_size=6),
    derivatives=st.booleans(),
)
def test_whatever_the_hand_does_the_samples_are_finite(
    speeds: list[float], loads: list[float], derivatives: bool
) -> None:
    frames = 400
    t = np.linspace(0, 1, frames)
    speed = np.interp(t, np.linspace(0, 1, len(speeds)), speeds)
    load = np.interp(t, np.linspace(0, 1, len(loads)), loads)
    given_ones = (
        {"speed_rate": np.gradient(speed) * 8000, "load_rate": np.gradient(load) * 8000, "load_bend": 0.0}
        if derivatives
        else {}
    )
    output = {**NARROW, "bandwidth": 200}
    voice = open_voice(scene_of(output=output, accuracy={"tolerance": 3e-2}))
    assert fit_for_an_actuator(voice.render(frames, Motion.of(frames, speed=speed, load=load, **given_ones)))
    assert fit_for_an_actuator(voice.render(100))


def test_the_lift_gate_is_exactly_zero_at_no_load() -> None:
    voice: Voice = open_voice(scene_of(output=NARROW))
    t = np.arange(800) / 8000
    load = np.maximum(0.002 * np.cos(2 * np.pi * 10 * t), 0.0)
    block = voice.render(800, Motion.of(800, speed=0.05, load=load))
    touched = (
        np.convolve(load > 0.0, np.ones(2 * voice.late + 1), "full")[: len(load)] > 0.5
    )  # all that is looked back at
    assert not block[~touched, 0].any() and not touched.all()
    assert np.abs(block[load > 0.001, 0]).max() > 0.01
