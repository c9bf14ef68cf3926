"""z of a fingertip, by a sum over all of its points at once and a root search; every random number drawn anew here.

The points, the ridges and the footprint are those of docs/scene.md, "A fingertip", written out in plain sums.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numba import njit
from scipy.integrate import quad
from scipy.interpolate import RectBivariateSpline
from scipy.optimize import brentq

Real = np.ndarray[Any, np.dtype[np.float64]]
Heights = Callable[[Real], Real]
CORE, CORRELATION, WAVES = 8e-3, 1.5e-3, 24
SAMPLES = 96  # of the splines, per ridge: with 32, the core of a whorl leaves 3e-3 of the acceleration at 0.04 N


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
        return self._ridges(x, y, field)

    def on_grid(self, x: Real, y: Real) -> Real:
        """Return the heights (m) at every pair of `x` and `y` (m)."""
        return self._ridges(x[:, np.newaxis], y[np.newaxis], field_on_grid)

    def _ridges(self, x: Real, y: Real, waves: Callable[..., Real]) -> Real:
        chance, k = np.random.default_rng(self.seed), 2.0 * math.pi / CORRELATION
        u = waves(chance, x, y, k, k / 3.0, self.spacing, "x")
        v = waves(chance, x, y, k / 6.0, k / 3.0, self.direction, "y")
        g = waves(chance, x, y, k, k, self.height, "")
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
    a, b, p, size = drawn(chance, kx, ky, spread, along)
    waves = sum(np.cos(one * x + other * y + phase) for one, other, phase in zip(a, b, p, strict=True))
    return np.asarray(size * waves)


def field_on_grid(
    chance: np.random.Generator, x: Real, y: Real, kx: float, ky: float, spread: float, along: str
) -> Real:
    """Return what `field` does at every pair of x [columns, 1] and y [1, rows], as real parts of products."""
    a, b, p, size = drawn(chance, kx, ky, spread, along)
    return np.asarray(size * (np.exp(1j * (x * a + p)) @ np.exp(1j * y.T * b).T).real)


def drawn(
    chance: np.random.Generator, kx: float, ky: float, spread: float, along: str
) -> tuple[Real, Real, Real, float]:
    """Return the wave numbers along x and y, the phases and the amplitude of WAVES plane waves."""
    a, b, p = chance.normal(0.0, kx, WAVES), chance.normal(0.0, ky, WAVES), chance.uniform(0.0, 2.0 * math.pi, WAVES)
    variance = {"": WAVES / 2.0, "x": float(np.sum(a**2)) / 2.0, "y": float(np.sum(b**2)) / 2.0}[along]
    return a, b, p, spread / math.sqrt(variance)


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


@dataclass(frozen=True)
class Points:
    """The highest points of a fingertip, in columns across the scan, each from its highest point down.

    x: of the columns, m.
    starts: where the points of each column begin [columns + 1].
    heights: m.
    sums: of the heights of each column, from its highest point down, m.
    lowest: height below which points were left out, m.
    share: area of a point over L0 W0.
    """

    x: Real
    starts: Any
    heights: Real
    sums: Real
    lowest: float
    share: float

    @classmethod
    def of(
        cls, ridges: Print, size: tuple[float, float], depth: float, lowest: float, columns: float, rows: float
    ) -> Points:
        """Return the points that lie above `lowest` (m), in the middles of columns and rows.

        size: length and width of the footprint at 1 N, m.
        depth: of the paraboloid at its edge, m.
        columns, rows: number per m.

        The ridges are splines of degree 5 through SAMPLES of each.
        """
        length, width = 2.0 * size[0], 2.0 * size[1]
        ridge = ridge_spline(ridges, length, width)
        many, across = math.ceil(columns * length), math.ceil(rows * width)
        x = ((np.arange(many) + 0.5) / many - 0.5) * length
        y = ((np.arange(across) + 0.5) / across - 0.5) * width
        tall = ridges.amplitude * (1.0 + 4.0 * ridges.height)
        found, counts = [], []
        for first in range(0, many, 64):
            some = x[first : first + 64]
            at_edge = np.sqrt(max(tall - lowest - depth * float(np.min((2.0 * some / size[0]) ** 2)), 0.0) / depth)
            near = y[np.abs(y) <= 0.5 * size[1] * at_edge + 1.0 / rows]
            drop = depth * ((2.0 * some[:, np.newaxis] / size[0]) ** 2 + (2.0 * near / size[1]) ** 2)
            inside = (some[:, np.newaxis] / length) ** 2 + (near / width) ** 2 < 0.25
            h = np.where(inside, ridge(some, near) - drop, -np.inf) if len(near) else np.empty((len(some), 0))
            for one in h:
                kept = np.sort(one[one > lowest])[::-1]
                found.append(kept)
                counts.append(len(kept))
        share = (length / many) * (width / across) / (size[0] * size[1])
        starts, sums = np.concatenate([[0], np.cumsum(counts)]), np.concatenate([np.cumsum(one) for one in found])
        return cls(x, starts, np.concatenate(found), sums, lowest, share)

    def approach(self, heights: Heights, places: Real, indentation: float) -> Real:
        """Return z (m) at each of `places` (m) by which the texture `heights` has moved; indentation: w / k, m."""
        under = np.stack([heights(self.x - place) for place in places])
        z = np.empty(len(places))
        sum_points(self.starts, self.heights, self.sums, under, indentation / self.share, z)
        assert np.all(z - under.max(axis=1) > self.lowest), "points that touch were left out"
        return z


@lru_cache(4)
def ridge_spline(ridges: Print, length: float, width: float) -> RectBivariateSpline:
    """Return the ridges over a rectangle about the middle (m), and a little beyond, as a spline."""
    step = ridges.period / SAMPLES
    ends = [math.ceil(0.5 * one / step) + 4 for one in (length, width)]
    x, y = (np.asarray(np.arange(-end, end + 1) * step, np.float64) for end in ends)
    return RectBivariateSpline(x, y, ridges.on_grid(x, y), kx=5, ky=5)


@njit(cache=False)
def sum_points(starts, heights, sums, under, target, z):  # type: ignore[no-untyped-def]
    """Write z (m) where the sum of max(h - z, 0) is `target` (m), by Newton's method from the left."""
    at = 0.0
    for p in range(len(z)):
        if p == 0:
            at = -1e9
            for c in range(len(starts) - 1):
                if starts[c + 1] > starts[c]:
                    at = max(at, heights[starts[c]] + under[p, c])
        at -= 1e-6  # not above z, or Newton's method would have to come back
        for _turn in range(200):
            total, count = 0.0, 0
            for c in range(len(starts) - 1):
                level = at - under[p, c]
                first, last = starts[c], starts[c + 1]
                while first < last:  # the number of points above the level
                    middle = (first + last) // 2
                    if heights[middle] > level:
                        first = middle + 1
                    else:
                        last = middle
                if first > starts[c]:
                    total += sums[first - 1] - (first - starts[c]) * level
                    count += first - starts[c]
            if count == 0:
                at -= 1e-6
                continue
            change = (total - target) / count
            at += change
            if abs(change) < 1e-16:
                break
        z[p] = at


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
