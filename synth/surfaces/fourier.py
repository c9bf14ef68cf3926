"""Sums of cosines of one period, the basis of the kinds `harmonics` and `rough`.

Stage   SURFACES.
Model   h(x) = sum over n of A_n cos(2 pi n x / period + p_n), n = 1 ... N.
        With up to DIRECT orders the sum is computed at every place. With more, an FFT makes a table of 16 heights per
        shortest wave. A height is interpolated from the 8 nearest entries of the table by their polynomial.
Source  Rq and rms slope: Parseval. Bounds: a trigonometric polynomial of order N is sampled at M equal places. It
        exceeds its largest sample by at most the factor 1 / cos(pi N / M) (Ehlich & Zeller 1964).
Limits  The table's error is at most 6e-7 of the shortest waves' amplitude. The bounds are up to 1 % too wide.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from synth.surfaces.profile import Array, Bounds, Profile, turns_of

DIRECT = 64  # orders; longer sums cost more than reading a table, and shorter ones need no table
TABLE = 16  # heights per shortest wave; from 8 points the error is (2 pi / TABLE)^8 / 936; half as many: 2^8 times that
FINE = 32  # places per shortest wave at which the bounds are measured; with 10 the bounds are 5 % too wide
LEAST_FINE = 4096  # smallest number of such places per period; the bounds of one cosine are then 3e-7 too wide
NODES = np.arange(-3, 5)  # the interpolated table entries, relative to the entry before the place


@dataclass(frozen=True, eq=False)
class FourierProfile(Profile):
    """A sum of cosines.

    period: m.
    shift: `phase` of the scene, rad.
    """

    period: float
    shift: float

    @property
    @abstractmethod
    def orders(self) -> tuple[Array, Array]:
        """Amplitudes (m) and phases (rad) of orders 1 to N."""

    @cached_property
    def _coefficients(self) -> np.ndarray:
        amplitudes, phases = self.orders
        return np.asarray(amplitudes * np.exp(1j * phases))

    def _sampled(self, points: int, derivative: int = 0) -> Array:
        """Return a derivative by the angle (m per rad^derivative), at `points` equal places of a period."""
        lines = np.zeros(points // 2 + 1, complex)
        numbers = np.arange(1, len(self._coefficients) + 1)
        lines[1 : len(self._coefficients) + 1] = self._coefficients * (1j * numbers) ** derivative * (0.5 * points)
        return np.asarray(np.fft.irfft(lines, points))

    @cached_property
    def _table(self) -> Array:
        points = TABLE * 2 ** math.ceil(math.log2(len(self._coefficients)))
        return self._sampled(points)

    def heights(self, places: Array) -> Array:
        """Return the heights (m) at `places` (m)."""
        turns = turns_of(places, self.period, self.shift)
        if len(self._coefficients) > DIRECT:
            return self._read(turns)
        wave = np.exp(2j * math.pi * turns)
        total = np.zeros(turns.shape, complex)
        for coefficient in self._coefficients[::-1]:
            total = (total + coefficient) * wave
        return np.asarray(total.real)

    def _read(self, turns: Array) -> Array:
        at = turns * len(self._table)
        before = np.floor(at).astype(np.int64)
        beyond = at - before
        total = np.zeros(turns.shape)
        for node in NODES:
            others = NODES[node != NODES]
            weight = np.prod([(beyond - other) / (node - other) for other in others], axis=0)
            total += weight * self._table[(before + node) % len(self._table)]
        return total

    @cached_property
    def bounds(self) -> Bounds:
        """Bounds from heights and derivatives at many places."""
        points = max(FINE * 2 ** math.ceil(math.log2(len(self._coefficients))), LEAST_FINE)
        wider = 1.0 / math.cos(math.pi * len(self._coefficients) / points)
        heights, slopes, bends = (self._sampled(points, derivative) for derivative in (0, 1, 2))
        slope, bend = (float(np.max(np.abs(values))) * wider for values in (slopes, bends))
        above = bend * (2.0 * math.pi / points) ** 2 / 8.0
        rate = 2.0 * math.pi / self.period
        return Bounds(float(heights.min()) - above, float(heights.max()) + above, slope * rate, bend * rate**2)

    @property
    def rms(self) -> tuple[float, float]:
        """Rq (m) and rms slope, in closed form."""
        amplitudes, _ = self.orders
        numbers = 2.0 * math.pi / self.period * np.arange(1, len(amplitudes) + 1)
        height, slope = np.linalg.norm(amplitudes), np.linalg.norm(numbers * amplitudes)
        return float(height) / math.sqrt(2.0), float(slope) / math.sqrt(2.0)
