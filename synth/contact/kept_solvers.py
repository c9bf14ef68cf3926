"""Solvers of a contact whose shape depends on the load: laid out when a load asks for them, and a few are kept.

Model   what was not asked for the longest goes first. A solver is laid out outside the lock, so that a thread that has
        its own is never held up by another that lays one out; two threads that ask for the same may both lay it out.
Limits  at least one is kept, however large.
"""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable

from synth.contact.geometry import Geometry
from synth.contact.phase_solver import PhaseSolver

MOST_KEPT = 8  # rows of load are solved one at a time; with fewer, threads at different loads would lay out anew
MOST_BYTES = 64 << 20  # of all that are kept; a solver of the default scene holds 16 kB


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
        self._lock = threading.Lock()

    @property
    def nbytes(self) -> int:
        """Bytes that they hold."""
        with self._lock:
            return self._used()

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
            while len(self._solvers) > 1 and (len(self._solvers) > MOST_KEPT or self._used() > MOST_BYTES):
                self._solvers.popitem(last=False)
        return solver

    def _used(self) -> int:
        return sum(solver.nbytes for solver in self._solvers.values())
