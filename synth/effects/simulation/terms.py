"""The balance of forces on the finger, term by term: what effects put in place of the quasi-static contact's own.

Model   m z'' + c z' = sum of the pressure - w. Without effects m = c = 0 and the pressure of a place is that of a
        spring, (k / L) max(d, 0), at an approach d = h - z. An effect replaces one term; those that do not concern each
        other can be put together.
        Skin is a foundation of elements; e is the indentation of one, p its pressure, kappa its relaxed modulus.
        One time tau: p = kappa (e + tau e'). With p held over a step h and E = exp(-h / tau), e becomes E e + (1 - E) p
        / kappa. With weights: p = kappa / g0 (g0 e + sum of gi qi), qi' = e' - qi / taui, g0 + sum of gi = 1. With e a
        straight line over the step, qi becomes Ei qi + ri (e1 - e0), ri = (1 - Ei) taui / h. Both read p = kappa A
        (e1 - efree) with efree = keep e0 - sum of lose_i qi, to which an element without pressure recovers.
Source  Fagiani & Barbieri (2016), eq. 1, for the spring; Kelvin-Voigt and Prony series: textbook forms, unverified.
Limits  steps of skin are exact for what they hold, stable for any h, and of second order in h / tau; the pressure of a
        step of one time is that of its middle (of its end, where h is far beyond tau), with weights that at the end.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from synth.arrays import Array

SKIN_POINT, SKIN_MEMORY = 2.0e-9, 0.6e-9  # s of a step: of a point, of what it remembers (`tests.bench effects`)
KEEP, HARDNESS = 0, 1  # places in the head of `Skin.coefficients`
LOSE, DECAY, FOLLOW = 0, 1, 2  # rows of its terms


@dataclass(frozen=True, slots=True)
class Adhesion:
    """An attraction between surfaces. stress: Pa, the largest. reach: m, the gap at which it is gone."""

    stress: float
    reach: float


@dataclass(frozen=True, slots=True)
class Skin:
    """A viscoelastic foundation.

    times: s, of Kelvin and Voigt's solid the retardation time (0: elastic), of Maxwell's the relaxation times. weights:
    of the Maxwell elements, as parts of the stiffness at once, empty for Kelvin and Voigt's solid.
    """

    times: tuple[float, ...]
    weights: tuple[float, ...] = ()

    @property
    def memories(self) -> int:
        """Numbers that an element remembers beside its indentation: one for each weight."""
        return len(self.weights)

    @property
    def point_time(self) -> float:
        """Seconds that a step of one of its points is predicted to take."""
        return SKIN_POINT + SKIN_MEMORY * self.memories

    @property
    def relaxed_part(self) -> float:
        """Relaxed modulus over the modulus at once (g0)."""
        return 1.0 - math.fsum(self.weights)

    def coefficients(self, step: float) -> tuple[Array, Array, float]:
        """Return head, terms and `when` of steps of `step` seconds.

        head: float64 [2], keep and A. terms: float64 [3, memories], lose, E and r of each q. when: the part of the step
        after which an element that is pressed in evenly has the pressure p of the step: there p meets the load.
        """
        if not self.weights:
            steps = step / self.times[0] if self.times[0] > 0.0 else math.inf
            return np.array([math.exp(-steps), -1.0 / math.expm1(-steps)]), np.empty((3, 0)), when_pressed(steps)
        weights, lasting = np.array(self.weights), step / np.array(self.times)
        decay, follow = np.exp(-lasting), -np.expm1(-lasting) / lasting
        stiffness = self.relaxed_part + float(weights @ follow)  # at the end of a step, of the one at once
        head = np.array([float(weights @ follow) / stiffness, stiffness / self.relaxed_part])
        return head, np.stack([weights * decay / stiffness, decay, follow]), 1.0

    @property
    def slowest(self) -> float:
        """The longest time (s) in which it creeps at a held load: longer than a relaxing skin relaxes in.

        At a held load g0 e + sum of gi qi is constant, so q' = -(I - 1 g^T) diag(1 / taui) q.
        """
        if not self.weights:
            return max(self.times)
        creep = (np.eye(self.memories) - np.array(self.weights)) / np.array(self.times)
        return float(1.0 / np.min(np.abs(np.linalg.eigvals(creep))))


def when_pressed(steps: float) -> float:
    """Return 1 / (1 - E) - 1 / x with x = h / tau: 1/2 for short steps, 1 for long ones or without a dashpot.

    p / kappa = (e0 + e1) / 2 + (1 / (1 - E) - 1/2) (e1 - e0) is e + tau e' there, if e moves evenly.
    """
    if steps < 0.03:  # the difference would lose digits; the next term of the series is below 1e-13
        return 0.5 + steps / 12.0 - steps**3 / 720.0
    return -1.0 / math.expm1(-steps) - 1.0 / steps


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
