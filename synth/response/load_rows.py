"""The contact response where the load varies: one series a row of load, and cubics between the rows.

Model   Between two rows z is the cubic in w through both series and their slopes dz/dw. An interval is halved at an
        exact series, against which the cubic is measured there; the halves are halved again until what their error
        falls to, as it fell with the last halving, is within the tolerance, or they are as narrow as rows may lie.
        Intervals begin as octaves of load above `base`, with one interval from the envelope at no load up to it. All
        octaves between the lightest and the heaviest load so far are halved to PASSING, the loads asked for finely.
Source  design, sections 1 and 8; Fagiani & Barbieri (2016), eqs 1, 4, 5.
Limits  where a patch is born the response is singular in the load, and no spacing of rows reaches a tight tolerance in
        acceleration: the rows stop at the finest interval asked for, and `errors` tells what is left. It is measured
        one halving before and carried on by at most half of the last gain.
"""

from __future__ import annotations

import math
import threading
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.contact.load_response import Response
from synth.response.phase_cells import load_cubic
from synth.response.spectrum import FLOOR, Complex, Demand, Spectrum, curves, points_for, solve_spectrum

NO_LOAD = 1e-6  # of `base`: the load at which the slope of the envelope row is taken, since dz/dw has a limit at w = 0
# The same of a response that is nothing at no load: its slope there is what it has grown to at this load, over the
# load. It may grow by a power of the load below 1, whose slope at 0 is infinite; a cubic that began as steeply as it is
# at NO_LOAD would overshoot several times, with 1 / 64 by some percent.
LIGHT_LOAD = 1.0 / 64.0
LARGEST_LOAD = 1e3  # N, the end of the scene's range
ROW_WORK = 1 << 27  # phases times cells of one row: about 1 s; the default scene takes a hundredth of it
# the same of all rows, about 25 s: beyond it intervals are not halved any more, and the error says so
ALL_WORK = 1 << 32
FEWEST_START = 64  # phases that a row begins with, whatever its neighbours took: fewer could miss what they saw
PASSING = 1.0 / 8.0  # of an octave: rows of loads that a motion only passes through
COARSE = 1.0 / 16.0  # of an octave: rows for a hand that cannot wait
FINEST = 1.0 / 1024.0  # of an octave: the closest rows there are
SAFETY = 2.0  # an interval errs by this much more at most than if its error fell as it did with the halving before


@dataclass(frozen=True, slots=True)
class Interval:
    """Two neighbouring rows, low and high (N).

    seen: the error of each order in the middle of the interval that this is a half of, relative to the peak-to-peak
    there. before: the same one halving earlier. Infinite where there was none.
    """

    low: float
    high: float
    seen: tuple[float, ...]
    before: tuple[float, ...]

    @property
    def errors(self) -> tuple[float, ...]:
        """The error of each order to be expected inside."""
        return tuple(
            seen if seen == 0.0 or math.isinf(before) else seen * min(1.0, SAFETY * seen / before)
            for seen, before in zip(self.seen, self.before, strict=True)
        )


class Rows:
    """Rows of load, solved as they are needed. Thread-safe: one thread solves, others read `edges`.

    contact: the response, z of a contact or a force. demand: what each row must hold. keep: harmonics of a row. base:
    the load (N) where octaves begin.
    tolerance: of the error between rows, relative as that of the demand; None: that of the demand.
    edges: the loads (N) of the rows that are ready and next to each other, rising; a new array whenever there are more.
    """

    def __init__(
        self, contact: Response, demand: Demand, keep: int, base: float, tolerance: float | None = None
    ) -> None:
        self.contact, self.demand, self.keep, self.base = contact, demand, keep, base
        self.tolerance = demand.tolerance if tolerance is None else tolerance
        self._spectra: dict[float, Spectrum] = {}
        self._octaves: dict[int, list[Interval]] = {}
        self._fine = (0.0, math.inf)
        self._work = 0
        self._lock = threading.RLock()
        self.edges: Array = np.array([])

    @property
    def errors(self) -> tuple[float, ...]:
        """The largest error of each order between rows, relative to its peak-to-peak at that load: over the loads that
        were asked for finely, if there were any.
        """
        worst = [0.0] * len(self.demand.orders)
        for part in self._asked():
            worst = [max(a, b) for a, b in zip(worst, part.errors, strict=True)]
        return tuple(worst)

    def worst_loads(self, order: int) -> tuple[float, float]:
        """Return the two rows (N) between which the error of `order` is largest."""
        place = self.demand.orders.index(order)
        part = max(self._asked(), key=lambda one: one.errors[place])
        return part.low, part.high

    def _asked(self) -> list[Interval]:
        """Return the intervals of the loads that were asked for finely, of all loads if there were none."""
        low, high = self._fine
        every = [part for parts in list(self._octaves.values()) for part in parts]
        return [part for part in every if part.low <= high and part.high > low]

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
        if load < self.base:
            return 0
        number = 1 + math.floor(math.log2(load / self.base))  # which rounding may put next to an end: ask the ends
        low, high = self.bounds(number)
        return number - 1 if load < low else number + 1 if load >= high else number

    def cover(self, low: float, high: float, finest: float, stop: Callable[[], bool] = lambda: False) -> None:
        """Solve the loads from `low` to `high` (N), and for passing through the octaves that hold them and those
        between them and what is there.

        finest: the smallest interval, as a fraction of an octave. stop: asked between octaves, and between the
        intervals that are refined.
        """
        low, high = max(low, 0.0), min(high, LARGEST_LOAD)
        first, last = self.octave(low), self.octave(high)
        with self._lock:
            for number in self._missing(first, last):
                if stop():
                    return
                unseen = (math.inf,) * len(self.demand.orders)
                self._octaves[number] = self._halved(Interval(*self.bounds(number), unseen, unseen), number, PASSING)
                self._publish()
            if finest < COARSE:
                known = self._fine if math.isfinite(self._fine[1]) else (low, high)
                self._fine = (min(known[0], low), max(known[1], high))
            for number in range(first, last + 1):
                self._refine(number, low, high, finest, stop)

    def _missing(self, first: int, last: int) -> list[int]:
        """Return the octaves to solve so that those from `first` to `last` and those that are there leave no gap.

        Each borders on what is there by then: a load that could be read stays within the rows that are ready.
        """
        if not self._octaves:
            return list(range(first, last + 1))
        low, high = min(self._octaves), max(self._octaves)
        return [*range(low - 1, first - 1, -1), *range(high + 1, last + 1)]

    def _refine(self, number: int, low: float, high: float, finest: float, stop: Callable[[], bool]) -> None:
        """Halve those intervals of an octave in which the loads from `low` to `high` lie."""
        parts = self._octaves[number]
        begin = max(bisect_right(parts, low, key=_low_of) - 1, 0)
        for part in parts[begin : max(bisect_right(parts, high, key=_low_of), begin + 1)]:
            if stop():
                return
            halves = self._halved(part, number, finest)
            if len(halves) > 1:
                parts = self._octaves[number]
                at = bisect_right(parts, part.low, key=_low_of) - 1
                self._octaves[number] = [*parts[:at], *halves, *parts[at + 1 :]]
                self._publish()

    def coarse(self, loads: Array) -> np.ndarray[Any, np.dtype[np.bool_]]:
        """Return which of `loads` (N), each that of a row, are ends of intervals of COARSE or wider."""
        mantissa, _exponent = np.frexp(loads / self.base)
        place = np.where(loads < self.base, loads / self.base, 2.0 * mantissa - 1.0) / COARSE
        return np.asarray(np.abs(place - np.rint(place)) < 1e-6)

    def _publish(self) -> None:
        parts = [part for number in sorted(self._octaves) for part in self._octaves[number]]
        self.edges = np.array([parts[0].low, *(part.high for part in parts)])

    def _solved(self, load: float) -> Spectrum:
        begins_at_nothing = load == 0.0 and self.contact.nothing_at_no_load
        at = max(load, (LIGHT_LOAD if begins_at_nothing else NO_LOAD) * self.base)
        row = solve_spectrum(self.contact, at, self.demand, self.keep, self._start(load), ROW_WORK)
        self._work += max(row.phases, 1) * self.contact.work_at(at)
        if begins_at_nothing:
            return replace(row, harmonics=np.zeros_like(row.harmonics), slopes=row.harmonics / at)
        return row

    def _start(self, load: float) -> int:
        """Return the phases to begin the row at `load` (N) with: a quarter of what the heavier end of its octave took.

        What is solved counts for the doublings too, so that beginning with few costs no more. The ends of octaves begin
        afresh, so that a row is the same whatever was solved before it: a recording of a hand depends on that.
        """
        low, high = self.bounds(self.octave(load))
        if load in (low, high):
            return 0
        return max(self.spectrum(high).phases // 4, FEWEST_START)

    def bounds(self, number: int) -> tuple[float, float]:
        """Return the loads (N) between which octave `number` lies."""
        if number == 0:
            return 0.0, self.base
        return self.base * 2.0 ** (number - 1), self.base * 2.0**number

    def _halved(self, whole: Interval, number: int, finest: float) -> list[Interval]:
        """Return an interval of octave `number`, or what it is halved into, in the order of the loads."""
        low, high = self.bounds(number)
        smallest = finest * (high - low) * (1.0 + 1e-9)
        waiting, done = [whole], []
        while waiting:
            part = waiting.pop()
            narrow = part.high - part.low <= smallest or self._work > ALL_WORK
            if max(part.errors) <= self.tolerance or (narrow and not math.isinf(part.seen[0])):
                done.append(part)
                continue
            middle = 0.5 * (part.low + part.high)
            seen = self.middle_error(part.low, middle, part.high)
            waiting += [Interval(middle, part.high, seen, part.seen), Interval(part.low, middle, seen, part.seen)]
        return done

    def cubic(self, low: float, high: float, harmonics: int) -> tuple[Complex, ...]:
        """Return the four series of the cubic over the load between two rows, cut at `harmonics`."""
        a, b = self.spectrum(low), self.spectrum(high)
        cut = harmonics + 1
        return load_cubic(a.harmonics[:cut], a.slopes[:cut], b.harmonics[:cut], b.slopes[:cut], high - low)

    def middle_error(self, low: float, middle: float, high: float) -> tuple[float, ...]:
        """Return the error of the cubic at `middle` (N), each order relative to its peak-to-peak there; 0 where it is
        round-off.
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
        floor = FLOOR * self.contact.scale_at(middle)
        small = float(np.max(np.abs(curves(read - truth, 0, points_for(highest))))) <= floor
        return (0.0,) * len(errors) if small else tuple(errors)

    def interval_of(self, load: float) -> int:
        """Return the index of the interval of `edges` that holds `load` (N), the nearest one beyond the ends."""
        return min(max(bisect_right(self.edges.tolist(), load) - 1, 0), len(self.edges) - 2)


def _low_of(part: Interval) -> float:
    return part.low
