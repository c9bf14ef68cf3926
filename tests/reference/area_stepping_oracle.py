"""A finger of points that moves over an area, stepped in plain NumPy: the reference for effects on any path.

Model   h = finger + texture at the place of each point, turned by the direction and moved along and across. Every point
        has the same share of the stiffness (N/m).
        Skin: e decays to E e, E = exp(-step / tau), unless it is pressed: p = share (e1 - E e0) / (1 - E), e1 = h - z.
        Mass: m z'' + c z' = sum of share max(h - z, 0) - w, by Runge and Kutta's method of fourth order.
        Attraction: sum of share max(h - z, 0) - pull clip(1 + (h - z) / d0, 0, 1) = w, followed from root to root.
Source  Fagiani & Barbieri (2016), eqs 1-2; textbook methods.
Limits  First order in step / tau for skin. One state a point.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.ndimage import map_coordinates
from scipy.optimize import brentq

Real = np.ndarray[Any, np.dtype[np.float64]]
Path = Callable[[Any], tuple[Any, Any, Any]]
"""Place of the finger along and across (m), and its direction (rad), at times (s)."""
KNOTS, MOVE = 1024, 2e-8  # of the texture along and across; m, step in which a root is sought


@dataclass(frozen=True)
class AreaPoints:
    """A finger of points over a texture.

    x, y: from the middle of the finger, along and across it (m).
    finger: height of each (m).
    share: stiffness of each (N/m).
    texture: heights (m) of one period [KNOTS, KNOTS], rows across.
    periods: along and across, m.
    middle: x of the middle of the finger before it moves, m.
    """

    x: Real
    y: Real
    finger: Real
    share: float
    texture: Real
    periods: tuple[float, float]
    middle: float = 0.0

    def heights(self, along: float, across: float, direction: float) -> Real:
        """Return h (m) of every point of a finger that has moved `along` and `across` (m)."""
        under = map_coordinates(self.texture, self._knots(along, across, direction), order=1, mode="grid-wrap")
        return np.asarray(self.finger + under)

    def _knots(self, along: float, across: float, direction: float) -> Real:
        """Return the row and column of the texture under every point."""
        c, s = math.cos(direction), math.sin(direction)
        u = (self.middle + c * self.x - s * self.y + along) / self.periods[0] * self.texture.shape[1]
        v = (s * self.x + c * self.y + across) / self.periods[1] * self.texture.shape[0]
        return np.stack([v, u])

    def pushed(self, pressed: Real, along: float, across: float, direction: float) -> list[float]:
        """Return minus the sum of share times `pressed` (m) times the slope of the texture along x and y (N).

        The slope is the difference over a knot.
        """
        some = pressed > 0.0
        at, found = self._knots(along, across, direction)[:, some], []
        for axis, period in ((1, self.periods[0]), (0, self.periods[1])):
            half = 0.5 * np.eye(2)[axis][:, np.newaxis]
            ends = [map_coordinates(self.texture, at + way * half, order=1, mode="grid-wrap") for way in (-1, 1)]
            slope = (ends[1] - ends[0]) * self.texture.shape[axis] / period
            found.append(-self.share * float(np.sum(pressed[some] * slope)))
        return found

    def forces(self, path: Path, times: Real, z: Real, exponent: float = 1.0) -> Real:
        """Return minus the sum of pressure times slope along x and y (N), and the sum of share max(h - z, 0)^exponent.

        The pressure is elastic, of a finger at `z` (m) at `times` (s).
        """
        found = []
        for t, at in zip(times.tolist(), z.tolist(), strict=True):
            depth = np.maximum(self.heights(*path(t)) - at, 0.0)
            powered = self.share * float(np.sum(depth[depth > 0.0] ** exponent))
            found.append([*self.pushed(depth, *path(t)), powered])
        return np.array(found).T

    def elastic(self, path: Path, times: Real, load: float) -> Real:
        """Return z (m) of an elastic finger without mass at `times` (s)."""
        return np.array([self.resting(self.heights(*path(t)), load) for t in times.tolist()])

    def resting(self, h: Real, load: float, free: Real | float = 0.0, hardness: float = 1.0) -> float:
        """Return the z (m) at which hardness times the sum of share max(h - z - free, 0) is `load` (N)."""
        g = np.sort(h - free)[::-1]
        total = np.cumsum(g) - load / (hardness * self.share)
        z = total / np.arange(1, len(g) + 1)
        return float(z[np.flatnonzero(z < g)[-1]])

    def skin(self, path: Path, times: Real, load: float, tau: float) -> Real:
        """Return z (m) of viscous skin at `times` (s), relaxed at the first."""
        return np.asarray(self.skin_with_forces(path, times, load, tau)[0])

    def skin_with_forces(self, path: Path, times: Real, load: float, tau: float) -> Real:
        """Return z (m), and minus the sum of pressure times slope along x and y (N), as `skin` does [3, times]."""
        step = float(times[1] - times[0])
        kept = math.exp(-step / tau)
        found: list[list[float]] = []
        indentation = np.zeros(len(self.x))
        for i, t in enumerate(times.tolist()):
            h = self.heights(*path(t))
            if i == 0:
                z = self.resting(h, load)
                indentation = pressed = np.maximum(h - z, 0.0)
            else:
                z = self.resting(h, load, kept * indentation, 1.0 / (1.0 - kept))
                pressed = np.maximum(h - z - kept * indentation, 0.0) / (1.0 - kept)
                indentation = np.maximum(h - z, kept * indentation)
            found.append([z, *self.pushed(pressed, *path(t))])
        return np.array(found).T

    def massive(self, path: Path, times: Real, load: float, mass: float, damping: float) -> Real:
        """Return z (m) of a mass at `times` (s), from rest at the first."""
        step = float(times[1] - times[0])
        z, v, h = self.resting(self.heights(*path(float(times[0]))), load), 0.0, self.heights(*path(float(times[0])))

        def force(heights: Real, at: float, speed: float) -> float:
            pressed = self.share * float(np.sum(np.maximum(heights - at, 0.0)))
            return (pressed - load - damping * speed) / mass

        found = [z]
        for t in times[:-1].tolist():
            middle, end = self.heights(*path(t + 0.5 * step)), self.heights(*path(t + step))
            a1 = force(h, z, v)
            a2 = force(middle, z + 0.5 * step * v, v + 0.5 * step * a1)
            a3 = force(middle, z + 0.5 * step * (v + 0.5 * step * a1), v + 0.5 * step * a2)
            a4 = force(end, z + step * (v + 0.5 * step * a2), v + step * a3)
            z += step * v + step**2 / 6.0 * (a1 + a2 + a3)
            v += step / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
            h = end
            found.append(z)
        return np.array(found)

    def attracted(self, path: Path, times: Real, load: float, pull: float, reach: float) -> Real:
        """Return z (m) at `times` (s) of a finger whose points are attracted with `pull` (N) each."""
        z, found = self.resting(self.heights(*path(float(times[0]))), load), []
        for t in times.tolist():
            h = self.heights(*path(t))

            def excess(at: float, h: Real = h) -> float:
                depth = h - at
                held = pull * float(np.sum(np.clip(1.0 + depth / reach, 0.0, 1.0)))
                return self.share * float(np.sum(np.maximum(depth, 0.0))) - held - load

            move = MOVE if excess(z) > 0.0 else -MOVE
            other = z + move
            while excess(other) * move > 0.0:
                z, other = other, other + move
            z = float(brentq(excess, *sorted((z, other)), xtol=1e-15))
            found.append(z)
        return np.array(found)
