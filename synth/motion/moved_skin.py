"""The motion of the skin where an effect lets it lag behind the hand: along a scan at any time, and after a live hand.

Stage   MOTION, between the hand and all that reads a place of the surface.
Model   A `Mover` turns the motion of a hand into the places of the skin, frame by frame, at the rate of the output.
        What follows reads the motion of the skin in place of the hand's; the load is the hand's.
        Along a scan the skin begins SETTLING before t = 0, relaxed and under the hand; a stroke begins at t = 0, where
        it turns, and a recording LIFT_TIME before its first point. Earlier the skin rests there. Between two frames the
        skin moves along the cubic through its places and speeds.
Limits  A time is reached by moving the skin from the nearest state before it that is kept, or from the beginning.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from copy import deepcopy
from typing import Any, Protocol

import numpy as np

from synth.arrays import Array
from synth.motion.motion import DIRECTION, SPEED, SPEED_RATE, Motion
from synth.scene.effects_section import declaration
from synth.scene.scene import Scene

SETTLING = 0.5  # s: long enough for a usual finger to reach its stick-slip; a shorter time begins with the first pull
CHUNK = 4096  # frames moved together
MOST_STATES = 64  # kept of one scan: of more, every second is dropped, so that an endless stream takes no more memory
LOOKED, LONGEST_LOOK = 2.0, 60.0  # s of a scan that is looked at for its largest speed: of a steady one, and at most
PLACE, SLIP, FORCE = range(3)


class Mover(Protocol):
    """Turns the motion of a hand into that of the skin. Frozen, so that many voices share it."""

    def start(self) -> Any:
        """Return the state before the first frame."""

    def follow(self, state: Any, hand: Motion) -> Array:
        """Return the skin at the frames of `hand`, and update `state`.

        Returns float64 [axes, 3, frames]: place (m) and speed (m/s) of the skin, and the force of friction on it (N),
        along x and, if the motion has a path, across, as `hand.position` and `hand.path` have them. Where the hand has
        only a speed (`hand.position` is empty), places count from that of the skin at the first frame, which is 0.
        """


def mover_of(scene: Scene, *, by_hand: bool = False) -> Mover | None:
    """Return what moves the skin in `scene`; None if it is where the hand is, as under a hand at rest.

    by_hand: whether a hand sets the motion, instead of the scan.
    """
    scan = scene.scan
    if not by_hand and scan.speed == 0.0 and scan.stroke is None and scan.trajectory is None:
        return None
    for name, settings in scene.effects.items():
        found: Mover | None = declaration(name).mover(scene, settings, by_hand=by_hand)
        if found is not None:
            return found
    return None


def skin_of(hand: Motion, skin: Array, bends: Array) -> Motion:
    """Return the motion of the skin.

    skin: of `Mover`.
    bends: rate of the speed of the skin at each frame [axes, frames], m/s^2.
    """
    samples, path, speeds = hand.samples.copy(), hand.path, skin[:, SLIP]
    samples[SPEED], samples[SPEED_RATE] = speeds[0], bends[0]
    if path.size:
        path = np.stack([skin[1, PLACE], hand.path[DIRECTION]])
        samples[SPEED] = along = np.hypot(*speeds)
        pull = np.sum(speeds * bends, axis=0)
        samples[SPEED_RATE] = np.divide(pull, along, out=np.zeros_like(pull), where=along > 0.0)
    return Motion(samples, skin[0, PLACE], path, force=skin[:, FORCE])


class SkinAfterHand:
    """The skin of a live hand.

    period: of the texture, m.
    rate: frames per second.
    """

    def __init__(self, mover: Mover, period: float, rate: int) -> None:
        self._mover, self._period, self._rate = mover, period, rate
        self._state = mover.start()
        self._begun = 0.0
        self._speed: Array | None = None

    def begin_at(self, phase: int) -> None:
        """Set the phase of the texture (a 64-bit fraction of a turn) where a hand begins that has only a speed."""
        self._begun = phase / 2.0**64 * self._period

    def after(self, hand: Motion) -> Motion:
        """Return the motion of the skin at the next frames of a hand."""
        skin = self._mover.follow(self._state, hand)
        if not len(hand.position):
            skin[0, PLACE] += self._begun
        before = skin[:, SLIP, :1] if self._speed is None else self._speed
        self._speed = skin[:, SLIP, -1:]
        return skin_of(hand, skin, self._rate * np.diff(skin[:, SLIP], axis=1, prepend=before))


class SkinAlongScan:
    """The skin along a scan, at any time.

    mover: of the scene.
    hand: gives the motion of the hand at frames from a first frame on, at `rate` frames per second.
    settling: time before t = 0 at which the skin begins, s.
    """

    def __init__(self, mover: Mover, hand: Callable[[int, int], Motion], rate: float, settling: float) -> None:
        self._mover, self._hand, self._rate = mover, hand, rate
        self._first = -math.ceil(settling * rate)
        self._states, self._apart = {0: mover.start()}, 1
        self._kept: dict[int, Array] = {}

    def fastest(self, seconds: float) -> float:
        """Return the largest speed (m/s) of the skin from its beginning to `seconds` after t = 0."""
        last = math.ceil(min(seconds, LONGEST_LOOK) * self._rate) - self._first
        return max(
            float(np.max(np.hypot.reduce(self._chunk(number)[:, SLIP], axis=0))) for number in range(last // CHUNK + 1)
        )

    def at(self, hand: Motion, moments: Any) -> Motion:
        """Return the motion of the skin.

        hand: the motion of the hand at the same moments.
        moments: equally spaced, rising, in frames after t = 0.
        """
        whole = np.floor(moments)
        first, t = int(whole[0]), moments - whole
        rows = self._frames(first, int(whole[-1]) + 2)
        place = (whole - first).astype(np.int64)
        bends = self._rate * np.diff(rows[:, SLIP], axis=1)[:, place]
        if not t.any():
            return skin_of(hand, rows[:, :, place], bends)
        (x0, v0, f0), (x1, v1, f1) = (rows[:, :, place + one].swapaxes(0, 1) for one in (0, 1))
        v0, v1, rise = v0 / self._rate, v1 / self._rate, x1 - x0
        cubic = x0 + t * (v0 + t * (3.0 * rise - 2.0 * v0 - v1 + t * (v0 + v1 - 2.0 * rise)))
        skin = np.stack([cubic, (v0 + t * (v1 - v0)) * self._rate, f0 + t * (f1 - f0)], axis=1)
        return skin_of(hand, skin, bends)

    def _frames(self, first: int, end: int) -> Array:
        """Return the skin at frames `first` to before `end`, at rest before its beginning [axes, 3, frames]."""
        begin = max(first, self._first) - self._first
        last = max(end, self._first + 1) - self._first
        parts = [
            self._chunk(number)[:, :, max(begin - number * CHUNK, 0) : last - number * CHUNK]
            for number in range(begin // CHUNK, (last - 1) // CHUNK + 1)
        ]
        rows = parts[0] if len(parts) == 1 else np.concatenate(parts, axis=2)
        early = self._first - first
        if early <= 0:
            return rows
        rest = np.repeat(rows[:, :, :1], early, axis=2)
        rest[:, SLIP:] = 0.0
        return np.concatenate([rest, rows], axis=2)[:, :, : end - first]

    def _chunk(self, number: int) -> Array:
        """Return the skin at the frames of a chunk. The last few chunks, and some states, are kept."""
        while number not in self._kept:
            known = max(one for one in self._states if one <= number)
            state = deepcopy(self._states[known])
            found = self._mover.follow(state, self._hand(self._first + known * CHUNK, CHUNK))
            self._states.setdefault(known + 1, state)
            if len(self._states) > MOST_STATES:
                self._apart *= 2
                self._states = {
                    one: kept for one, kept in self._states.items() if one % self._apart == 0 or one == known + 1
                }
            while len(self._kept) > 2:
                del self._kept[next(iter(self._kept))]
            self._kept[known] = found
        return self._kept[number]
