"""The balance of forces on the finger, term by term. Effects replace terms of the quasi-static contact.

Model   m z'' + c z' + k_p (z - z_w) = sum of the pressure - w (`pulp`). Without effects m = c = k_p = 0, and the
        pressure of a place is that of a spring, (k / L) max(d, 0), with d = h - z. An effect replaces one term; effects
        on different terms combine.
        Skin is a foundation of elements. e is the indentation of an element, p its pressure, kappa its relaxed modulus.
        One time constant tau: p = kappa (e + tau e'). With p constant over a step h and E = exp(-h / tau), e becomes
        E e + (1 - E) p / kappa.
        With weights: p = kappa / g0 (g0 e + sum of gi qi), qi' = e' - qi / taui, g0 + sum of gi = 1. With e a straight
        line over the step, from e0 to e1, qi becomes Ei qi + ri (e1 - e0), ri = (1 - Ei) taui / h.
        Both give p = kappa A (e1 - efree) with efree = keep e0 - sum of lose_i qi. An element without pressure recovers
        to efree.
Source  Fagiani & Barbieri (2016), eq. 1, for the spring; Kelvin-Voigt and Prony series: textbook forms, unverified.
Limits  Steps of skin are exact for the pressure or indentation that they assume, stable for any h, and of second order
        in h / tau. With one time constant the pressure of a step is that of its middle, or of its end if h is far
        beyond tau. With weights it is that of its end.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from synth.arrays import Array

SKIN_POINT, SKIN_MEMORY = 2.0e-9, 0.6e-9  # s per step: of a point, and of each of its memories (`tests.bench effects`)
KEEP, HARDNESS = 0, 1  # indices in the head of `Skin.coefficients`
LOSE, DECAY, FOLLOW = 0, 1, 2  # rows of its terms


@dataclass(frozen=True, slots=True)
class Adhesion:
    """An attraction between surfaces.

    stress: largest attraction (Pa).
    reach: gap at which the attraction vanishes (m).
    """

    stress: float
    reach: float


@dataclass(frozen=True, slots=True)
class Skin:
    """A viscoelastic foundation.

    times: retardation time of a Kelvin-Voigt solid (0: elastic), or relaxation times of Maxwell elements (s).
    weights: of the Maxwell elements, as parts of the instantaneous stiffness; empty for a Kelvin-Voigt solid.
    """

    times: tuple[float, ...]
    weights: tuple[float, ...] = ()

    @property
    def memories(self) -> int:
        """Number of values that an element stores in addition to its indentation, one per weight."""
        return len(self.weights)

    @property
    def point_time(self) -> float:
        """Predicted computing time of a step per point (s)."""
        return SKIN_POINT + SKIN_MEMORY * self.memories

    @property
    def relaxed_part(self) -> float:
        """Relaxed modulus over instantaneous modulus (g0)."""
        return 1.0 - math.fsum(self.weights)

    def coefficients(self, step: float) -> tuple[Array, Array, float]:
        """Return head, terms and `when` for steps of `step` (s).

        head: float64 [2], keep and A.
        terms: float64 [3, memories]: lose, E and r of each q.
        when: part of the step after which an element, indented at a constant rate, has the pressure p of the step. p
            balances the load at that time.
        """
        if not self.weights:
            steps = step / self.times[0] if self.times[0] > 0.0 else math.inf
            return np.array([math.exp(-steps), -1.0 / math.expm1(-steps)]), np.empty((3, 0)), when_pressed(steps)
        weights, lasting = np.array(self.weights), step / np.array(self.times)
        decay, follow = np.exp(-lasting), -np.expm1(-lasting) / lasting
        stiffness = self.relaxed_part + float(weights @ follow)  # at the end of a step, over the instantaneous one
        head = np.array([float(weights @ follow) / stiffness, stiffness / self.relaxed_part])
        return head, np.stack([weights * decay / stiffness, decay, follow]), 1.0

    @property
    def slowest(self) -> float:
        """Longest time constant of creep at a constant load (s), which exceeds that of relaxation.

        At a constant load g0 e + sum of gi qi is constant, so q' = -(I - 1 g^T) diag(1 / taui) q.
        """
        if not self.weights:
            return max(self.times)
        creep = (np.eye(self.memories) - np.array(self.weights)) / np.array(self.times)
        return float(1.0 / np.min(np.abs(np.linalg.eigvals(creep))))


ELASTIC = Skin((0.0,))


def when_pressed(steps: float) -> float:
    """Return 1 / (1 - E) - 1 / x: 1/2 for short steps, 1 for long steps or without a dashpot.

    steps: x = h / tau.

    At this part of the step e + tau e' equals p / kappa = (e0 + e1) / 2 + (1 / (1 - E) - 1/2) (e1 - e0), if e' is
    constant.
    """
    if steps < 0.03:  # the difference below would lose digits; the next term of this series is below 1e-13
        return 0.5 + steps / 12.0 - steps**3 / 720.0
    return -1.0 / math.expm1(-steps) - 1.0 / steps


@dataclass(frozen=True, slots=True)
class Terms:
    """The terms of one balance.

    mass: kg.
    damping: N s/m; needs a mass.
    pulp: stiffness k_p of the spring of the pulp (N/m).
    adhesion, skin: law of the pressure; the spring if both are None.

    Effects add to damping and pulp, and replace the others.
    """

    mass: float = 0.0
    damping: float = 0.0
    pulp: float = 0.0
    adhesion: Adhesion | None = None
    skin: Skin | None = None

    @property
    def quasi_static(self) -> bool:
        """True if the balance is that of eq. 1 alone."""
        return self == Terms()

    @property
    def of_rest(self) -> Terms:
        """Those that act on a finger at rest: neither its mass nor the memory of its skin does."""
        return Terms(pulp=self.pulp, adhesion=self.adhesion)
