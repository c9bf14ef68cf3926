"""A followed hand: smooth for any updates, exact to the frame, silent at rest or lifted, and equal to its slow twin."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from synth.motion import update_curve as following_curve
from synth.motion import update_smoothing as following
from synth.motion import update_timing as following_track
from synth.motion.motion import LARGEST_LOAD, LOAD, SPEED, SPEED_RATE, Update
from synth.motion.update_smoothing import DELAY, FRAME, GLIDE_DECAY, LOAD_DECAY, Follower
from tests.reference.slow_following import Numbers, SlowFollower
from tests.synth.engine_cases import Real

RATE = 48000
BLOCK = 480
Event = tuple[int, Update | None]
"""Frames before the event, and its update, or None for a release."""


def at_position(seq: int, position: float, load: float | None = 0.3, time: float | None = None) -> Update:
    return Update(seq, seq * 0.01 if time is None else time, position, None, load)


def at_speed(seq: int, speed: float, load: float | None = 0.3) -> Update:
    return Update(seq, seq * 0.01, None, speed, load)


def followed(follower: Follower, events: Iterable[Event], after: int = 0) -> Real:
    """Return the frames of `events` and `after` more, in rows: position, speed, rate, load, rate, bend."""
    parts = []
    for frames, update in events:
        parts.append(filled(follower, frames))
        if update is None:
            follower.release()
        else:
            follower.apply(update)
    return np.concatenate([*parts, filled(follower, after)], axis=1)


def filled(follower: Follower, frames: int) -> Real:
    """Return the next frames in six rows."""
    samples, position = np.empty((5, frames)), np.empty(frames)
    follower.fill(samples, position)
    return np.vstack([position, samples])


def moving(speed: float = 0.08, load: float = 0.3, rate: int = RATE) -> Follower:
    follower = Follower(rate)
    follower.begin(0.0, speed, load)
    return follower


def steady(count: int, speed: float = 0.08, first: int = 0) -> list[Event]:
    return [(BLOCK, at_position(n, speed * 0.01 * n)) for n in range(first, first + count)]


def updates() -> st.SearchStrategy[list[Event]]:
    """Return events as from a hostile network: any gap, any order of times, places, speeds, loads, releases."""
    place = st.floats(-0.05, 0.05)
    one = st.builds(
        lambda time, value, by_speed, load: Update(
            0, time, None if by_speed else value, 20.0 * value if by_speed else None, load
        ),
        st.floats(0.0, 2.0), place, st.booleans(), st.none() | st.floats(0.0, 2.0) | st.just(0.0),
    )  # fmt: skip
    return st.lists(st.tuples(st.integers(0, 1500), st.none() | one), min_size=1, max_size=12)


def in_order(events: list[Event]) -> list[Event]:
    """Return `events` with rising times as from a client, 1 to 60 ms apart, or with a pause."""
    time, ordered = 0.0, []
    for frames, update in events:
        if update is not None:
            time += 1e-3 + (0.2 if update.time > 1.8 else 0.03) * update.time
            update = Update(0, time, update.position, update.speed, update.load)
        ordered.append((frames, update))
    return ordered


# -- updates of any network


@given(updates(), st.booleans(), st.sampled_from([0.0, -0.02]))
@settings(max_examples=150, deadline=None, derandomize=True)
def test_any_order_of_updates_gives_finite_bounded_motion(events: list[Event], rising: bool, lowest: float) -> None:
    follower = Follower(RATE, lowest_load=lowest)
    rows = followed(follower, in_order(events) if rising else events, 400)
    position, speed, rate, load, *_rates = rows
    assert np.isfinite(rows).all()
    assert np.all(load >= lowest) and np.all(load <= 2.0)
    assert np.abs(speed).max() <= 30.0 and np.abs(position).max() <= 2.0 and np.abs(rate).max() <= 2e4


@given(updates(), st.booleans())
@settings(max_examples=100, deadline=None, derandomize=True)
def test_rows_are_the_derivatives_of_those_above_them(events: list[Event], rising: bool) -> None:
    follower, parts, load = moving(), [np.empty((6, 0))], 0.3
    for frames, update in in_order(events) if rising else events:
        parts.append(filled(follower, frames))
        load = parts[-1][3, -1] if frames else load
        if update is None:
            follower.release()
        elif follower.apply(update) or load == 0.0:  # a jump: the parts before and after it are checked separately
            _assert_derivatives(np.concatenate(parts, axis=1))
            parts = [np.empty((6, 0))]
    _assert_derivatives(np.concatenate([*parts, filled(follower, 700)], axis=1))


def _assert_derivatives(rows: Real) -> None:
    """Each row's steps are the trapezoids of the row below, across updates too. So all rows are continuous."""
    for value, rate, fastest in ((0, 1, 30.0), (1, 2, 2e4), (3, 4, 300.0), (4, 5, 3e5)):
        if rows.shape[1] > 1:
            steps = np.diff(rows[value]) - 0.5 * (rows[rate, 1:] + rows[rate, :-1]) / RATE
            bend = fastest * GLIDE_DECAY**2 * 40.0 / (12.0 * RATE**3)
            assert np.abs(steps).max() <= bend + 1e-12
    assert np.abs(np.diff(rows[2])).max(initial=0.0) <= 2e4 * 500.0 / RATE
    assert np.abs(np.diff(rows[5])).max(initial=0.0) <= 10.0 * LOAD_DECAY**3 / RATE


@given(updates(), st.booleans(), st.lists(st.integers(1, 700), min_size=1, max_size=6))
@settings(max_examples=50, deadline=None, derandomize=True)
def test_blocks_of_any_size_give_the_same_bits(events: list[Event], rising: bool, sizes: list[int]) -> None:
    events = in_order(events) if rising else events
    events = [*events, (900, None)]
    whole = followed(Follower(RATE), events)
    follower, parts, number = Follower(RATE), [], 0
    for frames, update in events:
        left = frames
        while left:
            count = min(left, sizes[number % len(sizes)])
            parts.append(filled(follower, count))
            left, number = left - count, number + 1
        if update is None:
            follower.release()
        else:
            follower.apply(update)
    assert np.concatenate(parts, axis=1).tobytes() == whole.tobytes()
    assert follower.state[FRAME] == whole.shape[1]


@given(updates())
@settings(max_examples=40, deadline=None, derandomize=True)
def test_the_slow_twin_moves_alike(events: list[Event]) -> None:
    engine, twin = Follower(RATE), SlowFollower(RATE, numbers())
    for number, (frames, update) in enumerate([*in_order(events), (300, None)]):
        wanted = np.array([twin.step() for _ in range(frames)]).reshape(frames, 6).T
        away = np.abs(filled(engine, frames) - wanted).max(axis=1, initial=0.0)
        assert np.all(away <= 1e-9 * np.array([1.0, 10.0, 3e3, 1.0, 300.0, 1e5]))
        if update is None:
            engine.release()
            twin.release()
        elif number % 5 == 4:
            engine.begin(0.01, 0.05, 0.2)
            twin.begin(0.01, 0.05, 0.2)
        else:
            value = update.position if update.speed is None else update.speed
            assert value is not None
            assert engine.apply(update) == twin.apply(update.time, value, update.speed is not None, update.load)


def numbers() -> Numbers:
    """Return the engine's constants for its twin."""
    homes: Any = [following, following_track, following_curve]
    names = Numbers.__dataclass_fields__
    found = {name: next(getattr(h, name.upper()) for h in homes if hasattr(h, name.upper())) for name in names
             if name not in ("largest_load", "back")}  # fmt: skip
    return Numbers(**found, back=following_track.RETURN, largest_load=LARGEST_LOAD)


# -- motions of a hand


@pytest.mark.parametrize("speed", [0.02, 0.08, -0.2])
@pytest.mark.parametrize("interval", [1 / 30, 1 / 90, 0.008, 0.002])
def test_at_constant_speed_the_delay_is_all_that_is_late(speed: float, interval: float) -> None:
    follower, seq = Follower(RATE), 0
    parts = []
    for block in range(200):
        newest = math.floor(block * BLOCK / RATE / interval)
        if newest >= seq:
            follower.apply(at_position(newest, speed * newest * interval, time=newest * interval))
            seq = newest + 1
        parts.append(filled(follower, BLOCK)[:2])
    found, speeds = np.concatenate(parts[120:], axis=1)
    now = np.arange(120 * BLOCK, 200 * BLOCK) / RATE
    np.testing.assert_allclose(found, speed * (now - DELAY), rtol=0, atol=2e-5)
    np.testing.assert_allclose(speeds, speed, rtol=0.01)


def test_updates_that_arrive_late_do_not_shake_a_steady_hand() -> None:
    random = np.random.default_rng(4)
    follower, parts = moving(), []
    for n in range(300):
        late = float(random.uniform(0.0, 0.009))
        follower.apply(at_position(n, 0.08 * (0.01 * n - late), time=0.01 * n - late))
        parts.append(follower.motion(BLOCK))
    speeds = np.concatenate([part.samples[SPEED] for part in parts[150:]])
    assert np.abs(speeds - 0.08).max() <= 0.025 * 0.08


def test_acceleration_and_bend_are_continuous_their_steps_halve_at_twice_the_rate() -> None:
    largest = []
    for rate in (RATE, 2 * RATE):
        follower, block = moving(rate=rate), rate // 100
        places = [0.08 * 0.01 * n for n in range(20)] + [0.015] * 5 + [0.02, 0.01, 0.005] * 3
        events: list[Event] = [
            (block, at_position(n, place, 0.0 if n % 9 == 5 else 0.4)) for n, place in enumerate(places)
        ]
        rows = followed(follower, [*events, (block, None)], rate // 10)
        largest.append(np.abs(np.diff(rows, axis=1)).max(axis=1))
    assert largest[1][[2, 5]] == pytest.approx(0.5 * largest[0][[2, 5]], rel=0.02)


def test_the_first_frame_after_an_update_is_changed_by_it() -> None:
    for update in (at_position(9, 0.00719), at_speed(9, 0.1), at_position(9, 0.0072, 0.6)):
        changed, kept = moving(), moving()
        for follower in (changed, kept):
            followed(follower, steady(9))
        assert not changed.apply(update)
        assert not np.array_equal(changed.motion(1).samples, kept.motion(1).samples)


def test_a_hand_that_stops_is_exactly_at_rest_where_it_stopped() -> None:
    follower = moving()
    rows = followed(follower, [*steady(30), *((BLOCK, at_position(n, 0.024)) for n in range(30, 100))], BLOCK)
    assert np.all(rows[0, -BLOCK:] == 0.024) and not rows[1:3, -BLOCK:].any()
    assert 0.024 <= rows[0].max() <= 0.024 + 1.5 * 0.08 * 0.01


def test_a_hand_that_goes_still_without_a_word_glides_to_rest() -> None:
    follower = moving()
    rows = followed(follower, steady(30), RATE // 2)
    speeds = rows[1, 30 * BLOCK :]
    assert not rows[1:3, -BLOCK:].any()
    assert speeds.min() >= 0.0 and rows[0, -1] <= 0.0232 + 0.08 * 0.08
    assert np.all(rows[3, -BLOCK:] == 0.3)


def test_a_hand_that_comes_back_after_a_pause_is_not_carried_on_at_its_old_speed() -> None:
    follower = moving()
    place = followed(follower, steady(30), RATE)[0, -1]
    follower.apply(at_position(130, place))
    motion = follower.motion(BLOCK)
    assert motion.position == pytest.approx(np.full(BLOCK, place), abs=1e-12)
    assert not motion.samples[SPEED : SPEED_RATE + 1].any()


def test_a_lift_ends_in_exact_silence_and_never_below_no_load() -> None:
    follower = moving()
    rows = followed(follower, [*steady(20), (BLOCK, at_position(20, 0.016, 0.0))], RATE // 5)
    load = rows[3, 20 * BLOCK :]
    assert np.all(np.diff(load) <= 0.0) and load.min() == 0.0
    assert not rows[3:, -BLOCK:].any()
    assert np.argmax(load < 1e-3) <= 0.06 * RATE


def test_a_release_lifts_and_stops_until_the_next_update() -> None:
    follower = moving()
    rows = followed(follower, [*steady(20), (100, None)], RATE // 2)
    assert not rows[1:, -BLOCK:].any()
    assert np.diff(rows[0, 20 * BLOCK :]).min() >= -1e-12
    follower.apply(at_position(100, rows[0, -1], None))
    assert follower.motion(RATE // 4).samples[LOAD, -1] == 0.3  # without a load the last one is kept


def test_loads_stay_between_those_that_were_asked_for() -> None:
    random = np.random.default_rng(7)
    for lowest in (0.0, -0.01):
        follower = Follower(RATE, lowest_load=lowest)
        loads = [-0.5, *random.uniform(0.1, 0.9, 300), 2e3]
        gaps = [0, RATE // 5, *random.integers(16, 2000, 300).tolist()]
        events = [(gap, at_position(n, 0.0, load)) for n, (gap, load) in enumerate(zip(gaps, loads, strict=True))]
        seen = followed(follower, events, BLOCK)
        assert seen[3].min() == lowest and seen[3].max() <= LARGEST_LOAD
        after = seen[3, np.argmax(seen[3] > 0.1) : -BLOCK]
        assert after.min() >= 0.1 and after.max() <= 0.9


def test_speeds_stay_between_those_that_were_given() -> None:
    random = np.random.default_rng(8)
    follower = Follower(RATE)
    given_speeds = random.uniform(0.02, 0.1, 200)
    events = [(int(random.integers(16, 2000)), at_speed(n, speed)) for n, speed in enumerate(given_speeds)]
    rows = followed(follower, events, RATE // 4)[:, events[0][0] :]
    assert rows[1].min() >= given_speeds.min() - 1e-12 and rows[1].max() <= given_speeds.max() + 1e-12
    follower = Follower(RATE)
    follower.apply(at_speed(0, 0.05))
    motion = follower.motion(BLOCK)
    assert motion.position.size == 0 and motion.complete and motion.frames == BLOCK


def test_nothing_is_moved_or_loaded_before_the_first_update() -> None:
    motion = Follower(RATE).motion(BLOCK)
    assert not motion.samples.any() and motion.position.size == 0


def test_while_nothing_sounds_the_finger_is_put_where_it_is() -> None:
    follower = Follower(RATE)
    assert not follower.apply(at_position(0, 0.02, 0.0))
    assert np.all(follower.motion(BLOCK).position == 0.02)
    assert not follower.apply(at_position(1, 0.5, 0.3))
    assert follower.motion(1).position[0] == pytest.approx(0.5, abs=0.2)
    followed(follower, [(BLOCK, at_position(2, 0.5, 0.0))], RATE // 2)
    assert not follower.apply(at_position(60, -0.3, 0.3))


def test_a_teleport_is_told_and_the_copy_goes_on_as_before() -> None:
    follower, other = moving(), moving()
    for one in (follower, other):
        followed(one, steady(20))
    before = follower.copy()
    assert follower.apply(at_position(20, 0.3))
    assert follower.motion(BLOCK).position == pytest.approx(np.full(BLOCK, 0.3))
    assert np.array_equal(before.motion(BLOCK).samples, other.motion(BLOCK).samples)
    assert follower.state[FRAME] == before.state[FRAME]


def test_a_hand_that_moved_on_unseen_is_a_jump_at_its_mean_speed() -> None:
    for blocks in (8, 12, 16, 20):
        follower = moving()
        followed(follower, steady(30), BLOCK * blocks)
        assert follower.apply(at_position(29 + blocks, 0.08 * 0.01 * (29 + blocks)))
        assert follower.motion(BLOCK).samples[SPEED] == pytest.approx(0.08)
        assert not follower.apply(at_position(30 + blocks, 0.08 * 0.01 * (30 + blocks)))
        assert follower.motion(3 * BLOCK).samples[SPEED] == pytest.approx(0.08, rel=1e-3)


def test_a_hand_that_rests_without_updates_begins_again_without_a_jump() -> None:
    follower = moving()
    followed(follower, [*steady(30), *((BLOCK, at_position(n, 0.0232)) for n in range(30, 40))], BLOCK * 20)
    assert not follower.apply(at_position(60, 0.0235))
    assert np.abs(follower.motion(BLOCK).samples[SPEED]).max() <= 0.05


def test_swift_hands_are_no_teleports() -> None:
    for top in (0.2, 0.6, 1.0):
        follower = Follower(RATE)
        s = np.clip(np.arange(60) * 0.01 / 0.3, 0.0, 1.0)
        places = top * 0.3 / 1.875 * s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
        for n, place in enumerate(places):
            assert not follower.apply(at_position(n, float(place)))
            follower.motion(BLOCK)


def test_positions_upon_speeds_are_a_jump_while_it_sounds() -> None:
    follower = Follower(RATE)
    follower.apply(at_speed(0, 0.08))
    follower.motion(BLOCK)
    assert follower.apply(at_position(1, 0.2))
    motion = follower.motion(BLOCK)
    assert motion.position[0] == pytest.approx(0.2, abs=1e-5)
    assert motion.samples[SPEED, 0] == pytest.approx(0.08, rel=0.01)
    assert not follower.apply(at_speed(2, 0.08))


def test_a_clock_that_is_set_back_or_on_does_not_throw_the_finger() -> None:
    for offset in (-50.0, 1e6, 3e-2):
        follower = moving()
        times = [0.01 * n + (offset if n > 40 else 0.0) for n in range(90)]
        events = [(BLOCK, at_position(n, 0.08 * 0.01 * n, time=time)) for n, time in enumerate(times)]
        rows = followed(follower, events, BLOCK)
        late = 0.08 * np.arange(rows.shape[1]) / RATE - rows[0]
        assert np.abs(late[20 * BLOCK :]).max() <= 0.006


def test_nothing_is_denormal() -> None:
    follower = moving()
    events = [*steady(20), (BLOCK, at_position(20, 0.016, 0.0))]
    events += [(BLOCK, at_position(n, 0.016, 1e-9 * (n % 2))) for n in range(21, 200)]
    rows = followed(follower, [*events, (10, None)], RATE)
    small = np.abs(rows[rows != 0.0])
    assert small.min() >= 1e-30
