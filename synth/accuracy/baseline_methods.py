"""The obvious ways to compute a steady scan: a trapezoid rule and SciPy's `brentq`, as frames or tabled for one period.

Stage   beside `methods`, with which a report of accuracy compares them.
Model   Frames are solved at each output frame, or oversampled and then band-limited. A table holds one period, solved
        once, and is read as every other table. Both come with rising numbers of points a ridge (`ladders`).
Source  Fagiani & Barbieri (2016), eqs 1-5, as `contact.baseline` solves them.
Limits  times are those of TIMED phases, times the number of phases. Errors are those of the same roots, found faster
        (`contact.trapezoid`). The filter that steps oversampled frames down is not counted: it is 1 % of the solutions.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from time import perf_counter

import numpy as np

from synth.accuracy.methods import OVERSAMPLINGS, Case, Method, Read, Ready, Rung
from synth.arrays import Array
from synth.contact.baseline import BrentqGrid
from synth.contact.trapezoid import trapezoid_heights
from synth.response.phase_cells import CUBIC, polynomials
from synth.response.spectrum import curves
from synth.response.steady import SteadyTable

POINTS = tuple(25 * 2**power for power in range(11))  # a ridge; the last takes a tenth of a second a phase
TABLED_PHASES = (256, 1024, 4096, 16384)  # of one period
NAME = "trapezoid and brentq"
TIMED = 16  # phases of which the time of one is taken
REPEATS = 5  # timings, whose median it is
A_POINT = 3e-9  # s that the fast root takes a point and phase, to guess how long an error takes to find


@dataclass(eq=False)
class Trapezoid:
    """The trapezoid rule of one case at one number of points a ridge: its roots, and what `brentq` takes for one."""

    case: Case
    points: int
    _kept: list[Array] = field(default_factory=list)

    @cached_property
    def grid(self) -> BrentqGrid:
        """The points of the contact."""
        return BrentqGrid.of_geometry(self.case.contact.geometry, self.points)

    def heights(self, phases: int) -> Array:
        """Return z (m) at `phases` equal steps of a period."""
        for kept in self._kept:
            if len(kept) % phases == 0:
                return kept[:: len(kept) // phases]
        found = trapezoid_heights(self.grid, np.arange(phases) / phases, self._indentation)
        self._kept.append(found)
        return found

    def solve(self, phases: int) -> None:
        """Solve `phases` phases, a frame apart, as somebody would who has only this."""
        self.grid.solve(np.arange(phases) / self.case.period_frames, self._indentation)

    @cached_property
    def seconds_a_phase(self) -> float:
        """Seconds that `brentq` takes for a phase."""
        times = []
        for _ in range(REPEATS):
            began = perf_counter()
            self.solve(TIMED)
            times.append(perf_counter() - began)
        return statistics.median(times) / TIMED

    @property
    def _indentation(self) -> float:
        return self.case.contact.indentation(self.case.scene.scan.load)


@dataclass(frozen=True, slots=True)
class Frames:
    """Frames that are solved by the trapezoid rule, `oversampling` solutions each. See `methods.Ready`."""

    rule: Trapezoid
    oversampling: int
    phases: int

    setup = None

    @property
    def frames(self) -> int:
        """See `Ready`."""
        return max(1, TIMED // self.oversampling)

    @property
    def nbytes(self) -> int:
        """See `Ready`."""
        return self.rule.grid.nbytes

    def period(self, points: int) -> Array:
        """See `Ready`."""
        case = self.rule.case
        series = case.series(self.rule.heights(self.phases))
        shifted = series * np.exp(1j * math.pi * np.arange(len(series)) / points)
        return (curves(shifted, 0, points) / case.extent).astype(np.float32).astype(float) * case.extent

    def run(self) -> None:
        """See `Ready`."""
        self.rule.solve(self.frames * self.oversampling)


def baseline_methods(case: Case) -> Iterator[Method]:
    """Yield the obvious ways, ladder by ladder, the fewest solutions first."""
    rules = [Trapezoid(case, points) for points in POINTS]
    for below, count in pairwise((0, *OVERSAMPLINGS)):
        for rule in rules:
            yield _framed(rule, count, below)
    for below, phases in pairwise((0, *TABLED_PHASES)):
        for rule in rules:
            yield _tabled(rule, phases, below)


def _framed(rule: Trapezoid, count: int, below: int) -> Method:
    phases = max(8, round(rule.case.period_frames)) * count
    return _method(rule, "oversampling {}", count, below, phases, lambda: Frames(rule, count, phases))


def _tabled(rule: Trapezoid, phases: int, below: int) -> Method:
    def set_up() -> Read:
        began = perf_counter()
        series = rule.case.series(rule.heights(phases), phases // 2)
        reader = SteadyTable(polynomials(series, CUBIC, phases))
        own = perf_counter() - began
        return Read(reader, rule.case, setup=own + phases * rule.seconds_a_phase)

    return _method(rule, "tabled, {} phases", phases, below, phases, set_up)


def _method(rule: Trapezoid, kind: str, size: int, below: int, phases: int, set_up: Callable[[], Ready]) -> Method:
    """Return a method called by its points and its kind, of which {} is the size; below: the size before, 0 if none."""
    name = f"{NAME}, {rule.points} points a ridge, {kind.format(size)}"
    before = f"{NAME}, {kind.format(below)}" if below else ""
    seconds = rule.points * rule.case.contact.geometry.ridges * phases * A_POINT
    return Method(name, "baseline", phases, set_up, seconds, Rung(f"{NAME}, {kind.format(size)}", rule.points, before))
