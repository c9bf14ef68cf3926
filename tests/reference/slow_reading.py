"""How tables are read at audio rate, a frame at a time in plain Python: the twin of the engine's compiled loops.

Model   A phase is an integer fraction of a turn out of 2^64; its high bits name the cell, the rest the place t in it.
        R(t, s) = sum over i, j of c[cell, i, j] t^i s^j, s = (w - low) / (high - low) between two rows of load.
        G = g(w) R, and its total time derivatives by the chain rule, R and g being functions of phase and load.
        Between fade_from and fade_to of a level its part goes over to the next level by 3 s^2 - 2 s^3.
Source  design, sections 4 and 8.
Limits  float64 throughout: a compiled loop that writes float32 differs by its rounding.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

Real = npt.NDArray[np.float64]

TURN = 1 << 64
#: Below it a float32 would be denormal, and the sample is zero.
SMALLEST_NORMAL = 1.2e-38


@dataclass(frozen=True)
class Level:
    """One level: tables [cells, degree + 1, 4] in m, an interval each (None: not built); its fade, turns a frame."""

    tables: tuple[Real | None, ...]
    fade_from: float
    fade_to: float


@dataclass(frozen=True)
class Hand:
    """The motion at one frame: speed (m/s), its rate, load (N), its rate and second rate."""

    speed: float
    speed_rate: float
    load: float
    load_rate: float
    load_bend: float


def steady(table: Real, phase: int, step: int, frames: int) -> Real:
    """Values of ``table`` [cells, 4] at phase + i step, i = 0 .. frames - 1."""
    cells = len(table)
    values = np.empty(frames)
    for frame in range(frames):
        cell, place = divmod(((phase + frame * step) % TURN) * cells, TURN)
        values[frame] = _polynomial(table[cell], place / TURN)
    return values


def phases(motion: Real, position: Real, phase: int, rate_hz: float, period: float) -> tuple[list[int], int]:
    """Phases of the frames of ``motion`` [5, frames] from ``phase`` on, and that after the last.

    Without positions a frame moves on by (u + du/dt / 2 / rate) / rate; with them the phase is position / period.
    """
    places = []
    moved = phase
    for frame in range(motion.shape[1]):
        speed, speed_rate = motion[0, frame], motion[1, frame]
        onward = to_phase(speed / (rate_hz * period) + speed_rate / (2.0 * rate_hz * rate_hz * period))
        here = to_phase(position[frame] / period) if len(position) else moved
        places.append(here)
        moved = (here + onward) % TURN
    return places, moved


def to_phase(turns: float) -> int:
    """``turns`` as an integer fraction of a turn."""
    rest = turns - round(turns)
    return round(rest * TURN) % TURN


def moving(
    levels: tuple[Level, ...], edges: Real, motion: Real, position: Real, phase: int,
    *, rate_hz: float, period: float, lift_load: float, order: int,
) -> Real:  # fmt: skip
    """Displacement (``order`` 0), velocity (1) or acceleration (2) at each frame; NaN where a table lacks."""
    places, _after = phases(motion, position, phase, rate_hz, period)
    values = np.empty(motion.shape[1])
    for frame, place in enumerate(places):
        hand = Hand(*(float(row) for row in motion[:, frame]))
        value = _frame(levels, edges, hand, place, rate_hz, period, lift_load, order)
        values[frame] = value if not abs(value) < SMALLEST_NORMAL else 0.0
    return values


def _frame(
    levels: tuple[Level, ...], edges: Real, hand: Hand, phase: int,
    rate_hz: float, period: float, lift: float, order: int,
) -> float:  # fmt: skip
    turns = abs(hand.speed) / (rate_hz * period)
    index = next((i for i, level in enumerate(levels) if turns < level.fade_to), None)
    if index is None or hand.load <= 0.0:
        return 0.0
    share = _smooth((turns - levels[index].fade_from) / (levels[index].fade_to - levels[index].fade_from))
    parts = [(levels[index], 1.0 - share)] + ([(levels[index + 1], share)] if index + 1 < len(levels) else [])
    total = np.zeros(3)
    for level, weight in parts:
        if weight > 0.0:
            total += weight * _response(level, edges, hand, phase, period)
    gate, gate1, gate2 = _gate(hand.load, lift)
    velocity_of_gate = gate1 * hand.load_rate
    acceleration_of_gate = gate2 * hand.load_rate**2 + gate1 * hand.load_bend
    value, first, second = total
    return (
        gate * value,
        gate * first + velocity_of_gate * value,
        gate * second + 2.0 * velocity_of_gate * first + acceleration_of_gate * value,
    )[order]


def _response(level: Level, edges: Real, hand: Hand, phase: int, period: float) -> Any:
    """R, dR/dt and d2R/dt2 of one level at one frame, float64 [3]; NaN where its table lacks."""
    interval = min(max(int(np.searchsorted(edges, hand.load, side="right")) - 1, 0), len(edges) - 2)
    table = level.tables[interval]
    if table is None:
        return np.full(3, math.nan)
    low, high = edges[interval], edges[interval + 1]
    beyond = not low <= hand.load <= high  # the end rows hold: no derivative over the load there
    s = min(max((hand.load - low) / (high - low), 0.0), 1.0)
    s1 = 0.0 if beyond else hand.load_rate / (high - low)
    s2 = 0.0 if beyond else hand.load_bend / (high - low)
    cell, rest = divmod(phase * len(table), TURN)
    t, t1, t2 = rest / TURN, hand.speed / period * len(table), hand.speed_rate / period * len(table)
    return cell_rates(table[cell], t, s, (t1, t2), (s1, s2))


def cell_rates(
    coefficients: Real, t: float, s: float, phase_rates: tuple[float, float], load_rates: tuple[float, float]
) -> Real:
    """R, dR/dt and d2R/dt2 in a cell, float64 [3]; the rates are the first and second of t, and of s."""
    (t1, t2), (s1, s2) = phase_rates, load_rates

    def at(i: int, j: int) -> float:
        """The derivative of order i along the phase and j along the load."""
        return _derivative(coefficients, t, s, i, j)

    return np.array(
        [
            at(0, 0),
            at(1, 0) * t1 + at(0, 1) * s1,
            at(2, 0) * t1**2 + at(1, 0) * t2 + 2.0 * at(1, 1) * t1 * s1 + at(0, 2) * s1**2 + at(0, 1) * s2,
        ]
    )


def _derivative(coefficients: Real, t: float, s: float, i: int, j: int) -> float:
    total = 0.0
    for p in range(i, coefficients.shape[0]):
        for q in range(j, coefficients.shape[1]):
            factor = math.perm(p, i) * math.perm(q, j)
            total += factor * float(coefficients[p, q]) * t ** (p - i) * s ** (q - j)
    return total


def _polynomial(coefficients: Real, t: float) -> float:
    return sum(float(value) * t**power for power, value in enumerate(coefficients))


def _smooth(s: float) -> float:
    s = min(max(s, 0.0), 1.0)
    return 3.0 * s**2 - 2.0 * s**3


def _gate(load: float, lift: float) -> tuple[float, float, float]:
    s = load / lift
    if s >= 1.0:
        return 1.0, 0.0, 0.0
    return (
        10.0 * s**3 - 15.0 * s**4 + 6.0 * s**5,
        (30.0 * s**2 - 60.0 * s**3 + 30.0 * s**4) / lift,
        (60.0 * s - 180.0 * s**2 + 120.0 * s**3) / lift**2,
    )
