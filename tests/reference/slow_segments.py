"""Two slow ways to z for a texture of any profile: the polyline of the compiled solver, and quadrature on the profile.

`slow_heights` is the readable twin: every segment, cut at both ends of L, by bisection. `heights_by_quadrature` shares
no code with it: the midpoint rule on the true profile with a million points, and Brent's method.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.optimize import brentq

Array = np.ndarray[Any, np.dtype[np.float64]]

POINTS = 1_000_000


def slow_heights(grid: Any, geometry: Any, phases: Array, indentation: float) -> Array:
    """Return z (m) at each phase (turns): the polyline of `grid` over L, with the knots of `grid`."""
    scale, step = geometry.height_scale, geometry.texture_period / grid.segments
    half = math.pi * step / geometry.ridge_period
    amplitude = geometry.ridge_amplitude * math.tan(half) / half
    knots = grid.texture[0, : grid.segments] * scale
    heights = []
    for phase in phases:
        first = phase * geometry.texture_period + float(grid.numbers[2]) * step
        number = np.arange(math.floor(-first / step) - 1, math.ceil((geometry.contact_length - first) / step) + 2)
        places = first + number * step
        angle = 2.0 * math.pi * places / geometry.ridge_period + geometry.ridge_phase
        run = knots[number % grid.segments] - amplitude * np.cos(angle)
        inside = (places > 0.0) & (places < geometry.contact_length)
        ends = np.array([0.0, geometry.contact_length])
        x = np.concatenate([ends[:1], places[inside], ends[1:]])
        h = np.interp(x, places, run)
        heights.append(_level(x, h, indentation))
    return np.array(heights)


def _level(x: Array, h: Array, indentation: float) -> float:
    """Return the z above which the mean of the polyline through (x, h) is `indentation` (m), by bisection."""
    low, high = float(np.min(h)) - indentation, float(np.max(h))
    for _ in range(100):
        middle = 0.5 * (low + high)
        if _mean_above(x, h - middle) > indentation:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def _mean_above(x: Array, y: Array) -> float:
    p, q = y[:-1], y[1:]
    crosses = (p > 0.0) != (q > 0.0)
    top, drop = np.maximum(np.maximum(p, q), 0.0), np.where(crosses, np.abs(p - q), 1.0)
    above = np.where(crosses, top * top / drop, np.maximum(p, 0.0) + np.maximum(q, 0.0))
    return float(0.5 * np.sum(np.diff(x) * above) / (x[-1] - x[0]))


def heights_by_quadrature(geometry: Any, phases: Array, indentation: float, points: int = POINTS) -> Array:
    """Return z (m) at each phase (turns) of the true profile."""
    assert geometry.profile is not None
    x = (np.arange(points) + 0.5) * (geometry.contact_length / points)
    finger = geometry.ridge_amplitude * np.cos(2.0 * math.pi * x / geometry.ridge_period)
    heights = []
    for phase in phases:
        h = geometry.profile.heights(x - phase * geometry.texture_period) - finger
        low, high = float(np.mean(h)) - indentation, float(np.max(h))
        heights.append(
            brentq(lambda z, h=h: float(np.mean(np.maximum(h - z, 0.0))) - indentation, low - 1e-12, high, xtol=1e-16)
        )
    return np.array(heights)
