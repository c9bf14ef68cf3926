"""How a steady series is read, a frame at a time in plain Python: the twin of a compiled loop.

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


def _polynomial(coefficients: Real, t: float) -> float:
    return sum(float(value) * t**power for power, value in enumerate(coefficients))
