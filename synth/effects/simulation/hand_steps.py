"""The steps between the frames of a hand: places, loads and path at equal times, the last of which is the frame's own.

Model   Between two frames a hand moves along the cubic through its places and speeds, and its load along that through
        its loads and their rates. A path is straight.
"""

from __future__ import annotations

import numpy as np

from synth.arrays import Array
from synth.effects.simulation.steps import Phases
from synth.kernels import signed_kernel
from synth.motion.motion import LOAD, LOAD_RATE, SPEED, Motion
from synth.response.phases import phases_of


def last_of(phases: Phases, samples: Array) -> tuple[int, float, float, float]:
    """Return phase, speed, load and load rate of the last frame."""
    last = len(phases) - 1
    return int(phases[last]), samples.item(SPEED, last), samples.item(LOAD, last), samples.item(LOAD_RATE, last)


def path_between(before: Array, path: Array, steps: int) -> Array:
    """Return a path at `steps` equal times per frame, in straight lines; before: at the frame before the first."""
    known = np.concatenate([before, path], axis=1)
    parts = np.arange(1, steps + 1) / steps
    moved = known[:, :-1, np.newaxis] + np.diff(known, axis=1)[:, :, np.newaxis] * parts
    moved[:, :, -1:] = path[:, :, np.newaxis]
    return np.ascontiguousarray(moved.reshape(2, -1))


def phases_after(motion: Motion, phase: int, rate: int, period: float) -> tuple[Phases, int]:
    """Return the phase of the texture at each frame of a hand's `motion`, and after the last.

    phase: at the first frame.
    """
    samples, position = np.ascontiguousarray(motion.samples), np.ascontiguousarray(motion.position)
    phases = np.empty(motion.frames, np.uint64)
    return phases, int(phases_of(samples, position, np.uint64(phase), float(rate), period, phases))


@signed_kernel("void(u8[::1], f8[:,::1], u8, f8[::1], i8, f8, f8, u8[::1], f8[::1])")
def fill_between(phases, samples, phase, before, steps, turn, frame, fine_phases, fine_loads):
    """Write phases and loads at `steps` equal times per frame, the last of which is the time of the frame itself.

    phase: at the frame before the first.
    before: speed (m/s), load (N) and load rate (N/s) at that frame.
    turn: turns per frame at 1 m/s.
    frame: duration of a frame (s).
    """
    speed, load, rate = before[0], before[1], before[2]
    for i in range(len(phases)):
        moved = np.float64(np.int64(phases[i] - phase))
        start, end = speed * turn * 2.0**64, samples[0, i] * turn * 2.0**64
        now, now_rate = samples[2, i], samples[3, i]
        for j in range(steps):
            s = (j + 1.0) / steps
            a = s * s * (3.0 - 2.0 * s)
            b, c = s * (1.0 - s) * (1.0 - s), s * s * (s - 1.0)
            place = moved * a + start * b + end * c
            fine_phases[i * steps + j] = phase + np.uint64(np.int64(np.rint(place)))
            fine_loads[i * steps + j] = load + (now - load) * a + frame * (rate * b + now_rate * c)
        fine_phases[i * steps + steps - 1] = phases[i]
        fine_loads[i * steps + steps - 1] = now
        phase, speed, load, rate = phases[i], samples[0, i], now, now_rate
