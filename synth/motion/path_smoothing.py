"""Follows a remote hand that moves a finger over an area and turns it.

Stage   Motion, for hands behind a network.
Model   The place along x, the place across and the direction are followed by one `update_smoothing.Follower` each. They
        receive the same updates at the same frames, so their delays are equal. A direction is followed as the length of
        an arc of radius TURN_RADIUS, so it jumps if the finger's rim jumps. It turns the short way round.
        The place across and the direction are followed from the first update that has them. Until then the finger is on
        the line of its scan; with that update it jumps to the new values.
Source  docs/live-motion.md.
Limits  Those of `update_smoothing`.
"""

from __future__ import annotations

import math
from typing import Self

import numpy as np

from synth.motion.motion import Motion, Update
from synth.motion.update_smoothing import Follower

TURN_RADIUS = 8e-3  # m: half a fingertip; with a larger radius, more turns of the finger count as jumps


class PathFollower(Follower):
    """The state of one followed hand, and of its place across and its direction.

    direction: of the finger before the first update that has one, rad.
    """

    __slots__ = ("_across", "_direction", "_turned")

    def __init__(self, sample_rate: int, *, lowest_load: float = 0.0, direction: float = 0.0) -> None:
        super().__init__(sample_rate, lowest_load=lowest_load)
        self._across: Follower | None = None
        self._turned: Follower | None = None
        self._direction = direction

    def apply(self, update: Update) -> bool:
        """Follow `update` from the next frame on; return True for a jump."""
        jumped = super().apply(update)
        if update.across is not None:
            jumped |= self._follow("_across", update, update.across)
        if update.direction is not None:
            self._direction += math.remainder(update.direction - self._direction, 2.0 * math.pi)
            jumped |= self._follow("_turned", update, TURN_RADIUS * self._direction)
        return jumped

    def _follow(self, name: str, update: Update, value: float) -> bool:
        """Follow `value` (m) with the follower called `name`, which the first call makes; return True for a jump."""
        follower: Follower | None = getattr(self, name)
        if follower is not None:
            return follower.apply(update._replace(position=value, speed=None))
        follower = Follower(self.sample_rate, lowest_load=self.lowest)
        follower.begin(value, 0.0, update.load or 0.0)
        follower.apply(update._replace(position=value, speed=None))
        setattr(self, name, follower)
        return True

    def release(self) -> None:
        """Let the load go to zero and the finger glide to a stop, until the next update."""
        super().release()
        for follower in (self._across, self._turned):
            if follower is not None:
                follower.release()

    def motion(self, frames: int) -> Motion:
        """Return the next frames, with derivatives. They have a path from the first update with a place across."""
        motion = super().motion(frames)
        across = None if self._across is None else self._across.motion(frames).position
        turned = None if self._turned is None else self._turned.motion(frames).position / TURN_RADIUS
        if across is None or not len(motion.position):
            return motion
        direction = np.full(frames, self._direction) if turned is None else turned
        return Motion(motion.samples, motion.position, np.stack([across, direction]))

    def copy(self) -> Self:
        """Return an independent follower in the same state."""
        other = super().copy()
        other._direction = self._direction
        other._across = None if self._across is None else self._across.copy()
        other._turned = None if self._turned is None else self._turned.copy()
        return other
