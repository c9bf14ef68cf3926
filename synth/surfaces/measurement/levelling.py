"""Levelling: removes the tilt or the curvature of a measured surface.

Stage   SURFACES, from files.
Model   The least-squares plane (tilt) or polynomial of second order (curvature) through the measured points is
        subtracted. Missing points do not count.
Source  The F-operation of ISO 25178-2 with a polynomial.
Limits  The fit is not robust: a tall feature shifts it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from synth.surfaces.readers.surface_file import Heights, Missing

POWERS = {"tilt": 1, "curvature": 2}


def levelled(heights: Heights, missing: Missing, level: str) -> Heights:
    """Return `heights` less their fitted form, with 0 at missing points.

    heights: [n] or [rows, columns].
    level: "tilt" or "curvature"; "none" changes nothing.
    """
    if level == "none":
        return heights
    grid, measured = np.atleast_2d(heights), np.atleast_2d(~missing).astype(np.float64)
    rows, columns = grid.shape
    x, y = _scale(columns), _scale(rows)
    order = POWERS[level]
    terms = [(i, j) for i in range(order + 1) for j in range(order + 1) if i + j <= order and (rows > 1 or not j)]
    # Each product of two terms is again x^i y^j. So sums over the points suffice, without a matrix row per point.
    sums: dict[tuple[int, int], float] = {}
    for i in range(2 * order + 1):
        along = measured @ x**i
        for j in range(2 * order + 1):
            sums[i, j] = float(along @ y**j)
    products = np.array([[sums[i + k, j + m] for k, m in terms] for i, j in terms])
    right = np.array([float(y**j @ ((grid * measured) @ x**i)) for i, j in terms])
    factors = np.linalg.lstsq(products, right, rcond=None)[0]
    form = np.zeros_like(grid)
    for (i, j), factor in zip(terms, factors, strict=True):
        form += factor * np.outer(y**j, x**i)
    left: Any = (grid - form) * measured
    return np.asarray(left.reshape(heights.shape))


def tilt_of(heights: Heights, missing: Missing) -> tuple[float, ...]:
    """Return the rise of the fitted plane over the length of the surface, along x, then along y."""
    grid, measured = np.atleast_2d(heights), np.atleast_2d(~missing).astype(np.float64)
    rises = []
    for axis in (1, 0)[: heights.ndim]:
        at = _scale(grid.shape[axis])
        weights = measured.sum(axis=1 - axis)
        total = float(weights.sum())
        centre = float(weights @ at) / total
        sums = (grid * measured).sum(axis=1 - axis)
        spread = float(weights @ (at - centre) ** 2)
        rises.append(2.0 * float(sums @ (at - centre)) / spread if spread else 0.0)
    return tuple(rises)


def _scale(count: int) -> Heights:
    return np.linspace(-1.0, 1.0, count) if count > 1 else np.zeros(1)
