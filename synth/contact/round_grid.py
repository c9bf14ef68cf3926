"""The cells of a round finger on a sinusoid: those of the exact solver, and what the parabola takes off each.

Model   d(x) = (x - xc)^2 / (2 R) off h, in every cell a parabola: see `finger_curvature`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.contact.exact_solver import Grid
from synth.contact.geometry import Geometry


@dataclass(frozen=True, slots=True)
class RoundGrid(Grid):
    """The cells of `Grid` with a parabola.

    dome: float64 [3, cells], the coefficients of 1, t and t^2 over a1 + a2: see `finger_curvature`.
    """

    dome: Array

    name = "exact solver, round finger"

    @property
    def pieces(self) -> Any:
        """What the kernels read of it."""
        return self.tables, self.dome

    @property
    def nbytes(self) -> int:
        """Bytes that the grid holds."""
        return int(self.tables.nbytes + self.dome.nbytes)

    @classmethod
    def of_finger(cls, geometry: Geometry, curvature: float) -> RoundGrid:
        """Return the grid of `geometry`, in whose middle a finger of `curvature` 1 / R (1/m) is thickest."""
        flat = Grid.of_geometry(geometry)
        half = 0.5 * geometry.contact_length / flat.cells
        place = (2.0 * np.arange(flat.cells) + 1.0 - flat.cells) * half
        drop = 0.5 * curvature / flat.height_scale
        dome = np.stack([drop * place**2, 2.0 * drop * place * half, np.full(flat.cells, drop * half * half)])
        return cls(flat.tables, flat.k1, flat.k2, flat.texture, flat.height_scale, dome)
