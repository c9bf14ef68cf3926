"""A hand on the network, followed: updates of 30 to 1000 Hz become position and load at audio rate.

Stage   motion, for hands that are far away.
Model   Each update says where the hand was expected DELAY ago (`following_track`), and the position joins that straight
        line with two continuous derivatives (`following_curve`, third order): at constant speed DELAY is all that it is
        late. Past the horizon it glides to a stop. A hand that gives speeds is followed by a glide of the same delay,
        and the load joins the newest one, held, with a fixed decay. These two weigh the past with a kernel that is
        never negative: what they give lies between what was asked for.
Source  docs/live-motion.md: what was measured, against which alternatives, and the figures that this choice rests on.
Limits  what the hand does between two updates is not known: a sudden stop is overshot by a part of it.
"""

from __future__ import annotations

import math

import numpy as np

from synth.arrays import Array
from synth.kernels import signed_kernel, unfused
from synth.motion.motion import LARGEST_LOAD, LOAD, LOAD_BEND, LOAD_RATE, NOWHERE, SPEED, SPEED_RATE, Motion, Update
from synth.motion.update_curve import ENTRIES as CURVE
from synth.motion.update_curve import STRIDE, fill_curve, glide, join, new_curve, stand, values_at
from synth.motion.update_timing import INTERVAL, begin_anew, late_by, new_track, slope_with

DELAY = 0.01  # s that place and speed are late, a block of the service; less: turns and stops are overshot, and mice
# sound rough (without it twice the error); more: a stroke is felt after it is seen
TIGHTNESS = 3.0  # decays in an interval of updates; more: updates are heard one by one; less: late at turns
QUICKEST = 250.0  # 1/s: decay at most, reached at 83 Hz; more: rough time stamps sound rough; less: late at turns
SLOWEST = 60.0  # 1/s: decay at least, of updates at 20 Hz; less: a turn at 5 Hz is lost
GLIDE_DECAY = 2.0 / DELAY  # 1/s of speeds, and of a stop without updates
LOAD_DECAY = 200.0  # 1/s: a load is 15 ms late; more: a touch is a click, louder than the texture (from 300 on); less:
# presses come late, and a lift sounds on for longer
HORIZON, SPARE = 2.0, 0.035  # intervals and s that a speed is carried on: one lost update, DELAY, a block, some jitter;
# less: such gaps are heard; more: a hand that stops, or turns while an update is lost, is carried too far
LEAP_SPEED = 1.5  # m/s by which a hand may surprise; more: teleports are heard as a sweep; less: swift starts are faded
LEAST_LEAP = 0.01  # s of LEAP_SPEED at least, however quick the updates are

UNKNOWN, BY_POSITION, BY_SPEED = 0.0, 1.0, 2.0
FRAME, MODE, UNTIL, ASKED = range(4)
"""Entries of a hand: next frame, what it gives, frame at which it glides to a stop, load asked for (N)."""
OF_PLACE = 4
OF_LOAD = OF_PLACE + CURVE
POWERS = OF_LOAD + CURVE
POWERS_OF_LOAD = POWERS + STRIDE
TRACK = POWERS_OF_LOAD + STRIDE
"""Where, behind the entries of a hand, the curves of place and load, the powers of each, and the track begin."""


class Follower:
    """The state of one followed hand; nothing is queued, the newest update wins.

    lowest_load: N, that of the scene's effects (`scene_effects.lowest_load`); loads stay within it and LARGEST_LOAD.
    Place and speed are DELAY late for being smooth, the load is 3 / LOAD_DECAY late. The same calls at the same frames
    give the same bits, whatever the blocks.
    """

    __slots__ = ("lowest", "sample_rate", "state")

    def __init__(self, sample_rate: int, *, lowest_load: float = 0.0) -> None:
        self.sample_rate = sample_rate
        self.lowest = lowest_load
        hand = np.array([0.0, UNKNOWN, math.inf, 0.0])
        (place, places), (load, loads) = new_curve(), new_curve()
        self.state = np.concatenate([hand, place, load, places, loads, new_track()])  # one: it is copied at each update

    def begin(self, position: float, speed: float, load: float) -> None:
        """Begin as a hand that already moves at `position` (m) and `speed` (m/s) with `load` (N), and goes on so."""
        held = min(max(load, self.lowest), LARGEST_LOAD)
        hand, place, load_curve, _, _, track = parts_of(self.state)
        stand(place, hand[FRAME], position, speed)
        stand(load_curve, hand[FRAME], held, 0.0)
        hand[MODE:] = BY_POSITION, math.inf, held
        track[:] = new_track()
        begin_anew(track, speed)

    def apply(self, update: Update) -> bool:
        """Follow `update` from the next frame on.

        Return True for a jump: the finger was put elsewhere while it sounds, faster than a hand moves or because
        positions follow upon speeds. Cross-fade then from a copy of the state before to this one.
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
        """Return the next frames, complete; without positions where the hand gives speeds, or nothing yet."""
        samples, position = np.empty((5, frames)), np.empty(frames)
        known = self.state.item(MODE) == BY_POSITION
        self.fill(samples, position)
        return Motion(samples, position if known else NOWHERE)

    def fill(self, samples: Array, position: Array) -> None:
        """Write the next frames to `samples` (float64 [5, frames], rows of a Motion) and `position` (m)."""
        fill_motion(self.state, float(self.sample_rate), self.lowest, samples, position)

    def copy(self) -> Follower:
        """Return another follower in the same state."""
        other = Follower.__new__(Follower)
        other.sample_rate, other.lowest, other.state = self.sample_rate, self.lowest, self.state.copy()
        return other


@signed_kernel("UniTuple(f8[::1], 6)(f8[::1])", fused=False)
def parts_of(state: Array) -> tuple[Array, Array, Array, Array, Array, Array]:
    """Return the hand, the curves of place and of load, the powers of each, and the track, all of which are `state`."""
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
    """Lead the load to `load`, from the frame before `frame` on, unless it goes there already."""
    if load != curve[2]:
        w, w1, w2 = values_at(curve, frame - 1.0, rate)
        join(curve, powers, rate, frame - 1.0, w, w1, w2, load, 0.0, LOAD_DECAY)


@unfused
def _go_to(
    hand: Array, curve: Array, powers: Array, track: Array, rate: float,
    time: float, position: float, late: float, silent: bool,
) -> bool:  # fmt: skip
    """Lead the place to a position that was true `late` s ago."""
    before = hand[FRAME] - 1.0
    x, v, a = values_at(curve, before, rate)
    slope = slope_with(track, time, position)
    level = position + slope * (late - DELAY - 1.0 / rate)
    leap = LEAP_SPEED * max(track[INTERVAL], LEAST_LEAP)
    jumped = not silent and bool(hand[MODE] == BY_SPEED or not abs(x - level) < leap)
    if jumped:
        level = position
        if hand[MODE] == BY_POSITION:
            begin_anew(track, 0.0)
            slope_with(track, time, position)
            slope, v, a = 0.0, 0.0, 0.0
    if silent:
        stand(curve, before, level, slope)
    else:
        decay = min(max(TIGHTNESS / track[INTERVAL], SLOWEST), QUICKEST)
        join(curve, powers, rate, before, level if jumped else x, v, a, level, slope, decay)
    hand[MODE], hand[UNTIL] = BY_POSITION, np.inf
    if slope != 0.0:
        hand[UNTIL] = hand[FRAME] + max(0.0, np.ceil((HORIZON * track[INTERVAL] + SPARE - late) * rate))
    return jumped


@signed_kernel("b1(f8[::1], f8, f8, f8, f8, b1, f8)", fused=False)
def apply_update(
    state: Array, rate: float, lowest: float, time: float, value: float, by_speed: bool, load: float
) -> bool:
    """Lead the curves of place and load to an update; return whether it is a jump. load: NaN keeps the last."""
    hand, place, load_curve, powers, load_powers, track = parts_of(state)
    frame = hand[FRAME]
    pressed, press_rate, _bend = values_at(load_curve, frame - 1.0, rate)
    silent = hand[MODE] == UNKNOWN or (lowest == 0.0 and pressed == 0.0 and press_rate == 0.0)
    late = late_by(track, frame / rate, time, silent)
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
    hand[UNTIL] = np.inf


@signed_kernel("void(f8[::1], f8, f8, f8[:,::1], f8[::1])", fused=False)
def fill_motion(state: Array, rate: float, lowest: float, samples: Array, position: Array) -> None:
    """Write the next frames, and glide to a stop where the horizon lies among them."""
    hand, place, load_curve, powers, load_powers, _track = parts_of(state)
    frames, first, done = len(position), hand[FRAME], 0
    while done < frames:
        if hand[UNTIL] <= first + done:
            x, v, a = values_at(place, hand[UNTIL], rate)
            glide(place, powers, rate, hand[UNTIL], x, v, a, 0.0, GLIDE_DECAY)
            hand[UNTIL] = np.inf
        stop = int(min(float(frames), hand[UNTIL] - first))
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
