"""Integrals of the pressure under one contact, in long double: the reference for the engine's pressure fields.

Model   h(x) = a2 cos(2 pi (x - p) / lambda2 + phi) - a1 cos(2 pi x / lambda1 + psi) - (x - L/2)^2 / (2 R), 0 <= x <= L.
        Means over L of max(h - z, 0)^g, of max(h - z, 0) dh_t/dx, and of dh_t/dx where h > z; h_t is the texture.
Source  Fagiani & Barbieri 2016, eqs 1 and 2; Takahasi & Mori 1974 for the double exponential rule.
Method  The length is cut where h turns (sign changes of its slope on a fine grid, bisected) and where h crosses z
        (bisected between the turns). Each touching part is integrated by the double exponential rule, which handles
        any power of a zero at the ends. Near an end h - z is its value at the end (0 at a crossing) plus the change of
        h from there, as a product of sines, which avoids cancellation.
Limits  Two turns within 1/400 of the shortest period may be missed; h between them is level to 1e-8 of its height.
        About 1e-13 of the integral, down to a power of -0.5. A few milliseconds per call.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

Long = npt.NDArray[np.floating[Any]]

POINTS_A_PERIOD = 400
BISECTIONS = 70
STEP, STEPS = 1.0 / 16.0, 66  # of the double exponential rule, to each side

PI = 2 * np.arcsin(np.longdouble(1))


@dataclass(frozen=True)
class Surfaces:
    """Lengths in metres, angles in radians; ``dome`` is 1 / R in 1/m, ``moved`` the distance p of the texture."""

    ridge_amplitude: float
    ridge_period: float
    ridge_phase: float
    texture_amplitude: float
    texture_period: float
    texture_phase: float
    length: float
    dome: float = 0.0
    moved: float = 0.0

    def texture_slope(self, x: Long) -> Long:
        """dh_t/dx."""
        wave = 2 * PI / np.longdouble(self.texture_period)
        angle = wave * (x - np.longdouble(self.moved)) + self.texture_phase
        return np.asarray(-self.texture_amplitude * wave * np.sin(angle))

    def height(self, x: Long) -> Long:
        """h."""
        finger = np.cos(2 * PI * x / np.longdouble(self.ridge_period) + self.ridge_phase)
        texture = np.cos(
            2 * PI * (x - np.longdouble(self.moved)) / np.longdouble(self.texture_period) + self.texture_phase
        )
        bulge = np.longdouble(self.dome) / 2 * (x - np.longdouble(self.length) / 2) ** 2
        return np.asarray(self.texture_amplitude * texture - self.ridge_amplitude * finger - bulge)

    def change(self, x: Long, step: Long) -> Long:
        """h(x + step) - h(x)."""
        ridge, texture = 2 * PI / np.longdouble(self.ridge_period), 2 * PI / np.longdouble(self.texture_period)
        middle = x + step / 2
        finger = np.sin(ridge * middle + self.ridge_phase) * np.sin(ridge * step / 2)
        wave = np.sin(texture * (middle - np.longdouble(self.moved)) + self.texture_phase) * np.sin(texture * step / 2)
        bulge = np.longdouble(self.dome) * (middle - np.longdouble(self.length) / 2) * step
        return np.asarray(2 * self.ridge_amplitude * finger - 2 * self.texture_amplitude * wave - bulge)

    def slope(self, x: Long) -> Long:
        """dh/dx."""
        wave = 2 * PI / np.longdouble(self.ridge_period)
        finger = self.ridge_amplitude * wave * np.sin(wave * x + self.ridge_phase)
        return np.asarray(self.texture_slope(x) + finger - self.dome * (x - np.longdouble(self.length) / 2))


def touching_parts(surfaces: Surfaces, z: float) -> tuple[Long, Long, Long, Long]:
    """Ends of the parts where h > z, also cut at the turns of h, and h - z at each end."""
    marks = np.concatenate([[0], turns(surfaces), [surfaces.length]]).astype(np.longdouble)
    edges = _zeros(lambda x: surfaces.height(x) - z, marks)
    above = np.concatenate([surfaces.height(marks) - z, np.zeros_like(edges)])
    marks = np.concatenate([marks, edges])
    order = np.argsort(marks)
    marks, above = marks[order], np.maximum(above[order], 0)
    touches = surfaces.height((marks[1:] + marks[:-1]) / 2) > z
    return marks[:-1][touches], marks[1:][touches], above[:-1][touches], above[1:][touches]


def turns(surfaces: Surfaces) -> Long:
    """Places where h turns."""
    shortest = min(surfaces.ridge_period, surfaces.texture_period)
    points = int(POINTS_A_PERIOD * surfaces.length / shortest) + 50
    return _zeros(surfaces.slope, np.linspace(0, np.longdouble(surfaces.length), points, dtype=np.longdouble))


def power_mean(surfaces: Surfaces, z: float, power: float) -> float:
    """Mean over L of max(h - z, 0)^power, in m^power; for a power of 0, the part of L where h > z."""
    return _mean(surfaces, z, lambda x, above: above ** np.longdouble(power))


def slope_mean(surfaces: Surfaces, z: float) -> float:
    """Mean over L of max(h - z, 0) dh_t/dx, in m."""
    return _mean(surfaces, z, lambda x, above: above * surfaces.texture_slope(x))


def balanced(surfaces: Surfaces, depth: float) -> float:
    """z (m) at which the mean of max(h - z, 0) is ``depth`` (m), by Newton from below, which never overshoots."""
    x = np.linspace(0, surfaces.length, 4001, dtype=np.longdouble)
    z = float(np.mean(surfaces.height(x))) - depth - 0.1 * (surfaces.ridge_amplitude + surfaces.texture_amplitude)
    for _ in range(60):
        step = (power_mean(surfaces, z, 1.0) - depth) / power_mean(surfaces, z, 0.0)
        z += step
        if abs(step) <= 1e-18 + 1e-16 * abs(z):
            break
    return z


def _zeros(function: Callable[[Long], Long], grid: Long) -> Long:
    """Zeros of ``function``, one in each interval of ``grid`` over which its sign changes."""
    positive = function(grid) > 0
    place = np.flatnonzero(positive[1:] != positive[:-1])
    low, high, rising = grid[place], grid[place + 1], positive[place + 1]
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        above = (function(middle) > 0) == rising
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    return np.asarray((low + high) / 2)


def _mean(surfaces: Surfaces, z: float, integrand: Callable[[Long, Long], Any]) -> float:
    """Mean over L of ``integrand`` of x and h - z where h > z, by the double exponential rule on each part."""
    left, right, above_left, above_right = (each[:, np.newaxis] for each in touching_parts(surfaces, z))
    t = STEP * np.arange(-STEPS, 1).astype(np.longdouble)  # the half of the nodes at the left end
    grow = PI / 2 * np.sinh(t)
    weight = STEP * PI / 2 * np.cosh(t) / (2 * np.cosh(grow) ** 2)
    weight[-1] /= 2  # the middle belongs to both halves
    step = (right - left) / (1 + np.exp(-2 * grow))
    from_left = integrand(left + step, above_left + surfaces.change(left, step))
    from_right = integrand(right - step, above_right + surfaces.change(right, -step))
    total = np.sum((right - left) * weight * (from_left + from_right))
    return float(total / np.longdouble(surfaces.length))
