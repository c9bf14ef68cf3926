"""The obvious way to compute a steady scan: a trapezoid rule and SciPy's `brentq`, as frames or tabled for one period.

Stage   beside `methods`, with which a report of accuracy compares it.
Model   integral over [0, L] of max(h - z, 0) dx = w L / k of eq. 1 on equally spaced points, a root of a function of z,
        a phase at a time. Frames are solved at each output frame, or oversampled and then band-limited; a table holds
        one period, solved once, and is read as every series is. Points and solutions grow together.
Source  Fagiani & Barbieri (2016), eqs 1-5.
Limits  times are those of `brentq` at TIMED phases, times the number of phases. Errors are those of the same roots,
        found by Newton's method: the trapezoid of max(h - z, 0) is convex, falls, and is straight between the heights
        of its points, so it ends at the root to round-off. The filter that steps oversampled frames down is not
        counted: it is 1 % of the solutions.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property
from time import perf_counter

import numpy as np

from synth.accuracy.methods import Case, Method, Ready, of_series, read_by
from synth.arrays import Array
from synth.contact.load_balance import Contact
from synth.response.series_curve import SeriesCurve

SIZES = tuple((25 * 2**power, 2 ** round(0.45 * power)) for power in range(8))
"""Points a ridge and solutions a frame: folding falls as the power 2.5 of the solutions, the rule's error as the square
of the points. The largest takes 3 ms a phase."""
TABLED = 512  # times the solutions a frame: phases of a table
TIMED, TRIED = 16, 4  # phases of which the time of one is taken, of `brentq` and of what finds errors
REPEATS = 3  # timings of `brentq`, whose median it is
MOST_STEPS = 100  # of Newton's method; never reached in the suite
SETTLED = 1e-15  # of a1 + a2: a step this small is rounding


class Trapezoid:
    """The trapezoid rule on one contact at one load (N) with so many points a ridge."""

    def __init__(self, contact: Contact, load: float, points: float) -> None:
        from scipy.optimize import brentq

        self._find, geometry = brentq, contact.geometry_at(load)
        self._geometry, self._target = geometry, contact.indentation(load)
        self.pieces = max(8, math.ceil(points * geometry.ridges))
        self._places = np.linspace(0.0, geometry.contact_length, self.pieces + 1)
        ridges = np.cos(2.0 * np.pi * self._places / geometry.ridge_period + geometry.ridge_phase)
        from_middle = self._places - 0.5 * geometry.contact_length
        self._finger = -geometry.ridge_amplitude * ridges - 0.5 * contact.dome * from_middle**2
        self._kept: dict[int, Array] = {}

    @property
    def nbytes(self) -> int:
        """Bytes that it holds."""
        return int(self._places.nbytes + self._finger.nbytes)

    @cached_property
    def seconds_a_root(self) -> float:
        """Seconds that a phase of `roots` takes."""
        began = perf_counter()
        self.roots(np.arange(TRIED) / (TRIED * TABLED))
        return (perf_counter() - began) / TRIED

    @cached_property
    def seconds_a_phase(self) -> float:
        """Seconds that `brentq` takes for a phase."""
        marks = [perf_counter()]
        for _ in range(REPEATS):
            self.solved(np.arange(TIMED) / TIMED)
            marks.append(perf_counter())
        return statistics.median(np.diff(marks)) / TIMED

    def solved(self, phases: Array) -> Array:
        """Return z (m) at each of `phases` (turns), as somebody solves it who has only this."""
        scale, found = self._geometry.height_scale, []
        for phase in phases:
            h = self._heights(float(phase))
            bottom = float(h.min()) - self._target - 1e-6 * scale
            tight = {"xtol": 1e-15 * scale, "rtol": 4.0 * np.finfo(float).eps}
            found.append(self._find(lambda z, h=h: self._excess(h, z), bottom, float(h.max()), **tight))
        return np.array(found)

    def period(self, phases: int) -> Array:
        """Return z (m) at `phases` equal steps of a period; they are found once."""
        if phases not in self._kept:
            self._kept[phases] = self.roots(np.arange(phases) / phases)
        return self._kept[phases]

    def roots(self, phases: Array) -> Array:
        """Return the same z at `phases` that follow each other closely."""
        found, z = np.empty(len(phases)), math.inf
        settled = SETTLED * self._geometry.height_scale
        for i, phase in enumerate(phases):
            h = self._heights(float(phase))
            for _ in range(MOST_STEPS):
                part = (np.count_nonzero(h > z) - 0.5 * (h[0] > z) - 0.5 * (h[-1] > z)) / self.pieces
                if part == 0.0:
                    z = float(h.min()) - self._target
                    continue
                step = self._excess(h, z) / part
                z += step
                if abs(step) <= settled:
                    break
            found[i] = z
        return found

    def _heights(self, phase: float) -> Array:
        geometry = self._geometry
        return np.asarray(geometry.texture(self._places - phase % 1.0 * geometry.texture_period) + self._finger)

    def _excess(self, h: Array, z: float) -> float:
        over = np.maximum(h - z, 0.0)
        return float(np.sum(over) - 0.5 * (over[0] + over[-1])) / self.pieces - self._target


def baseline_methods(case: Case) -> Iterator[Method]:
    """Yield the obvious way, as frames and as tables, the fewest points first."""
    for points, count in SIZES:
        rule = Trapezoid(case.contact, case.load, points)
        name = f"trapezoid and brentq, {points} points a ridge"
        yield _framed(case, rule, f"{name}, oversampling {count}", count)
    for points, count in SIZES:
        rule = Trapezoid(case.contact, case.load, points)
        name = f"trapezoid and brentq, {points} points a ridge"
        yield _tabled(case, rule, f"{name}, tabled, {TABLED * count} phases", TABLED * count)


def _framed(case: Case, rule: Trapezoid, name: str, count: int) -> Method:
    phases = max(8, round(case.period_frames * count))
    frames = max(1, TIMED // count)

    def set_up() -> Ready:
        def period(points: int) -> Array:
            return of_series(case, case.series(rule.period(phases)), points)

        steps = np.arange(frames * count) / (count * case.period_frames)
        return Ready(frames, rule.nbytes, lambda: rule.solved(steps), period)

    return Method(name, "baseline", set_up, phases * rule.seconds_a_root)


def _tabled(case: Case, rule: Trapezoid, name: str, phases: int) -> Method:
    def set_up() -> Ready:
        ready = read_by(case, SeriesCurve(case.series(rule.period(phases), phases // 2)))
        return replace(ready, setup=phases * rule.seconds_a_phase)

    return Method(name, "baseline", set_up, phases * rule.seconds_a_root)
