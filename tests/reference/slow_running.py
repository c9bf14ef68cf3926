"""The readable twins of the loops of `effects.simulation.decimation` and `running`: a frame at a time, plain Python."""

from __future__ import annotations

import math
from collections.abc import Sequence

TURN = 2**64


def frames_of(values: Sequence[float], taps: Sequence[float], steps: int, keep: bool, count: int) -> list[float]:
    """Return each frame: the taps over the steps round it, of what differs from the step at the frame."""
    middle = len(taps) // 2
    frames = []
    for frame in range(count):
        near = values[frame * steps : frame * steps + len(taps)]
        base = near[middle]
        change = math.fsum(tap * (value - base) for tap, value in zip(taps, near, strict=True))
        frames.append(base + change if keep else change)
    return frames


def between(
    phases: Sequence[int], speeds: Sequence[float], loads: Sequence[float], rates: Sequence[float],
    before: tuple[int, float, float, float], steps: int, period: float, rate: float,
) -> tuple[list[float], list[float]]:  # fmt: skip
    """Return places (turns from the first) and loads at the steps of each frame: cubics through values and slopes."""
    start, speed, load, load_rate = before
    turns, found = [], []
    at = 0.0
    for phase, next_speed, next_load, next_rate in zip(phases, speeds, loads, rates, strict=True):
        moved = ((phase - start + TURN // 2) % TURN - TURN // 2) / TURN
        for j in range(1, steps + 1):
            s = j / steps
            turns.append(at + _cubic(moved, speed / (period * rate), next_speed / (period * rate), s))
            found.append(load + _cubic(next_load - load, load_rate / rate, next_rate / rate, s))
        at += moved
        start, speed, load, load_rate = phase, next_speed, next_load, next_rate
    return turns, found


def _cubic(rise: float, first: float, last: float, s: float) -> float:
    """Return the cubic from 0 to `rise` over s from 0 to 1 with slopes `first` and `last`."""
    return first * s + (3.0 * rise - 2.0 * first - last) * s**2 + (first + last - 2.0 * rise) * s**3


def held_gates(attached: Sequence[float], begin: float, step: float) -> list[float]:
    """Return the gate after each step: it goes toward 1 while attached and toward 0 while not, smoothly."""
    place, gates = begin, []
    for one in attached:
        place = min(1.0, place + step) if one > 0.0 else max(0.0, place - step)
        gates.append(10.0 * place**3 - 15.0 * place**4 + 6.0 * place**5)
    return gates
