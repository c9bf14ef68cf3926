"""Solvers of eq. 1: what each offers, and which one a contact is laid out with.

Model   Two cosines over one length have elementary antiderivatives and are solved to round-off (`exact_solver`). Any
        other profile, and any finger that is round or grows, becomes a polyline of `Geometry.segments` segments a
        period (`profile_solver`), which can be refined. A contact whose shape depends on the load has a solver for each
        load; those that were asked for last are kept.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Protocol

from synth.arrays import Array
from synth.contact.exact_solver import Approaches, Grid
from synth.contact.geometry import Geometry
from synth.contact.profile_solver import SegmentGrid

FINEST = 1 << 17  # segments of a period and of a contact; more take seconds to lay out and change z by 1e-8 of a1 + a2
MOST_KEPT = 4  # some 12 MB each at their finest; rows of load are solved one at a time


class PhaseSolver(Protocol):
    """One contact, ready to be solved at any phase."""

    @property
    def name(self) -> str:
        """What a report or a plan calls it."""

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

    def measure(self, phases: Array, heights: Array) -> tuple[Array, Array]:
        """Return the mean of max(h - z, 0) (m) over its length and the touching part of it, at each phase and z (m)."""


@lru_cache(maxsize=MOST_KEPT)
def solver_of(geometry: Geometry, dome: float = 0.0) -> PhaseSolver:
    """Return the solver of `geometry`, laid out; dome: 1 / R (1/m) of a round finger, whose texture is a profile."""
    return Grid.of_geometry(geometry) if geometry.profile is None else SegmentGrid.of_geometry(geometry, dome)


def refined(geometry: Geometry, solver: PhaseSolver) -> Geometry | None:
    """Return `geometry` in segments of half the length; None where `solver`, that of `geometry`, is exact.

    None too where the segments, halved once at least, are FINEST a period, or over the contact, or more.
    """
    if not isinstance(solver, SegmentGrid):
        return None
    periods = max(1.0, geometry.contact_length / geometry.texture_period)
    if geometry.segments is not None and periods * solver.segments >= FINEST:
        return None
    return replace(geometry, segments=2 * solver.segments)
