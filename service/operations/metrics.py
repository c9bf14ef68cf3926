"""What one process counts and measures of itself, cheaply enough for every block of every stream.

Model: plain numbers under one lock; nothing is formatted until somebody asks (`snapshot`), and what others already
    count (the cache, the sessions) is read then and not before (`watch`). `metrics_text` merges the snapshots
    of all workers and writes them for Prometheus.
Limits: half a microsecond a block (tests/bench/service_watch.py prints it). Methods may be called from any thread.
"""

from __future__ import annotations

import os
import threading
import time
from bisect import bisect_left
from collections.abc import Callable
from typing import ParamSpec, TypeVar

from service.operations.metrics_table import TABLE, Row

Series = dict[str, float | list[float]]
"""Values by label value ("" without a label). A histogram is its bucket counts, the one beyond all bounds, its sum."""
Snapshot = dict[str, Series]
"""Series by metric: what one worker has to tell."""

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")


class Histogram:
    """Counts between bounds, and the sum."""

    __slots__ = ("bounds", "counts", "total")

    def __init__(self, bounds: tuple[float, ...]) -> None:
        self.bounds = bounds
        self.counts = [0] * (len(bounds) + 1)
        self.total = 0.0

    def add(self, value: float) -> None:
        """Count one value."""
        self.counts[bisect_left(self.bounds, value)] += 1
        self.total += value


class Metrics:
    """The metrics of one process; the methods say what happened."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._numbers: dict[str, dict[str, float]] = {}
        self._histograms: dict[str, dict[str, Histogram]] = {}
        self._watched: dict[str, Callable[[], float]] = {
            "ridgewave_cpu_seconds_total": time.process_time,
            "ridgewave_resident_memory_bytes": _resident_bytes,
        }
        for row in TABLE.values():
            if row.kind == "histogram":
                self._histograms[row.name] = {value: Histogram(row.bounds) for value in row.values}
            else:
                self._numbers[row.name] = dict.fromkeys(row.values, 0)
        self._numbers["ridgewave_build_info"][""] = 1
        self._frames = self._numbers["ridgewave_frames_sent_total"]
        self._skipped = self._numbers["ridgewave_skipped_seconds_total"]
        self._lateness = self._histograms["ridgewave_block_lateness_seconds"]

    def watch(self, name: str, read: Callable[[], float]) -> None:
        """Have `read` tell the metric `name` (without a label) whenever a snapshot is taken."""
        assert TABLE[name].values == ("",) and TABLE[name].kind != "histogram", name
        self._watched[name] = read

    def stream_opened(self, kind: str) -> None:
        """A stream (http, live, play) began."""
        self._add("ridgewave_streams", 1, kind)
        self._add("ridgewave_streams_opened_total", 1, kind)

    def stream_closed(self, kind: str) -> None:
        """A stream ended; once for each that was opened."""
        self._add("ridgewave_streams", -1, kind)

    def block_sent(self, kind: str, frames: int, late_seconds: float | None = None, skipped: float = 0.0) -> None:
        """A block went out, so long after its time (negative: before); None where nothing was due (a play, pull).

        skipped: s by which its time was put off before, since the service was late; the stream fell silent for them.
        """
        with self._lock:
            self._frames[kind] += frames
            if late_seconds is not None:
                self._lateness[kind].add(max(0.0, late_seconds) + skipped)
            if skipped:
                self._skipped[kind] += skipped

    def lagged(self, seconds: float) -> None:
        """The event loop did what was due so long after its time."""
        with self._lock:
            self._histograms["ridgewave_loop_lag_seconds"][""].add(max(0.0, seconds))

    def underran(self, count: int) -> None:
        """A device was short of samples so many times."""
        self._add("ridgewave_underruns_total", count)

    def limited(self, reduction_db: float, seconds: float, blocks: int = 1) -> None:
        """Blocks of so many seconds were turned down by the safety limiter, by at most this many decibels."""
        self._add("ridgewave_limited_blocks_total", blocks)
        self._add("ridgewave_limited_seconds_total", seconds)
        largest = self._numbers["ridgewave_limiter_largest_reduction_decibels"]
        with self._lock:
            largest[""] = max(largest[""], reduction_db)

    def built(self, what: str, seconds: float) -> None:
        """A voice was opened ("voice"), or a change solved ("change"), in so many seconds."""
        with self._lock:
            self._histograms["ridgewave_build_seconds"][what].add(seconds)

    def waited(self, pool: str, seconds: float) -> None:
        """Work of a pool (render, solve, block) began, so long after it was asked for."""
        with self._lock:
            self._histograms["ridgewave_pool_wait_seconds"][pool].add(seconds)

    def timed(
        self, what: str, work: Callable[Arguments, Result], *arguments: Arguments.args, **named: Arguments.kwargs
    ) -> Result:
        """Return what `work` returns, its time counted as `built`."""
        began = time.perf_counter()
        made = work(*arguments, **named)
        self.built(what, time.perf_counter() - began)
        return made

    def render_began(self) -> None:
        """A finite sound is going to be sent."""
        self._add("ridgewave_renders_total", 1)

    def refused(self, kind: str) -> None:
        """A problem of this name (service.problems.TYPES) was told, over HTTP or live."""
        self._add("ridgewave_problems_total", 1, kind)

    def live_closed(self, code: int) -> None:
        """A live connection was closed with this code; 1006 where it broke."""
        known = str(code) in TABLE["ridgewave_live_closes_total"].values
        self._add("ridgewave_live_closes_total", 1, str(code) if known else "other")

    def updates(self, received: int = 0, applied: int = 0, dropped: int = 0) -> None:
        """So many movements of a hand came, were rendered with, were overtaken or refused; once a block is enough."""
        with self._lock:
            self._numbers["ridgewave_updates_received_total"][""] += received
            self._numbers["ridgewave_updates_applied_total"][""] += applied
            self._numbers["ridgewave_updates_dropped_total"][""] += dropped

    def snapshot(self) -> Snapshot:
        """Return everything as it is now; each metric of the table is there, each of its labels too."""
        watched = {name: float(read()) for name, read in self._watched.items()}
        with self._lock:
            return {row.name: self._series(row, watched) for row in TABLE.values()}

    def _series(self, row: Row, watched: dict[str, float]) -> Series:
        if row.kind == "histogram":
            histograms = self._histograms[row.name].items()
            return {value: [*histogram.counts, histogram.total] for value, histogram in histograms}
        if row.name in watched:
            return {"": watched[row.name]}
        return dict(self._numbers[row.name])

    def _add(self, name: str, amount: float, value: str = "") -> None:
        with self._lock:
            self._numbers[name][value] += amount


def _resident_bytes() -> int:
    """Return the memory of this process, as Linux tells it; 0 elsewhere."""
    try:
        with open("/proc/self/statm") as table:
            return int(table.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except OSError:
        return 0
