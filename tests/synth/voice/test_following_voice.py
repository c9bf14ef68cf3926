"""A followed hand through a live voice: no action of the finger makes a step larger than those of a steady stroke."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from synth.motion.motion import Motion, Update
from synth.motion.update_smoothing import Follower
from synth.voice.hand_voice import HandVoice
from synth.voice.voice import Voice, open_voice
from tests.few import paired
from tests.synth.engine_cases import Real, largest_step, scene_of

RATE, BLOCK = 48000, 480
SPEED, LOAD = 0.08, 0.3

Contact = tuple[float, float]
"""Position (m) and load (N) of an update."""


LOADS = (1e-3, 3e-3, 1e-2, 3e-2, 0.1, LOAD, 1.5 * LOAD)  # N: from the load at which a lift begins to fade


@pytest.fixture(scope="module")
def voice() -> Voice:
    return open_voice(scene_of(output={"quantity": "acceleration", "sample_rate": RATE, "bandwidth": 1000}), live=True)


def stroke(voice: Voice, load: float, speed: float = 1.25 * SPEED) -> Real:
    """Return the acceleration (m/s^2) of a steady stroke, by default at the speed that a reversal reaches."""
    place = 0.998 * speed * np.arange(20 * BLOCK) / RATE
    rates = {"speed_rate": 0.0, "load_rate": 0.0, "load_bend": 0.0}
    motion = Motion.of(20 * BLOCK, position=place, speed=0.998 * speed, load=load, **rates)
    return np.asarray(voice.render(20 * BLOCK, motion)[:, 0].astype(float) * voice.full_scale[0])


@pytest.fixture(scope="module")
def kept(voice: Voice) -> dict[float, Real]:
    """Return, by load (N), the largest step and the largest value (m/s^2) of a steady stroke."""
    strokes = {load: stroke(voice, load) for load in LOADS}
    return {load: np.array([largest_step(found), np.abs(found).max()]) for load, found in strokes.items()}


def heard(voice: Voice, contacts: list[Contact], follower: Follower | None = None) -> Real:
    """Return the acceleration (m/s^2) of a hand with `contacts`, one per block of 10 ms."""
    follower = follower or Follower(RATE)
    parts = []
    for n, (position, load) in enumerate(contacts):
        assert not follower.apply(Update(n, 0.01 * n, position, None, load))
        parts.append(voice.render(BLOCK, follower.motion(BLOCK)))
    return np.concatenate(parts)[:, 0].astype(float) * voice.full_scale[0]


def steady(count: int, first: int = 0) -> list[Contact]:
    return [(SPEED * 0.01 * n, LOAD) for n in range(first, first + count)]


def stopping(n: int) -> float:
    """Return the position of a hand `n` updates after it began to slow down, which takes 60 ms."""
    s = min(n / 6.0, 1.0)
    return SPEED * 0.06 * (s - s**3 + 0.5 * s**4)


WHAT: dict[str, Callable[[int], Contact]] = {
    "stops": lambda n: (stopping(n), LOAD),
    "stops at once": lambda n: (0.0, LOAD),
    "reverses": lambda n: (2.0 * stopping(n) - SPEED * 0.01 * n, LOAD),
    "lifts": lambda n: (SPEED * 0.01 * n, LOAD * max(0.0, 1.0 - n / 5.0)),
    "lifts at once": lambda n: (SPEED * 0.01 * n, 0.0),
    "lifts and touches": lambda n: (SPEED * 0.01 * n, 0.0 if n < 20 else LOAD),
    "presses": lambda n: (SPEED * 0.01 * n, LOAD * 1.5),
}


TOUCHING = {"lifts and touches": 2.0}
"""A sudden load rises within 2 ms. It is heard, but not louder than the texture under a light finger."""


@pytest.mark.parametrize("name", WHAT)
def test_what_a_finger_does_makes_no_step_above_a_steady_strokes(
    voice: Voice, kept: dict[float, Real], name: str
) -> None:
    stroke(voice, LOAD)
    before = steady(40)
    then = [(before[-1][0] + place, load) for place, load in map(WHAT[name], range(1, 60))]
    samples = heard(voice, before + then)
    loads = {load for _place, load in then} | {LOAD}
    steps, peaks = np.max([kept[load] for load in LOADS if min(loads) <= load <= max(loads)], axis=0)
    assert largest_step(samples[40 * BLOCK :]) <= TOUCHING.get(name, 1.0) * steps
    assert np.abs(samples[40 * BLOCK :]).max() <= 1.1 * peaks  # a slow hand has more harmonics in the band
    if name in ("stops", "stops at once", "lifts", "lifts at once"):
        assert not samples[-BLOCK:].any()


def test_a_jump_is_told_and_its_cross_fade_makes_no_step(voice: Voice, kept: dict[float, Real]) -> None:
    follower = Follower(RATE)
    before = heard(voice, steady(60), follower)[-1:]
    old = follower.copy()
    assert follower.apply(Update(60, 0.6, 0.2003, None, LOAD))
    gone, come = (
        voice.render(BLOCK, one.motion(BLOCK))[:, 0].astype(float) * voice.full_scale[0] for one in (old, follower)
    )
    part = 0.5 - 0.5 * np.cos(np.pi * np.arange(1, BLOCK + 1) / BLOCK)
    assert largest_step(np.concatenate([before, gone + part * (come - gone)])) <= kept[LOAD][0]


@pytest.mark.parametrize("held", ["lost", "all at once", "in two parts"])
@pytest.mark.parametrize(("late", "speed"), paired([6, 7, 9, 12, 16, 20, 26, 33], [0.01, 0.03, SPEED]))
def test_a_gap_in_the_updates_ends_without_a_jolt(late: int, speed: float, held: str) -> None:
    """The finger glides to a stop in the gap, and is then behind the hand: it does not sweep to the hand's place.

    held: whether the updates of the gap are lost, or come together at its end, as after a hiccup of the network.
    """
    voice = HandVoice(scene_of(output={"quantity": "acceleration", "sample_rate": RATE, "bandwidth": 1000}))
    parts = []

    def touch(first: int, end: int) -> None:
        for n in range(first, end):
            voice.touch(Update(n, 0.01 * n, speed * 0.01 * n, None, LOAD))

    end = 60 + late
    for n in range(90 + late):
        if not 60 <= n < end:
            touch(60 if n == end and held != "lost" else n, n + 1)
        elif n == end - 1 and held == "in two parts":
            touch(60, 60 + late // 2)
        if late >= 25 and n == 60 + 25:
            voice.lift()  # the watchdog of a service
        parts.append(voice.render(BLOCK)[:, 0])
    usual, after = np.concatenate(parts[30:60]), np.concatenate(parts[60:])
    most = 2.5 if speed > 0.01 else 3.5  # a slow hand is caught up by the least speed, half of its own
    most = most if late < 25 else 4.5  # a landing passes light loads, under which the texture is louder
    assert np.abs(after).max() <= most * np.abs(usual).max()
    assert np.abs(np.concatenate(parts[-10:])).max() == pytest.approx(np.abs(usual).max(), rel=0.15)


@pytest.mark.parametrize(("stall", "interval"), paired([6, 10, 20, 28, 60], [0.002, 0.0083, 0.033]))
def test_a_stream_that_stood_still_goes_on_without_a_burst_and_without_silence(stall: int, interval: float) -> None:
    """The blocks of the stall are rendered together at its end, each with the newest update, as a late service does."""
    voice = HandVoice(scene_of(output={"quantity": "acceleration", "sample_rate": RATE, "bandwidth": 1000}))
    parts, last = [], -1
    for n in range(100 + stall):
        clock = 0.01 * (60 + stall if 60 <= n < 60 + stall else n)
        if (newest := math.floor(clock / interval + 1e-9)) > last:
            voice.touch(Update(newest, newest * interval, SPEED * newest * interval, None, LOAD))
            last = newest
        parts.append(voice.render(BLOCK)[:, 0])
    usual, after = (np.concatenate(some) for some in (parts[30:60], parts[60:]))
    assert np.abs(after).max() <= 1.7 * np.abs(usual).max()
    for begin in range(60 + stall + 10, 95 + stall, 5):
        assert np.std(np.concatenate(parts[begin : begin + 5])) > 0.5 * np.std(usual)
