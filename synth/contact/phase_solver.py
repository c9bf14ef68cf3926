"""What every solver of eq. 1 offers, so that each can stand for another: the approach at given phases and loads.

The implementations are `exact` (to round-off), `sampled` (a polygon, where the tolerance is loose) and `baseline` (the
obvious way, for comparison).
"""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from synth.arrays import Array
from synth.contact.exact import Approaches


class PhaseSolver(Protocol):
    """One contact, ready to be solved at any phase."""

    @property
    def name(self) -> str:
        """What a report or a plan calls it."""

    @property
    def family(self) -> str:
        """Return baseline, sampled or exact."""

    @property
    def cells(self) -> int:
        """Pieces of the contact length: the work of a phase."""

    @property
    def nbytes(self) -> int:
        """Bytes that it holds."""

    def solve(self, phases: Array, indentation: float | Array, guess: Array | None = None) -> Approaches:
        """Return the approach at each of `phases` (turns of the texture period).

        indentation: w / k in metres, at least 0; one for all phases, or one a phase. guess: z in metres at each phase,
        for those who can begin from it.
        """


@runtime_checkable
class MeasuringSolver(PhaseSolver, Protocol):
    """A solver that also tells how a contact is pressed at a z that need not balance any load."""

    def measure(self, phases: Array, heights: Array) -> tuple[Array, Array]:
        """Return the mean of max(h - z, 0) (m) over its length and the touching part of it, at each phase and z (m)."""
