"""Brute force of a finger on a surface over an area: many points in every cell of the finger, and SciPy for the load.

It shares no code with the engine: max(h - z, 0) is summed over the points, and z is found by root finding.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.optimize import brentq

Real = np.ndarray[Any, np.dtype[np.float64]]
Heights = Callable[[Real, Real], Real]

IN_A_CELL = 8  # points along and across
ALONG_A_COMB = 500  # the same of a comb


def inside(cell: tuple[float, float]) -> tuple[Real, Real]:
    """Return x and y of IN_A_CELL^2 points of a cell, from its middle; cell: its size along and across."""
    parts = (np.arange(IN_A_CELL) + 0.5) / IN_A_CELL - 0.5
    return np.repeat(parts * cell[0], IN_A_CELL), np.tile(parts * cell[1], IN_A_CELL)


def comb(length: float, amplitude: float, period: float, direction: float, y: float) -> tuple[Real, Real, Real, float]:
    """Return x, y and height (m) of points all over a square comb, and the area of one over A0.

    direction: rad; the comb turns about its middle, at x = length / 2 and `y` (m).
    """
    parts = (np.arange(ALONG_A_COMB) + 0.5) * (length / ALONG_A_COMB)
    u, v = np.repeat(parts, ALONG_A_COMB), np.tile(parts - 0.5 * length, ALONG_A_COMB)
    place = 0.5 * length + 1j * y + (u - 0.5 * length + 1j * v) * np.exp(1j * direction)
    return place.real, place.imag, -amplitude * np.cos(2.0 * np.pi * u / period), 1.0 / len(u)


def approach(x: Real, y: Real, h1: Real, share: float, heights: Heights, path: Real, indentation: float) -> Real:
    """Return z (m) at each place of `path`.

    x, y, h1: of every point of the finger (m), of one shape.
    share: area of a point over A0.
    heights: of the texture (m) at x and y (m) of the same shape.
    path: how far the finger has moved along and across (m): [places, 2].
    indentation: w / k (m).
    """
    found = []
    for along, across in path:
        h = h1 + heights(x - along, y - across)
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


def dots(
    period: float, rows: float, stagger: float, height: float, diameter: float, top: float, phase: float
) -> Heights:
    """Return the heights of dots about the level between them (m): of each place, those of the tallest dot near it."""

    def at(x: Real, y: Real) -> Real:
        found = np.zeros(np.shape(x))
        x = x + phase / (2.0 * np.pi) * period
        for j in range(int(np.floor(y.min() / rows)) - 1, int(np.ceil(y.max() / rows)) + 2):
            moved = stagger * period if j % 2 else 0.0
            from_dot = (x - moved + 0.5 * period) % period - 0.5 * period
            radius = np.sqrt(from_dot**2 + (y - j * rows) ** 2)
            flank = 0.5 * height * (1.0 + np.cos(np.pi * (2.0 * radius - top) / (diameter - top)))
            dot = np.where(radius <= 0.5 * top, height, np.where(radius < 0.5 * diameter, flank, 0.0))
            found = np.where(np.abs(dot) > np.abs(found), dot, found)
        return found

    return at


def bilinear(heights: Real, spacing: tuple[float, float], ends: str, phase: float) -> Heights:
    """Return the bilinear surface through a map [rows, columns], with y = 0 in its middle, about any level (m)."""
    tile = heights if ends == "join" else np.pad(heights, [(0, n - 2) for n in heights.shape], "reflect")
    period = tile.shape[1] * spacing[0]

    def at(x: Real, y: Real) -> Real:
        column = x / spacing[0] + phase / (2.0 * np.pi) * (period / spacing[0])
        row = y / spacing[1] + 0.5 * (heights.shape[0] - 1)
        i, j = np.floor(column).astype(int), np.floor(row).astype(int)
        u, v = column - i, row - j
        corner = [[tile[(j + b) % tile.shape[0], (i + a) % tile.shape[1]] for a in (0, 1)] for b in (0, 1)]
        return np.asarray(
            (1 - v) * ((1 - u) * corner[0][0] + u * corner[0][1]) + v * ((1 - u) * corner[1][0] + u * corner[1][1])
        )

    return at
