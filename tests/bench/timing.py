"""Shared parts of the benchmarks: a figure with its limit, one core to run on, and times that tolerate a busy machine.

A figure is the median of its repeats; `least` is the smallest of them, which other work on the machine can only raise.
"""

from __future__ import annotations

import os
import platform
import statistics
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from time import perf_counter

import numba
import numpy as np


@dataclass(frozen=True, slots=True)
class Figure:
    """One line of the table.

    value: median of the repeats, in `unit`.
    least: minimum of the repeats; of a ratio, that of the two minima.
    limit: the project's own limit; None for a line without one.
    how: what was timed, and how often.
    """

    name: str
    value: float
    least: float
    unit: str
    limit: float | None
    how: str

    @property
    def verdict(self) -> str:
        """Return "within", "OVER", or "" where there is no limit."""
        if self.limit is None:
            return ""
        return "within" if self.value <= self.limit else "OVER"

    def document(self) -> dict[str, object]:
        """Return the figure for JSON."""
        return asdict(self) | {"verdict": self.verdict}


def figure(
    name: str, values: Sequence[float], unit: str, limit: float | None, how: str, *, scale: float = 1.0
) -> Figure:
    """Return the figure of the repeats `values`, each times `scale`."""
    return Figure(name, scale * statistics.median(values), scale * min(values), unit, limit, how)


def seconds(work: Callable[[], object]) -> float:
    """Return the time that `work` takes."""
    began = perf_counter()
    work()
    return perf_counter() - began


def repeated(work: Callable[[], object], repeats: int) -> list[float]:
    """Return the seconds of each of `repeats` runs, after one that does not count."""
    work()
    return [seconds(work) for _ in range(repeats)]


def alternated(
    first: Sequence[Callable[[], object]], second: Sequence[Callable[[], object]], repeats: int
) -> tuple[list[float], list[float]]:
    """Return the seconds of each pass over `first` and over `second`: first[0], second[0], first[1], second[1], ...

    A temporary slowdown of the machine affects both, so the ratio of two passes is stable.
    """
    totals: tuple[list[float], list[float]] = ([], [])
    for _ in range(repeats):
        sums = [0.0, 0.0]
        for one, other in zip(first, second, strict=True):
            began = perf_counter()
            one()
            between = perf_counter()
            other()
            sums[1] += perf_counter() - between
            sums[0] += between - began
        totals[0].append(sums[0])
        totals[1].append(sums[1])
    return totals


@contextmanager
def one_core() -> Iterator[None]:
    """Keep this thread and those that it starts on one core (Linux; elsewhere the figures are for all cores)."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    allowed = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(allowed)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, allowed)


def machine() -> dict[str, object]:
    """Return the conditions of the figures: processor, cores, versions."""
    try:
        wide = "avx512f" in Path("/proc/cpuinfo").read_text("ascii", "replace")
    except OSError:
        wide = False
    return {
        "processor": platform.machine() + (" with AVX-512" if wide else ""),
        "cores": len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count(),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "numba": numba.__version__,
    }
