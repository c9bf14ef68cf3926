"""Voices that solve eq. 1 along their motion: independent of blocks and of strokes, within the error that they tell."""

from __future__ import annotations

import math
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import ridgewave as rw
from synth.contact.stiffness import Stiffness
from synth.motion.motion import Motion
from synth.plan.prepare import prepare
from synth.plan.usual_hand import prepare_hand
from synth.response_cache import ResponseCache
from synth.sampling.direct_reader import DirectReader
from synth.scene.scene import parse_scene
from synth.surfaces import profile_of
from synth.surfaces.surface_data import SurfaceData, remember
from synth.voice.live_voice import LiveVoice
from synth.voice.table_reading import reader_of
from synth.voice.voice import Voice, open_voice
from tests.few import thorough
from tests.reference.kinds_oracle import approach
from tests.synth.engine_cases import Real

RATE = 48000
CHANNELS = ["displacement", "velocity", "acceleration", "approach"]
ROUGH = {"kind": "rough", "period": "20 mm"}
FINGERS = ("comb", "probe", "fingertip")
CACHE = ResponseCache()


def document(**sections: Any) -> dict[str, Any]:
    """Return a scene on a rough surface of 20 mm, with all four quantities."""
    return {"texture": ROUGH, "output": {"channels": CHANNELS}} | sections


@cache
def solved(finger: str) -> Voice:
    """Return a voice for a hand on the rough surface."""
    return open_voice(document(finger={"kind": finger}), live=True, cache=CACHE)


def hand(finger: str) -> Voice:
    """Return a voice for a hand, at its first frame."""
    return solved(finger).twin()


def wild(frames: int) -> Motion:
    """Return a motion that turns, lifts and lands."""
    t = np.arange(frames) / RATE
    place = 2e-3 * np.sin(2.0 * math.pi * 15.0 * t) + 0.05 * t
    load = np.maximum(0.3 * np.sin(2.0 * math.pi * 24.0 * t) + 0.2, 0.0)
    return Motion.of(frames, position=place, load=load, speed=np.gradient(place) * RATE, speed_rate=0.0, load_rate=0.0,
                     load_bend=0.0)  # fmt: skip


def part(motion: Motion, first: int, end: int) -> Motion:
    return Motion(motion.samples[:, first:end], motion.position[first:end])


def in_blocks(voice: Voice, motion: Motion, cuts: list[int]) -> Real:
    pairs = pairwise([0, *cuts, motion.frames])
    return np.concatenate([voice.render(end - first, part(motion, first, end)) for first, end in pairs])


def in_band(samples: Real, rate: int, band: float) -> Real:
    """Return the components of whole periods of a motion up to `band` (Hz), without the mean."""
    series = np.fft.rfft(samples, axis=0)
    hertz = np.arange(len(series)) * rate / len(samples)
    series[hertz > band], series[0] = 0.0, 0.0
    return np.asarray(np.fft.irfft(series, len(samples), axis=0))


@pytest.mark.parametrize("finger", FINGERS)
def test_blocks_of_any_size_give_the_samples_of_one(finger: str) -> None:
    motion = wild(2400)
    whole = hand(finger).render(motion.frames, motion)
    cuts = np.sort(np.random.default_rng(0).choice(np.arange(1, motion.frames), 40, replace=False)).tolist()
    assert np.array_equal(in_blocks(hand(finger), motion, cuts), whole)
    assert np.array_equal(in_blocks(hand(finger), part(motion, 0, 90), list(range(1, 90))), whole[:90])
    assert np.max(np.abs(whole)) > 0.01


def test_ten_strokes_over_the_same_places_give_the_same_samples() -> None:
    frames = 20 * 240  # of a stroke back and forth: whole groups of solutions
    t = np.arange(frames) / frames
    place = 5e-3 * (1.0 - np.cos(2.0 * math.pi * t))
    motion = Motion.of(10 * frames, position=np.tile(place, 10), load=0.3)
    strokes = in_blocks(hand("comb"), motion, list(range(480, 10 * frames, 480))).reshape(10, frames, -1)
    assert all(np.array_equal(stroke, strokes[1]) for stroke in strokes[2:])
    assert np.ptp(strokes[1, :, 2]) > 0.05


def test_strokes_that_begin_within_a_group_differ_by_rounding_only() -> None:
    frames = 4801
    place = 5e-3 * (1.0 - np.cos(2.0 * math.pi * np.arange(frames) / frames))
    one = hand("comb").render(2 * frames, Motion.of(2 * frames, position=np.tile(place, 2), load=0.3))
    shifted = Motion.of(2 * frames + 6, position=np.roll(np.tile(place, 3), 6)[: 2 * frames + 6], load=0.3)
    other, late = hand("comb").render(shifted.frames, shifted), hand("comb").late
    assert np.max(np.abs(one[2 * late :] - other[2 * late + 6 :])) <= 2e-7 * np.max(np.abs(one))


@pytest.mark.parametrize("finger", FINGERS)
def test_a_finger_at_rest_is_exactly_silent_and_costs_no_solution(finger: str, monkeypatch: pytest.MonkeyPatch) -> None:
    voice = hand(finger)
    voice.render(2000, part(wild(2000), 0, 2000))
    rest = Motion.of(2000, position=1.234e-3, load=0.3, speed=0.0, speed_rate=0.0, load_rate=0.0, load_bend=0.0)
    voice.render(2000, rest)
    stood = hand(finger).render(2000, rest)[-1]
    counted: list[bool] = []
    solved = DirectReader.solved

    def counting(self: DirectReader, places: Real, before: Real, last: float) -> Real:
        counted.append(bool(np.any(places[0] != before[0])))
        return solved(self, places, before, last)

    monkeypatch.setattr(DirectReader, "solved", counting)
    found = voice.render(2000, rest)
    assert not np.any(found[:, 1:3])
    assert np.all(found[:, [0, 3]] == found[0, [0, 3]])
    assert found[0, 0] != 0.0
    assert found[0] == pytest.approx(stood, abs=1e-6)  # as if it had always been there
    assert counted
    assert not any(counted)


def test_no_load_is_exact_silence_on_every_channel() -> None:
    lifted = Motion.of(3000, position=0.08 * np.arange(3000) / RATE, load=0.0)
    assert not np.any(hand("comb").render(3000, lifted))


@cache
def swung(finger: str) -> tuple[Real, Real, dict[str, float]]:
    """Return three quantities of one swing, live and by the oracle, SI [3, frames], and the errors that are told.

    z over a swing by a cosine is periodic, so its Fourier series has the band exactly. The oracle sums heights at
    200,000 points of the contact, of the true profile.
    """
    rate, band, frames, speed, load = 8000, 250.0, 800, 0.04, 0.3
    texture = {"kind": "rough", "period": "20 mm", "shortest": "0.4 mm"}
    output = {"channels": CHANNELS[:3], "sample_rate": rate, "bandwidth": band}
    scene = parse_scene({
        "finger": {"kind": finger, "contact_length": "3 mm"},
        "texture": texture,
        "scan": {"speed": speed, "load": load},
        "output": output,
    })  # fmt: skip
    voice = open_voice(scene, live=True, cache=CACHE)
    reach = speed * frames / rate / (2.0 * math.pi)
    place = 4e-3 + reach * np.cos(2.0 * math.pi * np.arange(frames) / frames)
    motion = Motion.of(4 * frames, position=np.tile(place, 4), load=load)
    felt = voice.render(4 * frames, motion).astype(float) * np.array(voice.full_scale)
    found = np.ascontiguousarray(felt[voice.late + 2 * frames :][:frames].T)
    k = Stiffness.of_scene(scene).stiffness(load)
    profile = profile_of(scene)
    every = 4
    series = np.fft.rfft(approach(scene.finger, profile, place[::every] / profile.period, load / k)) * every
    series = np.append(series, np.zeros(frames // 2 + 1 - len(series)))
    hertz = np.arange(len(series)) * rate / frames
    series[hertz > band] = 0.0
    wanted: Real = np.array([np.fft.irfft(series * (2j * math.pi * hertz) ** order, frames) for order in range(3)])
    hand_plan = voice._for_hand
    assert hand_plan is not None
    assert hand_plan.direct is not None
    return found, wanted, {one.quantity: one.error for one in hand_plan.channels}


@pytest.mark.parametrize("order", range(3))
def test_a_hand_on_a_long_surface_follows_the_oracle_within_the_told_error(order: int) -> None:
    found, wanted, told = swung("comb")
    here, there = in_band(found[order], 8000, 250.0), in_band(wanted[order], 8000, 250.0)
    assert np.max(np.abs(here - there)) <= told[CHANNELS[order]] * np.ptp(there)
    assert told[CHANNELS[order]] <= 0.02


def lines(samples: Real, rate: int) -> tuple[Real, Real]:
    """Return the frequencies (Hz) and amplitudes of a windowed run."""
    window = np.hanning(len(samples))
    hertz, series = np.fft.rfftfreq(len(samples), 1.0 / rate), np.fft.rfft(samples * window)
    return np.asarray(hertz, np.float64), np.abs(series) * 2.0 / np.sum(window)


@pytest.mark.parametrize("finger", ["comb", thorough("fingertip")])
def test_the_spectrum_of_a_rough_surface_live_is_that_of_its_exact_file_up_to_the_band(finger: str) -> None:
    speed, load, seconds = 0.08, 0.3, 0.5
    scene = document(finger={"kind": finger}, scan={"speed": speed, "load": load})
    scene["output"] = {"quantity": "acceleration", "duration": seconds}
    file = rw.render(scene).values[:, 0]
    voice = open_voice(scene, live=True, cache=CACHE)
    frames = len(file)
    place = speed * np.arange(-2000, frames + voice.late) / RATE
    felt = voice.render(len(place), Motion.of(len(place), position=place, load=load)).astype(float)[:, 0]
    live = felt[2000 + voice.late :] * voice.full_scale[0]
    told = voice._for_hand.channels[0].error  # type: ignore[union-attr]
    hertz, of_live = lines(live, RATE)
    _hertz, of_file = lines(file, RATE)
    kept = hertz < 1000.0
    assert np.max(np.abs(of_live - of_file)[kept]) <= told * np.ptp(file)
    assert np.sum(of_file[(hertz > 300.0) & kept] ** 2) > 0.01 * np.sum(of_file[kept] ** 2)  # the table ended at 256 Hz
    ratio = np.sqrt(np.sum(of_live[(hertz > 300.0) & kept] ** 2) / np.sum(of_file[(hertz > 300.0) & kept] ** 2))
    assert abs(ratio - 1.0) < 0.05


def test_nothing_is_left_above_twice_the_band() -> None:
    voice = hand("comb")
    frames = 24000
    felt = voice.render(frames, Motion.of(frames, position=0.3 * np.arange(frames) / RATE, load=0.3))[1000:, 2]
    hertz, sizes = lines(felt.astype(float), RATE)
    assert np.max(sizes[hertz > 2000.0]) <= 0.01 * np.max(sizes[hertz < 1000.0])


def test_a_streamed_stroke_is_solved_directly_and_may_be_read_in_any_order() -> None:
    scene = parse_scene(document(scan={"stroke": {"length": "30 mm", "speed": "80 mm/s", "load": "0.3 N"}}))
    assert LiveVoice(scene, cache=CACHE).plan.response["method"] == "direct solutions"
    voice = Voice(prepare(scene, CACHE, paced=True), paced=True, cache=CACHE)
    whole = voice.render(9000)
    voice.seek(5000)
    assert np.array_equal(voice.render(3000), whole[5000:8000])
    assert np.max(np.abs(whole)) > 0.1


def test_exact_solves_more_often_and_is_as_late() -> None:
    scene = parse_scene(document(accuracy={"tolerance": 1e-3}))
    usual, exact = (prepare_hand(scene, (None,) * 4, CACHE, exact=one) for one in (False, True))
    assert exact.direct is not None
    assert usual.direct is not None
    assert exact.direct.rate > usual.direct.rate
    assert max(exact.direct.errors) < max(usual.direct.errors)
    assert reader_of(exact).delay == reader_of(usual).delay


WAVE_PERIOD, STEP = 0.8e-3, 2e-6
CHORDS = (2.0 * math.pi * STEP / WAVE_PERIOD) ** 2 / 8.0  # of the amplitude: how far chords lie below the crests


@cache
def sampled(length: float, ends: str) -> dict[str, Any]:
    """Return a texture of the heights of a sinusoid over `length` (m), whole periods of it."""
    count = round(length / STEP) + (ends == "mirror")
    heights = 20e-6 * np.cos(2.0 * math.pi * STEP / WAVE_PERIOD * np.arange(count))
    address = remember(SurfaceData(heights.astype(np.float32), (STEP,)))
    return {"kind": "profile", "surface": address, "ends": ends, "phase": 0.0}


STIFF = {"stiffness": 1e4, "contact_length": "3 mm"}  # eqs 4-5 take the rms of heights, which chords lower
SINUSOID = {"period": WAVE_PERIOD, "amplitude": 20e-6, "phase": 0.0}
AS_SAMPLED = pytest.mark.parametrize(("length", "ends"), [(2.4e-3, "join"), thorough(0.24, "join"), (0.24, "mirror")])


@cache
def filed(length: float = 0.0, ends: str = "") -> rw.Sound:
    """Return a file over a sampled sinusoid, or over the sinusoid."""
    output = {"channels": CHANNELS[:3], "duration": 0.4, "sample_rate": 8000}  # 15 periods
    texture = sampled(length, ends) if ends else SINUSOID
    return rw.render({"finger": STIFF, "texture": texture, "scan": {"speed": 0.03}, "output": output})


@AS_SAMPLED
def test_a_sampled_sinusoid_is_a_sinusoid_in_a_file(length: float, ends: str) -> None:
    plain, other = filed(), filed(length, ends)
    for number, name in enumerate(CHANNELS[:3]):
        assert plain.plan is not None
        assert other.plan is not None
        told = plain.plan.estimated_error[name] + other.plan.estimated_error[name]
        # beyond 0.92 of the band a scan of constant speed keeps its lines, and solved frames fade
        here, there = (in_band(sound.values[:, number], 8000, 920.0) for sound in (plain, other))
        assert np.max(np.abs(here - there)) <= (told + CHORDS) * np.ptp(here)


@cache
def touched(length: float = 0.0, ends: str = "") -> tuple[Real, Real]:
    """Return what a hand feels in the band on a sampled sinusoid, or on the sinusoid, and the errors that are told."""
    output = {"channels": CHANNELS[:3], "full_scale": None}
    texture = sampled(length, ends) if ends else SINUSOID
    scene = {"finger": STIFF, "texture": texture, "scan": {"speed": 0.03}, "output": output}
    voice = open_voice(scene, live=True, cache=CACHE)
    t = np.arange(-2000, 4800 + voice.late) / RATE
    place = 0.8e-3 * np.sin(2.0 * math.pi * 10.0 * t)
    felt = voice.render(len(t), Motion.of(len(t), position=place, load=0.3)).astype(float)
    found = (felt * np.array(voice.full_scale))[2000 + voice.late :]
    assert voice._for_hand is not None
    return in_band(found, RATE, 1000.0), np.array([one.error for one in voice._for_hand.channels])


@AS_SAMPLED
def test_a_sampled_sinusoid_is_a_sinusoid_under_a_hand(length: float, ends: str) -> None:
    (plain, told), (other, more) = touched(), touched(length, ends)
    assert np.all(np.max(np.abs(plain - other), axis=0) <= (told + more) * np.ptp(plain, axis=0))
