"""A Fourier series over a period, prepared for reading: at audio rate along a steady scan, and at any place.

Stage   RESPONSE.
Model   A period is cut into equal cells, a power of two. In each cell a polynomial of degree 7 replaces the series; it
        has the same value and three derivatives at both ends. The phase theta is a 64-bit fraction of a turn: its high
        bits are the number of the cell, the rest is the place in it.
Source  Hermite interpolation; the derivatives are exact, from the series. Design, sections 1 and 8.
Limits  With CELLS_A_HARMONIC cells per period of the highest harmonic, the error is 1.4e-8 of that harmonic, below the
        rounding of float32; for lower harmonics it falls with the eighth power. The phase is rounded by 2^-65 turn per
        frame at most: 5e-10 turn in 24 h at 192 kHz.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.kernels import signed_kernel
from synth.response.demand import Complex

CELLS_A_HARMONIC = 8  # least number; with half as many the error is 4e-6 of the last harmonic
FEWEST_CELLS = 16
SHARED = 4  # a cell shares the value and 3 derivatives at each end; its 8 coefficients fill a cache line
SMALLEST = 1.2e-38  # the smallest normal float32; smaller values become zero, since denormals are slow
PLACE = 2.0**-53  # one unit of the 53 phase bits below the cell, as a fraction of the cell


class SeriesCurve:
    """The sum of a series at any place of a period.

    harmonics: complex128 [highest + 1], one-sided as in `Spectrum`.
    mean: its harmonic 0.
    cells: coefficients of the other harmonics in powers of the place in a cell, float64 [cells, 8].
    """

    def __init__(self, harmonics: Complex) -> None:
        kept = np.trim_zeros(harmonics[1:], "b")
        self.count = len(kept)
        self.mean = float(harmonics[0].real)
        self.cells = polynomials(kept, max(FEWEST_CELLS, 1 << (CELLS_A_HARMONIC * self.count - 1).bit_length()))

    @property
    def name(self) -> str:
        """Name of the curve in a plan or a report."""
        return f"series of {self.count} harmonic{'' if self.count == 1 else 's'}"

    @property
    def nbytes(self) -> int:
        """Memory in bytes."""
        return int(self.cells.nbytes)

    def read(self, phase: int, step: int, gain: float, out: Any, channel: int) -> None:
        """Write gain times the curve minus its mean to out[:, channel], float32.

        phase, step: frame i has the phase phase + i step, 64-bit fractions of a turn.
        """
        bits = np.uint64(len(self.cells).bit_length() - 1)
        read_cells(self.cells, bits, np.uint64(phase), np.uint64(step), gain, out, channel)

    def heights(self, places: Array, loads: Array) -> Array:
        """Return the curve at each of `places` (turns). `loads` is ignored, since the series belongs to one load."""
        x = (places - np.floor(places)) * len(self.cells)
        cell = np.minimum(x.astype(np.intp), len(self.cells) - 1)
        found, t = np.zeros(len(x)), x - cell
        for power in range(2 * SHARED - 1, -1, -1):
            found = found * t + self.cells[cell, power]
        return self.mean + found


def polynomials(harmonics: Complex, cells: int) -> Array:
    """Return the coefficients [cells, 8] of the sum of `harmonics` 1, 2, ... in powers of the place t in a cell.

    The lower four are the derivatives at t = 0, divided by factorials. The upper four match value and derivatives at
    t = 1.
    """
    powers, orders = np.arange(2 * SHARED), np.arange(SHARED)
    points = max(cells, 2 << len(harmonics).bit_length())
    spectra = np.zeros((SHARED, points // 2 + 1), np.complex128)
    turns = 2j * np.pi / cells * np.arange(1, len(harmonics) + 1)
    spectra[:, 1 : len(harmonics) + 1] = harmonics * turns ** orders[:, np.newaxis]
    begin = (np.fft.irfft(spectra, points) * points)[:, :: points // cells]
    table = np.empty((2 * SHARED, cells))
    table[:SHARED] = begin / np.array([[math.factorial(order)] for order in orders])
    at_end = np.array([[math.perm(power, order) for power in powers] for order in orders], dtype=float)
    left = np.roll(begin, -1, axis=1) - at_end[:, :SHARED] @ table[:SHARED]
    table[SHARED:] = np.linalg.solve(at_end[:, SHARED:], left)
    return np.ascontiguousarray(table.T)


@signed_kernel("void(f8[:,::1], u8, u8, u8, f8, f4[:,::1], i8)")
def read_cells(cells, bits, phase, step, gain, out, channel):
    """Write gain times the polynomials of `cells` [2^bits, 8] at the phases phase + i step to out[:, channel]."""
    shift = np.uint64(64) - bits
    for i in range(out.shape[0]):
        j = np.int64(phase >> shift)
        t = np.float64(np.int64((phase << bits) >> np.uint64(11))) * PLACE
        value = cells[j, 7]
        for power in range(6, -1, -1):
            value = value * t + cells[j, power]
        value *= gain
        out[i, channel] = value if abs(value) >= SMALLEST else 0.0
        phase += step
