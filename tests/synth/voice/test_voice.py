"""A voice: blocks do not matter; full scales, gate and fades; and the approach, z of eq. 1, under a changing load."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from synth.contact.scene_contact import contact_of
from synth.encode.sound import render
from synth.motion.motion import LOAD, Motion, Update
from synth.motion.scan_motion import ScanMotion
from synth.plan.plan import plan_of
from synth.scene.scene import Scene, parse_scene
from synth.voice.hand_voice import HandVoice
from synth.voice.voice import blocks, open_voice, total_frames
from tests.synth.engine_cases import QUANTITIES, Real, physical, scene_of

ALL = {"channels": list(QUANTITIES)}
NARROW = {**ALL, "bandwidth": 400, "sample_rate": 8000}  # few harmonics: rows of the load grid are solved quickly


def cuts(frames: int, seed: int, most: int = 400) -> list[int]:
    """Return random sizes of blocks that add up to `frames`, with empty blocks among them."""
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
    return Motion(motion.samples[:, first : first + frames], places, complete=motion.complete)


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


def test_below_a_nanometre_an_automatic_scale_gives_silence_and_a_warning() -> None:
    faint = {"texture": {"amplitude": "0.3 nm"}, "output": {"quantity": "acceleration"}}
    voice = open_voice(parse_scene(faint))
    assert not voice.render(1000).any()
    assert any("less than 1 nm" in warning for warning in voice.warnings)
    assert plan_of(voice.solved).estimated_error == {"acceleration": 1.0}  # the whole motion is left out
    asked = open_voice(parse_scene({**faint, "output": {"quantity": "displacement", "full_scale": "1 nm"}}))
    assert np.abs(asked.render(1000)).max() > 0.005
    assert not any("1 nm" in warning for warning in asked.warnings)


@pytest.mark.parametrize("quantity", QUANTITIES)
@pytest.mark.parametrize("load", [0.01, 0.3, 60.0])
def test_the_automatic_full_scale_puts_the_steady_peak_at_08(quantity: str, load: float) -> None:
    voice = open_voice(scene_of(scan={"speed": 0.0801, "load": load}, output={"quantity": quantity}))
    # 2e-3 of the peak is the tolerance, relative to the peak-to-peak; the rest is a peak between two frames
    assert np.abs(voice.render(60_000)).max() == pytest.approx(0.8, rel=3e-3)


def test_a_given_full_scale_only_scales() -> None:
    automatic = open_voice(scene_of(output={"quantity": "velocity"}))
    given_one = open_voice(scene_of(output={"quantity": "velocity", "full_scale": "0.5 m/s"}))
    assert given_one.full_scale == (0.5,)
    assert np.max(np.abs(physical(automatic, 900) - physical(given_one, 900))) <= 1e-6 * automatic.full_scale[0]


@pytest.mark.parametrize("load", [5e-5, 4e-4, 9e-4])
def test_a_light_touch_is_faded_by_the_gate(load: float) -> None:
    output = {"quantity": "displacement", "full_scale": 1e-5}
    lift = 1e-3
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
    told = np.abs(plain[:, 0]) > 0.05
    gain = np.where(told, faded[:, 0] / np.where(told, plain[:, 0], 1.0), np.nan)
    assert np.all(np.diff(gain[:480][told[:480]]) > -1e-5) and np.nanmax(np.abs(gain - gain[::-1])) <= 1e-5
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


PRESSING = [[0, 1e-4, 0.1], [0.05, 1e-4, 0.1], [0.15, 1e-4, 1.0], [0.2, 1e-4, 1.0]]


def approaching(rate: int = 8000, **sections: Any) -> Scene:
    both = [{"quantity": "approach", "full_scale": 1.0}, {"quantity": "displacement", "full_scale": 1.0}]
    return scene_of(output={"channels": both, "sample_rate": rate, "duration": 0.2}, **sections)


def sampled(scene: Scene) -> Real:
    return np.concatenate(list(blocks(open_voice(scene)))).astype(float)


def approach_along(scene: Scene, frames: Any) -> Real:
    """Return z (m) along the scan of `scene` at some of its first 9,600 frames."""
    motion = ScanMotion(scene).at(0, 9600)
    turns, loads = motion.position / scene.texture.period, motion.samples[LOAD]
    return np.asarray(contact_of(scene).heights(turns[frames], loads[frames]))


@pytest.mark.parametrize("scan", [{}, {"stroke": {"length": "5 mm"}}, {"trajectory": PRESSING}], ids=str)
def test_the_approach_is_z(scan: dict[str, Any]) -> None:
    asked = approaching(48000, scan=scan)
    some = np.arange(0, 9600, 7)
    found, wanted = sampled(asked)[some, 0], approach_along(asked, some)
    assert np.max(np.abs(found - wanted)) <= 2e-3 * 2e-6  # of the peak-to-peak: the band cuts little


@pytest.mark.parametrize(
    ("speed", "ridges", "told"), [(0.4, 40e-6, "harmonic is above the band"), (0.1, 0.0, "less than 1 nm")]
)
def test_the_approach_of_a_finger_that_does_not_move_is_its_height(speed: float, ridges: float, told: str) -> None:
    def scene(channels: list[str]) -> Scene:
        output = {"channels": channels, "sample_rate": 8000, "bandwidth": 500.0}
        scan = {"speed": speed, "load": 30.0}
        return scene_of(finger={"ridge_amplitude": ridges}, texture={"period": 0.5e-3}, scan=scan, output=output)

    both = scene(["approach", "acceleration"])
    voice = open_voice(both)
    mean = np.mean(contact_of(both).heights(np.arange(256) / 256, np.full(256, 30.0)))
    np.testing.assert_allclose(voice.render(64) * voice.full_scale, np.tile([mean, 0.0], (64, 1)), rtol=1e-3)
    assert any(told in warning for warning in voice.solved.warnings)
    assert np.max(np.abs(open_voice(scene(["approach"])).render(64))) == pytest.approx(0.8, rel=1e-3)


def test_pressing_moves_the_approach_and_not_the_displacement() -> None:
    found = sampled(approaching(scan={"trajectory": PRESSING}))
    assert found[100, 0] - found[-100, 0] == pytest.approx(33.7e-6, abs=0.1e-6)  # z falls as the finger is pressed
    assert abs(found[100, 1] - found[-100, 1]) <= 3e-6


@pytest.mark.parametrize("effects", [{"inertia": {}}, {"adhesion": {}}, {"contact_growth": {}}], ids=str)
def test_with_effects_it_is_their_z(effects: dict[str, Any]) -> None:
    found = sampled(approaching(effects=effects))
    level = found[:, 0] - found[:, 1]
    assert np.ptp(level) <= 1e-10 and 2e-5 <= level[0] <= 5e-5


def test_its_automatic_full_scale_holds_its_level() -> None:
    for scan in ({}, {"trajectory": PRESSING}):
        asked = scene_of(scan=scan, output={"quantity": "approach", "sample_rate": 8000, "duration": 0.23})
        voice = open_voice(asked)
        assert np.max(np.abs(np.concatenate(list(blocks(voice))))) == pytest.approx(0.8, rel=0.01)
        assert voice.plan.response["channels"][0]["unit"] == "m"
        assert voice.plan.estimated_error["approach"] <= 1e-3


def test_a_hand_feels_it_and_is_not_limited() -> None:
    voice = HandVoice(scene_of(output={"quantity": "approach", "sample_rate": 8000}))
    levels: list[float] = []
    for load in (0.1, 1.0):
        for _ in range(30):
            voice.touch(Update(len(levels), 0.01 * len(levels), 8e-4 * len(levels), None, load))
            levels.append(float(voice.render(80).mean()))
            assert voice.reduction_db == 0.0
    moved = (np.mean(levels[24:30]) - np.mean(levels[54:60])) * voice.full_scale[0]
    assert moved == pytest.approx(33e-6, abs=1.5e-6)


def test_a_number_of_frames_may_be_an_integer_of_numpy_and_nothing_else() -> None:
    for live in (False, True):
        voice: Any = open_voice(scene_of(), live=live)
        same = open_voice(scene_of(), live=live)
        first = voice.render(np.int32(480))
        voice.seek(np.int64(960)) if not live else voice.render(np.int64(480))
        same.render(960)
        assert first.shape[0] == 480 and np.array_equal(voice.render(480), same.render(480))
        for wrong in (480.0, "480"):
            with pytest.raises(TypeError):
                voice.render(wrong)


def test_a_motion_whose_rows_have_other_lengths_is_refused() -> None:
    voice = open_voice(scene_of(), live=True)
    samples = np.zeros((5, 480))
    for motion in (Motion(samples, np.zeros(10)), Motion(samples[:4]), Motion(samples, path=np.zeros((2, 5)))):
        with pytest.raises(ValueError, match=r"Motion\.of"):
            voice.render(480, motion)
