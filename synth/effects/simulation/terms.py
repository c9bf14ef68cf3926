"""The balance of forces on the finger, term by term: what effects put in place of the quasi-static contact's own.

Model   m z'' + c z' = sum of the pressure - w. Without effects m = c = 0 and the pressure of a place is that of a
        spring, (k / L) max(d, 0), at an approach d = h - z. An effect replaces one term; those that do not concern each
        other can be put together.
Source  Fagiani & Barbieri (2016), eq. 1, for the spring; the others are those of the effects.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

FORGOTTEN = 7.0  # time constants after which a start is below 1e-3 of itself
LONGEST_SETTLING = 0.5  # s that is simulated before a frame from which a run begins in the middle of its motion


@dataclass(frozen=True, slots=True)
class Adhesion:
    """An attraction between surfaces. stress: Pa, the largest. reach: m, the gap at which it is gone."""

    stress: float
    reach: float


@dataclass(frozen=True, slots=True)
class Skin:
    """A viscoelastic foundation.

    times: s, of Kelvin and Voigt's solid the retardation time, of Maxwell's the relaxation times. weights: of the
    Maxwell elements, as parts of the stiffness at once, empty for Kelvin and Voigt's solid.
    """

    times: tuple[float, ...]
    weights: tuple[float, ...] = ()

    @property
    def slowest(self) -> float:
        """The longest time (s) in which it creeps at a held load: longer than a relaxing skin relaxes in.

        It creeps as exp(s t) where g0 + sum of g_i s / (s + 1 / tau_i) = 0, a polynomial with real roots.
        """
        if not self.weights:
            return max(self.times)
        rest = 1.0 - sum(self.weights)
        rates = np.array([1.0])
        terms = [np.array([1.0, 1.0 / time]) for time in self.times]
        for one in terms:
            rates = np.polymul(rates, one)
        total = rest * rates
        for place, weight in enumerate(self.weights):
            others = np.array([weight, 0.0])
            for other, one in enumerate(terms):
                others = others if other == place else np.polymul(others, one)
            total = np.polyadd(total, others)
        return float(1.0 / np.min(np.abs(np.roots(total).real)))


@dataclass(frozen=True, slots=True)
class Terms:
    """The terms of one balance. mass: kg. damping: N s/m. adhesion, skin: the law of the pressure, None: the spring."""

    mass: float = 0.0
    damping: float = 0.0
    adhesion: Adhesion | None = None
    skin: Skin | None = None

    @property
    def quasi_static(self) -> bool:
        """True where the balance is that of eq. 1 alone."""
        return self == Terms()

    def settling(self, stiffness: float) -> float:
        """Return how long (s) a run forgets its start, LONGEST_SETTLING at most; stiffness: see `slowest`."""
        return min(FORGOTTEN * self.slowest(stiffness), LONGEST_SETTLING)

    def slowest(self, stiffness: float) -> float:
        """Return the longest time (s) in which a start is forgotten; stiffness: dF/dz (N/m) round the load."""
        slowest = 0.0 if self.skin is None else self.skin.slowest
        if self.mass > 0.0 and self.damping > 0.0:
            rate = 0.5 * self.damping / self.mass
            stiff = rate**2 - stiffness / self.mass
            slow = rate - math.sqrt(stiff) if stiff > 0.0 else rate
            slowest = max(slowest, 1.0 / slow if slow > 0.0 else 0.0)
        elif self.damping > 0.0:
            slowest = max(slowest, self.damping / stiffness)
        return slowest
