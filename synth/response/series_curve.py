"""A series over a period as a curve that is read at any place: polynomials of fifth degree in equal cells.

Stage   RESPONSE.
Model   In each cell the polynomial shares value, slope and curvature with the series at both ends (`phase_cells`).
Limits  with CELLS_A_HARMONIC cells the last harmonic errs by 2e-6 of itself, those below it by the sixth power less.
"""

from __future__ import annotations

import numpy as np

from synth.arrays import Array
from synth.response.phase_cells import QUINTIC, polynomials
from synth.response.spectrum import Complex

CELLS_A_HARMONIC = 8


class SeriesCurve:
    """The sum of a series, its mean included, at any place. harmonics: complex128 [highest + 1], as of `Spectrum`."""

    def __init__(self, harmonics: Complex) -> None:
        cells = 1 << (CELLS_A_HARMONIC * len(harmonics) - 1).bit_length()
        self._mean, self._cells = float(harmonics[0].real), polynomials(harmonics, QUINTIC, cells)

    @property
    def nbytes(self) -> int:
        """Bytes that it holds."""
        return int(self._cells.nbytes)

    def heights(self, places: Array, loads: Array) -> Array:
        """Return the value at each of `places` (turns); the loads are those of the series."""
        x = (places - np.floor(places)) * len(self._cells)
        cell = np.minimum(x.astype(np.intp), len(self._cells) - 1)
        found, t = np.zeros(len(x)), x - cell
        for degree in range(QUINTIC, -1, -1):
            found = found * t + self._cells[cell, degree]
        return self._mean + found
