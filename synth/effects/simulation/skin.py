"""How an element of skin answers an indentation, and the coefficients of one step of it.

Model   Foundation of elements side by side; e is the indentation of one, p its pressure, kappa its relaxed modulus.
        Kelvin-Voigt: p = kappa (e + tau e'). With p held over a step h and E = exp(-h / tau), e becomes
        E e + (1 - E) p / kappa. Relaxation (generalised Maxwell): p = kappa / g0 (g0 e + sum of gi qi), qi' = e' -
        qi / taui, g0 + sum of gi = 1. With e a straight line over the step, qi becomes Ei qi + ri (e1 - e0), ri =
        (1 - Ei) taui / h. Both read p = kappa A (e1 - efree) with efree = keep e0 - sum of lose_i qi, to which an
        element without pressure recovers.
Source  Kelvin-Voigt and Prony series: textbook forms, unverified. Times: Pawluk & Howe (1999), abstract.
Limits  both steps are exact for what they hold, stable for any h, and of second order in h / tau; the pressure of a
        Kelvin-Voigt step is that of its middle (of its end, where h is far beyond tau), that of a relaxing element that
        at the end. Linear in the indentation: the exponential force of Pawluk & Howe is not in it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from synth.arrays import Array

RECOVERY_TIME = 0.004
"""s, the shortest time of Pawluk & Howe (1999), taken as eta / kappa of Kelvin-Voigt: an unverified default. With a
longer one the skin leaves the surface sooner behind every crest; 0 is the elastic contact."""

RELAXATION_TIMES = (0.004, 0.070, 1.4)
"""s, Pawluk & Howe (1999), from their abstract. They set the speeds at which the skin begins to stiffen."""

RELAXATION_WEIGHTS = (0.25, 0.25, 0.25)
"""Parts of the instantaneous modulus that relax: an unverified default (the paper's are not known to us). What they
leave to 1 is the relaxed part: 1/4 makes fast skin four times as stiff as slow skin."""

KEEP, HARDNESS = 0, 1  # places in the head of `StepCoefficients.head`
LOSE, DECAY, FOLLOW = 0, 1, 2  # rows of `StepCoefficients.terms`


@dataclass(frozen=True, slots=True)
class StepCoefficients:
    """One step of an element; step: s.

    head: float64 [2], keep and A. terms: float64 [3, n], lose, E and r of each q. when: the part of the step after
    which an element that is pressed in evenly has the pressure p of the step: there p meets the load.
    """

    step: float
    head: Array
    terms: Array
    when: float


class SkinLaw(Protocol):
    """What an element of skin is made of."""

    @property
    def memories(self) -> int:
        """Numbers that an element remembers beside its indentation."""

    def coefficients(self, step: float) -> StepCoefficients:
        """Return the coefficients of steps of `step` seconds."""


def when_pressed(steps: float) -> float:
    """Return 1 / (1 - E) - 1 / x with x = h / tau: 1/2 for short steps, 1 for long ones or without a dashpot.

    p / kappa = (e0 + e1) / 2 + (1 / (1 - E) - 1/2) (e1 - e0) is e + tau e' there, if e moves evenly.
    """
    if steps < 0.03:  # the difference would lose digits; the next term of the series is below 1e-13
        return 0.5 + steps / 12.0 - steps**3 / 720.0
    return -1.0 / math.expm1(-steps) - 1.0 / steps


@dataclass(frozen=True, slots=True)
class KelvinVoigt:
    """A spring beside a dashpot; time: tau = eta / kappa (s), at least 0."""

    time: float = RECOVERY_TIME

    def __post_init__(self) -> None:
        assert 0.0 <= self.time < math.inf, f"recovery time {self.time} s"

    @property
    def memories(self) -> int:
        """Numbers that an element remembers beside its indentation: none."""
        return 0

    def coefficients(self, step: float) -> StepCoefficients:
        """Return the coefficients of steps of `step` seconds."""
        assert step > 0.0, f"step {step} s"
        steps = step / self.time if self.time > 0.0 else math.inf
        head = np.array([math.exp(-steps), -1.0 / math.expm1(-steps)])
        return StepCoefficients(step, head, np.empty((3, 0)), when_pressed(steps))


@dataclass(frozen=True, slots=True)
class Relaxation:
    """A spring beside springs whose forces die away.

    times: taui (s). weights: gi, parts of the instantaneous modulus; they leave a relaxed part g0 above 0.
    """

    times: tuple[float, ...] = RELAXATION_TIMES
    weights: tuple[float, ...] = RELAXATION_WEIGHTS

    def __post_init__(self) -> None:
        assert len(self.times) == len(self.weights) > 0, "a weight for each time"
        assert all(0.0 < time < math.inf for time in self.times), f"relaxation times {self.times} s"
        assert all(weight >= 0.0 for weight in self.weights), f"weights {self.weights}"
        assert self.relaxed_part > 0.0, f"weights {self.weights} leave nothing to 1"

    @property
    def relaxed_part(self) -> float:
        """Relaxed modulus over instantaneous modulus (g0)."""
        return 1.0 - math.fsum(self.weights)

    @property
    def memories(self) -> int:
        """Numbers that an element remembers beside its indentation: one for each time."""
        return len(self.times)

    def coefficients(self, step: float) -> StepCoefficients:
        """Return the coefficients of steps of `step` seconds."""
        assert step > 0.0, f"step {step} s"
        weights, steps = np.array(self.weights), step / np.array(self.times)
        decay, follow = np.exp(-steps), -np.expm1(-steps) / steps
        stiffness = self.relaxed_part + float(weights @ follow)  # at the end of a step, of the instantaneous one
        head = np.array([float(weights @ follow) / stiffness, stiffness / self.relaxed_part])
        return StepCoefficients(step, head, np.stack([weights * decay / stiffness, decay, follow]), when=1.0)


@dataclass(frozen=True, slots=True)
class LoadLaw:
    """k = coefficient max(w, lightest)^power in N/m; loads below `lightest` (N) count as `lightest`.

    The plain contact has power -1/2 (Fagiani & Barbieri 2016, eqs 4-5).
    """

    coefficient: float
    power: float
    lightest: float

    def __post_init__(self) -> None:
        assert 0.0 < self.coefficient < math.inf, f"stiffness coefficient {self.coefficient}"
        assert 0.0 < self.lightest < math.inf, f"lightest load {self.lightest} N"

    def stiffness(self, load: float) -> float:
        """Return k (N/m) at `load` (N)."""
        return float(self.coefficient * max(load, self.lightest) ** self.power)
