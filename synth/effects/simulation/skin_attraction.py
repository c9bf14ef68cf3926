"""The height of a finger of points whose surfaces attract.

Stage   part of `skin_steps`
Model   The force is R = k1 I(z) - k2 I(z - d0), as in `table_steps`, with I the mean over L of max(h - z, 0). It is not
        monotone. z is the nearest root in the direction of the forces, from the place that the velocity leads to. A
        finger that no root holds has let go; it stays out of reach until a load presses it again.
Source  As of `table_steps`.
Limits  z is solved to rounding. A stride that is too long may skip a pair of roots that are close together.
"""

from __future__ import annotations

import math

import numpy as np

from synth.effects.simulation.skin_profile import POINTS, modified_area
from synth.effects.simulation.steps import HELD, SPEED, TOUCH_LOAD
from synth.kernels import inner

MOST_TRIES, ROOT = 300, 1e-15  # of a root; of 1 + |z|, its error
MARCH, FURTHEST, OVER = 1.6, 16.0, 1.05  # strides towards it, see `table_steps`


@inner
def attracted_height(nodes, pieces, weights, window, law, base, alpha, z0, start, whole):
    """Return the z that balances under attraction; infinite if nothing holds the finger.

    law: k2 / k1, and d0 relative to a1 + a2.
    start: where the search begins.
    whole: the mean over L of 1.
    """
    ratio, reach = law
    stride, sign, low, high, z = 0.0, 0.0, -np.inf, np.inf, start
    top = np.max(nodes[POINTS]) + reach
    for _pass in range(MOST_TRIES):
        area, part = modified_area(nodes, pieces, weights, z, window)
        far_area, far_part = modified_area(nodes, pieces, weights, z - reach, window)
        force = area - ratio * far_area - base - alpha * (z - z0)
        slope = part - ratio * far_part + alpha  # minus the change of the force
        if force > 0.0:
            low = z
        elif force < 0.0:
            high = z
        else:
            return z
        if low > -np.inf and high < np.inf:
            following = z + force / slope if slope > 0.0 else np.inf
            if not low < following < high:
                following = 0.5 * (low + high)
            if abs(following - z) <= ROOT * (1.0 + abs(z)) or high - low <= ROOT * (1.0 + abs(z)):
                return following
            z = following
            continue
        if alpha == 0.0 and force > 0.0 and z > top:
            return np.inf
        if sign == 0.0:
            sign, stride = math.copysign(1.0, force), FURTHEST * abs(force) / (whole + alpha)
            if slope > 0.0:
                stride = min(stride, OVER * abs(force) / slope)
        else:
            stride *= MARCH
        z += sign * stride
    return z


@inner
def held_height(nodes, pieces, weights, window, law, base, alpha, z0, start, whole, load, numbers):
    """Return z, and the z from which it has moved; update whether the finger is held, in `numbers`.

    The other arguments are those of `attracted_height`; load: N.
    """
    top = np.max(nodes[POINTS]) + law[1]
    if numbers[HELD] == 0.0 and load >= TOUCH_LOAD:
        numbers[HELD] = 1.0
    if numbers[HELD] > 0.0:
        z = attracted_height(nodes, pieces, weights, window, law, base, alpha, z0, start, whole)
        if z < np.inf and not (alpha > 0.0 and load <= 0.0 and z > top):
            return z, z0
    numbers[HELD], numbers[SPEED] = 0.0, 0.0
    return top, top


@inner
def forces_of(nodes, pieces, weights, window, own, more, reach, z, held):
    """Return the sum of the pressure without attraction, and with it (N).

    own, more: k and k2 (N per mean of a1 + a2).
    """
    if not held:
        return 0.0, 0.0
    near = modified_area(nodes, pieces, weights, z, window)[0]
    far = modified_area(nodes, pieces, weights, z - reach, window)[0]
    return own * near, own * near - more * (far - near)
