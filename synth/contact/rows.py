"""The contact response where the load varies: one series a row of load, and cubics between the rows.

Model   Between two rows z is the cubic in w through both series and their slopes dz/dw. An interval is halved, each
        half with an exact series at its middle, until that middle agrees with the cubic within the tolerance, or the
        interval is as fine as rows may lie.
        Intervals begin as octaves of load above `base`, with one interval from the envelope at no load up to it.
Source  design, sections 1 and 8; Fagiani & Barbieri (2016), eqs 1, 4, 5.
Limits  Where a patch is born the response is singular in the load, and no spacing of rows reaches a tight tolerance in
        acceleration: the rows stop at the finest
        interval asked for, and `error` tells what was measured.
"""

from __future__ import annotations

import math
import threading
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from synth.contact.exact import Array
from synth.contact.spectrum import Complex, Contact, Demand, Spectrum, curves, points_for, solve_spectrum
from synth.contact.tables import load_cubic

NO_LOAD = 1e-6  # of `base`: the load at which the slope of the envelope row is taken, since dz/dw has a limit at w = 0
LARGEST_LOAD = 1e3  # N, the end of the scene's range
ROW_WORK = 1 << 27  # phases times cells of one row: about 1 s; the default scene takes a hundredth of it
# the same of all rows, about 25 s: beyond it intervals are not halved any more, and the error says so
ALL_WORK = 1 << 32
COARSE = 1.0 / 16.0  # of an octave: rows of octaves that a motion only passes through


@dataclass(frozen=True, slots=True)
class Interval:
    """Two neighbouring rows, low and high (N), and the error seen in their middle, relative to the peak-to-peak."""

    low: float
    high: float
    errors: tuple[float, ...]


class Rows:
    """Rows of load, solved as they are needed. Thread-safe: one thread solves, others read `edges`.

    contact, demand: what each row must hold. keep: harmonics of a row. base: the load (N) where octaves begin.
    """

    def __init__(self, contact: Contact, demand: Demand, keep: int, base: float) -> None:
        self.contact, self.demand, self.keep, self.base = contact, demand, keep, base
        self._spectra: dict[float, Spectrum] = {}
        self._octaves: dict[int, tuple[float, list[Interval]]] = {}
        self._work = 0
        self._lock = threading.RLock()
        self._edges: Array = np.array([])

    @property
    def edges(self) -> Array:
        """The loads (N) of the rows that are ready and next to each other, rising."""
        return self._edges

    @property
    def errors(self) -> tuple[float, ...]:
        """The largest error of each order between rows, relative to its peak-to-peak at that load."""
        worst = [0.0] * len(self.demand.orders)
        for interval in [part for _finest, parts in list(self._octaves.values()) for part in parts]:
            worst = [max(a, b) for a, b in zip(worst, interval.errors, strict=True)]
        return tuple(worst)

    @property
    def row_error(self) -> tuple[float, ...]:
        """The largest error of each order within a row."""
        rows = list(self._spectra.values())
        return tuple(max(column) for column in zip(*(row.errors for row in rows), strict=True))

    @property
    def memory_bytes(self) -> int:
        """Bytes that the rows hold."""
        return sum(row.harmonics.nbytes + row.slopes.nbytes for row in list(self._spectra.values()))

    def spectrum(self, load: float) -> Spectrum:
        """Return the row at `load` (N), solving it if it is new."""
        row = self._spectra.get(load)
        if row is None:
            row = self._solved(load)
            self._spectra[load] = row
        return row

    def octave(self, load: float) -> int:
        """Return the number of the octave that holds `load` (N): 0 is everything below `base`."""
        return 0 if load < self.base else 1 + math.floor(math.log2(load / self.base) + 1e-12)

    def cover(self, low: float, high: float, finest: float, stop: Callable[[], bool] = lambda: False) -> None:
        """Solve the octaves that hold the loads from `low` to `high` (N), and those between them and what is there.

        finest: the smallest interval, as a fraction of an octave; an octave that is coarser is refined. stop: asked
        between octaves.
        """
        first, last = self.octave(max(low, 0.0)), self.octave(min(high, LARGEST_LOAD))
        with self._lock:
            reached = list(self._octaves) or [first]
            for number in range(min(first, *reached, first), max(last, *reached, last) + 1):
                wanted = finest if first <= number <= last else max(finest, COARSE)
                if stop():
                    return
                if number not in self._octaves or self._octaves[number][0] > wanted:
                    self._octaves[number] = (wanted, self._refined(number, wanted))
                    self._publish()

    def _publish(self) -> None:
        numbers = sorted(self._octaves)
        run = [number for place, number in enumerate(numbers) if number - numbers[0] == place]
        parts = [part for number in run for part in self._octaves[number][1]]
        self._edges = np.array([parts[0].low, *(part.high for part in parts)])

    def _solved(self, load: float) -> Spectrum:
        at = max(load, NO_LOAD * self.base)
        row = solve_spectrum(self.contact, at, self.demand, self.keep, self._start, ROW_WORK)
        self._work += max(row.phases, 1) * self.contact.grid.tables.shape[1]
        return row

    @property
    def _start(self) -> int:
        """Phases to begin a row with: half of what the first row took."""
        first = next((row for row in list(self._spectra.values()) if not row.closed), None)
        return 0 if first is None else max(first.phases // 2, 64)

    def bounds(self, number: int) -> tuple[float, float]:
        """Return the loads (N) between which octave `number` lies."""
        if number == 0:
            return 0.0, self.base
        return self.base * 2.0 ** (number - 1), self.base * 2.0**number

    def _refined(self, number: int, finest: float) -> list[Interval]:
        low, high = self.bounds(number)
        smallest = finest * (high - low)
        waiting, done = [(low, high)], []
        while waiting:
            a, b = waiting.pop()
            middle = 0.5 * (a + b)
            errors, good = self.middle_error(a, middle, b)
            halves = ((a, middle), (middle, b))
            if good or (b - a) <= 2.0 * smallest * (1.0 + 1e-9) or self._work > ALL_WORK:
                done += [Interval(lo, hi, errors) for lo, hi in halves]
            else:
                waiting += halves[::-1]
        return sorted(done, key=lambda part: part.low)

    def cubic(self, low: float, high: float, harmonics: int) -> tuple[Complex, ...]:
        """Return the four series of the cubic over the load between two rows, cut at `harmonics`."""
        a, b = self.spectrum(low), self.spectrum(high)
        cut = harmonics + 1
        return load_cubic(a.harmonics[:cut], a.slopes[:cut], b.harmonics[:cut], b.slopes[:cut], high - low)

    def middle_error(self, low: float, middle: float, high: float) -> tuple[tuple[float, ...], bool]:
        """Return the error of the cubic at `middle` (N), each order relative to its peak-to-peak there; and if it is
        small.
        """
        highest = self.demand.highest
        truth = self.spectrum(middle).harmonics[: highest + 1]
        s = (middle - low) / (high - low)
        a, b, c, d = self.cubic(low, high, highest)
        read = a + s * (b + s * (c + s * d))
        errors = []
        for order in self.demand.orders:
            extent = float(np.ptp(curves(truth, order, points_for(highest))))
            error = float(np.max(np.abs(curves(read - truth, order, points_for(highest)))))
            errors.append(error / extent if extent > 0.0 else 0.0)
        floor = 1e-12 * self.contact.geometry.height_scale
        small = float(np.max(np.abs(curves(read - truth, 0, points_for(highest))))) <= floor
        return tuple(errors), small or max(errors) <= self.demand.tolerance

    def interval_of(self, load: float) -> int:
        """Return the index of the interval of `edges` that holds `load` (N), the nearest one beyond the ends."""
        return min(max(bisect_right(self._edges.tolist(), load) - 1, 0), len(self._edges) - 2)
