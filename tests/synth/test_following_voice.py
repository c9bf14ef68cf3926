"""A followed hand through a live voice: what the finger does makes no step larger than a steady stroke's own."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest

from synth.following import Follower, Update
from synth.voice import Voice, open_voice
from tests.synth.engine_cases import Real, scene_of

RATE, BLOCK = 48000, 480
SPEED, LOAD = 0.08, 0.3

Contact = tuple[float, float | None]
"""Position (m) and load (N) of an update."""


@pytest.fixture(scope="module")
def voice() -> Iterator[Voice]:
    output = {"quantity": "acceleration", "sample_rate": RATE}
    voice = open_voice(scene_of(output=output, accuracy={"tolerance": 3e-2}), live=True)
    try:
        while not voice.rows_ready:
            assert voice._solver is not None and voice._solver.wait(60)
        yield voice
    finally:
        voice.close()


def heard(voice: Voice, contacts: list[Contact], follower: Follower | None = None) -> Real:
    """Return the acceleration (m/s^2) of a hand that gives `contacts`, one a block of 10 ms."""
    follower = follower or Follower(RATE)
    parts = []
    for n, (position, load) in enumerate(contacts):
        assert not follower.apply(Update(n, 0.01 * n, position, None, load))
        parts.append(voice.render(BLOCK, follower.motion(BLOCK)))
    return np.concatenate(parts)[:, 0].astype(float) * voice.full_scale[0]


def steady(count: int, first: int = 0) -> list[Contact]:
    return [(SPEED * 0.01 * n, LOAD) for n in range(first, first + count)]


def largest_step(samples: Real) -> float:
    return float(np.abs(np.diff(samples)).max())


def stopping(n: int) -> float:
    """Return where a hand is, n updates after it began to slow down; it takes 60 ms."""
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


@pytest.mark.parametrize("name", WHAT)
def test_what_a_finger_does_makes_no_step_above_a_steady_strokes(voice: Voice, name: str) -> None:
    before = steady(40)
    then = [(before[-1][0] + place, load) for place, load in map(WHAT[name], range(1, 60))]
    samples = heard(voice, before + then)
    kept = largest_step(samples[20 * BLOCK : 40 * BLOCK])
    louder = 1.5 ** (2.0 / 3.0) if name == "presses" else 1.0
    print(name, largest_step(samples[40 * BLOCK :]) / kept)
    assert largest_step(samples[40 * BLOCK :]) <= 1.05 * louder * kept
    if name not in ("reverses", "presses", "lifts and touches"):
        assert not samples[-BLOCK:].any()


def test_a_hand_that_touches_down_begins_without_a_step(voice: Voice) -> None:
    samples = heard(voice, [(place, LOAD if n >= 10 else 0.0) for n, (place, _load) in enumerate(steady(60))])
    assert not samples[: 10 * BLOCK].any()
    assert largest_step(samples[: 40 * BLOCK]) <= 1.05 * largest_step(samples[40 * BLOCK :])


def test_a_teleport_is_flagged_where_it_would_be_heard(voice: Voice) -> None:
    follower = Follower(RATE)
    samples = heard(voice, steady(60), follower)
    kept = largest_step(samples[30 * BLOCK :])
    old = follower.copy()
    assert follower.apply(Update(60, 0.6, 0.2003, None, LOAD))
    assert abs(follower.motion(1).position[0] - old.motion(1).position[0]) > 0.1
    hard = voice.render(BLOCK, follower.motion(BLOCK))[:, 0].astype(float) * voice.full_scale[0]
    assert abs(hard[0] - samples[-1]) > kept or largest_step(hard) > 0.0
