"""Curves from the hand's present motion to its target, with two continuous derivatives and a definite end.

Model   x = level + slope s + (b0 + b1 s + b2 s^2) exp(-decay s), with s in seconds since `start`. x, x' and x''
        continue from their present values. `join` chooses b so that the error e = x - level - slope s obeys
        (d/dt + decay)^3 e = 0. `glide` chooses b so that the speed obeys (d/dt + decay)^2 (x' - slope) = 0; it does
        not prescribe the final position. Both are critically damped.
Source  The closed forms of linear equations with one threefold, or twofold, root.
Limits  e is exactly 0 from decay s = SETTLED on, or from the start if it is below STILL, so no denormals occur. Every
        frame is computed from its distance to `start`, without fused operations, so blocks of any size give the same
        bits.
"""

from __future__ import annotations

import math

import numpy as np

from synth.arrays import Array
from synth.kernels import signed_kernel, unfused

START, END, LEVEL, SLOPE, B0, B1, B2, DECAY = range(8)
"""Entries of a curve: first frame, frame from which e is 0, then the coefficients in SI."""
ENTRIES = 8

SETTLED = 36.0  # decay s from which e is 0; exp(-36) 36^2 / 2 = 1.5e-13 of it is then left; smaller leaves a step
STILL = 1e-13  # m or N: smaller errors are ignored; their acceleration is 1e-10 of that of a stroke
STRIDE = 64  # frames between computed exponentials; a table gives the others at a tenth of the cost


@unfused
def values_at(curve: Array, frame: float, rate: float) -> tuple[float, float, float]:
    """Return x, x' and x'' of `curve` at `frame`."""
    s = (frame - curve[START]) / rate
    line = curve[LEVEL] + curve[SLOPE] * s
    if frame >= curve[END]:
        return line, curve[SLOPE], 0.0
    fall, decay = math.exp(-curve[DECAY] * s), curve[DECAY]
    e = curve[B0] + s * (curve[B1] + s * curve[B2])
    e1 = curve[B1] + 2.0 * s * curve[B2]
    first = e1 - decay * e
    second = 2.0 * curve[B2] - decay * (e1 + first)
    return line + e * fall, curve[SLOPE] + first * fall, second * fall


@signed_kernel("void(f8[::1], f8, f8, f8)", fused=False)
def stand(curve: Array, frame: float, level: float, slope: float) -> None:
    """Set `curve` to the straight line through `level` at `frame`."""
    curve[START], curve[END], curve[LEVEL], curve[SLOPE] = frame, frame, level, slope
    curve[B0], curve[B1], curve[B2] = 0.0, 0.0, 0.0


@unfused
def join(
    curve: Array, powers: Array, rate: float, frame: float, x: float, v: float, a: float,
    level: float, slope: float, decay: float,
) -> None:  # fmt: skip
    """Set `curve` to go from x, x' = v, x'' = a at `frame` to the line through `level` at `frame`."""
    stand(curve, frame, level, slope)
    e, e1 = x - level, v - slope
    if abs(e) + abs(e1) / decay + abs(a) / decay**2 < STILL:
        return
    curve[B0], curve[B1], curve[B2] = e, e1 + decay * e, 0.5 * (a + decay * (2.0 * e1 + decay * e))
    fall_by(curve, powers, rate, decay)


@unfused
def glide(
    curve: Array, powers: Array, rate: float, frame: float, x: float, v: float, a: float, slope: float, decay: float
) -> None:
    """Set `curve` to go from x, x' = v, x'' = a at `frame` to the speed `slope`."""
    stand(curve, frame, x, slope)
    e, bend = v - slope, a + decay * (v - slope)
    if abs(e) / decay + abs(a) / decay**2 < STILL:
        return
    curve[B1] = -bend / decay
    curve[B0] = (curve[B1] - e) / decay
    curve[LEVEL] = x - curve[B0]
    fall_by(curve, powers, rate, decay)


@unfused
def fall_by(curve: Array, powers: Array, rate: float, decay: float) -> None:
    """Set the decay (1/s) of the error of `curve`, and write exp(-decay s) over a stride of frames to `powers`."""
    curve[END] = curve[START] + math.ceil(SETTLED * rate / decay)
    if decay != curve[DECAY]:
        curve[DECAY] = decay
        for i in range(STRIDE):
            powers[i] = math.exp(-decay * i / rate)


@unfused
def fill_curve(curve: Array, powers: Array, rate: float, frame: float, x: Array, v: Array, a: Array) -> None:
    """Write x, x' and x'' of `curve`, from `frame` on, to `x`, `v` and `a`, each float64 [frames]."""
    decay, slope, level = curve[DECAY], curve[SLOPE], curve[LEVEL]
    b0, b1, b2 = curve[B0], curve[B1], curve[B2]
    away, fading = int(frame - curve[START]), int(curve[END] - frame)
    i = 0
    while i < min(fading, len(x)):
        stride, place = divmod(away + i, STRIDE)
        count = min(STRIDE - place, min(fading, len(x)) - i)
        coarse = math.exp(-decay * (stride * STRIDE) / rate)
        fine, x1, v1, a1 = powers[place : place + count], x[i : i + count], v[i : i + count], a[i : i + count]
        for k in range(count):
            s = (away + i + k) / rate
            fall = coarse * fine[k]
            e = b0 + s * (b1 + s * b2)
            e1 = b1 + 2.0 * s * b2
            first = e1 - decay * e
            x1[k] = (level + slope * s) + e * fall
            v1[k] = slope + first * fall
            a1[k] = (2.0 * b2 - decay * (e1 + first)) * fall
        i += count
    for k in range(i, len(x)):
        x[k] = level + slope * ((away + k) / rate)
        v[k] = slope
        a[k] = 0.0


def new_curve() -> tuple[Array, Array]:
    """Return a curve at rest at 0 before frame 0, and memory for its powers."""
    curve = np.zeros(ENTRIES)
    curve[START] = curve[END] = -1.0
    return curve, np.ones(STRIDE)
