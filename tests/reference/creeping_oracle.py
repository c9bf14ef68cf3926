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
        About 2 us per step for 1000 places; compiled, without any part of the engine.
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

Complex = npt.NDArray[np.complex128]

KNOTS = 1 << 16  # per period of a profile
TINY = 1e-300  # m, instead of no difference between two heights
CLOSE = 1e-13  # m, of Newton's last step: what it leaves is its square, over a micrometre


@dataclass(frozen=True)
class Solid:
    """The viscous law of the skin.

    times: s.
    weights: parts of the instantaneous stiffness; none: Kelvin and Voigt with times[0].
    """

    times: tuple[float, ...]
    weights: tuple[float, ...] = ()


@numba.njit(cache=True, fastmath=True, error_model="numpy")
def above(g, z, width):
    """Return area and length of the part above z of the line through the points `g`, `width` apart."""
    area = length = 0.0
    for j in range(1, len(g)):
        p, q = g[j - 1] - z, g[j] - z
        most, least = max(p, q), min(p, q)
        part = min(max(most / (most - least + TINY), 0.0), 1.0)  # of the distance; without branches, several at once
        area += part * (max(p, 0.0) + max(q, 0.0))
        length += part
    return 0.5 * area * width, length * width


@numba.njit(cache=True)
def balanced(g, z, width, full, load, heavy, before, velocity):
    """Return the z at which full times the area above it is the load and the force on the mass and the damper.

    z: near it. heavy: m / step^2, c / step and k_p (N/m), and z_w (m).
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
        if abs(move) < CLOSE:
            break
    return z


@numba.njit(cache=True, fastmath=True)
def surface(waves, table, places, angle, h):
    """Put h from rows of ridges, cosine and sine, or with the texture from a `table` of one period at `places`."""
    if len(table) == 0:
        cosine, sine = math.cos(angle), math.sin(angle)
        for j in range(len(h)):
            h[j] = waves[0, j] + waves[1, j] * cosine - waves[2, j] * sine
        return
    turns = angle / (2.0 * math.pi)
    for j in range(len(h)):
        place = places[j] + turns
        place = (place - math.floor(place)) * len(table)
        k = int(place)
        h[j] = waves[0, j] + table[k % len(table)] * (k + 1 - place) + table[(k + 1) % len(table)] * (place - k)


@numba.njit(cache=True)
def work(g, z, waves, angle, width):
    """Return minus the integral of max(g - z, 0) times the slope of the cosine over its angle (m^2)."""
    cosine, sine, total = math.cos(angle), math.sin(angle), 0.0
    for j in range(len(g)):
        part = 0.5 if j in (0, len(g) - 1) else 1.0
        total += part * max(g[j] - z, 0.0) * (waves[2, j] * cosine + waves[1, j] * sine)
    return total * width


@numba.njit(cache=True)
def creep(x, shape, press, solid, pace, total, indentation, table):
    """Return z (m) and, on a cosine, the force on its slopes (N) at every step, beginning with the elastic contact.

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
    springs, free, g = np.zeros((len(weights), count)), np.zeros(count), np.empty(count)
    heights, forces, velocity = np.empty(total), np.zeros(total), 0.0
    hard = 1.0 + times[0] / step if len(weights) == 0 else (rest + np.sum(weights * fading)) / rest
    surface(waves, table, places, phase + turn * total, g)
    z = balanced(g, np.min(g) - indentation, width, kappa, load, (0.0, 0.0, 0.0, 0.0), 0.0, 0.0)
    u = np.maximum(g - z, 0.0)
    for i in range(total):
        angle = phase - turn * (i + 1 - total)
        surface(waves, table, places, angle, g)
        for j in range(count):
            if len(weights) == 0:
                free[j] = u[j] * fading[0]
            else:
                free[j] = 0.0
                for n in range(len(weights)):
                    free[j] += weights[n] * fading[n] * (u[j] - springs[n, j]) / (rest * hard)
            g[j] -= free[j]
        before = z
        z = balanced(g, z + velocity, width, kappa * hard, load, heavy, before, velocity)
        for j in range(count):
            after = free[j] + max(g[j] - z, 0.0)
            for n in range(len(weights)):
                springs[n, j] = fading[n] * (springs[n, j] + after - u[j])
            u[j] = after
        velocity = z - before  # per step
        heights[i] = z
        if len(table) == 0:
            forces[i] = kappa * hard * wave2 * work(g, z, waves, angle, width)
    return heights, forces


@dataclass(frozen=True)
class Creep:
    """A finger of skin on one touch at constant speed (m/s).

    places: their number.
    mass, damping, spring: kg, N s/m, N/m.
    rest: z_w (m), where the spring has no force.
    profile: of a texture that is not a cosine; `touch` is then that of its equivalent sinusoid.
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

    def last_period(self, steps: int, periods: float, *, of_force: bool = False) -> Complex:
        """Return the harmonics below steps / 2 of z (m), from `steps` equal times of the last of `periods` periods.

        The last time is t = 0 of eq. 2.

        of_force: those of the force on the slopes of a cosine (N) instead.
        """
        touch = self.touch
        law, step = stiffness(touch), self.period / abs(self.speed) / steps
        waves = (2 * math.pi / touch.ridge_period, 2 * math.pi / self.period)
        known = self.profile is None
        shape = (touch.ridge_amplitude, touch.texture_amplitude, *waves, touch.phase if known else 0.0)
        table = np.empty(0) if known else self.profile.heights(np.arange(KNOTS) / KNOTS * self.period)
        x = np.linspace(0.0, touch.contact_length, self.places)
        heavy = (self.mass / step**2, self.damping / step, self.spring, self.rest)
        press = (law.k / touch.contact_length, touch.load, heavy)
        solid = (np.array(self.solid.times), np.array(self.solid.weights))
        turn = math.copysign(2 * math.pi / steps, self.speed)
        found = creep(x, shape, press, solid, (step, turn), round(steps * periods), law.indentation, table)[of_force]
        return np.fft.rfft(np.roll(found[-steps:], 1))[: steps // 2] / steps

    def extrapolated(self, coarse: Complex, fine: Complex) -> Harmonics:
        """Return z (m) of the steady scan from two runs, of which the second has twice the steps."""
        return Harmonics(2.0 * fine[: len(coarse)] - coarse, abs(self.speed) / self.period)

    def steady(self, steps: int, periods: float) -> Harmonics:
        """Return z (m) of the steady scan, extrapolated from runs of `steps` and of twice as many steps a period."""
        return self.extrapolated(self.last_period(steps, periods), self.last_period(2 * steps, periods))
