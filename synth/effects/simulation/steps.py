"""What a simulation of a contact offers, whatever moves it on: a state that is started once, and runs over any steps.

Model   A step leads from one place and load to the next, at equal times `step` (s) apart. What a stepper needs of the
        step before stands in its state, so that runs of any lengths give the same numbers.
Limits  phases are 64-bit fractions of a turn (`response.phases`): their differences are right across whole turns as
        long as a step is shorter than half of one.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from synth.arrays import Array
from synth.contact.load_balance import Contact

Phases = np.ndarray[Any, np.dtype[np.uint64]]

HEIGHT, SLOPE_FORCE, REACTION, ATTACHED = range(4)
"""Rows of what a run writes: z (m), the horizontal force of the pressure on the slopes of the texture (N), the sum of
the pressure where it presses (N), and 1 while the finger touches or is held, 0 when it has let go."""
ROWS = 4
TOUCH_LOAD = 1e-6  # N, far below what is felt: less does not bring back a finger that has let go


@dataclass(frozen=True, slots=True)
class StiffnessLaw:
    """k = coefficient max(w, lightest)^power in N/m: power -0.5 for eqs 4-5; lightest: N."""

    coefficient: float
    power: float
    lightest: float

    @classmethod
    def of(cls, contact: Contact, load: float, lightest: float) -> StiffnessLaw:
        """Return the stiffness of `contact`; that of one `load` (N) where its shape follows the load."""
        load = max(load, lightest)
        power = 1.0 - contact.stiffness.load_exponent if contact.of_one_shape else 0.0
        return cls(contact.stiffness_at(load) / load**power, power, lightest)

    def at(self, load: float) -> float:
        """Return k (N/m) at `load` (N)."""
        return float(self.coefficient * max(load, self.lightest) ** self.power)


class Stepper(ABC):
    """Simulates one contact; frozen coefficients, so that one stepper serves many states. mass: kg."""

    __slots__ = ()
    mass: float

    @property
    def memory(self) -> float:
        """The longest time (s) in which a start is forgotten, but for a mass's; 0 where nothing is remembered."""
        return 0.0

    @property
    @abstractmethod
    def nbytes(self) -> int:
        """Bytes that it holds."""

    @property
    @abstractmethod
    def state_bytes(self) -> int:
        """Bytes of one state."""

    @property
    @abstractmethod
    def step_time(self) -> float:
        """Seconds that a step is predicted to take."""

    @property
    @abstractmethod
    def elastic(self) -> Self:
        """The same contact without mass, memory or adhesion."""

    @abstractmethod
    def start(self, phase: int, load: float, turns: float, step: float) -> Any:
        """Return the state of a finger that follows the elastic contact at `phase` and `load` (N).

        turns: texture periods a second (signed), for the velocity with which it follows. step: s.
        """

    @abstractmethod
    def resumed(self, state: Any, step: float) -> Any:
        """Return a copy of `state` that goes on in steps of `step` s."""

    @abstractmethod
    def run(self, state: Any, phases: Phases, loads: Array, out: Array) -> None:
        """Go on to each of `phases` and `loads` (N) in turn, and write ROWS rows of `out`, float64 [ROWS, steps]."""

    @abstractmethod
    def apart(self, before: Any, after: Any, seconds: float) -> Array:
        """Return how far (m) each number of a state lies from that of another; velocities as of `seconds` / (2 pi)."""

    @abstractmethod
    def mixed(self, states: Sequence[Any], parts: Array) -> Any:
        """Return the sum of `parts`, which add up to 1, of states at one phase and load, the last the nearest to it."""

    def forgetting(self, longest: float) -> Self:
        """Return the same contact, none of its time constants longer than `longest` (s)."""
        return self

    def taken_over(self, state: Any) -> Any:
        """Return the state of the same contact at other points, at its own."""
        return state

    def coarser(self) -> Self | None:
        """Return the same contact at half as many phases and heights; None where points say how fine it is."""
        return None
