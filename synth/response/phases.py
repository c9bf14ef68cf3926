"""The phase of the texture at every frame of a motion, as a 64-bit fraction of a turn (one period).

Model   Where the position is known, the phase is position / lambda2. Otherwise each frame advances it by
        (speed + speed_rate / (2 rate)) / (rate lambda2), computed in double-double and summed in fixed point.
Source  design, section 8.
Limits  Drift is below 1e-9 turn in 24 h at every rate and speed of the scene's range
        (tests/synth/hard/test_long_streams.py).
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from synth.arrays import Array
from synth.kernels import inlined, signed_kernel, two_product

HALF_TURN = 2.0**63
WORD = 2.0**32
INTEGER, INTEGER_BITS = 1.5 * 2.0**52, np.uint64(0x4338 << 48)  # a double whose last digit is 1, and its bits

SPEED, SPEED_RATE = 0, 1  # rows of `motion`


@inlined
def rest_of_step(step, rate, period):
    """Return the rounding error of step = 1 / (rate period), which adds up to 1e-9 turn in 24 hours of frames."""
    whole, low = two_product(rate, period)
    product, rest = two_product(step, whole)
    return ((1.0 - product) - rest - step * low) * step


@inlined
def fill_steps(speed, speed_rate, rate, period, steps):
    """Write the turns from each frame to the next, as uint64 fractions of a turn, exact to 2^-65.

    The upper and the lower 32 bits are computed separately. Adding a number to INTEGER leaves its integer part in the
    low bits of the sum. Direct conversions to 64 bits are not vectorised without AVX-512.
    """
    step = 1.0 / (rate * period)  # turns per frame at 1 m/s
    step_rest, bend = rest_of_step(step, rate, period), 0.5 * step / rate
    step1 = np.float64(np.float32(step))  # halves of 24 and 29 bits: their products are exact
    step2 = step - step1
    upper, lower = np.empty(len(steps)), np.empty(len(steps))
    for i in range(len(steps)):
        speed1 = np.float64(np.float32(speed[i]))
        speed2 = speed[i] - speed1
        coarse = speed1 * step1
        small = speed1 * step2 + speed2 * step1 + (speed2 * step2 + speed[i] * step_rest + speed_rate[i] * bend)
        coarse = (coarse - np.rint(coarse)) * WORD
        whole = np.rint(coarse)
        rest = (coarse - whole) + (small - np.rint(small)) * WORD
        carried = np.rint(rest)
        upper[i] = whole + carried + INTEGER
        lower[i] = (rest - carried) * WORD + INTEGER
    high, low = upper.view(np.uint64), lower.view(np.uint64)
    for i in range(len(steps)):
        steps[i] = ((high[i] - INTEGER_BITS) << np.uint64(32)) + (low[i] - INTEGER_BITS)


@inlined
def fill_phases(motion, position, phase, rate, period, first, stride, phases):
    """Write the phase of the frames first, first + stride, ... to `phases`; return the phase after the last frame."""
    frames = motion.shape[1]
    begin = frames - 1 if len(position) == frames else 0
    steps = np.empty(frames - begin, dtype=np.uint64)
    fill_steps(motion[SPEED, begin:], motion[SPEED_RATE, begin:], rate, period, steps)
    if len(position) == frames:
        for k in range(len(phases)):
            phases[k] = phase_at(position[first + k * stride] / period)
        return phase_at(position[begin] / period) + steps[0]
    done = 0
    for k in range(len(phases)):
        for i in range(done, first + k * stride):
            phase += steps[i]
        done = first + k * stride
        phases[k] = phase
    for i in range(done, frames):
        phase += steps[i]
    return phase


@inlined
def phase_at(turns):
    """Return turns as a uint64 fraction of a turn."""
    return np.uint64(np.int64(np.rint((turns - np.rint(turns)) * HALF_TURN)) << np.int64(1))


@signed_kernel("u8(f8[:,::1], f8[::1], u8, f8, f8, i8, i8, u8[::1])")
def phases_of(motion, position, phase, rate, period, first, stride, phases):
    """Write the phase of the frames first, first + stride, ... to `phases`; return the phase after the last frame."""
    return fill_phases(motion, position, phase, rate, period, first, stride, phases)


def phase_step(speed: float, period: float, rate: int) -> int:
    """Return the turns per frame as a 64-bit fraction of a turn, exact to 2^-65 turn.

    speed: m/s.
    period: m.
    """
    turns = Fraction(speed) / (Fraction(period) * rate)
    return round(turns * 2**64) % 2**64


def turns_to_phase(turns: Array) -> np.ndarray:
    """Return turns as uint64 fractions of a turn."""
    rest = turns - np.rint(turns)
    return (np.rint(rest * HALF_TURN).astype(np.int64).view(np.uint64)) << np.uint64(1)
