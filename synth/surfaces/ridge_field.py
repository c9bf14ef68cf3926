"""The ridges of a fingertip: curved, unequal and not quite parallel, from a seed.

Stage   SURFACES.
Model   h(x, y) = -a (1 + s_h g) cos(2 pi (r + u + v) / period). x is along the scan and y across it, both from the
        middle of the fingertip. 1 + s_h g is clipped at 0. r is the distance from the core of the print, which is 8 mm
        behind the middle for a loop, and the middle itself for a whorl. u and v are smooth random displacements. The
        rms gradient of u along x is the spread of the spacing; that of v along y is the spread of the direction (rad).
        g is a random field of variance 1. Each field is the sum of WAVES plane waves of random direction and phase,
        drawn in order from PCG64(seed).
Source  Mean period and height: see `finger_section`. The loop's radius, the spreads and the correlation length are
        unverified defaults. They are chosen so that no grating is commensurate with the whole print. With equal ridges
        the line at u / lambda2 can be 59 dB below the strongest; with these spreads it is 5 dB below.
Limits  Ridges have no ends and no forks.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from synth.arrays import Array

PATTERNS = ("loop", "whorl", "straight")
CORE = 8e-3  # m: from the core of a loop to the middle of the fingertip
CORRELATION = 1.5e-3  # m: wavelength of the random fields; the spacing therefore varies over a few ridges
WAVES = 24  # plane waves of a field; with many fewer the field repeats visibly
TOGETHER = 1 << 16  # heights that are computed together: their arrays stay in the cache
ALONG, ACROSS = 1.0 / 6.0, 1.0 / 3.0  # factors of wave numbers; with them, spacing varies slowly along a ridge


@dataclass(frozen=True, slots=True)
class RidgeField:
    """The ridges of one fingertip.

    period: mean distance of neighbouring ridges, m.
    amplitude: mean of half the height from valley to crest, m.
    pattern: one of PATTERNS.
    spacing_spread: standard deviation of the spacing, relative to its mean.
    direction_spread: standard deviation of the direction, rad.
    height_spread: standard deviation of the height, relative to its mean.
    seed: of the random fields.
    """

    period: float
    amplitude: float
    pattern: str
    spacing_spread: float
    direction_spread: float
    height_spread: float
    seed: int

    def heights(self, x: Array, y: Array, direction: float = 0.0) -> Array:
        """Return h (m) at every pair of `x` [columns] and `y` [rows] (m): [columns, rows].

        direction: angle (rad, counter-clockwise) by which the fingertip is turned about its middle.
        """
        chance, number = np.random.default_rng(self.seed), 2.0 * math.pi / CORRELATION
        spacing = Waves.drawn(chance, number, number * ACROSS).of_gradient(self.spacing_spread, 0)
        sideways = Waves.drawn(chance, number * ALONG, number * ACROSS).of_gradient(self.direction_spread, 1)
        height = Waves.drawn(chance, number, number)
        moved = factors_of([one.turned(direction) for one in (spacing, sideways)], x, y)
        swelling = factors_of([height.turned(direction)], x, y)
        found, together = np.empty((len(x), len(y))), max(1, TOGETHER // max(len(y), 1))
        for first in range(0, len(x), together):
            some = slice(first, first + together)
            distance = self._distance(x[some], y, direction)
            distance += moved[0][some] @ moved[1]
            distance *= 2.0 * math.pi / self.period
            swell = swelling[0][some] @ swelling[1]
            swell *= self.height_spread
            swell += 1.0
            np.maximum(swell, 0.0, out=swell)
            swell *= -self.amplitude
            np.multiply(swell, np.cos(distance, out=distance), out=found[some])
        return found

    def _distance(self, x: Array, y: Array, direction: float) -> Array:
        """Return the distance (m) of every pair of `x` and `y` from the core, less that of the middle."""
        across, along = turned_back(x, y, direction)
        if self.pattern == "straight":
            return np.broadcast_to(across, (len(x), len(y))).copy()
        core = CORE if self.pattern == "loop" else 0.0
        distance = np.square(across + core) + np.square(along)
        np.sqrt(distance, out=distance)
        distance -= core
        return np.asarray(distance)


def turned_back(x: Array, y: Array, direction: float) -> tuple[Array, Array]:
    """Return every pair of `x` and `y` in the frame of a finger that is turned by `direction` (rad).

    Both are [len(x), len(y)].
    """
    c, s = math.cos(direction), math.sin(direction)
    along, across = x[:, np.newaxis], y[np.newaxis]
    return c * along + s * across, c * across - s * along


@dataclass(frozen=True, slots=True)
class Waves:
    """A smooth random field: the sum of plane waves.

    x, y: wave numbers, 1/m.
    phase: rad.
    amplitude: of each wave; sqrt(2 / WAVES) gives a variance of 1.
    """

    x: Array
    y: Array
    phase: Array
    amplitude: float

    @classmethod
    def drawn(cls, chance: np.random.Generator, x: float, y: float) -> Waves:
        """Return a field of variance 1; x, y: standard deviations of the wave numbers (1/m)."""
        numbers = chance.normal(0.0, x, WAVES), chance.normal(0.0, y, WAVES)
        return cls(*numbers, chance.uniform(0.0, 2.0 * math.pi, WAVES), math.sqrt(2.0 / WAVES))

    def of_gradient(self, gradient: float, axis: int) -> Waves:
        """Return the field scaled to the rms `gradient` along x (axis 0) or y (axis 1)."""
        numbers = (self.x, self.y)[axis]
        rms = self.amplitude * math.sqrt(0.5 * float(np.sum(numbers**2)))
        return Waves(self.x, self.y, self.phase, self.amplitude * gradient / rms)

    def turned(self, direction: float) -> Waves:
        """Return the field turned by `direction` (rad)."""
        c, s = math.cos(direction), math.sin(direction)
        return Waves(c * self.x - s * self.y, s * self.x + c * self.y, self.phase, self.amplitude)


def factors_of(fields: list[Waves], x: Array, y: Array) -> tuple[Array, Array]:
    """Return two factors whose product is the sum of `fields` at every pair of `x` and `y` (m).

    The first is [len(x), 2 waves], the second [2 waves, len(y)].
    """
    along, across = [], []
    for one in fields:
        first, second = x[:, np.newaxis] * one.x + one.phase, one.y[:, np.newaxis] * y
        along += [one.amplitude * np.cos(first), -one.amplitude * np.sin(first)]
        across += [np.cos(second), np.sin(second)]
    return np.concatenate(along, axis=1), np.concatenate(across)
