"""The direction of friction on the finger: that of the surface under it, at each frame of a motion.

Stage   3 (VOICE), used by `tangential_force`.
Model   tanh(|u| / u0) u / |u|, with the velocity u of the surface. Along a path u is the difference of the places
        before and after a frame.
Limits  Near a stop the direction turns round within the speed u0.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.motion.motion import ACROSS, SPEED, Motion
from synth.motion.scan_motion import ScanMotion
from synth.scene.line_scan import as_written


def along_scan(own: ScanMotion, first: int, frames: int) -> Array:
    """Return the speed of the surface along x and y (m/s) at each frame of the scan itself [2, frames]."""
    motion = own.at(first - 1, frames + 2)
    if not motion.path.size:
        return np.stack([motion.samples[SPEED, 1:-1], np.zeros(frames)])
    places = np.stack([motion.position, motion.path[ACROSS]])
    return np.asarray((places[:, 2:] - places[:, :-2]) * (0.5 * own.rate))


def after_hand(motion: Motion, before: Array | None, rate: float) -> tuple[Array, Array | None]:
    """Return the speed of the surface along x and y (m/s) under a hand [2, frames], and its last place (m) on a path.

    before: the place at the frame before the first [2, 1]; None if it is unknown.
    """
    if not motion.path.size or not len(motion.position):
        return np.stack([motion.samples[SPEED], np.zeros(motion.frames)]), before
    places = np.stack([motion.position, motion.path[ACROSS]])
    first = places[:, :1] if before is None else before
    return np.asarray(np.diff(places, axis=1, prepend=first) * rate), places[:, -1:]


def directed(speeds: Array, reversal: float) -> Array:
    """Return the direction of friction at each of `speeds` [2, frames]: of length 1 but where it turns round.

    reversal: u0, m/s.
    """
    size = np.hypot(*speeds)
    return np.asarray(speeds * np.divide(np.tanh(size / reversal), size, out=np.zeros_like(size), where=size > 0.0))


def own_direction(scene: Any, law: Any) -> Array:
    """Return the direction of friction at the scan's own speed [2]."""
    scan = as_written(scene).scan
    speeds = scan.speed * np.array([[math.cos(scan.heading)], [math.sin(scan.heading)]])
    return directed(speeds, law.reversal_speed)[:, 0]
