"""A self-affine random surface over an area: a sum of plane waves, periodic along and across.

Stage   SURFACES.
Model   h(x, y) = sum of A_nm cos(2 pi (n x / period + m y / across) + p_nm) over the whole orders n, m of half a plane.
        With q^2 = (n / period)^2 + (aspect m / across)^2, the waves whose length 1 / q lies between `shortest` and
        `longest` have A_nm^2 proportional to q^-(2 + 2 H), all others 0. A common factor gives exactly the required rms
        height or rms slope along x. The phases are uniform, drawn from PCG64(seed) in order of q. A change of
        `shortest` or `longest` therefore keeps the phase of each wave.
        A sum over a lattice is a product of matrices: of the waves along y, the coefficients, the waves along x.
Source  Persson et al. 2005 (J. Phys.: Condens. Matter 17, R1): C(q) of a surface falls as q^-(2 + 2H), that of its
        profile as q^-(1 + 2H). Rq and rms slope: Parseval.
Limits  The spectrum has no plateau. Bounds come from SAMPLES heights per shortest wave, and from 16 times as many about
        the PEAKS extremes of these. They are up to 2 % too wide. A higher peak between samples would be missed; the
        tests find none.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from synth.surfaces.height_field import Floats, HeightField
from synth.surfaces.profile import Array, Bounds

Waves = np.ndarray[Any, np.dtype[np.complex128]]
Indices = np.ndarray[Any, np.dtype[np.intp]]

MOST_ORDERS = 512  # shortest waves per period, along and across; limits memory (8 MB) and time
SAMPLES = 4  # heights per shortest wave, along and across, among which extremes are looked for
PEAKS = 64  # samples about which the extremes are refined
NEAR = np.linspace(-0.5, 0.5, 9)  # places about a sample, in distances of samples
WIDER = 1.01  # of the bounds: a cosine of the shortest waves falls by (pi / 32)^2 to the nearest of the places, 1 %
ROUNDING = 1e-9  # of an order: tolerates rounding where period / longest is a whole number
PLACES_TOGETHER = 1 << 12  # of a line: with 512 orders, 34 MB of waves


@dataclass(frozen=True, eq=False)
class SelfAffineArea(HeightField):
    """A self-affine surface.

    period, across: in x and in y, m.
    hurst: Hurst exponent, 0 to 1.
    rms_height: m, or None.
    rms_slope: along x, or None; exactly one of the two is given.
    longest, shortest: wavelengths along x, m; across they are `aspect` times as long.
    seed: of the phases.
    aspect: length of the features across, relative to that along; 1 is isotropic.
    phase: rad.
    """

    period: float
    across: float
    hurst: float
    rms_height: float | None
    rms_slope: float | None
    longest: float
    shortest: float
    seed: int = 0
    aspect: float = 1.0
    phase: float = 0.0
    kind = "rough_area"
    random = True

    @property
    def key(self) -> Hashable:
        """Everything that decides the heights."""
        size = self.period, self.across, self.rms_height, self.rms_slope, self.longest, self.shortest
        return self.kind, *size, self.hurst, self.seed, self.aspect, self.phase

    @property
    def _rates(self) -> tuple[Array, Array]:
        """Wave numbers (rad/m) along [n] and across [m]: n from 0 up, m from the lowest to the highest."""
        most = most_orders(self.period, self.across, self.shortest, self.aspect)
        along, across = np.arange(most[0] + 1.0), np.arange(-most[1], most[1] + 1.0)
        return 2.0 * math.pi / self.period * along, 2.0 * math.pi / self.across * across

    @cached_property
    def _waves(self) -> tuple[Indices, Indices, Array]:
        """Row and column of each wave not shorter than `shortest`, in order of q, and its q (1/m)."""
        along, across = self._rates
        q = np.hypot(along, self.aspect * across[:, np.newaxis]) / (2.0 * math.pi)
        half = (along > 0.0) | (across[:, np.newaxis] > 0.0)  # without the mean and the other half of the plane
        rows, columns = np.nonzero(half & (q * self.shortest <= 1.0 + ROUNDING))
        order = np.lexsort([columns, rows, q[rows, columns]])
        return rows[order], columns[order], q[rows, columns][order]

    @property
    def in_band(self) -> bool:
        """Whether a wave that varies along x lies between `shortest` and `longest`."""
        _rows, columns, q = self._waves
        return bool(np.any((columns > 0) & (q * self.longest >= 1.0 - ROUNDING)))

    @cached_property
    def _coefficients(self) -> Waves:
        """A exp(i p) of each wave (m): [m, n]."""
        along, across = self._rates
        rows, columns, q = self._waves
        sizes = np.where(q * self.longest >= 1.0 - ROUNDING, q ** -(1.0 + self.hurst), 0.0)
        unit = sizes if self.rms_height is not None else sizes * along[columns]
        wanted = self.rms_height if self.rms_height is not None else self.rms_slope
        assert wanted is not None
        sizes *= wanted * math.sqrt(2.0) / float(np.linalg.norm(unit))
        phases = np.random.Generator(np.random.PCG64(self.seed)).random(len(q))
        found = np.zeros((len(across), len(along)), complex)
        found[rows, columns] = sizes * np.exp(2j * math.pi * phases)
        return np.asarray(found * np.exp(1j * self.phase * np.arange(len(along))))

    def area(self, x: Array, y: Array) -> Array:
        """Return the heights (m) at every pair of `x` and `y` (m)."""
        along, across = self._rates
        lines = np.exp(1j * np.outer(y, across)) @ self._coefficients
        found = np.empty((len(y), len(x)))
        for first in range(0, len(x), PLACES_TOGETHER):
            some = slice(first, first + PLACES_TOGETHER)
            waves = np.exp(1j * np.outer(along, x[some]))
            found[:, some] = lines.real @ waves.real - lines.imag @ waves.imag
        return found

    def lines(self, x: Array) -> Callable[[Array], Floats]:
        """See `HeightField.lines`; sums are taken in float32, with an error of some 1e-7 of the largest height."""
        along, across = self._rates
        waves = np.exp(1j * np.outer(along, x)).astype(np.complex64)
        halves = np.concatenate([waves.real, -waves.imag])

        def heights(y: Array) -> Floats:
            lines = (np.exp(1j * np.outer(y, across)) @ self._coefficients).astype(np.complex64)
            return np.asarray(np.concatenate([lines.real, lines.imag], axis=1) @ halves)

        return heights

    @cached_property
    def bounds(self) -> Bounds:
        """Bounds of the heights and of the slope along x; that of the curvature follows from it (Bernstein)."""
        along = self._rates[0]
        low, high = self._extremes(self._coefficients)
        slope = max(map(abs, self._extremes(1j * along * self._coefficients)))
        return Bounds(low, high, slope, slope * float(along[-1]))

    @cached_property
    def slope_across(self) -> float:
        """Bound of |dh/dy|."""
        return max(map(abs, self._extremes(1j * self._rates[1][:, np.newaxis] * self._coefficients)))

    @cached_property
    def rms(self) -> tuple[float, float]:
        """Rq (m) and rms slope along x, in closed form."""
        height, slope = np.linalg.norm(self._coefficients), np.linalg.norm(self._coefficients * self._rates[0])
        return float(height) / math.sqrt(2.0), float(slope) / math.sqrt(2.0)

    def _extremes(self, coefficients: Waves) -> tuple[float, float]:
        """Return bounds of the sum with these `coefficients`, lowest and highest."""
        most = len(coefficients) // 2
        rows, columns = fast_length(SAMPLES * (most + 1)), fast_length(SAMPLES * coefficients.shape[1])
        lines = np.zeros((rows, coefficients.shape[1]), complex)
        lines[: most + 1] = coefficients[most:]
        lines[rows - most :] = coefficients[:most]
        lines[:, 1:] *= 0.5  # the inverse for real values adds the other half
        sampled = np.fft.irfft(np.fft.ifft(lines, axis=0, norm="forward"), columns, norm="forward").ravel()
        peaks = min(PEAKS, len(sampled) // 2)
        order = np.argpartition(sampled, [peaks, len(sampled) - peaks])
        low, high = (
            self._about(coefficients, np.divmod(some, columns), (rows, columns))
            for some in (order[:peaks], order[-peaks:])
        )
        return WIDER * float(low.min()), WIDER * float(high.max())

    def _about(self, coefficients: Waves, samples: tuple[Indices, Indices], counts: tuple[int, int]) -> Array:
        """Return the sum at the places NEAR each of some samples.

        samples: row and column of each.
        counts: rows and columns of a period.
        """
        along, across = self._rates
        row, column = (one[:, np.newaxis] + NEAR for one in samples)
        waves = np.exp(1j * along[:, np.newaxis] * (column * (self.period / counts[1]))[:, np.newaxis])
        lines = np.exp(1j * across * (row * (self.across / counts[0]))[..., np.newaxis]) @ coefficients
        return np.asarray((lines @ waves).real)


def most_orders(period: float, across: float, shortest: float, aspect: float) -> tuple[int, int]:
    """Return the highest orders along and across."""
    return math.floor(period / shortest + ROUNDING), math.floor(across / (aspect * shortest) + ROUNDING)


def fast_length(least: int) -> int:
    """Return a length of `least` or a little more whose Fourier transform is fast."""
    return min(odd << math.ceil(math.log2(least / odd)) for odd in (1, 3, 5, 9) if odd <= least)
