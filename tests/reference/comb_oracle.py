"""z of a comb over a whole period by brute force: both surfaces as one polyline, whose area above z is exact.

Model   Eq. 1 over N equal pieces of the contact. Where a piece crosses z, its part above counts. z is found by Newton's
        method. The error falls with the square of N, so the change from 2 N / 5 tells how much is left.
Limits  No part of the engine. The heights of the texture are those of its kind.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit

Real = np.ndarray[Any, np.dtype[np.float64]]
FEWER = 2.5  # factor on the pieces from the coarse to the fine solution
LEFT = 1.0 / (FEWER**2 - 1.0)  # error of the fine solution over the change


@dataclass(frozen=True)
class Comb:
    """A comb of ridges and what it touches.

    amplitude, period: of the ridges, m.
    length: of the contact, m.
    indentation: w / k, m.
    heights: of the texture (m) at places (m), which repeats after `texture` (m).
    """

    amplitude: float
    period: float
    length: float
    indentation: float
    heights: Callable[[Real], Real]
    texture: float

    def series(self, highest: int, phases: int, pieces: int) -> Any:
        """Return harmonics 0 to `highest` of z (m), one-sided, without the mean."""
        x = np.arange(pieces + 1) / pieces * self.length
        finger = -self.amplitude * np.cos(2.0 * math.pi * x / self.period)
        z = np.empty(phases)
        at = self.amplitude + float(np.max(self.heights(x)))
        for phase in range(phases):
            at = root(finger + self.heights(x - phase / phases * self.texture), self.indentation, at)
            z[phase] = at
        found = np.fft.rfft(z)[: highest + 1] / phases
        found[0] = 0.0
        return found


@njit
def root(h, target, z):  # type: ignore[no-untyped-def]
    """Return the z (m) at which the mean of max(h - z, 0) is `target`; z: where Newton's method starts."""
    pieces = len(h) - 1
    for _step in range(200):
        area, touching = 0.0, 0.0
        for i in range(pieces):
            a, b = h[i] - z, h[i + 1] - z
            if a > 0.0 and b > 0.0:
                area += 0.5 * (a + b)
                touching += 1.0
            elif a > 0.0:
                area += 0.5 * a * a / (a - b)
                touching += a / (a - b)
            elif b > 0.0:
                area += 0.5 * b * b / (b - a)
                touching += b / (b - a)
        if touching == 0.0:
            z -= 1e-7
            continue
        change = (area / pieces - target) / (touching / pieces)
        z += change
        if abs(change) < 1e-17:
            break
    return z
