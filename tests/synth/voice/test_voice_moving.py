"""A voice with changing speed and load: against the oracle, its own derivatives, and the band limit at any instant."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from synth.motion.motion import Motion
from synth.motion.scan_motion import ScanMotion
from synth.response.mip_levels import MipLevels
from synth.scene.scene import parse_scene
from synth.voice.voice import Voice, open_voice
from tests.few import few, paired
from tests.reference.spectral_checks import fit_harmonics
from tests.reference.synthesis_oracle import direct, synthesise
from tests.synth.engine_cases import QUANTITIES, Real, physical, scene_of, touch_of

RATE = 8000
PERIOD = 0.8e-3
SHORT = {"contact_length": "3 mm"}  # few ridges: quick to solve, for the oracle too
SLOW = [[0, 0, 0.3], [0.3, 3e-3, 0.4], [0.6, 6e-3, 0.2], [0.9, 8.5e-3, 0.3], [1.2, 1e-2, 0.35]]


def even(frames: int, speed: float, load: float, position: bool = False) -> Motion:
    """Return an evenly moving hand, with all its derivatives."""
    fields: dict[str, Any] = {"position": speed * np.arange(frames) / RATE} if position else {}
    return Motion.of(frames, speed=speed, load=load, speed_rate=0.0, load_rate=0.0, load_bend=0.0, **fields)


def swaying(frames: int, rate: int, speed: float, sway: float, load: float = 0.3, press: float = 0.08) -> Motion:
    t = np.arange(frames) / rate
    return Motion.of(
        frames,
        position=speed * t + sway / 20 * (1 - np.cos(20 * t)),
        speed=speed + sway * np.sin(20 * t),
        speed_rate=20 * sway * np.cos(20 * t),
        load=load + press * np.sin(60 * t),
        load_rate=60 * press * np.cos(60 * t),
        load_bend=-3600 * press * np.sin(60 * t),
    )


def hand_signal(voice: Voice, motion: Motion) -> Real:
    """Return the signal at the frames of a hand's motion, SI [frames - late, channels], without the late frames."""
    felt = voice.render(motion.frames, motion).astype(float) * np.array(voice.full_scale)
    return np.asarray(felt[voice.late :])


def even_signal(voice: Voice, frames: int, speed: float, load: float, position: bool = False) -> Real:
    """Return the first channel of `frames` frames of an evenly moving hand."""
    return hand_signal(voice, even(frames + 200, speed, load, position))[:frames, 0]


def test_a_trajectory_follows_the_oracle_over_position_and_load() -> None:
    scene = scene_of(finger=SHORT, scan={"trajectory": SLOW}, output={"quantity": "displacement", "sample_rate": RATE})
    frames = round(1.2 * RATE)
    found = physical(open_voice(scene), frames)[:, 0]
    motion = ScanMotion(scene).at(0, frames)
    some = np.arange(0, frames, 193)
    wanted = direct(touch_of(scene), motion.position[some], motion.samples[2, some], mean_phases=96)
    assert np.max(np.abs(found[some] - wanted)) <= 1e-3 * np.ptp(wanted)


def test_a_hand_follows_the_oracle_over_position_and_load() -> None:
    output = {"quantity": "displacement", "sample_rate": RATE, "bandwidth": 1000}
    scene = scene_of(finger=SHORT, scan={"speed": 0.02}, output=output)
    motion, voice = swaying(2 * RATE // 5, RATE, 0.02, 0.004), open_voice(scene)
    found = hand_signal(voice, motion)[:, 0]
    some = np.arange(0, len(found), 59)
    wanted = direct(touch_of(scene), motion.position[some], motion.samples[2, some], mean_phases=96)
    assert np.max(np.abs(found[some] - wanted)) <= voice.plan.estimated_error["displacement"] * np.ptp(wanted)
    assert voice.plan.estimated_error["displacement"] <= 1e-2  # the band has 80 harmonics, the table 64


def plateau(bandwidth: float) -> float:
    """Return a speed (m/s) near which no level fades: the voice is then a fixed sum of harmonics."""
    levels = MipLevels.up_to(64)
    begin, end = levels.fades
    level = next(k for k, top in enumerate(levels.highest) if top <= 10)
    return float(0.5 * (end[level - 1] + begin[level]) * bandwidth * PERIOD)


def test_velocity_and_acceleration_are_the_derivatives_of_what_sounds() -> None:
    finer, narrow = 8, 300.0
    output = {"channels": list(QUANTITIES), "sample_rate": RATE, "bandwidth": narrow}
    document: dict[str, Any] = {"output": output, "scan": {"speed": 0.02}}
    faster = {**document, "output": {**output, "sample_rate": finer * RATE}}
    speed = plateau(narrow)
    coarse = hand_signal(open_voice(parse_scene(document)), swaying(1200, RATE, speed, 0.05 * speed))
    fine = hand_signal(open_voice(parse_scene(faster)), swaying(1200 * finer, finer * RATE, speed, 0.05 * speed))
    last = min(len(coarse), len(fine) // finer) - 2
    for order, bound in ((1, 2e-3), (2, 2e-3)):
        before = fine[:, order - 1]
        step = finer // 2
        place = np.arange(20, last) * finer
        slope = (
            before[place - 2 * step] - 8 * before[place - step] + 8 * before[place + step] - before[place + 2 * step]
        ) * (finer * RATE / step / 12)
        assert np.max(np.abs(slope - coarse[20:last, order])) <= bound * np.ptp(slope)
    pressing = (
        coarse[:, 1]
        - hand_signal(open_voice(parse_scene(document)), swaying(1200, RATE, speed, 0.05 * speed, press=0.0))[:, 1]
    )
    assert np.ptp(pressing) > 1e-2 * np.ptp(coarse[:, 1])  # the changing load has a larger effect than the bound


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_a_load_that_crosses_rows_makes_no_step(quantity: str) -> None:
    output = {"quantity": quantity, "sample_rate": RATE, "bandwidth": 300}
    document: dict[str, Any] = {"output": output, "scan": {"speed": 0.02}}
    frames = 6000
    t = np.arange(frames) / RATE
    press = Motion.of(frames, speed=plateau(300.0), speed_rate=0.0, load=0.05 + 0.6 * t, load_rate=0.6, load_bend=0.0)
    signal = hand_signal(open_voice(parse_scene(document)), press)[:, 0]
    steps = np.abs(np.diff(signal))
    around = np.array([np.sort(steps[max(0, i - 40) : i + 40])[-4] for i in range(len(steps))])
    assert np.max(steps / np.maximum(around, 0.02 * np.max(steps))) < 1.5  # no step is much larger than its neighbours


@pytest.mark.parametrize("quantity", few(QUANTITIES, 2))
def test_level_changes_make_no_step(quantity: str) -> None:
    scene = scene_of(output={"quantity": quantity, "sample_rate": RATE})
    frames, slow, fast = RATE, 0.02, 4.0
    t = np.arange(frames) / RATE
    growth = np.log(fast / slow)
    speed = slow * np.exp(growth * t)
    chirp = Motion.of(frames, speed=speed, speed_rate=growth * speed, load=0.3, load_rate=0.0, load_bend=0.0)
    signal = hand_signal(open_voice(scene), chirp)[:, 0]
    steps, speed = np.abs(np.diff(signal)), speed[: len(signal)]
    # the largest possible step of such harmonics at each speed, from even motion
    for u in np.geomspace(0.03, 3.0, 7):
        here = np.abs(speed[:-1] / u - 1.0) < 0.1
        largest = 0.0
        for factor in (0.9, 0.95, 1.0, 1.05, 1.1):
            evenly = even_signal(open_voice(scene), 1500, u * factor, 0.3)
            largest = max(largest, float(np.max(np.abs(np.diff(evenly)))))
        assert np.max(steps[here]) <= 1.1 * largest + 1e-3 * np.max(np.abs(signal)) / 8


@pytest.mark.parametrize("speed", few([0.0563, 0.1113, 0.2217, 0.4441, 0.8883, 1.7771, 2.5], 3))
def test_none_above_049_and_none_below_035_at_the_speed_of_the_hand(speed: float) -> None:
    output = {"quantity": "acceleration", "sample_rate": RATE, "full_scale": 1.0}
    hand = even_signal(open_voice(scene_of(scan={"speed": 0.05}, output=output)), RATE, speed, 0.3)
    fundamental = speed / PERIOD
    found = fit_harmonics(hand, RATE, fundamental, 0.495 * RATE).coefficients
    scene = scene_of(scan={"speed": speed}, output=output)
    wanted = fit_harmonics(physical(open_voice(scene), RATE)[:, 0], RATE, fundamental, 0.495 * RATE).coefficients
    frequency = np.arange(found.size) * fundamental
    largest = float(np.max(np.abs(wanted)))
    assert np.max(np.abs(found[frequency > 0.49 * RATE]), initial=0.0) <= 1e-3 * largest
    low = (frequency < 0.35 * RATE) & (frequency > 0)
    assert np.max(np.abs(found - wanted)[low], initial=0.0) <= 2e-2 * largest
    residue = hand - fit_harmonics(hand, RATE, fundamental, 0.495 * RATE).signal(np.arange(RATE), mean=True)
    assert np.max(np.abs(residue)) <= 2e-3 * np.ptp(hand)


@pytest.mark.parametrize("quantity", few(QUANTITIES, 1))
def test_a_hand_slower_than_the_scan_loses_no_harmonic(quantity: str) -> None:
    output = {"quantity": quantity, "sample_rate": RATE, "full_scale": 1.0}
    slower = even_signal(open_voice(scene_of(scan={"speed": 0.08}, output=output)), 3000, 0.04, 0.3)
    steady = physical(open_voice(scene_of(scan={"speed": 0.04}, output=output)), 3000)[:, 0]
    fundamental = 0.04 / PERIOD
    both = [fit_harmonics(signal, RATE, fundamental, 0.495 * RATE).coefficients for signal in (slower, steady)]
    low = np.arange(both[0].size) * fundamental < 0.35 * RATE
    assert np.max(np.abs(both[0] - both[1])[low]) <= 3e-2 * np.max(np.abs(both[1]))


@pytest.mark.parametrize("scan_load", [0.0, 60.0])
def test_a_hand_may_press_otherwise_than_the_scan(scan_load: float) -> None:
    output = {"quantity": "velocity", "sample_rate": RATE, "full_scale": 1.0}
    voice = open_voice(scene_of(scan={"load": scan_load}, output=output))
    found = even_signal(voice, 1000, 0.08, 0.3, position=True)
    steady = physical(open_voice(scene_of(output=output)), 1000)[:, 0]
    fits = [fit_harmonics(signal, RATE, 100.0, 0.495 * RATE).coefficients for signal in (found, steady)]
    low = np.arange(fits[0].size) * 100.0 < 0.35 * RATE
    assert np.max(np.abs(fits[0] - fits[1])[low]) <= 5e-3 * np.max(np.abs(fits[1]))


@pytest.mark.parametrize(("quantity", "load"), paired(QUANTITIES, [0.11, 0.3712, 0.9]))
def test_a_hand_that_presses_evenly_keeps_the_error_told_at_any_load(quantity: str, load: float) -> None:
    """Against the oracle, below the frequency at which a hand's harmonics begin to fade."""
    output = {"quantity": quantity, "sample_rate": RATE, "full_scale": 1.0, "bandwidth": 1050}
    voice = open_voice(scene_of(finger=SHORT, output=output))
    found = fit_harmonics(even_signal(voice, RATE, 0.08, load), RATE, 100.0, 0.495 * RATE).coefficients
    pressed = scene_of(finger=SHORT, scan={"load": load}, output=output)
    wanted = synthesise(touch_of(pressed), 0.08, 1050.0, relative_error=1e-5)
    spectrum = wanted.spectrum(quantity)
    apart = np.zeros(512 + 1, dtype=complex)
    apart[1 : len(spectrum) + 1] = found[1 : len(spectrum) + 1] - spectrum
    error = np.max(np.abs(np.fft.irfft(apart, norm="forward"))) / wanted.peak_to_peak(quantity)
    told = voice.plan.estimated_error[quantity]
    assert error <= told <= {"displacement": 2e-3, "velocity": 5e-3, "acceleration": 1.5e-2}[quantity]


@pytest.mark.parametrize("quiet", [{"scan": {"load": 0}}, {"scan": {"speed": 0}}, {"scan": {"speed": 10}}], ids=str)
def test_a_live_hand_is_heard_on_a_scene_that_is_silent_by_itself(quiet: dict[str, Any]) -> None:
    output = {"quantity": "acceleration", "sample_rate": RATE}
    voice = open_voice(scene_of(output=output, **quiet), live=True)
    room = voice.full_scale[0] / open_voice(scene_of(output=output)).full_scale[0]  # for heavier and faster hands
    assert 0.2 <= room * np.max(np.abs(voice.render(800, even(800, 0.08, 0.3)))) <= 2.0 and room < 10.0


def test_a_trajectory_that_ends_heavy_sounds_full_where_it_is_light() -> None:
    points = [[0, 0, 0.3], [0.2, 8e-3, 0.3], [0.4, 16e-3, 0.3], [0.6, 24e-3, 6.0], [0.8, 32e-3, 6.0]]
    output = {"quantity": "displacement", "sample_rate": RATE}
    scene = scene_of(finger=SHORT, scan={"trajectory": points}, output=output)
    frames = round(0.35 * RATE)
    found = physical(open_voice(scene), frames)[:, 0]
    motion = ScanMotion(scene).at(0, frames)
    some = np.arange(0, frames, 29)
    some = some[motion.samples[2, some] >= scene.scan.lift_load]  # the spline lifts the finger before it presses
    wanted = direct(touch_of(scene), motion.position[some], motion.samples[2, some], mean_phases=96)
    assert np.max(np.abs(found[some] - wanted)) <= 5e-3 * np.ptp(wanted)


def test_a_stroke_too_fast_for_the_band_sounds_where_it_is_slow() -> None:
    scene = scene_of(
        scan={"stroke": {"speed": 1.0, "length": 0.1}},
        texture={"period": "0.25 mm"},
        output={"quantity": "displacement", "sample_rate": RATE, "full_scale": "10 um"},
    )
    block = open_voice(scene).render(200)  # begins at rest: 0.25 m/s, 1 kHz, are passed within 10 ms
    assert np.abs(block[:60]).max() > 0.01


@pytest.mark.parametrize("field", ["position", "load"])
def test_a_hand_without_derivatives_does_not_click_at_its_first_frames(field: str) -> None:
    scene = scene_of(output={"quantity": "acceleration", "sample_rate": RATE, "bandwidth": 400, "full_scale": 1.0})
    frames = 400
    t = np.arange(frames) / RATE
    loads = 0.3 + 0.5 * t if field == "load" else np.full(frames, 0.3)
    rates = {"speed_rate": 0.0, "load_rate": 0.5 if field == "load" else 0.0, "load_bend": 0.0}
    told = Motion.of(frames, position=0.05 * t, speed=0.05, load=loads, **rates)
    along = {"position": 0.05 * t} if field == "position" else {"speed": 0.05}
    guessed = Motion.of(frames, load=loads, **along)
    wanted, found = (hand_signal(open_voice(scene), motion)[:, 0] for motion in (told, guessed))
    assert np.max(np.abs(found - wanted)[2:]) <= 0.02 * np.ptp(wanted)
    assert np.max(np.abs(found)) <= 1.05 * np.max(np.abs(wanted))


def test_after_a_hand_the_scan_goes_on_without_a_step() -> None:
    scene = scene_of(output={"quantity": "displacement", "sample_rate": RATE, "bandwidth": 1000})
    voice = open_voice(scene)
    signal = np.concatenate([voice.render(300, even(300, 0.08, 0.3)), voice.render(600)])[voice.late :, 0]
    steady = open_voice(scene).render(900)[: len(signal), 0]
    assert np.max(np.abs(np.diff(signal))) <= 1.1 * np.max(np.abs(np.diff(steady)))
    assert np.max(np.abs(fit_harmonics(signal - steady, RATE, 100.0, 990.0).coefficients)) <= 2e-3
