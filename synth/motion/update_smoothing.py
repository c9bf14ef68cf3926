"""Follows a remote hand: updates at 30 to 1000 Hz become position and load at audio rate.

Stage   Motion, for hands behind a network.
Model   `update_timing` extrapolates each update to a straight line of the position. The position joins this line, as of
        DELAY ago, with two continuous derivatives (`update_curve`, third order). So at constant speed the lag is only
        DELAY. Past the horizon the position glides to a stop. If a hand sends speeds, its speed follows by a glide with
        the same delay. The newest load is held, and the load joins it with a fixed decay. Speed and load are averages
        of the past with weights that are never negative, so they stay within the range of the requested values.
        An update after the glide finds the finger behind, as does one whose clock is adopted at once. If it would have
        to catch up faster than CATCH_UP times the speed of the hand, it is put there by a jump, at that speed.
Source  docs/live-motion.md: the measurements, the alternatives, and the figures behind this choice.
Limits  The motion between two updates is unknown. A sudden stop is therefore overshot by a part of that motion.
"""

from __future__ import annotations

import math
from typing import Self

import numpy as np

from synth.arrays import Array
from synth.kernels import signed_kernel, unfused
from synth.motion.motion import LARGEST_LOAD, LOAD, LOAD_BEND, LOAD_RATE, NOWHERE, SPEED, SPEED_RATE, Motion, Update
from synth.motion.update_curve import ENTRIES as CURVE
from synth.motion.update_curve import STRIDE, fill_curve, glide, join, new_curve, stand, values_at
from synth.motion.update_timing import (
    ARRIVALS,
    CLOCK,
    INTERVAL,
    LATEST,
    SLOPE,
    begin_anew,
    late_by,
    new_track,
    slope_with,
)

DELAY = 0.01  # s, lag of position and speed: one block of the service; less: turns and stops are overshot, and mice
# sound rough (without a delay the error is doubled); more: a stroke is felt after it is seen
TIGHTNESS = 3.0  # decays per interval of updates; more: updates are heard one by one; less: late at turns
QUICKEST = 250.0  # 1/s: largest decay, reached at 83 Hz; more: rough time stamps sound rough; less: late at turns
SLOWEST = 60.0  # 1/s: smallest decay, that of updates at 20 Hz; less: a turn at 5 Hz is lost
GLIDE_DECAY = 2.0 / DELAY  # 1/s: decay for speeds, and for a stop without updates
LOAD_DECAY = 200.0  # 1/s: a load is 15 ms late; more: a touch is a click, louder than the texture (from 300 on); less:
# presses are late, and the sound of a lift lasts longer
HORIZON, SPARE = 2.0, 0.035  # intervals and s of extrapolation: one lost update, DELAY, a block, some jitter;
# less: such gaps are heard; more: overshoot when the hand stops, or turns while an update is lost
LEAP_SPEED = 1.5  # m/s, largest unexpected speed; more: jumps are heard as a sweep; less: fast starts are faded
LEAST_LEAP = 0.01  # s; at any update rate, a jump is at least LEAP_SPEED times this
CATCH_UP = 0.4  # speed of catching up after a glide, over that of the hand: the acceleration grows with the square, to
# twice its own; more: a gap in the updates ends in a jolt; less: gaps of a few ms beyond the horizon are faded
LEAST_CATCH_UP = 5e-3  # m/s, at any speed of the hand: slower is not felt; less: rounded positions count as jumps
FASTER = 2.0  # largest mean speed over a pause, over that before it, with which a finger goes on at a place far off
OF_JOINING = 2.0 * math.exp(-2.0)  # largest speed by which `join` takes back an error, over the error times the decay

UNKNOWN, BY_POSITION, BY_SPEED = 0.0, 1.0, 2.0
FRAME, MODE, UNTIL, ASKED, FOUND = range(5)
"""Entries of a hand: next frame, kind of updates, frame at which it glides to a stop, requested load (N), and the frame
of the last update after a glide or with another clock: others may come with it. It glides where UNTIL is before FRAME.
"""
OF_PLACE = 5
OF_LOAD = OF_PLACE + CURVE
POWERS = OF_LOAD + CURVE
POWERS_OF_LOAD = POWERS + STRIDE
TRACK = POWERS_OF_LOAD + STRIDE
"""Offsets in the state, after the entries of a hand: the curves of place and load, the powers of each, the track."""


class Follower:
    """The state of one followed hand. Updates are not queued: each replaces the previous one.

    sample_rate: Hz.
    lowest_load: N, from the scene's effects (`scene_effects.lowest_load`); loads stay between it and LARGEST_LOAD.

    Smoothing delays place and speed by DELAY, and the load by 3 / LOAD_DECAY. The same calls at the same frames give
    the same bits in blocks of any size.
    """

    __slots__ = ("lowest", "sample_rate", "state")

    def __init__(self, sample_rate: int, *, lowest_load: float = 0.0) -> None:
        self.sample_rate = sample_rate
        self.lowest = lowest_load
        hand = np.array([0.0, UNKNOWN, math.inf, 0.0, -1.0])
        (place, places), (load, loads) = new_curve(), new_curve()
        self.state = np.concatenate([hand, place, load, places, loads, new_track()])  # one array: each update copies it

    def begin(self, position: float, speed: float, load: float) -> None:
        """Begin with a hand that moves steadily at `speed` (m/s) from `position` (m), at `load` (N)."""
        held = min(max(load, self.lowest), LARGEST_LOAD)
        hand, place, load_curve, _, _, track = parts_of(self.state)
        stand(place, hand[FRAME], position, speed)
        stand(load_curve, hand[FRAME], held, 0.0)
        hand[MODE:] = BY_POSITION, math.inf, held, -1.0
        track[:] = new_track()
        begin_anew(track, speed)

    def apply(self, update: Update) -> bool:
        """Follow `update` from the next frame on.

        Return True for a jump: while the finger sounds, its position changed faster than a hand can move, a position
        follows a speed, or the finger would have to catch up fast after a glide. The caller should then cross-fade from
        a copy of the previous state to this one.
        """
        by_speed = update.position is None
        value = update.speed if by_speed else update.position
        assert value is not None, "an update has a position or a speed"
        load = math.nan if update.load is None else update.load
        jumped: bool = apply_update(
            self.state, float(self.sample_rate), self.lowest, float(update.time), float(value), by_speed, float(load)
        )
        return jumped

    def release(self) -> None:
        """Let the load go to zero and the position glide to a stop, until the next update."""
        release_hand(self.state, float(self.sample_rate), self.lowest)

    def motion(self, frames: int) -> Motion:
        """Return the next frames, with derivatives; without positions while the hand sends speeds or is unknown."""
        samples, position = np.empty((5, frames)), np.empty(frames)
        known = self.state.item(MODE) == BY_POSITION
        self.fill(samples, position)
        return Motion(samples, position if known else NOWHERE)

    def fill(self, samples: Array, position: Array) -> None:
        """Write the next frames to `samples` (float64 [5, frames], rows of a Motion) and `position` (m)."""
        fill_motion(self.state, float(self.sample_rate), self.lowest, samples, position)

    def copy(self) -> Self:
        """Return an independent follower in the same state."""
        other = self.__new__(type(self))
        other.sample_rate, other.lowest, other.state = self.sample_rate, self.lowest, self.state.copy()
        return other


@signed_kernel("UniTuple(f8[::1], 6)(f8[::1])", fused=False)
def parts_of(state: Array) -> tuple[Array, Array, Array, Array, Array, Array]:
    """Return the parts of `state`: hand, curves of place and load, powers of each, and track."""
    return (
        state[:OF_PLACE],
        state[OF_PLACE:OF_LOAD],
        state[OF_LOAD:POWERS],
        state[POWERS:POWERS_OF_LOAD],
        state[POWERS_OF_LOAD:TRACK],
        state[TRACK:],
    )


@unfused
def press(curve: Array, powers: Array, rate: float, frame: float, load: float) -> None:
    """Lead the load to `load`, from the frame before `frame` on, unless `load` is its target already."""
    if load != curve[2]:
        w, w1, w2 = values_at(curve, frame - 1.0, rate)
        join(curve, powers, rate, frame - 1.0, w, w1, w2, load, 0.0, LOAD_DECAY)


@unfused
def _go_to(
    hand: Array, curve: Array, powers: Array, track: Array, rate: float,
    time: float, position: float, late: float, silent: bool,
) -> bool:  # fmt: skip
    """Lead the position to an update's position, which the hand had `late` s ago; return whether it is a jump."""
    before = hand[FRAME] - 1.0
    x, v, a = values_at(curve, before, rate)
    usual = abs(track[SLOPE])
    slope = slope_with(track, time, position)
    level = position + slope * (late - DELAY - 1.0 / rate)
    decay = min(max(TIGHTNESS / track[INTERVAL], SLOWEST), QUICKEST)
    leap = LEAP_SPEED * max(track[INTERVAL], LEAST_LEAP)
    if hand[UNTIL] < hand[FRAME]:
        hand[FOUND] = hand[FRAME]
    behind = OF_JOINING * decay * abs(x - level) >= max(CATCH_UP * abs(slope), LEAST_CATCH_UP)
    far = not abs(x - level) < leap
    like_before = not far or abs(slope) <= FASTER * usual
    unseen = not silent and behind and like_before and hand[MODE] == BY_POSITION and hand[FOUND] == hand[FRAME]
    jumped = not silent and not unseen and bool(hand[MODE] == BY_SPEED or far)
    if jumped:
        level = position
        if hand[MODE] == BY_POSITION:
            begin_anew(track, 0.0)
            slope_with(track, time, position)
            slope, v, a = 0.0, 0.0, 0.0
    if silent or unseen:
        stand(curve, before, level, slope)
    else:
        join(curve, powers, rate, before, level if jumped else x, v, a, level, slope, decay)
    hand[MODE], hand[UNTIL] = BY_POSITION, np.inf
    if slope != 0.0:
        hand[UNTIL] = hand[FRAME] + max(0.0, np.ceil((HORIZON * track[INTERVAL] + SPARE - late) * rate))
    return jumped or unseen


@signed_kernel("b1(f8[::1], f8, f8, f8, f8, b1, f8)", fused=False)
def apply_update(
    state: Array, rate: float, lowest: float, time: float, value: float, by_speed: bool, load: float
) -> bool:
    """Lead the curves of place and load to an update; return whether it is a jump.

    load: N; NaN keeps the previous load.
    """
    hand, place, load_curve, powers, load_powers, track = parts_of(state)
    frame = hand[FRAME]
    pressed, press_rate, _bend = values_at(load_curve, frame - 1.0, rate)
    silent = hand[MODE] == UNKNOWN or (lowest == 0.0 and pressed == 0.0 and press_rate == 0.0)
    known, clock = track[ARRIVALS], track[CLOCK]
    late = late_by(track, frame / rate, time, silent)
    if known > 0.0 and abs(track[CLOCK] - clock) >= LATEST:
        hand[FOUND] = frame
    if load == load:
        hand[ASKED] = min(max(load, lowest), LARGEST_LOAD)
    press(load_curve, load_powers, rate, frame, hand[ASKED])
    if by_speed:
        x, v, a = values_at(place, frame - 1.0, rate)
        if silent:
            stand(place, frame - 1.0, x, value)
        else:
            glide(place, powers, rate, frame - 1.0, x, v, a, value, GLIDE_DECAY)
        begin_anew(track, value)
        hand[MODE], hand[UNTIL] = BY_SPEED, np.inf
        return False
    jumped: bool = _go_to(hand, place, powers, track, rate, time, value, late, silent)
    return jumped


@signed_kernel("void(f8[::1], f8, f8)", fused=False)
def release_hand(state: Array, rate: float, lowest: float) -> None:
    """Lead the load to zero and the speed to rest."""
    hand, place, load_curve, powers, load_powers, _track = parts_of(state)
    press(load_curve, load_powers, rate, hand[FRAME], max(0.0, lowest))
    x, v, a = values_at(place, hand[FRAME] - 1.0, rate)
    glide(place, powers, rate, hand[FRAME] - 1.0, x, v, a, 0.0, GLIDE_DECAY)
    hand[UNTIL] = hand[FRAME] - 1.0


@signed_kernel("void(f8[::1], f8, f8, f8[:,::1], f8[::1])", fused=False)
def fill_motion(state: Array, rate: float, lowest: float, samples: Array, position: Array) -> None:
    """Write the next frames. If the horizon is within them, the position glides to a stop from there."""
    hand, place, load_curve, powers, load_powers, _track = parts_of(state)
    frames, first, done = len(position), hand[FRAME], 0
    while done < frames:
        if hand[UNTIL] == first + done:
            x, v, a = values_at(place, hand[UNTIL], rate)
            glide(place, powers, rate, hand[UNTIL], x, v, a, 0.0, GLIDE_DECAY)
        stop = int(min(float(frames), hand[UNTIL] - first)) if hand[UNTIL] > first + done else frames
        fill_curve(
            place, powers, rate, first + done,
            position[done:stop], samples[SPEED, done:stop], samples[SPEED_RATE, done:stop],
        )  # fmt: skip
        done = stop
    loads = samples[LOAD]
    fill_curve(load_curve, load_powers, rate, first, loads, samples[LOAD_RATE], samples[LOAD_BEND])
    for i in range(frames):
        loads[i] = min(max(loads[i], lowest), LARGEST_LOAD)
    hand[FRAME] = first + frames
