"""Solve z more often where the load changes quickly, so that a landing pays for itself and not for the whole scan.

Stage   SAMPLING, used by `frame_solver` in every chunk.
Model   Where the load changes by QUICK of itself within RISE, z changes within a fraction of a millisecond. There it is
        solved at two, four, ... times as many steps, and a short low-pass filter (a sinc in a Kaiser window) reduces
        these to the usual steps. The number doubles until the quantities in the band change by no more than is allowed,
        to LEAST_FINER at least.
Source  Kaiser & Schafer (1980), IEEE Trans. ASSP 28: the window and its length for an attenuation. The rest is this
        project's.
Limits  At most MOST_FINER times the usual steps. What a doubling leaves is taken to be LEFT of its change. In some 40
        recordings (three fingers, landings of 2 to 30 ms) the error before a doubling was 0.8 to 1.34 times its change;
        an error that falls with the square of the steps then leaves a third of the change, and kinks of order 3/2 less.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache

import numpy as np

from synth.arrays import Array
from synth.motion.motion import LOAD, SPEED
from synth.motion.scan_motion import ScanMotion
from synth.scene.scene import Scene

LOOK_RATE, LOOKS = 4000.0, 1 << 20  # Hz; most moments at which a long recording is looked at
RISE, QUICK = 1e-3, 0.1  # s; part of the load: a swing of a hand at 10 Hz changes the load by 3 to 6 %
LEAST_FINER = 4  # times the usual steps, where they may be twice: one change can be small by chance
MOST_FINER = 64  # times the usual steps: 2 ms landings of a fingertip need 16
CREEPS = 1e-4  # m/s: a finger that is slower everywhere is looked at where its load is lightest
MOST_STEPS = 1 << 22  # of all parts of a chunk: 400 MB of working memory
LEFT = 0.5  # of the last change
ATTENUATION = 110.0  # dB, of the low-pass filter: 3e-6 in the band and beyond it

Solved = Callable[[int, int, int], Array]
"""Rows of z at `count` steps from step `first` on, where steps are `finer` times as many: (first, count, finer)."""


def windows(loads: Array, seconds: float, beside: int) -> list[tuple[int, int]]:
    """Return the parts of a motion in which the load changes quickly, as first and last step.

    loads: N, at equal steps of `seconds`.
    beside: number of steps that are added on both sides.
    """
    reach = min(max(1, math.ceil(RISE / seconds)), len(loads) - 1)
    before, after = loads[:-reach], loads[reach:]
    starts = np.flatnonzero(np.abs(after - before) > QUICK * np.maximum(after, before))
    found: list[tuple[int, int]] = []
    for start in starts.tolist():
        begin, end = max(start - beside, 0), min(start + reach + beside, len(loads) - 1)
        if found and begin <= found[-1][1] + 1:
            found[-1] = found[-1][0], end
        else:
            found.append((begin, end))
    return found


def solved_again(
    rows: Array, parts: list[tuple[int, int]], solve: Solved, limited: Callable[[Array], Array], allowed: Array,
    top: float, most: int,
) -> tuple[Array, Array]:  # fmt: skip
    """Return `rows` with `parts` solved as often as is needed, and the error that is left of each quantity.

    rows: z, and what is subtracted from it, at the usual steps, m [rows, steps].
    limited: function that returns the quantities [quantities, frames] of such rows.
    allowed: largest error of each quantity, SI.
    top: highest frequency that counts, cycles per usual step.
    most: largest number of steps for each usual one.
    """
    finer, before, left = 1, rows, np.zeros(len(allowed))
    together = sum(last - first for first, last in parts)
    while parts:
        finer *= 2
        weights = low_pass(finer, top)
        beside = len(weights) // 2
        after = before.copy()
        for first, last in parts:
            steps = solve(first * finer - beside, (last - first) * finer + 2 * beside + 1, finer)
            windowed = np.lib.stride_tricks.sliding_window_view(steps, len(weights), axis=1)[:, ::finer]
            after[:, first : last + 1] = windowed @ weights
        left = LEFT * np.max(np.abs(limited(after - before)), axis=1)
        before = after
        enough = finer >= LEAST_FINER and np.all(left <= allowed)
        if enough or 2 * finer > most or 2 * finer * together > MOST_STEPS:
            break
    return before, left


def pieces(scene: Scene) -> dict[str, float]:
    """Return the times (s) about which a motion is most demanding, by what makes it so.

    "load", "calm": its load changes most, in a landing and outside of landings. "beside": outside of landings a light
    load changes by a large part of itself, as at the end of a landing. "speed": it is fastest. "light": it is fast for
    a light load, under which few places touch. Under one load they are "speed" and "middle".
    """
    rate = min(LOOK_RATE, LOOKS / scene.output.duration)
    samples = ScanMotion(scene, rate).at(0, math.ceil(scene.output.duration * rate) + 1).samples
    load, reach = samples[LOAD], min(max(1, math.ceil(RISE * rate)), samples.shape[1] - 1)
    changes, touching = np.abs(load[reach:] - load[:-reach]), load > 0.0
    calm = np.ones(len(changes), bool)
    for first, last in windows(load, 1.0 / rate, 0):
        calm[first : last + 1] = False
    speed = np.abs(samples[SPEED]) * touching
    lightly = (speed + CREEPS * touching) / np.cbrt(np.maximum(load, scene.scan.lift_load))
    fastest = int(np.argmax(speed)) / rate
    if not changes.any():
        return {"speed": fastest, "middle": 0.5 * scene.output.duration}
    heavier = np.maximum(np.maximum(load[reach:], load[:-reach]), scene.scan.lift_load)
    found = {
        "load": changes,
        "calm": changes * calm,
        "beside": changes * calm / heavier ** (4.0 / 3.0),
        "light": lightly,
    }
    return {"speed": fastest} | {name: int(np.argmax(one)) / rate for name, one in found.items()}


@cache
def low_pass(finer: int, top: float) -> Array:
    """Return the weights that reduce `finer` times the usual steps to these; top: as of `solved_again`, below 1/2.

    Frequencies up to `top` pass, and those that would fold onto them do not.
    """
    width = 1.0 - 2.0 * top  # of the transition, cycles per usual step
    reach = math.ceil((ATTENUATION - 7.95) / (4.0 * math.pi * 2.285 * width)) * finer
    places = np.arange(-reach, reach + 1)
    weights = np.sinc(places / finer) * np.kaiser(len(places), 0.1102 * (ATTENUATION - 8.7))
    return np.asarray(weights / np.sum(weights))
