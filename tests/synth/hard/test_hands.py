"""Hands at the ends of what they may do, one row a hand: bounds, blocks that do not matter, the oracle's places, and
live voices that stay within full scale.

Model   displacement is within (pi / sqrt 3) a2 at any load that stands still (`bounds`), and within the tolerance of it
        between rows of load; where the load does not change velocity and acceleration are held by `bounds` too, the
        latter with the du/dt of the hand.
"""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest

from synth.arrays import Block
from synth.motion.motion import Motion
from synth.plan.request import N_MAX
from synth.response.reading_filter import reading_filter
from synth.scene.scene import Scene
from synth.voice.limiter import Limiter
from synth.voice.live_voice import LiveVoice
from synth.voice.voice import open_voice
from tests.few import few, paired
from tests.reference.synthesis_oracle import direct
from tests.synth.engine_cases import QUANTITIES, Real, scene_of, touch_of
from tests.synth.hard.bounds import ALL, BAND, MOST_DISPLACEMENT, MOVING_REMOVED, finite, merged, overshoot
from tests.synth.hard.test_scans import touching

FRAMES, RATE, BANDWIDTH, TOLERANCE = 2400, 8000, 600.0, 1e-2
TIME = np.arange(FRAMES) / RATE
PERIOD, HEIGHT = 0.8e-3, 20e-6
RANDOM = np.random.default_rng(77)
NUMBERS = np.arange(FRAMES)
HANDS: dict[str, dict[str, Any]] = {
    "a load that drops to nothing and returns": {
        "speed": 0.04,
        "load": np.where((TIME > 0.1) & (TIME < 0.2), 0.0, 0.3),
    },
    "a load that fades to nothing and returns": {"speed": 0.04, "load": 0.3 * np.cos(20 * TIME) ** 2},
    "a load that steps at every frame": {"speed": 0.04, "load": np.where(NUMBERS % 2, 0.25, 0.35)},
    "a load of every size at every frame": {"speed": 0.04, "load": 10.0 ** RANDOM.uniform(-9, 3, FRAMES)},
    "noisy force at 1 kHz": {
        "speed": 0.04,
        "load": np.interp(TIME, np.arange(400) / 1000, 0.3 + 0.02 * RANDOM.standard_normal(400)),
    },
    "loads from a nanonewton to a kilonewton": {"speed": 0.04, "load": 10.0 ** np.interp(TIME, [0, 0.3], [-9, 3])},
    "no load at all": {"speed": 0.04, "load": 0.0},
    "a nanonewton": {"speed": 0.04, "load": 1e-9},
    "a kilonewton": {"speed": 0.04, "load": 1e3},
    "a reversal in mid-block": {"speed": np.where(TIME < 0.1537, 0.04, -0.04), "load": 0.3},
    "speed steps": {"speed": np.where((NUMBERS // 100) % 2, 0.3, 0.02), "load": 0.3},
    "a speed that steps at every frame": {"speed": np.where(NUMBERS % 2, -0.1, 0.3), "load": 0.3},
    "no speed at all": {"speed": 0.0, "load": 0.3},
    "a nanometre a second": {"speed": 1e-9, "load": 0.3},
    "10 m/s": {"speed": 10.0, "load": 0.3},
    "a hand that jumps": {"position": RANDOM.uniform(-1e3, 1e3, FRAMES), "load": 0.3},
    "a hand that trembles": {"position": 1e-6 * np.cumsum(RANDOM.standard_normal(FRAMES)), "load": 0.3},
    "the smallest numbers": {"speed": 5e-324, "load": 5e-324, "speed_rate": 5e-324, "load_rate": 5e-324,
                             "load_bend": 5e-324},
    "the smallest numbers of a load that presses": {"position": 5e-324, "load": 0.3, "speed": 1e-310,
                                                    "speed_rate": -5e-324, "load_rate": 1e-310, "load_bend": 5e-324},
    "far too fast": {"speed": 1e30, "load": 0.3},
    "far too heavy": {"speed": 0.04, "load": 1e30},
    "pulled, not pressed": {"speed": 0.04, "load": -1e30},
}  # fmt: skip
STILL = ("a hand that jumps", "no load at all", "no speed at all", "10 m/s", "far too fast", "pulled, not pressed")


LATE = reading_filter("displacement", RATE, BANDWIDTH).delay


def scene() -> Scene:
    output = {**ALL, "sample_rate": RATE, "bandwidth": BANDWIDTH}
    finger = {"contact_length": 2.5e-3}  # few ridges: quick to solve
    return scene_of(finger=finger, output=output, accuracy={"tolerance": TOLERANCE})


def part_of(fields: dict[str, Any], first: int, last: int) -> Motion:
    at = {key: value[first:last] if isinstance(value, np.ndarray) else value for key, value in fields.items()}
    return Motion.of(last - first, **at)


def rendered(fields: dict[str, Any], sizes: list[int]) -> Block:
    voice = open_voice(scene())
    ends = [0, *itertools.accumulate(sizes)]
    return np.concatenate([voice.render(b - a, part_of(fields, a, b)) for a, b in itertools.pairwise(ends)])


def check_hand(whole: Block, fields: dict[str, Any]) -> None:
    """Assert the bounds that hold for a hand."""
    assert finite(whole)
    assert np.max(np.abs(whole[:, 0])) <= MOST_DISPLACEMENT * HEIGHT * (1.0 + 2.0 * TOLERANCE)
    if "speed" not in fields or isinstance(fields["load"], np.ndarray):
        return
    speed = np.broadcast_to(fields["speed"], FRAMES)
    turns = min(float(np.max(np.abs(speed))) / PERIOD, MOVING_REMOVED * RATE)  # faster than that is silence
    bend = float(np.max(np.abs(np.diff(speed)))) * RATE / PERIOD
    slope = 2.0 * math.pi * HEIGHT * overshoot(N_MAX) * (1.0 + 2.0 * TOLERANCE)
    highest = 2.0 * math.pi * MOVING_REMOVED * BANDWIDTH / BAND
    assert np.max(np.abs(whole[:, 1])) <= slope * turns
    assert np.max(np.abs(whole[:, 2])) <= slope * (turns * highest + bend)


@pytest.mark.parametrize("name", few(HANDS, 11))
def test_a_hard_hand_stays_within_bounds_and_its_blocks_do_not_matter(name: str) -> None:
    fields = HANDS[name]
    whole = rendered(fields, [FRAMES])
    check_hand(whole, fields)
    assert np.array_equal(whole, rendered(fields, [1, 1, 7, 480, 511, 1000, 400]))
    loads = np.broadcast_to(fields["load"], FRAMES)
    touched = np.convolve(loads > 0.0, np.ones(2 * LATE + 1), "full")[:FRAMES] > 0.5  # all that is looked back at
    assert not whole[~touched, 0].any()
    assert bool(whole[:, 1:].any()) == (name not in STILL and "smallest numbers" not in name)


@pytest.mark.parametrize(
    ("value", "name"), paired([1e30, 1e155, -1e300, 1.7e308], ["speed_rate", "load_rate", "load_bend", "all of them"])
)
def test_derivatives_that_no_hand_has_leave_finite_samples(name: str, value: float) -> None:
    """What would be beyond every float32, or no number, is silence; the displacement does not depend on them."""
    given = {"speed_rate": 0.0, "load_rate": 0.0, "load_bend": 0.0}
    sudden = dict.fromkeys(given, value) if name == "all of them" else {**given, name: value}
    for load in (0.3, 5e-4):  # above the gate, and in it
        voice, other = open_voice(scene()), open_voice(scene())
        block = voice.render(100, Motion.of(100, speed=0.04, load=load, **sudden))
        assert finite(block)
        even = other.render(100, Motion.of(100, speed=0.04, load=load, **given))
        if sudden["speed_rate"] == 0.0:
            assert np.array_equal(block[:, 0], even[:, 0])


def swaying(speed: Real) -> dict[str, Any]:
    """Return the places of a hand of these speeds."""
    return {"position": np.concatenate([[0.0], np.cumsum(speed)[:-1]]) / RATE}


FOLLOWED: dict[str, dict[str, Any]] = {
    "a load that drops to nothing and returns": {
        **swaying(np.full(FRAMES, 0.01)),
        "load": np.where((TIME > 0.1) & (TIME < 0.2), 0.0, 0.3),
    },
    "from ten millinewtons to ten newtons": {**swaying(np.full(FRAMES, 0.01)), "load": 10.0 ** (NUMBERS // 850 - 2.0)},
    "a reversal in mid-block": {**swaying(np.where(TIME < 0.1537, 0.01, -0.01)), "load": 0.3},
    "speed steps": {**swaying(np.where((NUMBERS // 400) % 2, 0.01, 0.001)), "load": 0.3},
    "noisy force at 1 kHz": {
        **swaying(np.full(FRAMES, 0.01)),
        "load": np.interp(TIME, np.arange(400) / 1000, 0.3 + 0.02 * RANDOM.standard_normal(400)),
    },
}


@pytest.mark.parametrize("name", FOLLOWED)
def test_a_slow_hand_stands_where_the_oracle_says_at_every_load(name: str) -> None:
    """All of its harmonics are in the band, so the oracle of places and loads needs no band limit.

    A voice reads at every few frames and looks back and ahead: where load or speed jump it is the jump of a band.
    """
    fields = FOLLOWED[name]
    followed = scene_of(
        finger={"contact_length": 2.5e-3}, scan={"speed": 0.01},
        output={"quantity": "displacement", "full_scale": 1.0, "sample_rate": RATE},
        accuracy={"tolerance": TOLERANCE},
    )  # fmt: skip
    voice, load = open_voice(followed), np.broadcast_to(fields["load"], FRAMES)
    found = voice.render(FRAMES, part_of(fields, 0, FRAMES))[voice.late :, 0].astype(float)
    bends = np.abs(np.diff(fields["position"], 2, prepend=[-fields["position"][1], 0.0]))
    jumps = (np.abs(np.diff(load, prepend=load[0])) > 0.05) | (bends > 1e-7)
    near = np.convolve(jumps, np.ones(2 * voice.late + 1), "same") > 0.5
    some = np.flatnonzero(~near[: len(found)])[::41]
    loads = load[some]
    s = np.minimum(loads / followed.scan.lift_load, 1.0)
    gate = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    wanted = gate * direct(touch_of(followed), fields["position"][some], loads, mean_phases=128)
    assert np.max(np.abs(found[some] - wanted)) <= 2e-2 * np.ptp(wanted)


LOUD = {
    "channels": [{"quantity": name, "full_scale": 1e-9} for name in QUANTITIES],
    "sample_rate": RATE,
    "bandwidth": BANDWIDTH,
}
QUIET = LOUD | {"channels": list(QUANTITIES)}
SCENES: dict[str, dict[str, Any]] = {
    "no load": touching(scan_load=0.0),
    "a nanonewton": touching(scan_load=1e-9),
    "a kilonewton": touching(scan_load=1e3),
    "no ridges": touching(finger_ridge_amplitude=0.0),
    "no texture": touching(texture_amplitude=0.0),
    "standing still": touching(scan_speed=0.0),
    "10 m/s": touching(scan_speed=10.0),
    "locked": touching(texture_period=0.5e-3),
    "cancelled": touching(texture_period=1e-3, scan_load=30.0),
    "next to nothing": touching(texture_amplitude=2.3e-308),
    "as high as it goes": touching(finger_ridge_amplitude=1e-3, texture_amplitude=1e-3),
}
SILENT = ("no load", "no texture", "10 m/s", "cancelled")


def few_ridges(output: dict[str, Any], tolerance: float, sections: dict[str, Any] | None = None) -> Scene:
    """Return a scene that is quick to solve."""
    finger, accuracy = {"contact_length": 2e-3}, {"tolerance": tolerance}
    return scene_of(**merged({"finger": finger, "output": output, "accuracy": accuracy}, sections or {}))


@pytest.mark.parametrize("output", [QUIET, LOUD], ids=["automatic", "far beyond full scale"])
@pytest.mark.parametrize("name", SCENES)
def test_a_live_voice_stays_within_full_scale_from_its_first_frame_to_its_last(
    name: str, output: dict[str, Any]
) -> None:
    voice = LiveVoice(few_ridges(output, 1e-2, SCENES[name]))
    blocks = [voice.render(400)]
    voice.apply(voice.prepare(few_ridges(output, 1e-2)))
    blocks.append(voice.render(1200))
    voice.apply(voice.prepare(few_ridges(output, 1e-2, SCENES[name])))
    blocks.append(voice.render(1200))
    voice.release()
    blocks.append(voice.render(1200))
    whole = np.concatenate(blocks)
    assert finite(whole)
    assert np.max(np.abs(whole)) <= 1.0
    assert np.max(np.abs(whole[600:1500])) > 0.1  # the default scene in the middle of it
    assert voice.finished
    assert not whole[-400:].any()
    if name in SILENT:
        assert not whole[:380].any()


@pytest.mark.parametrize("name", HANDS)
def test_a_live_hand_never_passes_full_scale_once_it_is_limited(name: str) -> None:
    """A voice that does not wait plays the nearest rows; whatever they are, the samples are fit."""
    voice = open_voice(few_ridges(LOUD, 3e-2), live=True)
    limiter = Limiter(voice.channels, RATE, 12)
    for first in range(0, FRAMES, 240):
        block = voice.render(240, part_of(HANDS[name], first, first + 240))
        assert finite(block)
        assert np.max(np.abs(limiter.process(block))) <= 1.0
