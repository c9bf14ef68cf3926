"""A steady scan over viscous skin, by extrapolated implicit Euler on places of the skin: the reference for renders.

Model   u is the indentation of a place of the skin. It is never less than that of the surface, u >= h - z. Its pressure
        p is never below 0, and is 0 where u > h - z. Kelvin and Voigt: p = kappa (u + tau u'). Relaxing: p = kappa / g0
        (g0 u + sum of g_i q_i), q_i' = u' - q_i / tau_i. kappa = k / L; the sum of p dx is w, or m z'' + c z' + k_p (z
        - z_w) + w.
Source  Textbook forms; Fagiani & Barbieri (2016), eqs 1, 2, 4, 5.
Method  A step of implicit Euler gives p = A max(h - z - u0, 0), where u0 is the indentation that a place would recover
        to by itself. Between two places h - u0 is a straight line, of which the part above z counts. z follows from
        Newton's rule. Steps of a part of a period, and of half of that: the errors of first order cancel.
Limits  The remaining error comes from kinks where a place loses the surface. It halves when the step and the distance
        of the places are both halved. Three such runs extrapolate it, and report the error of the extrapolation.
        About 10 us per step for 1000 places; compiled, without any part of the engine.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numba
import numpy as np
import numpy.typing as npt

from tests.reference.moving_oracle import Harmonics
from tests.reference.stiffness_oracle import Touch, stiffness

Real = npt.NDArray[np.float64]


KNOTS = 1 << 16  # per period of a profile


@dataclass(frozen=True)
class Solid:
    """The viscous law of the skin.

    times: s.
    weights: parts of the instantaneous stiffness; none: Kelvin and Voigt with times[0].
    """

    times: tuple[float, ...]
    weights: tuple[float, ...] = ()


@numba.njit(cache=True)
def above(g, z, width):
    """Return area and length of the part above z of the line through the points `g`, `width` apart."""
    area = length = 0.0
    for j in range(1, len(g)):
        p, q = g[j - 1] - z, g[j] - z
        if p > 0.0 and q > 0.0:
            area += 0.5 * (p + q) * width
            length += width
        elif p > 0.0 or q > 0.0:
            most = max(p, q)
            part = width * most / abs(p - q)
            area += 0.5 * most * part
            length += part
    return area, length


@numba.njit(cache=True)
def balanced(g, z, width, full, load, heavy, before, velocity):
    """Return the z at which full times the area above it is the load and the force on the mass and the damper.

    heavy: m / step^2, c / step and k_p (N/m), and z_w (m).
    velocity: m per step.
    """
    for _ in range(200):
        area, length = above(g, z, width)
        if length == 0.0 and heavy[0] + heavy[1] == 0.0:
            z = np.min(g) - load / (full * width * (len(g) - 1))  # Newton's rule climbs from there
            continue
        moved = (heavy[0] + heavy[1]) * (z - before) - heavy[0] * velocity
        moved += heavy[2] * (z - heavy[3])
        move = (full * area - load - moved) / (full * length + heavy[0] + heavy[1] + heavy[2])
        z += move
        if abs(move) < 1e-16:
            break
    return z


@numba.njit(cache=True)
def force_of(g, x, z, wave, angle, amplitude):
    """Return the sum of the part above z of the line through `g` times the texture's slope."""
    total, width = 0.0, x[1] - x[0]
    for j in range(1, len(g)):
        p, q, left, right = g[j - 1] - z, g[j] - z, x[j - 1], x[j]
        if p <= 0.0 and q <= 0.0:
            continue
        if p <= 0.0:
            left, p = right - width * q / (q - p), 0.0
        elif q <= 0.0:
            right, q = left + width * p / (p - q), 0.0
        middle = 0.5 * (left + right)
        slopes = (math.sin(wave * left + angle), math.sin(wave * middle + angle), math.sin(wave * right + angle))
        total += (right - left) / 6.0 * (p * slopes[0] + 2.0 * (p + q) * slopes[1] + q * slopes[2])
    return amplitude * wave * total


@numba.njit(cache=True)
def surface(waves, table, places, angle):
    """Return h from rows of ridges, cosine and sine, or with the texture from a `table` of one period at `places`."""
    if len(table) == 0:
        return waves[0] + waves[1] * math.cos(angle) - waves[2] * math.sin(angle)
    h, turns = waves[0].copy(), angle / (2.0 * math.pi)
    for j in range(len(h)):
        place = (places[j] + turns) % 1.0 * len(table)
        k = int(place)
        h[j] += table[k % len(table)] * (k + 1 - place) + table[(k + 1) % len(table)] * (place - k)
    return h


@numba.njit(cache=True)
def creep(x, shape, press, solid, pace, total, indentation, table):
    """Return z and the force on the slopes at every step, beginning with the elastic contact.

    table: heights (m) of a period of a texture of any kind, at equal distances from x = 0; empty: a cosine.
    """
    a1, a2, wave1, wave2, phase = shape
    kappa, load, heavy = press
    times, weights = solid
    step, turn = pace
    count, width, rest = len(x), x[1] - x[0], 1.0 - np.sum(weights)
    waves = np.stack((-a1 * np.cos(wave1 * x), a2 * np.cos(wave2 * x), a2 * np.sin(wave2 * x)))
    places = wave2 * x / (2.0 * math.pi)
    fading = 1.0 / (1.0 + step / times)
    springs, free = np.zeros((len(weights), count)), np.zeros(count)
    heights, forces, velocity = np.empty(total), np.empty(total), 0.0
    hard = 1.0 + times[0] / step if len(weights) == 0 else (rest + np.sum(weights * fading)) / rest
    angle = phase + turn * total
    g = surface(waves, table, places, angle)
    z = balanced(g, np.min(g) - indentation, width, kappa, load, (0.0, 0.0, 0.0, 0.0), 0.0, 0.0)
    u = np.maximum(g - z, 0.0)
    for i in range(total):
        angle = phase - turn * (i + 1 - total)
        h = surface(waves, table, places, angle)
        if len(weights) == 0:
            free = u * fading[0]
        else:
            free = np.zeros(count)
            for n in range(len(weights)):
                free += weights[n] * fading[n] * (u - springs[n]) / (rest * hard)
        before = z
        z = balanced(h - free, z, width, kappa * hard, load, heavy, before, velocity)
        after = np.maximum(free, h - z)
        for n in range(len(weights)):
            springs[n] = fading[n] * (springs[n] + after - u)
        u, velocity = after, z - before  # per step
        heights[i] = z
        forces[i] = kappa * hard * force_of(h - free, x, z, wave2, angle, a2)
    return heights, forces


@dataclass(frozen=True)
class Creep:
    """A finger of skin on one touch at constant speed (m/s).

    places: their number.
    mass, damping, spring: kg, N s/m, N/m.
    rest: z_w (m), where the spring has no force.
    profile: of a texture that is not a cosine; `touch` is then that of its equivalent sinusoid, and the forces are
        meaningless.
    """

    touch: Touch
    speed: float
    solid: Solid
    places: int
    mass: float = 0.0
    damping: float = 0.0
    spring: float = 0.0
    rest: float = 0.0
    profile: Any = None

    @property
    def period(self) -> float:
        """Period of the texture (m)."""
        return float(self.touch.texture_period if self.profile is None else self.profile.period)

    def last_period(self, steps: int, periods: int) -> tuple[Real, Real]:
        """Return z (m) and the force on the slopes (N) at `steps` equal times of the last of `periods` periods.

        The last time is t = 0 of eq. 2.
        """
        touch = self.touch
        found, step = stiffness(touch), self.period / abs(self.speed) / steps
        waves = (2 * math.pi / touch.ridge_period, 2 * math.pi / self.period)
        known = self.profile is None
        shape = (touch.ridge_amplitude, touch.texture_amplitude, *waves, touch.phase if known else 0.0)
        table = np.empty(0) if known else self.profile.heights(np.arange(KNOTS) / KNOTS * self.period)
        x = np.linspace(0.0, touch.contact_length, self.places)
        heavy = (self.mass / step**2, self.damping / step, self.spring, self.rest)
        press = (found.k / touch.contact_length, touch.load, heavy)
        solid = (np.array(self.solid.times), np.array(self.solid.weights))
        turn = math.copysign(2 * math.pi / steps, self.speed)
        heights, forces = creep(x, shape, press, solid, (step, turn), steps * periods, found.indentation, table)
        return heights[-steps:], forces[-steps:]

    def steady(self, steps: int, periods: int) -> tuple[Harmonics, Harmonics]:
        """Return z (m) and the force on the slopes (N) of the steady scan, extrapolated from two runs."""
        coarse, fine = (self.last_period(count, periods) for count in (steps, 2 * steps))
        fundamental, found = abs(self.speed) / self.period, []
        for one, other in zip(coarse, fine, strict=True):
            several = [np.fft.rfft(np.roll(each, 1))[: steps // 2] / len(each) for each in (one, other)]
            found.append(Harmonics(2.0 * several[1] - several[0], fundamental))
        return found[0], found[1]
