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
from synth.kernels import fma, signed_kernel, unfused

TURN = 2.0**64  # units of a phase
INTEGER = 1.5 * 2.0**52  # a double whose last digit is 1
OFFSET = np.uint64(0xC338 << 48)  # the bits of 1.5, shifted up by 12, plus those of INTEGER

SPEED, SPEED_RATE = 0, 1  # rows of `motion`


@unfused
def fraction(turns, rest):
    """Return turns + rest as a uint64 fraction of a turn, exact to 2^-65; rest: below 2^-13.

    The low bits of turns + 1.5 are the upper 52 bits of the fraction, and those of INTEGER + x are the integer x.
    Direct conversions to 64 bits are not vectorised without AVX-512.
    """
    turns -= np.rint(turns)
    upper = turns + 1.5
    lower = fma(turns - (upper - 1.5) + rest, TURN, INTEGER)
    return (np.float64(upper).view(np.uint64) << np.uint64(12)) + (np.float64(lower).view(np.uint64) - OFFSET)


@unfused
def fill_steps(speed, speed_rate, rate, period, steps):
    """Write the turns from each frame to the next, as uint64 fractions of a turn."""
    product, step, half = rate * period, 1.0 / (rate * period), 0.5 / rate  # step: turns per frame at 1 m/s
    step_rest = (fma(-step, product, 1.0) - step * fma(rate, period, -product)) * step
    for i in range(len(steps)):
        mean = fma(speed_rate[i], half, speed[i])
        mean_rest = fma(speed_rate[i], half, speed[i] - mean)
        turns = mean * step
        steps[i] = fraction(turns, fma(mean_rest, step, fma(mean, step_rest, fma(mean, step, -turns))))


@unfused
def fill_phases(motion, position, phase, rate, period, phases):
    """Write the phase of each frame to `phases`, uint64; return the phase after the last frame.

    motion: float64 [5, frames], as in `motion.Motion`.
    position: of the texture (m) at each frame. Where it is empty, the texture goes on from `phase`.
    """
    frames = len(phases)
    begin = frames - 1 if len(position) else 0
    fill_steps(motion[SPEED, begin:], motion[SPEED_RATE, begin:], rate, period, phases[begin:])
    if len(position):
        step = phases[begin]
        for i in range(frames):
            phases[i] = fraction(position[i] / period, 0.0)
        return phases[begin] + step
    for i in range(frames):
        step = phases[i]
        phases[i] = phase
        phase += step
    return phase


@signed_kernel("u8(f8[:,::1], f8[::1], u8, f8, f8, u8[::1])")
def phases_of(motion, position, phase, rate, period, phases):
    """Write the phase of each frame, and return the phase after the last: `fill_phases` for Python."""
    return fill_phases(motion, position, phase, rate, period, phases)


def phase_step(speed: float, period: float, rate: int) -> int:
    """Return the turns per frame as a 64-bit fraction of a turn, exact to 2^-65 turn.

    speed: m/s.
    period: m.
    """
    turns = Fraction(speed) / (Fraction(period) * rate)
    return round(turns * 2**64) % 2**64


def turns_to_phase(turns: Array) -> np.ndarray:
    """Return turns as uint64 fractions of a turn, as `fraction` does."""
    rest = turns - np.rint(turns)
    rest = np.where(rest < 0.5, rest, rest - 1.0)  # half a turn either way; 2^63 is no int64
    return np.rint(rest * TURN).astype(np.int64).view(np.uint64)
