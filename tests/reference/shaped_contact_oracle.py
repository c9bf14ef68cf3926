"""Contacts whose shape depends on the load, directly from their definition: every turning point, every edge, every
    area.

Model   integral of max(h(x) - (x - xc)^2 / (2 R) - z, 0) dx over [start, stop] = target. h is that of eq. 2, with x
        from the end of the nominal contact, so nothing is shifted. A flat finger has 1 / R = 0.
        Growing: start and stop are (L0 -/+ L) / 2, with L = L0 (w / w0)^p within its limits, and target = L w / k(L).
        Round: start and stop are xc -/+ sqrt(2 R 2 (a1 + a2) + b^2), beyond which nothing can touch. target = w /
        kappa, where b solves w = (2/3) kappa b^3 / R with kappa = k(2 b) / (2 b).
Source  Fagiani & Barbieri (2016), eqs 1-5; Johnson, Contact Mechanics (1985), sec. 4.3.
Method  The slope is sampled 64 times per period and its zeros are bisected. Between them h - z is monotone; its edge is
        bisected, then found by Newton's rule, and its area is in closed form. The area above z is convex in z, so
        Newton's rule from below finds z and never overshoots. Everything is in long double.
Limits  |error of z| about 1e-15 of the depth. A dip between two crests closer than 1/64 of the shortest period is
        missed; it is at most 1e-7 of the heights deep. About 20 ms per case.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import brentq

from tests.reference.stiffness_oracle import Touch, stiffness

Long = Any
SAMPLES_A_PERIOD = 64
PI = np.longdouble("3.14159265358979323846264338327950288")
HALVINGS = 34  # of 1/64 of a period: a turning point to 1e-12 of it
NEAR, NEWTON = 8, 6  # halvings of a stretch and steps of Newton's rule: an edge; the error of the area is the square


@dataclass(frozen=True)
class Window:
    """A stretch of the nominal x axis (m) and the surfaces over it; `bend` is 1 / R (1/m) about `middle`."""

    touch: Touch
    theta: float
    start: Long
    stop: Long
    middle: Long
    bend: float = 0.0

    def angles(self, x: Long) -> tuple[Long, Long]:
        texture = 2 * PI * (x / np.longdouble(self.touch.texture_period) - np.longdouble(self.theta))
        return 2 * PI * x / np.longdouble(self.touch.ridge_period), texture + np.longdouble(self.touch.phase)

    def height(self, x: Long) -> Long:
        ridge, texture = self.angles(x)
        waves = self.touch.texture_amplitude * np.cos(texture) - self.touch.ridge_amplitude * np.cos(ridge)
        return waves - self.bend * (x - self.middle) ** 2 / 2

    def slope(self, x: Long) -> Long:
        ridge, texture = self.angles(x)
        rise1 = 2 * math.pi * self.touch.ridge_amplitude / self.touch.ridge_period
        rise2 = 2 * math.pi * self.touch.texture_amplitude / self.touch.texture_period
        return rise1 * np.sin(ridge) - rise2 * np.sin(texture) - self.bend * (x - self.middle)

    def area(self, left: Long, right: Long, z: Long) -> Long:
        """Integral of h - z (m^2): the value from the middle, minus the effect of the curvature."""
        width, middle = right - left, (left + right) / 2
        ridge, texture = self.angles(middle)
        lost1 = self.touch.ridge_amplitude * np.cos(ridge) * _one_less_sinc(PI * width / self.touch.ridge_period)
        lost2 = self.touch.texture_amplitude * np.cos(texture) * _one_less_sinc(PI * width / self.touch.texture_period)
        return width * (self.height(middle) - z + lost1 - lost2 - self.bend * width**2 / 24)


@dataclass(frozen=True)
class Pressed:
    """z (m), the length that touches (m), and the highest point of the gap (m)."""

    approach: float
    length: float
    crest: float


def grown_length(touch: Touch, load: float, exponent: float, shortest: float = 1e-5, longest: float = 0.1) -> float:
    """L (m) of a contact whose nominal length belongs to 1 N."""
    return min(max(touch.contact_length * math.pow(load, exponent), shortest), longest)


def growing_contact(touch: Touch, theta: float, load: float, exponent: float) -> Pressed:
    """The contact of length L0 w^p, w in newtons, about the middle of the nominal contact."""
    length = grown_length(touch, load, exponent)
    half, middle = np.longdouble(length) / 2, np.longdouble(touch.contact_length) / 2
    law = stiffness(replace(touch, load=load, contact_length=length))
    return _solved(Window(touch, theta, middle - half, middle + half, middle), length * law.indentation)


def smooth_half_length(touch: Touch, load: float, radius: float) -> float:
    """b (m): half the length that a round finger without ridges touches, by search."""

    def excess(logarithm: float) -> float:
        b = math.exp(logarithm)
        foundation = stiffness(replace(touch, load=load, contact_length=2 * b)).k / (2 * b)
        return math.log(2 / 3 * foundation * b**3 / radius / load)

    return math.exp(float(brentq(excess, math.log(1e-12), math.log(1e3), xtol=1e-15, rtol=1e-15)))


def fitting_radius(touch: Touch) -> float:
    """R (m) of the round finger that, without ridges, touches the nominal length at 1 N."""
    wanted = math.log(touch.contact_length / 2)

    def excess(logarithm: float) -> float:
        return math.log(smooth_half_length(touch, 1.0, math.exp(logarithm))) - wanted

    return math.exp(float(brentq(excess, math.log(1e-9), math.log(1e9), xtol=1e-15, rtol=1e-15)))


def round_window(touch: Touch, theta: float, load: float, radius: float) -> tuple[Window, float]:
    """The window in which a round finger may touch, and w / kappa (m^2)."""
    b = smooth_half_length(touch, load, radius) if load > 0 else 0.0
    target = load / (stiffness(replace(touch, load=load, contact_length=2 * b)).k / (2 * b)) if load > 0 else 0.0
    half = math.sqrt(4 * radius * (touch.ridge_amplitude + touch.texture_amplitude) + b * b)
    middle = np.longdouble(touch.contact_length) / 2
    return Window(touch, theta, middle - half, middle + half, middle, 1 / radius), target


def round_contact(touch: Touch, theta: float, load: float, radius: float) -> Pressed:
    """The contact of a round finger of `radius` (m)."""
    return _solved(*round_window(touch, theta, load, radius))


def _solved(window: Window, target: float) -> Pressed:
    points = turning_points(window)
    heights = window.height(points)
    crest = float(heights.max())
    if target == 0.0:
        return Pressed(crest, 0.0, crest)
    deepest = float(heights.max() - heights.min()) + 2 * target / float(window.stop - window.start)

    z = heights.max() - deepest
    for _ in range(200):
        area, length = _above(window, points, heights, z)
        step = (area - target) / length
        z += step
        if abs(step) <= 4 * np.finfo(float).eps * (heights.max() - z):
            break
    return Pressed(float(z), float(_above(window, points, heights, z)[1]), crest)


def turning_points(window: Window) -> Long:
    """Both ends of a window and all places between them where h turns, rising."""
    shortest = min(window.touch.ridge_period, window.touch.texture_period)
    count = 2 + math.ceil(SAMPLES_A_PERIOD * float(window.stop - window.start) / shortest)
    x = window.start + (window.stop - window.start) * np.arange(count + 1) / count
    rising = window.slope(x) > 0
    turns = np.flatnonzero(rising[1:] != rising[:-1])
    low, high = x[turns].copy(), x[turns + 1].copy()
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        before = (window.slope(middle) > 0) == rising[turns]
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    return np.concatenate([x[:1], (low + high) / 2, x[-1:]])


def _above(window: Window, points: Long, heights: Long, z: Long) -> tuple[Long, Long]:
    """Area above z (m^2), and the length (m) above z."""
    above = heights > z
    left, right = points[:-1].copy(), points[1:].copy()
    cut = np.flatnonzero(above[1:] != above[:-1])
    low, high = left[cut], right[cut]
    for _ in range(NEAR):
        middle = (low + high) / 2
        before = (window.height(middle) > z) == above[cut]
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    edge = (low + high) / 2
    for _ in range(NEWTON):
        edge = np.clip(edge - (window.height(edge) - z) / window.slope(edge), low, high)
    rising = above[1:][cut]
    left[cut[rising]], right[cut[~rising]] = edge[rising], edge[~rising]
    kept = above[1:] | above[:-1]
    left, right = left[kept], right[kept]
    return np.sum(window.area(left, right, z)), np.sum(right - left)


def _one_less_sinc(angle: Long) -> Long:
    """1 - sin(angle) / angle, to full relative precision also where it is tiny."""
    square = angle * angle
    series = square / 6 * (1 - square / 20 * (1 - square / 42 * (1 - square / 72 * (1 - square / 110))))
    return np.where(angle < 0.01, series, 1 - np.sin(angle) / np.where(angle == 0, 1, angle))
