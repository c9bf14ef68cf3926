"""Which solver a contact is laid out with: the one place that asks what the texture is.

Model   two cosines have elementary antiderivatives and are solved to round-off (`exact`); any other profile becomes a
        polyline of `Geometry.segments` segments a period (`segments`), which can be refined.
"""

from __future__ import annotations

from dataclasses import replace

from synth.arrays import Array
from synth.contact.exact import Grid
from synth.contact.geometry import Geometry
from synth.contact.lengths import heights_over
from synth.contact.phase_solver import PhaseSolver
from synth.contact.pressure import PressureField
from synth.contact.round_grid import RoundGrid
from synth.contact.segment_lengths import segment_heights_over
from synth.contact.segment_pressure import SegmentField
from synth.contact.segments import SegmentGrid


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
    """Return `geometry` in segments of half the length; None where `solver`, that of `geometry`, is exact."""
    return replace(geometry, segments=2 * solver.segments) if isinstance(solver, SegmentGrid) else None
