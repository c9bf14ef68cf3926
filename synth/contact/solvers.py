"""Solvers of eq. 1: what each offers, which one a contact is laid out with, and those that are kept.

Model   Two cosines have elementary antiderivatives and are solved to round-off (`exact_solver`, `round_grid`). Any
        other profile becomes a polyline of `Geometry.segments` segments a period (`profile_solver`), which can be
        refined. This is the one place that asks what the texture is. A contact whose shape depends on the load has a
        solver for each load, laid out when it is asked for. What was not asked for the longest goes first. Solvers are
        laid out outside the lock: threads do not wait, and two that ask for the same may both lay it out.
Limits  at least one is kept, however large.
"""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import replace
from typing import Protocol

from synth.arrays import Array
from synth.contact.exact_lengths import heights_over
from synth.contact.exact_solver import Approaches, Grid
from synth.contact.geometry import Geometry
from synth.contact.pressure import PressureField
from synth.contact.profile_lengths import segment_heights_over
from synth.contact.profile_pressure import SegmentField
from synth.contact.profile_solver import SegmentGrid
from synth.contact.round_grid import RoundGrid

FINEST = (
    1 << 17
)  # segments of a period and of the contact; more take seconds to lay out, and change z by 1e-8 of a1 + a2
MOST_KEPT = 8  # rows of load are solved one at a time; with fewer, threads at different loads would lay out anew
MOST_BYTES = 64 << 20  # of all that are kept; a solver of the default scene holds 16 kB


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


def solver_of(geometry: Geometry, dome: float = 0.0) -> PhaseSolver:
    """Return the solver of `geometry` with a dome of 1 / R (1/m), laid out."""
    if geometry.profile is not None:
        return SegmentGrid.of_geometry(geometry, dome)
    return RoundGrid.of_finger(geometry, dome) if dome else Grid.of_geometry(geometry)


def heights_of_lengths(geometry: Geometry, phases: Array, lengths: Array, indentations: Array) -> Array:
    """Return z (m) at each of `phases` (turns), with lengths (m) about the middle of `geometry`, and w / k (m)."""
    over = heights_over if geometry.profile is None else segment_heights_over
    return over(geometry, phases, lengths, indentations)


def field_of(geometry: Geometry, dome: float = 0.0) -> PressureField | SegmentField:
    """Return the pressure field of `geometry` with a dome of 1 / R (1/m), as its solver sees it."""
    field = PressureField if geometry.profile is None else SegmentField
    return field.of_geometry(geometry, dome)


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


class ManyShapes:
    """What contacts share whose shape depends on the load. grid: the solver at one load; _kept: those of the others."""

    __slots__ = ()

    grid: PhaseSolver
    _kept: KeptSolvers

    @property
    def of_one_shape(self) -> bool:
        """False: each load has its own solver."""
        return False

    @property
    def nbytes(self) -> int:
        """Bytes that the contact holds now."""
        return self.grid.nbytes + self._kept.nbytes


class KeptSolvers:
    """The solvers of the shapes that were asked for last, by their geometry; thread-safe."""

    def __init__(self) -> None:
        self._solvers: OrderedDict[Geometry, PhaseSolver] = OrderedDict()
        self._lock = threading.RLock()

    @property
    def nbytes(self) -> int:
        """Bytes that they hold."""
        with self._lock:
            return sum(solver.nbytes for solver in self._solvers.values())

    def get(self, geometry: Geometry, lay_out: Callable[[Geometry], PhaseSolver]) -> PhaseSolver:
        """Return the solver of `geometry`, laying it out where it is not kept."""
        with self._lock:
            solver = self._solvers.get(geometry)
            if solver is not None:
                self._solvers.move_to_end(geometry)
                return solver
        solver = lay_out(geometry)
        with self._lock:
            self._solvers[geometry] = solver
            while len(self._solvers) > 1 and (len(self._solvers) > MOST_KEPT or self.nbytes > MOST_BYTES):
                self._solvers.popitem(last=False)
        return solver
