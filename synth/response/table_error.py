"""The error of a table, at every load it covers, for each quantity and number of harmonics.

Stage   RESPONSE, measured while a table is made.
Model   The error of a quantity is the largest difference over a period of steady scanning, relative to the quantity's
        own peak-to-peak at that load or at 0.3 N, whichever is larger, both cut at the same harmonic. Told is what the
        cubic missed in the middle of the interval twice as wide (before it was halved) or of a neighbour's; what folds:
        a share of what half as many places would have changed; and the images of the splines. Harmonics beyond the
        fullest level are left out: `beyond` is what those of the next octave add up to, and those after it fall as
        n^-2.5.
Source  design, sections 1 and 8.
Limits  a bound by experience: tests/synth/response/test_table_error.py measures how often it is passed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import fft

from synth.arrays import Array
from synth.response.mip_levels import MipLevels
from synth.response.place_spline import TAPS
from synth.response.spectrum import Complex

QUANTITIES = ("displacement", "velocity", "acceleration")
USUAL_LOAD = 0.3  # N: lighter motions than those at this load are judged by it, since nobody feels them
FALL = 2.5  # harmonics of a kink of order 3/2 fall as n^-2.5
FOLDED = 1.5  # times what should fold of such harmonics, by what half as many places changed
LEAST = 1e-4  # told at least: what a kink that begins between two measurements was seen to leave of few harmonics
LINE = 0.65  # of the peak-to-peak: the largest harmonic that a curve can have (of a square wave, 0.64)
FLOOR = 1e-12  # of a1 + a2: what round-off leaves in z


@dataclass(frozen=True, slots=True)
class TableError:
    """What a table may err by.

    loads: ends of the intervals of load (N) [rows]. harmonics: numbers of harmonics that errors are told for, rising.
    largest: relative error [quantity, harmonics, interval], in the order of QUANTITIES. beyond: what harmonics of the
    octave above the highest add up to [quantity, interval].
    """

    loads: Array
    harmonics: tuple[int, ...]
    largest: np.ndarray[Any, np.dtype[np.float32]]
    beyond: np.ndarray[Any, np.dtype[np.float32]]

    def at(self, load: float, quantity: str, harmonics: int) -> float:
        """Return the largest error of `quantity` at `load` (N) with so many harmonics in the band.

        Loads beyond the last row have the error of the last interval. ValueError for a quantity that is none of three.
        """
        order = QUANTITIES.index(quantity)
        interval = int(np.clip(np.searchsorted(self.loads, load, side="right") - 1, 0, len(self.loads) - 2))
        count = min(int(np.searchsorted(self.harmonics, harmonics)), len(self.harmonics) - 1)
        below = max(0, int(np.searchsorted(self.harmonics, harmonics, side="right")) - 1)
        told = float(max(self.largest[order, count, interval], self.largest[order, min(below, count), interval]))
        octaves = math.ceil(math.log2(max(harmonics / self.harmonics[-1], 1.0)))
        left_out = sum(2.0 ** (k * (order + 1.0 - FALL)) for k in range(octaves))
        return float(told + left_out * float(self.beyond[order, interval]))

    def over(self, loads: tuple[float, float], quantity: str, harmonics: int) -> float:
        """Return the largest error of `quantity` between two `loads` (N); other arguments as in `at`."""
        low, high = loads
        inside = [float(load) for load in self.loads if low < load < high]
        return max(self.at(load, quantity, harmonics) for load in (low, *inside, high))

    def largest_told(self, quantity: str, harmonics: int = 32, lightest: float = 0.02) -> float:
        """Return the largest error told of `quantity` with so many harmonics, over the loads from `lightest` (N) on."""
        loads = self.loads[:-1]
        return max(self.at(float(load), quantity, harmonics) for load in loads[loads >= min(lightest, loads[-1])])


def told_harmonics(highest: int) -> tuple[int, ...]:
    """Return the numbers of harmonics that errors are told for: octaves up to `highest`."""
    counts = [highest]
    while counts[-1] > 1:
        counts.append(counts[-1] // 2)
    return tuple(counts[::-1])


def swings(series: Complex, counts: tuple[int, ...], peak_to_peak: bool) -> Array:
    """Return the largest size, or the peak-to-peak, of each derivative over place of `series` [rows, harmonics + 1].

    Returns [3, counts, rows]: value, first and second derivative over turns, cut at each of `counts` harmonics.
    """
    found = np.empty((3, len(counts), len(series)))
    for j, count in enumerate(counts):
        points = max(16, 1 << (3 * count - 1).bit_length())
        n = 2j * math.pi * np.arange(1, count + 1)
        for order in range(3):
            spectrum = np.zeros((len(series), points // 2 + 1), dtype=np.complex128)
            spectrum[:, 1 : count + 1] = series[:, 1 : count + 1] * n**order
            curve = fft.irfft(spectrum, points, axis=1, overwrite_x=True) * points
            high, low = curve.max(axis=1), curve.min(axis=1)
            found[order, j] = high - low if peak_to_peak else np.maximum(high, -low)
    return found


def relative(errors: Array, extents: Array, counts: tuple[int, ...], scale: float) -> Array:
    """Return `errors` over `extents` (both of `swings`), 0 where an error is round-off of z; scale: a1 + a2 (m)."""
    n = (2.0 * math.pi * np.array(counts)) ** np.arange(3)[:, np.newaxis]
    floor = FLOOR * scale * n[:, :, np.newaxis]
    return np.where(errors <= floor, 0.0, errors / np.maximum(extents, floor))


def folding(counts: tuple[int, ...], phases: int) -> Array:
    """Return of each number of harmonics the share of what half of the `phases` changed that still folds in."""
    n = np.array(counts)
    return np.asarray(FOLDED * ((phases / 2 - n) / (phases - n)) ** FALL)


def images(levels: MipLevels, counts: tuple[int, ...]) -> Array:
    """Return what the images of the splines add to each quantity, of the levels told under each count [3, counts]."""
    found = np.zeros((3, len(counts)))
    for n, places in zip(levels.highest, levels.places, strict=True):
        at = int(np.searchsorted(counts, n))
        ratio = n / (places - n)
        found[:, at] = np.maximum(found[:, at], [LINE * ratio ** (TAPS - order) for order in range(3)])
    return found


def octave_beyond(series: Complex, extents: Array) -> Array:
    """Return what the harmonics above the first half of `series` [rows, 2 highest + 1] add up to, a quantity each.

    extents: peak-to-peak of each [3, rows]. Returns [3, rows].
    """
    highest = series.shape[1] // 2
    n = 2.0 * math.pi * np.arange(highest + 1, series.shape[1])
    sizes = np.abs(series[:, highest + 1 :])
    sums = np.array([2.0 * np.sum(sizes * n**order, axis=1) for order in range(3)])
    return np.asarray(sums / np.maximum(extents, 1e-300))


def widest(missed: Array) -> Array:
    """Return of each interval (last axis) the larger of its own and its neighbours': a kink drifts over a border."""
    edge = np.pad(missed, [(0, 0)] * (missed.ndim - 1) + [(1, 1)])
    return np.maximum(missed, np.maximum(edge[..., :-2], edge[..., 2:]))
