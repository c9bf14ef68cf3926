"""Reading the response at constant speed and load: a table or a sum of harmonics, at phases that rise by equal steps.

Model   The phase theta is a 64-bit fraction of a turn; its high bits name the cell of a table, the rest the place in
        it. A sum of harmonics is Horner's rule in w = exp(2 pi i theta): Re (a_1 w + ... + a_H w^H), whose sine and
        cosine are Taylor polynomials of an eighth of a turn at most.
Source  design, sections 1 and 8.
Limits  64-bit phase: one rounding of 2^-65 turn a frame at most, 5e-10 turn in 24 h at 192 kHz. The sum of harmonics is
        exact to 2e-16 of the sum of the amplitudes, times the number of harmonics.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from synth.arrays import Array
from synth.kernels import inlined, signed_kernel
from synth.response.evaluation import PLACE, SMALLEST
from synth.response.spectrum import Complex

RADIANS = 2.0 * np.pi / 2.0**64  # of one step of the phase
LANES = 64  # frames that the sum of harmonics takes together: long enough for vectors, short enough for the cache


class SteadyReader(Protocol):
    """Writes one channel of a steady scan."""

    @property
    def name(self) -> str:
        """What a plan or a report calls it."""

    @property
    def nbytes(self) -> int:
        """Bytes that it holds."""

    def read(self, phase: int, step: int, gain: float, out: Any, channel: int) -> None:
        """Write gain * value at the phases phase + i step (64-bit fractions of a turn) to out[:, channel], float32."""


@dataclass(frozen=True, slots=True)
class SteadyTable:
    """Polynomials over the phase: coefficients float64 [cells, degree + 1], cells a power of two, degree 1 or 3."""

    coefficients: Array

    @property
    def name(self) -> str:
        """What a plan or a report calls it."""
        cells, width = self.coefficients.shape
        return f"{'cubic' if width == 4 else 'linear'} table of {cells} cells"

    @property
    def nbytes(self) -> int:
        """Bytes that it holds."""
        return int(self.coefficients.nbytes)

    def read(self, phase: int, step: int, gain: float, out: Any, channel: int) -> None:
        """See `SteadyReader`."""
        read = read_cubic if self.coefficients.shape[1] == 4 else read_linear
        read(self.coefficients, np.uint64(phase), np.uint64(step), gain, out, channel)


@dataclass(frozen=True, slots=True)
class SteadyHarmonics:
    """A sum of harmonics: series complex128 [highest + 1], one-sided, its mean left out."""

    series: Complex

    @property
    def name(self) -> str:
        """What a plan or a report calls it."""
        count = len(self.series) - 1
        return f"sum of {count} harmonic{'s' if count > 1 else ''}"

    @property
    def nbytes(self) -> int:
        """Bytes that it holds."""
        return int(self.series.nbytes)

    def read(self, phase: int, step: int, gain: float, out: Any, channel: int) -> None:
        """See `SteadyReader`."""
        read_harmonics(self.series, np.uint64(phase), np.uint64(step), gain, out, channel)


@inlined
def bits_of(cells):
    """Return log2 of `cells`, a power of two."""
    bits = np.uint64(0)
    while (1 << np.int64(bits)) < cells:
        bits += np.uint64(1)
    return bits


@signed_kernel("void(f8[:,::1], u8, u8, f8, f4[:,::1], i8)")
def read_cubic(table, phase, step, gain, out, channel):
    """Write gain * table at the phases phase + i step (uint64 fractions of a turn) to out[:, channel].

    table: float64 [cells, 4].
    """
    bits = bits_of(table.shape[0])
    shift = np.uint64(64) - bits
    for i in range(out.shape[0]):
        j = np.int64(phase >> shift)
        t = np.float64(np.int64((phase << bits) >> np.uint64(11))) * PLACE
        value = gain * (table[j, 0] + t * (table[j, 1] + t * (table[j, 2] + t * table[j, 3])))
        out[i, channel] = value if abs(value) >= SMALLEST else 0.0
        phase += step


@signed_kernel("void(f8[:,::1], u8, u8, f8, f4[:,::1], i8)")
def read_linear(table, phase, step, gain, out, channel):
    """Write what `read_cubic` does from a table of straight lines, float64 [cells, 2]."""
    bits = bits_of(table.shape[0])
    shift = np.uint64(64) - bits
    for i in range(out.shape[0]):
        j = np.int64(phase >> shift)
        t = np.float64(np.int64((phase << bits) >> np.uint64(11))) * PLACE
        value = gain * (table[j, 0] + t * table[j, 1])
        out[i, channel] = value if abs(value) >= SMALLEST else 0.0
        phase += step


@inlined
def cosine_and_sine(phase):
    """Return cosine and sine of a uint64 fraction of a turn."""
    quarter = (phase + np.uint64(1 << 61)) >> np.uint64(62)
    x = np.float64(np.int64(phase - (quarter << np.uint64(62)))) * RADIANS
    q = x * x
    s = -1.0 / 39916800.0 + q * (1.0 / 6227020800.0 - q / 1307674368000.0)
    s = x * (1.0 + q * (-1.0 / 6.0 + q * (1.0 / 120.0 + q * (-1.0 / 5040.0 + q * (1.0 / 362880.0 + q * s)))))
    c = -1.0 / 3628800.0 + q * (1.0 / 479001600.0 - q * (1.0 / 87178291200.0 - q / 20922789888000.0))
    c = 1.0 + q * (-0.5 + q * (1.0 / 24.0 + q * (-1.0 / 720.0 + q * (1.0 / 40320.0 + q * c))))
    odd = (quarter & np.uint64(1)) != np.uint64(0)
    cosine = s if odd else c
    sine = c if odd else s
    behind = ((quarter + np.uint64(1)) & np.uint64(2)) != np.uint64(0)
    below = (quarter & np.uint64(2)) != np.uint64(0)
    return -cosine if behind else cosine, -sine if below else sine


@signed_kernel("void(c16[::1], u8, u8, f8, f4[:,::1], i8)")
def read_harmonics(series, phase, step, gain, out, channel):
    """Write gain * the sum of `series` (complex128 [highest + 1]) as `read_cubic` does its table."""
    highest = len(series) - 1
    cosines, sines = np.empty(LANES), np.empty(LANES)
    real, imaginary = np.empty(LANES), np.empty(LANES)
    for begin in range(0, out.shape[0], LANES):
        for i in range(LANES):
            cosines[i], sines[i] = cosine_and_sine(phase + np.uint64(i) * step)
            real[i], imaginary[i] = 2.0 * gain * series[highest].real, 2.0 * gain * series[highest].imag
        for n in range(highest - 1, 0, -1):
            a, b = 2.0 * gain * series[n].real, 2.0 * gain * series[n].imag
            for i in range(LANES):
                turned = real[i] * cosines[i] - imaginary[i] * sines[i] + a
                imaginary[i] = real[i] * sines[i] + imaginary[i] * cosines[i] + b
                real[i] = turned
        for i in range(min(LANES, out.shape[0] - begin)):
            value = real[i] * cosines[i] - imaginary[i] * sines[i]
            out[begin + i, channel] = value if abs(value) >= SMALLEST else 0.0
        phase += np.uint64(LANES) * step
