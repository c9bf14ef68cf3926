"""z of a fingertip, by a sum over all of its points at once and a root search; every random number drawn anew here.

The points, the ridges and the footprint are those of docs/scene.md, "A fingertip", written out in plain sums.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq

Real = np.ndarray[Any, np.dtype[np.float64]]
Heights = Callable[[Real], Real]
CORE, CORRELATION, WAVES = 8e-3, 1.5e-3, 24


@dataclass(frozen=True)
class Print:
    """A fingerprint, as the finger section of a scene has it."""

    period: float
    amplitude: float
    pattern: str
    spacing: float
    direction: float
    height: float
    seed: int

    def heights(self, x: Real, y: Real) -> Real:
        """Return the heights (m) of the ridges at the points x, y (m) of one shape."""
        chance, k = np.random.default_rng(self.seed), 2.0 * math.pi / CORRELATION
        u = field(chance, x, y, k, k / 3.0, self.spacing, "x")
        v = field(chance, x, y, k / 6.0, k / 3.0, self.direction, "y")
        g = field(chance, x, y, k, k, self.height, "")
        distance = {
            "straight": x,
            "whorl": np.sqrt(x**2 + y**2),
            "loop": np.sqrt((x + CORE) ** 2 + y**2) - CORE,
        }[self.pattern]
        return np.asarray(
            -self.amplitude * np.clip(1.0 + g, 0.0, None) * np.cos(2.0 * math.pi * (distance + u + v) / self.period)
        )


def field(chance: np.random.Generator, x: Real, y: Real, kx: float, ky: float, spread: float, along: str) -> Real:
    """Return a sum of plane waves with a standard deviation of `spread`, or with that of its slope along x or y."""
    a, b, p = chance.normal(0.0, kx, WAVES), chance.normal(0.0, ky, WAVES), chance.uniform(0.0, 2.0 * math.pi, WAVES)
    waves = sum(np.cos(one * x + other * y + phase) for one, other, phase in zip(a, b, p, strict=True))
    variance = {"": WAVES / 2.0, "x": float(np.sum(a**2)) / 2.0, "y": float(np.sum(b**2)) / 2.0}[along]
    return np.asarray(spread / math.sqrt(variance) * waves)


def footprint_depth(amplitude: float, mean_indentation: float) -> float:
    """Return the depth (m) of the paraboloid at the edge of the footprint on a flat plate.

    mean_indentation: w / k at 1 N, over L0 W0 (m).
    """

    def over_oval(depth: float) -> float:
        def above(drop: float) -> float:  # mean over a ridge of what lies above the plate at this drop
            over = depth - drop - amplitude
            if over >= amplitude:
                return over
            if amplitude == 0.0 or over <= -amplitude:
                return 0.0
            edge = math.acos(-over / amplitude)
            return (over * edge + amplitude * math.sin(edge)) / math.pi

        joint = max(depth - 2.0 * amplitude, 0.0)
        return float(quad(above, 0.0, joint, limit=200)[0] + quad(above, joint, depth, limit=200)[0]) / depth

    wanted = 4.0 / math.pi * mean_indentation
    return float(brentq(lambda depth: over_oval(depth) - wanted, 1e-12, 2.0 * (wanted + amplitude) + 1e-9, xtol=1e-16))


def approach(x: Real, h1: Real, share: float, heights: Heights, places: Real, indentation: float) -> Real:
    """Return z (m) at each of `places` (m, of the texture).

    x, h1: place along the scan and height of every point (m).
    share: area of a point over L0 W0.
    heights: of the texture (m) at places along it (m).
    indentation: w / k (m).
    """
    found = []
    for place in places:
        h = h1 + heights(x - place)
        top = float(h.max())
        found.append(
            brentq(
                lambda z, h=h: share * float(np.sum(np.clip(h - z, 0.0, None))) - indentation,
                top - 1.0,
                top,
                xtol=1e-17,
                rtol=1e-14,
            )
        )
    return np.array(found)
