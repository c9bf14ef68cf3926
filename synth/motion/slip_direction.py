"""The share of each axis in the friction of a skin that is dragged over an area.

Stage   MOTION, used by `dragged_hand`.
Model   A trailer follows the hand on a rope, whose length is the way at which the spring gives way, mu_d w / k. The
        squares of the direction cosines of the trailer's way are averaged over that length of it, and their roots are
        the shares. Along a straight line they are exactly its direction. Where the hand stands, trembles or turns back,
        the rope is slack, and the shares remain: the skin sticks, and its force with it.
        Before the rope is taut for the first time, the shares are those of the rope.
Limits  Along a curve the shares are late by the length of the rope, 0.2 mm on wet glass at 0.5 N.
"""

from __future__ import annotations

import math

import numpy as np

from synth.arrays import Array
from synth.kernels import signed_kernel

LEAST = 1e-3  # share of an axis across which a hand moves: 0 has no Stribeck speed
SHORTEST = 1e-9  # m: rope of a finger without load
ROPE, SQUARES, TAUT = slice(0, 2), slice(2, 4), 4
"""State: the rope (m) along x and across, the mean squares of the direction cosines, and whether it was taut."""


def slack() -> Array:
    """Return the state before the first frame: the hand moves along x."""
    return np.array([0.0, 0.0, 1.0, 0.0, 0.0])


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
