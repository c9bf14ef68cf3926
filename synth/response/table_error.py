"""The error of a table at every covered load, for each quantity and number of harmonics.

Stage   RESPONSE: measured while a table is made.
Model   The error of a quantity is the largest difference over a period of steady scanning. It is relative to the
        quantity's peak-to-peak at that load or at 0.3 N, whichever is larger, both cut at the same harmonic. The
        estimate is the sum of four parts. Interpolation over the load: the error of the cubic in the middle of the
        interval twice as wide (before it was halved), or in that of a neighbour. Folding: a share of the change when
        half the places are left out. Images of the splines over place. Discretisation: the change by the last
        refinement. Harmonics above the fullest level are absent: `beyond` is the sum of those in the next octave, and
        higher ones fall as n^-2.5.
Source  design, sections 1 and 8.
Limits  The bound is empirical: tests/synth/response/test_table_error.py measures how often it is exceeded.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.response.demand import Complex
from synth.response.mip_levels import MipLevels
from synth.response.place_spline import TAPS

QUANTITIES = ("displacement", "velocity", "acceleration")
USUAL_LOAD = 0.3  # N: the error of a smaller motion is relative to that at this load, since it cannot be felt
FALL = 2.5  # harmonics of a kink of order 3/2 fall as n^-2.5
FOLDED = 1.5  # safety factor on the share of such harmonics that folds
LEAST = 1e-4  # smallest estimate: the largest error seen where a kink begins between two measurements
LINE = 0.65  # largest amplitude of a harmonic relative to the peak-to-peak (0.64 for a square wave)
FLOOR = 1e-12  # round-off of z, relative to a1 + a2


@dataclass(frozen=True, slots=True)
class TableError:
    """Error bounds of a table.

    loads: ends of the intervals of load (N) [rows].
    harmonics: rising numbers of harmonics for which errors are known.
    largest: relative error [quantity, harmonics, interval], quantities in the order of QUANTITIES.
    beyond: relative sum of the harmonics in the octave above the highest [quantity, interval].
    """

    loads: Array
    harmonics: tuple[int, ...]
    largest: np.ndarray[Any, np.dtype[np.float32]]
    beyond: np.ndarray[Any, np.dtype[np.float32]]

    def at(self, load: float, quantity: str, harmonics: int) -> float:
        """Return the largest relative error of `quantity` at `load` (N) with `harmonics` harmonics in the band.

        A load beyond the last row has the error of the last interval. Raises ValueError unless the quantity is one of
        QUANTITIES.
        """
        order = QUANTITIES.index(quantity)
        interval = int(np.clip(np.searchsorted(self.loads, load, side="right") - 1, 0, len(self.loads) - 2))
        count = min(int(np.searchsorted(self.harmonics, harmonics)), len(self.harmonics) - 1)
        below = max(0, int(np.searchsorted(self.harmonics, harmonics, side="right")) - 1)
        reported = float(max(self.largest[order, count, interval], self.largest[order, min(below, count), interval]))
        octaves = math.ceil(math.log2(max(harmonics / self.harmonics[-1], 1.0)))
        left_out = sum(2.0 ** (k * (order + 1.0 - FALL)) for k in range(octaves))
        return float(reported + left_out * float(self.beyond[order, interval]))

    def over(self, loads: tuple[float, float], quantity: str, harmonics: int) -> float:
        """Return the largest error of `quantity` between two `loads` (N). Other arguments as in `at`."""
        low, high = loads
        inside = [float(load) for load in self.loads if low < load < high]
        return max(self.at(load, quantity, harmonics) for load in (low, *inside, high))

    def largest_reported(self, quantity: str, harmonics: int = 32, lightest: float = 0.02) -> float:
        """Return the largest error of `quantity` with `harmonics` harmonics, over all loads from `lightest` (N) on."""
        loads = self.loads[:-1]
        return max(self.at(float(load), quantity, harmonics) for load in loads[loads >= min(lightest, loads[-1])])


def harmonic_counts(highest: int) -> tuple[int, ...]:
    """Return the numbers of harmonics for which errors are kept: `highest` and the octaves below it, rising."""
    counts = [highest]
    while counts[-1] > 1:
        counts.append(counts[-1] // 2)
    return tuple(counts[::-1])


def swings(series: Complex, counts: tuple[int, ...], peak_to_peak: bool) -> Array:
    """Return the largest value, or the peak-to-peak, of each derivative over place of `series` [rows, harmonics + 1].

    The result is [3, counts, rows]: value, first and second derivative over turns, cut at each of `counts` harmonics.
    """
    found = np.empty((3, len(counts), len(series)))
    for j, count in enumerate(counts):
        points = max(16, 1 << (3 * count - 1).bit_length())
        n = 2j * math.pi * np.arange(1, count + 1)
        for order in range(3):
            spectrum = np.zeros((len(series), points // 2 + 1), dtype=np.complex128)
            spectrum[:, 1 : count + 1] = series[:, 1 : count + 1] * n**order
            curve = np.fft.irfft(spectrum, points, axis=1) * points
            high, low = curve.max(axis=1), curve.min(axis=1)
            found[order, j] = high - low if peak_to_peak else np.maximum(high, -low)
    return found


def relative(errors: Array, extents: Array, counts: tuple[int, ...], scale: float) -> Array:
    """Return `errors` / `extents` (both as from `swings`), 0 where an error is round-off. scale: a1 + a2 (m)."""
    n = (2.0 * math.pi * np.array(counts)) ** np.arange(3)[:, np.newaxis]
    floor = FLOOR * scale * n[:, :, np.newaxis]
    return np.where(errors <= floor, 0.0, errors / np.maximum(extents, floor))


def folded_swings(change: Complex, counts: tuple[int, ...], phases: int) -> Array:
    """Return the error by folding at `phases` phases, as from `swings`.

    change: of each harmonic when every second phase is left out [rows, harmonics + 1]. Harmonic `phases` / 2 - n then
        folds to harmonic n. With all phases, harmonic `phases` - n folds to n. In a smooth series it is smaller, since
        harmonics fall with the power FALL. Strong lines of other series may fold to any harmonic, so the largest errors
        are assigned to the highest harmonics.
    """
    n = np.arange(1, change.shape[1])
    left = change[:, 1:] * (FOLDED * (np.maximum(phases / 2 - n, 0.0) / (phases - n)) ** FALL)
    left = np.take_along_axis(left, np.argsort(np.abs(left), axis=1), axis=1)
    worst = [np.pad(left[:, len(n) - count :], [(0, 0), (1, 0)]) for count in counts]
    return np.concatenate([swings(one, (count,), False) for one, count in zip(worst, counts, strict=True)], axis=1)


def images(levels: MipLevels, counts: tuple[int, ...]) -> Array:
    """Return the error of each quantity by images of the splines, for the levels below each count [3, counts]."""
    found = np.zeros((3, len(counts)))
    for n, places in zip(levels.highest, levels.places, strict=True):
        at = int(np.searchsorted(counts, n))
        ratio = n / (places - n)
        found[:, at] = np.maximum(found[:, at], [LINE * ratio ** (TAPS - order) for order in range(3)])
    return found


def octave_beyond(series: Complex, extents: Array) -> Array:
    """Return the sum of the harmonics in the upper half of `series` [rows, 2 highest + 1] for each quantity [3, rows].

    extents: peak-to-peak of each quantity, to which the sum is relative [3, rows].
    """
    highest = series.shape[1] // 2
    n = 2.0 * math.pi * np.arange(highest + 1, series.shape[1])
    sizes = np.abs(series[:, highest + 1 :])
    sums = np.array([2.0 * np.sum(sizes * n**order, axis=1) for order in range(3)])
    return np.asarray(sums / np.maximum(extents, 1e-300))


def widest(missed: Array) -> Array:
    """Return the largest of each interval (last axis) and its two neighbours, since a kink may drift over a border."""
    edge = np.pad(missed, [(0, 0)] * (missed.ndim - 1) + [(1, 1)])
    return np.maximum(missed, np.maximum(edge[..., :-2], edge[..., 2:]))
