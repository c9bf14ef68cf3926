"""Position of the finger in a stroke, back and forth between two places, without drift over hours.

Model   The finger cruises at u between turns. In a turn the velocity changes from u to -u as u (1 - 2 S(s)), with
        S = 3 s^2 - 2 s^3.
Source  design, section 4.
"""

from __future__ import annotations

import math

import numpy as np

from synth.arrays import Array
from synth.kernels import signed_kernel, two_product
from synth.motion.motion import LOAD, SPEED, SPEED_RATE, Motion
from synth.scene.scan_section import TURN_REACH, Stroke


@signed_kernel("void(f8, f8, f8, i8, f8, f8[:,::1], f8[::1])")
def fill_stroke(u: float, turn: float, cruise: float, first: int, rate: float, samples: Array, position: Array) -> None:
    """Write speed and its rate to `samples`, and `position`.

    u: speed of the stroke, m/s.
    turn, cruise: durations, s.
    """
    half, reach = cruise + turn, TURN_REACH * u * turn
    half_rest = (cruise - (half - turn)) if cruise < turn else (turn - (half - cruise))
    length = 2.0 * reach + u * cruise
    for i in range(len(position)):
        t = (first + i) / rate
        turned = math.floor(t / half)
        # after hours the rounding of t and of the preceding turns is 1e-11 s: subtract it
        frames, frames_rest = two_product(t, rate)
        t_rest = ((first + i - frames) - frames_rest) / rate
        before, before_rest = two_product(turned, half)
        local = (t - before) + (t_rest - before_rest - turned * half_rest)
        travel, speed, bend = reach + u * (local - 0.5 * turn), u, 0.0
        if local < 0.5 * turn or local > 0.5 * turn + cruise:
            leaving = local < 0.5 * turn
            s = 0.5 + local / turn if leaving else (local - 0.5 * turn - cruise) / turn
            area = u * turn * (s - 2.0 * s**3 + s**4)
            sign = -1.0 if leaving else 1.0
            travel = reach - area if leaving else reach + u * cruise + area
            speed = sign * u * (1.0 - 6.0 * s**2 + 4.0 * s**3)
            bend = sign * u * 12.0 * s * (s - 1.0) / turn
        back = turned % 2.0 != 0.0
        samples[SPEED, i], samples[SPEED_RATE, i] = (-speed, -bend) if back else (speed, bend)
        position[i] = length - travel if back else travel


def stroke_motion(stroke: Stroke, first: int, frames: int, rate: float) -> Motion:
    """Return the stroke over `frames` frames from frame `first`. At t = 0 the finger is at rest at position 0."""
    samples, position = np.zeros((5, frames)), np.empty(frames)
    samples[LOAD] = stroke.load
    fill_stroke(stroke.speed, stroke.turn_time, stroke.cruise_time, first, float(rate), samples, position)
    return Motion(samples, position)
