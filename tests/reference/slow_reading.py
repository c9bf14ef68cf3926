"""How a steady table is read and where a texture stands, a frame at a time in plain Python: twins of compiled loops.

Model   A phase is an integer fraction of a turn out of 2^64; its high bits name the cell, the rest the place t in it.
Source  design, section 8.
Limits  float64 throughout: a compiled loop that writes float32 differs by its rounding.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Real = npt.NDArray[np.float64]

TURN = 1 << 64


def steady(table: Real, phase: int, step: int, frames: int) -> Real:
    """Values of ``table`` [cells, coefficients] at phase + i step, i = 0 .. frames - 1."""
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


def _polynomial(coefficients: Real, t: float) -> float:
    return sum(float(value) * t**power for power, value in enumerate(coefficients))
