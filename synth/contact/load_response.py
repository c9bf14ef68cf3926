"""What may be read as a response over phase and load: the approach z of a contact, or a force that it makes.

Model   a response is a periodic function of the phase at each load; `spectrum` takes its series, tables interpolate
        them over the load. The implementations are `balance.Contact` (m) and the forces of `forces` (N).
"""

from __future__ import annotations

from collections.abc import Hashable
from typing import Protocol

from synth.arrays import Array
from synth.contact.full_contact import FullContact
from synth.contact.geometry import Geometry
from synth.contact.phase_solver import PhaseSolver


class Response(Protocol):
    """A quantity of one contact, ready to be taken at any phase and load."""

    @property
    def key(self) -> Hashable:
        """What it depends on, for a cache."""

    @property
    def of_one_shape(self) -> bool:
        """True where solver and shape are those of every load, so that another solver may take their place."""

    def work_at(self, load: float) -> int:
        """Return the work of a phase at `load` (N), in cells of the exact solver."""

    @property
    def nbytes(self) -> int:
        """Bytes that it holds."""

    @property
    def nothing_at_no_load(self) -> bool:
        """True where it is exactly zero at no load."""

    def scale_at(self, load: float) -> float:
        """Return what an error of round-off is relative to at `load` (N), in the unit of the response."""

    def closed(self, load: float) -> FullContact | None:
        """Return it in closed form where that is exact at `load` (N), else None."""

    def solver(self, load: float) -> PhaseSolver:
        """Return what solves it at `load` (N)."""

    def refined(self) -> Response | None:
        """Return it on a finer discretisation, which tells the error of this one; None where its solver has none."""

    def approach(self, phases: Array, load: float, guess: Array | None = None) -> tuple[Array, Array]:
        """Return the value and its derivative over the load (1/N) at each of `phases` (turns) and `load` (N).

        guess: the value at each phase, for those who can begin from it.
        """


class PressedContact(Response, Protocol):
    """A contact whose z at each load is that of a pressure (k / L) max(h - z, 0) on given surfaces."""

    def refined(self) -> PressedContact | None:
        """See `Response`."""

    @property
    def dome(self) -> float:
        """1 / R (1/m) of a parabola about the middle of the length that is taken off h; 0: the finger is flat."""

    def geometry_at(self, load: float) -> Geometry:
        """Return the surfaces over the length that presses at `load` (N)."""

    def stiffness_at(self, load: float) -> float:
        """Return k (N/m) at `load` (N): the force for a metre of the mean of max(h - z, 0)."""
