"""What is asked of a series, and the curves of its harmonics.

Stage   RESPONSE, used by all of it and by the plan.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from synth.arrays import Array

Complex = np.ndarray[Any, np.dtype[np.complex128]]
STILL_PHASES = 1024  # least number that decides whether a finger is still
GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)  # the golden ratio less one: its multiples fall between all grids
SLOWER = math.sqrt(2.0)  # factor between the speeds at which the error of a slower scan is judged


@dataclass(frozen=True, slots=True)
class Demand:
    """The requirements on a series.

    highest: highest harmonic in the band at the scan's own speed, at least 1.
    orders: time derivatives (0 displacement, 1 velocity, 2 acceleration).
    tolerance: largest error of each, relative to its own peak-to-peak at the own speed.
    still: if the peak of all harmonics of z is below this (m), the finger counts as still and the series is not
        refined.
    slower: highest harmonic that counts where the scan is slower; 0: `highest`.
    """

    highest: int
    orders: tuple[int, ...]
    tolerance: float
    still: float = 0.0
    slower: int = 0

    @property
    def total(self) -> int:
        """Number of harmonics that count at any speed."""
        return max(self.highest, self.slower)

    @property
    def bands(self) -> list[tuple[int, float]]:
        """The number of harmonics in the band, and the speed over the own, at the own speed and at slower ones.

        A k-th time derivative falls with the k-th power of the speed.
        """
        counts = [self.highest]
        while counts[-1] < self.total:
            counts.append(min(math.ceil(SLOWER * counts[-1]), self.total))
        return [(count, self.highest / count) for count in counts]

    def largest(self, series: Complex, order: int) -> float:
        """Return the largest value of derivative `order` of `series` at any speed, at the scale of the own speed."""
        return max(
            speed**order * float(np.max(np.abs(curves(series[: count + 1], order, points_for(count)))))
            for count, speed in self.bands
        )

    def is_still(self, height: Array) -> bool:
        """Return whether z at equal steps of a period (m), enough of them to judge, moves by less than `still`."""
        enough = len(height) >= max(STILL_PHASES, 4 * self.total)
        return self.still > 0.0 and enough and self.of_still(harmonics_of(height, self.total))

    def of_still(self, harmonics: Complex) -> bool:
        """Return whether the harmonics of the demand, of z (m), have a peak below `still`."""
        moved = curves(harmonics[: self.total + 1], 0, points_for(self.total))
        return float(np.max(np.abs(moved))) < self.still


def curves(harmonics: Complex, order: int, points: int) -> Array:
    """Return the `order`-th derivative over theta (in turns), without the mean, at `points` equal steps of a period."""
    count = len(harmonics)
    series = np.zeros(points // 2 + 1, dtype=np.complex128)
    n = np.arange(1, count)
    series[1:count] = harmonics[1:] * (2j * math.pi * n) ** order
    return np.fft.irfft(series, points) * points


def points_for(highest: int) -> int:
    """Return the number of points that resolve `highest` harmonics: a power of two, at least 4 per harmonic."""
    return max(64, 1 << (4 * highest).bit_length())


def harmonics_of(samples: Array, highest: int) -> Complex:
    """Return harmonics 0 to `highest` of one period of samples; those above the Nyquist harmonic are zero.

    The Nyquist harmonic is halved, since it is the sum of its two sides. It is kept, so that a strong harmonic there is
    not missed.
    """
    found = np.fft.rfft(samples) / len(samples)
    found[-1] *= 0.5
    series = np.zeros(highest + 1, dtype=np.complex128)
    kept = min(highest + 1, len(found))
    series[:kept] = found[:kept]
    return series
