"""24 hours of stream: the phase keeps 1e-9 turn, and a frame by itself is the frame that a stream comes to."""

from __future__ import annotations

import functools
from fractions import Fraction

import numpy as np
import pytest

from synth.motion.motion import Motion
from synth.motion.scan_motion import ScanMotion
from synth.scene.scan_section import Stroke
from synth.scene.scene import Scene
from synth.voice.voice import open_voice
from tests.few import paired
from tests.reference.synthesis_oracle import SteadySpectrum, synthesise
from tests.synth.engine_cases import QUANTITIES, Real, physical, scene_of, touch_of
from tests.synth.hard.bounds import ALL, check_fit

DAY = 86400  # s
ALLOWED = Fraction(1, 10**9)  # turn
RATES = (1000, 8000, 44100, 48000, 192000)
PERIOD = 0.8e-3
NARROW = {**ALL, "bandwidth": 400.0}
SHORT = {"contact_length": "2 mm"}  # few ridges: quick to solve
STROKES: tuple[dict[str, object], ...] = (
    {},
    {"speed": 10, "length": 10},
    {"speed": 10, "length": 0.5, "turn_time": 0.05},
    {"length": "5 mm"},
)


def off(found: int, turns: Fraction) -> Fraction:
    """Return how far a phase (a 64-bit fraction of a turn) is from `turns`, in turns."""
    apart = (Fraction(found, 2**64) - turns) % 1
    return min(apart, 1 - apart)


@pytest.mark.parametrize(("rate", "speed"), paired(RATES, (0.08, -0.0777, 1.2345, 1e-9, 2.3e-308, -10.0)))
def test_the_phase_of_a_steady_scan_after_24_hours(rate: int, speed: float) -> None:
    voice = open_voice(scene_of(finger=SHORT, scan={"speed": speed}, output={**NARROW, "sample_rate": rate}))
    frame = DAY * rate + 12345
    voice.seek(frame)
    assert off(voice.phase, Fraction(speed) * frame / (Fraction(PERIOD) * rate)) < ALLOWED


def wide(speed: float, tolerance: float) -> Scene:
    output = {**ALL, "bandwidth": 2000.0}
    return scene_of(finger=SHORT, scan={"speed": speed}, output=output, accuracy={"tolerance": tolerance})


@functools.cache
def oracle_of(speed: float, error: float) -> SteadySpectrum:
    return synthesise(touch_of(wide(speed, error)), speed, 2000.0, relative_error=error)


@pytest.mark.parametrize("frame", [10**6, DAY * 48000 - 300, 2**32 - 77, 2**40 + 1])
@pytest.mark.parametrize("speed", [0.0801, -1.2345])
def test_late_frames_are_those_of_the_oracle(frame: int, speed: float) -> None:
    """The oracle takes its phase in 64 bits from the frame number: 1e-11 turn is left of them at frame 2^40."""
    tolerance = 1e-5
    voice = open_voice(wide(speed, tolerance))
    voice.seek(frame)
    found, wanted = physical(voice, 600), oracle_of(speed, 0.01 * tolerance)
    for channel, quantity in enumerate(QUANTITIES):
        truth = wanted.signal(quantity, frame + np.arange(600), 48000)
        assert np.max(np.abs(found[:, channel] - truth)) <= tolerance * wanted.peak_to_peak(quantity)


def test_a_day_streamed_block_after_block_ends_where_a_seek_goes() -> None:
    """The whole day at 1 kHz, 86.4 million frames; every block is looked at."""
    scene = scene_of(scan={"speed": 0.0613}, output={"quantity": "displacement", "sample_rate": 1000})
    streamed, sought = open_voice(scene), open_voice(scene)
    size = 200_000
    for first in range(0, DAY * 1000, size):
        block = streamed.render(size)
        sought.seek(first + size - 5)
        assert np.array_equal(sought.render(5), block[-5:])
        assert 0.5 < float(np.max(block)) <= 0.801
    assert streamed.frame == DAY * 1000
    turns = Fraction(0.0613) * DAY / Fraction(PERIOD)
    assert off(streamed.phase, turns) < ALLOWED


@pytest.mark.parametrize("scan", [{}, {"speed": -10.0}, *({"stroke": stroke} for stroke in STROKES)], ids=str)
def test_a_frame_by_seek_is_the_frame_streamed_across_24_hours(scan: dict[str, object]) -> None:
    scene = scene_of(finger=SHORT, scan=scan, output=NARROW, accuracy={"tolerance": 1e-2})
    streamed, sought = open_voice(scene), open_voice(scene)
    begin = DAY * 48000 - 3000
    streamed.seek(begin)
    whole = np.concatenate([streamed.render(size) for size in (1, 999, 2000, 1, 2999)])
    check_fit(streamed, whole)
    for frame in (0, 1, 777, 2999, 3000, 5990):
        sought.seek(begin + frame)
        assert np.array_equal(sought.render(10), whole[frame : frame + 10])


def place_in_a_stroke(stroke: Stroke, frame: int, rate: int) -> Fraction:
    """Return where a stroke is (m), in exact arithmetic on its own speed, turns and cruise."""
    speed, turn, cruise = Fraction(stroke.speed), Fraction(stroke.turn_time), Fraction(stroke.cruise_time)
    half, reach = cruise + turn, Fraction(5, 16) * speed * turn
    back, local = divmod(Fraction(frame, rate), half)

    def turning(s: Fraction) -> Fraction:
        return speed * turn * (s - 2 * s**3 + s**4)

    if local < turn / 2:
        travel = reach - turning(Fraction(1, 2) + local / turn)
    elif local > turn / 2 + cruise:
        travel = reach + speed * cruise + turning((local - turn / 2 - cruise) / turn)
    else:
        travel = reach + speed * (local - turn / 2)
    return 2 * reach + speed * cruise - travel if back % 2 else travel


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("fields", STROKES, ids=str)
def test_the_phase_of_a_stroke_after_24_hours(fields: dict[str, object], rate: int) -> None:
    scene = scene_of(finger=SHORT, scan={"stroke": fields}, output={"sample_rate": rate})
    stroke, first = scene.scan.stroke, DAY * rate - 100
    assert stroke is not None
    frames = round(stroke.period * rate) + 1
    position = ScanMotion(scene).at(first, frames).position
    for i in range(0, frames, max(1, frames // 200)):
        wanted = place_in_a_stroke(stroke, first + i, rate)
        assert abs(Fraction(float(position[i])) - wanted) / Fraction(PERIOD) < ALLOWED


RANDOM = np.random.default_rng(70)
BLOCK = 1 << 16
HANDS: dict[str, Real | float] = {
    "0.08 m/s": 0.08,
    "backwards": -0.0777,
    "fast": 1.2345,
    "as fast as it goes": 10.0,
    "a nanometre a second": 1e-9,
    "any speed": RANDOM.uniform(-0.1, 0.2, BLOCK),
    "a hand that trembles": 0.02 + 0.2 * RANDOM.standard_normal(BLOCK),
}


def exact_sum(values: Real) -> Fraction:
    """Return the sum without rounding; equal values are counted."""
    different, counts = np.unique(values, return_counts=True)
    return sum(
        (Fraction(one) * count for one, count in zip(different.tolist(), counts.tolist(), strict=True)), Fraction(0)
    )


@pytest.mark.parametrize(("rate", "name"), paired([8000, 44100, 192000], HANDS))
def test_the_phase_of_a_hand_keeps_a_billionth_of_a_turn_a_day(name: str, rate: int) -> None:
    """A speed that does not change makes the same error at each frame, so what a few seconds leave grows in proportion:
    in 24 hours, to this many times as much. Errors of a speed that changes add up to less than in proportion.
    """
    speed, blocks = HANDS[name], 10
    output = {**NARROW, "sample_rate": rate}
    voice = open_voice(scene_of(finger=SHORT, output=output, accuracy={"tolerance": 3e-2}))
    speed_rate = np.gradient(speed) * rate if isinstance(speed, np.ndarray) else 0.0
    motion = Motion.of(BLOCK, speed=speed, load=0.3, speed_rate=speed_rate, load_rate=0.0, load_bend=0.0)
    for _ in range(blocks):
        voice.render(BLOCK, motion)
    speeds, rates = (exact_sum(row) for row in motion.samples[:2])
    turns = blocks * (speeds + rates / (2 * rate)) / (Fraction(PERIOD) * rate)
    assert off(voice.phase, turns) * DAY * rate / (blocks * BLOCK) < ALLOWED


def test_after_a_hand_the_scan_goes_on_without_drift() -> None:
    scene = scene_of(finger=SHORT, scan={"speed": 0.0613}, output=NARROW, accuracy={"tolerance": 3e-2})
    voice = open_voice(scene)
    voice.render(BLOCK, Motion.of(BLOCK, speed=0.1, load=0.3, speed_rate=0.0, load_rate=0.0, load_bend=0.0))
    for _ in range(40):
        voice.render(BLOCK)
    turns = BLOCK * (Fraction(0.1) + 40 * Fraction(0.0613)) / (Fraction(PERIOD) * 48000)
    assert off(voice.phase, turns) * DAY * 48000 / (41 * BLOCK) < ALLOWED
