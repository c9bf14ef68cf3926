"""A hand that leads a finger over an area and turns it: place, direction, short turns, jumps, and the end."""

from __future__ import annotations

import math

import numpy as np
import pytest

from synth.motion.motion import LOAD, Update
from synth.motion.path_smoothing import PathFollower
from synth.motion.update_smoothing import DELAY

RATE = 8000
BLOCK = 80
INTERVAL = BLOCK / RATE  # s


def led(follower: PathFollower, turn_from: float = 0.0, first: int = 0, updates: int = 40) -> list[bool]:
    """Lead the finger at 50 mm/s along x, -30 mm/s across and 0.5 rad/s, with a block after each update; return jumps.

    turn_from: direction at the first update, rad; each update has its angle between -pi and pi.
    """
    jumps = []
    for n in range(first, first + updates):
        t = n * INTERVAL
        direction = math.remainder(turn_from + 0.5 * t, 2.0 * math.pi)
        jumps.append(follower.apply(Update(n, t, 0.05 * t, None, 0.3, -0.03 * t, direction)))
        follower.motion(BLOCK)
    return jumps


def started(direction: float = 0.0) -> PathFollower:
    follower = PathFollower(RATE, direction=direction)
    follower.begin(0.0, 0.05, 0.3)
    return follower


def test_a_steady_hand_is_late_by_the_delay_along_across_and_turning() -> None:
    follower = started()
    led(follower)
    motion = follower.motion(BLOCK)
    t = 40 * INTERVAL + np.arange(BLOCK) / RATE - DELAY
    assert motion.position == pytest.approx(0.05 * t, abs=1e-7)
    assert motion.path[0] == pytest.approx(-0.03 * t, abs=1e-7)
    assert motion.path[1] == pytest.approx(0.5 * t, abs=1e-4)


def test_only_the_first_update_off_the_line_is_a_jump() -> None:
    assert led(started()) == [True] + [False] * 39


def test_a_finger_turns_the_short_way_round_past_half_a_turn() -> None:
    follower = started(direction=3.1)
    assert not any(led(follower, turn_from=3.1)[1:])
    t = 40 * INTERVAL - DELAY
    assert follower.motion(1).path[1, 0] == pytest.approx(3.1 + 0.5 * t, abs=1e-4)


def test_a_finger_that_is_not_turned_keeps_the_direction_of_its_scan() -> None:
    follower = started(direction=0.7)
    follower.apply(Update(0, 0.0, 0.0, None, 0.3, 2e-3))
    assert np.array_equal(follower.motion(BLOCK).path[1], np.full(BLOCK, 0.7))


def test_a_hand_on_its_line_has_no_path() -> None:
    follower = started()
    follower.apply(Update(0, 0.0, 0.0, None, 0.3))
    assert follower.motion(BLOCK).path.size == 0


def test_a_release_lifts_the_finger_and_stops_it_along_across_and_turning() -> None:
    follower = started()
    led(follower)
    follower.release()
    follower.motion(RATE // 2)
    motion = follower.motion(BLOCK)
    assert not motion.samples[LOAD].any()
    assert np.ptp(motion.position) == 0.0 and not np.ptp(motion.path, axis=1).any()
    assert motion.path[0, 0] == pytest.approx(-0.03 * 40 * INTERVAL, abs=1e-3)


def test_a_copy_moves_on_alone() -> None:
    follower, other = started(), started()
    led(follower)
    led(other)
    copy = follower.copy()
    led(follower, first=40, updates=2)
    moved, kept = copy.motion(BLOCK), other.motion(BLOCK)
    assert np.array_equal(moved.position, kept.position) and np.array_equal(moved.path, kept.path)
