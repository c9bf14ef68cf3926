"""Moves the skin as `skin_drag` does: along a line, or over an area along both axes.

Stage   MOTION, a `Mover` of `moved_skin`.
Model   Along a line the skin is dragged along it. Over an area each axis is dragged, with its share
        of the load and of the speed of Stribeck, so that along a straight line in any direction the motion is that
        along a line.
        Shares: a trailer follows the hand on a rope, whose length is the way at which the spring gives way, mu_d w / k.
        The squares of the direction cosines of the trailer's way are averaged over that length of it, and their roots
        are the shares. Along a straight line they are exactly its direction. Where the hand stands, trembles or turns
        back, the rope is slack, and the shares remain: the skin sticks, and its force with it. Before the rope is taut
        for the first time, the shares are those of the rope.
Limits  Where a path bends, friction along one axis does not depend on the speed along the other, but for the shares. A
        hand over an area moves at a constant speed between two frames. Along a curve the shares are late by the length
        of the rope, 0.2 mm on wet glass at 0.5 N.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from synth.arrays import Array
from synth.kernels import signed_kernel
from synth.motion.motion import ACROSS, LOAD, SPEED, SPEED_RATE, Motion
from synth.motion.skin_drag import KINETIC, SPRING, at_rest, drag

LEAST = 1e-3  # share of an axis across which a hand moves: 0 has no Stribeck speed
SHORTEST = 1e-9  # m: rope of a finger without load
SLACK = 0.0, 0.0, 1.0, 0.0, 0.0
"""First state of the shares, of a hand that moves along x: the rope (m) along x and across, the mean squares of the
direction cosines, and whether it was taut."""


@signed_kernel("void(f8[::1], f8[:,::1], f8[::1], f8[:,::1])", fused=False)
def write_shares(state, travel, lengths, out):
    """Write the share of each axis at each frame, and update `state`.

    travel: of the hand since the frame before, m [2, frames].
    lengths: of the rope at each frame, m.
    out: float64 [2, frames].
    """
    for i in range(travel.shape[1]):
        x, y = state[0] + travel[0, i], state[1] + travel[1, i]
        long, length = math.hypot(x, y), max(lengths[i], SHORTEST)
        part = length / long if long > length else 1.0
        state[0], state[1] = part * x, part * y
        moved = long - length
        if moved > 0.0:
            fresh = 1.0 if state[4] == 0.0 else -math.expm1(-moved / length)
            state[2] += fresh * ((x / long) ** 2 - state[2])
            state[3] += fresh * ((y / long) ** 2 - state[3])
            state[4] = 1.0
        elif state[4] == 0.0 and long > 0.0:
            state[2], state[3] = (x / long) ** 2, (y / long) ** 2
        out[0, i], out[1, i] = max(math.sqrt(state[2]), LEAST), max(math.sqrt(state[3]), LEAST)


@dataclass(slots=True)
class DragState:
    """The state of a skin.

    axes: state of `skin_drag` along x, and across.
    place: of the hand at the last frame, along x and across (m); None before the first.
    speed: of the hand at the last frame, and its rate (m/s, m/s^2).
    direction: state of `write_shares`.
    """

    axes: tuple[Array, Array] = field(default_factory=lambda: (at_rest(), at_rest()))
    place: Array | None = None
    speed: tuple[float, float] = (0.0, 0.0)
    direction: Array = field(default_factory=lambda: np.array(SLACK))


@dataclass(frozen=True, slots=True)
class DraggedHand:
    """Drags the skin after a hand.

    parameters: of `skin_drag`.
    rate: frames per second.
    """

    parameters: tuple[float, ...]
    rate: int

    def start(self) -> DragState:
        """See `Mover`."""
        return DragState()

    def follow(self, state: DragState, hand: Motion) -> Array:
        """See `Mover`."""
        load = np.maximum(hand.samples[LOAD], 0.0)
        places = self._places(state, hand)
        first = places[:, :1] if state.place is None else state.place[: len(places), np.newaxis]
        travel = np.diff(places, axis=1, prepend=first)
        speeds: Array
        shares: Array
        if len(places) == 1:
            speeds, shares = hand.samples[SPEED : SPEED + 1], np.ones((1, hand.frames))
        else:
            speeds, shares = travel * self.rate, np.empty(travel.shape)
            lengths = load * (self.parameters[KINETIC] / self.parameters[SPRING])
            write_shares(state.direction, np.ascontiguousarray(travel), np.ascontiguousarray(lengths), shares)
        state.place = np.append(places[:, -1], [0.0])[:2]
        state.speed = hand.samples.item(SPEED, -1), hand.samples.item(SPEED_RATE, -1)
        skin = np.empty((len(places), 3, hand.frames))
        p = np.array(self.parameters)
        for axis, out in enumerate(skin):
            arrays = (travel[axis], speeds[axis], load, shares[axis])
            drag(p, float(self.rate), state.axes[axis], *map(np.ascontiguousarray, arrays), out)
            out[0] = places[axis] - out[0]
        return skin

    def _places(self, state: DragState, hand: Motion) -> Array:
        """Return the places of the hand (m) along x and, over an area, across [axes, frames]."""
        if len(hand.position):
            return np.stack([hand.position, hand.path[ACROSS]]) if hand.path.size else hand.position[np.newaxis]
        speed, bend = (
            np.concatenate([[before], hand.samples[row]])
            for before, row in zip(state.speed, (SPEED, SPEED_RATE), strict=True)
        )
        moved = 0.5 * (speed[1:] + speed[:-1]) / self.rate + (bend[:-1] - bend[1:]) / (12.0 * self.rate**2)
        if state.place is None:
            moved[0] = 0.0
        begun = 0.0 if state.place is None else float(state.place[0])
        return np.asarray(np.cumsum(np.concatenate([[begun], moved]))[np.newaxis, 1:])
