"""What simulates a contact step by step offers: state that is started once, and runs over any number of steps.

Model   A step leads from one place and load to the next, at equal times `step` (s) apart. What a stepper needs of the
        step before stands in its state, so that runs of any lengths give the same numbers.
Limits  phases are 64-bit fractions of a turn (`contact.phases`): their differences are right across whole turns as long
        as a step is shorter than half of one.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from synth.arrays import Array

Phases = np.ndarray[Any, np.dtype[np.uint64]]

HEIGHT, STATIC, SLOPE_FORCE, REACTION, ATTACHED = range(5)
"""Rows of what a run writes: z (m), z of the elastic contact without mass, memory or adhesion at the same place and
load (m), the horizontal force of the pressure on the slopes of the texture (N), the sum of the pressure where it
presses (N), and 1 while the finger touches or is held, 0 when it has let go."""
ROWS = 5


class Stepper(Protocol):
    """Simulates one contact; frozen coefficients, so that one stepper serves many states."""

    @property
    def nbytes(self) -> int:
        """Bytes that it holds."""

    @property
    def state_bytes(self) -> int:
        """Bytes of one state."""

    def start(self, phase: int, load: float, turns: float, step: float) -> Any:
        """Return the state of a finger that follows the elastic contact at `phase` and `load` (N).

        turns: texture periods a second (signed), for the velocity with which it follows. step: s.
        """

    def resumed(self, state: Any, step: float) -> Any:
        """Return a copy of `state` that goes on in steps of `step` s."""

    def run(self, state: Any, phases: Phases, loads: Array, out: Array) -> None:
        """Go on to each of `phases` and `loads` (N) in turn, and write ROWS rows of `out`, float64 [ROWS, steps]."""
