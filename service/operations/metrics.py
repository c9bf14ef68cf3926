"""The metrics of one process, and what a service of several workers answers at `/metrics`.

Model: the counters, gauges and histograms are those of prometheus_client, in a registry of this process. Values that
    other parts count (the cache, the sessions) are read when the registry is collected (`watch`). `merged` adds up the
    workers. Every value of every label is known here, so the number of series is fixed, and no label holds a session's
    id or anything that a client wrote.
Limits: a block costs 2 to 3 us (tests/bench/service_watch.py prints it). Methods may be called from any thread. The
    mode of prometheus_client for several processes is not used: it takes 4 us per block and cannot read a gauge on
    demand.
"""

from __future__ import annotations

import json
import os
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import ParamSpec, TypeVar

from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.exposition import choose_encoder
from prometheus_client.registry import Collector
from prometheus_client.samples import Sample

from service import PYTHON, VERSION, problems
from service.operations.load_meter import LoadMeter

STREAM_KINDS = ("http", "live", "play")
CLOSE_CODES = ("1000", "1001", "1006", "1007", "1008", "1009", "1011", "1012", "1013", "4408", "other")
LATENESS_BOUNDS = (0.0001, 0.0002, 0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0)
"""Seconds, from far less than a hand can feel to a lead that is used up. Stored series do not fit changed bounds."""
LAG_BOUNDS = (0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0)
"""Seconds, from the resolution of the timer to a process that was stopped for a while."""
WAIT_BOUNDS = (0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0)
"""Seconds, from a thread that is free to a service that is overloaded."""
BUILD_BOUNDS = (0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0)
"""Seconds, from a cached response to a scene with every effect."""
LARGEST = ("ridgewave_limiter_largest_reduction_decibels", "ridgewave_build_info")
"""Gauges that are merged by their largest value, workers that have ended included; others are added up."""

Snapshot = dict[str, float]
"""The values of one worker by series, as it is stored in a file."""

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")
Kind = TypeVar("Kind", Counter, Gauge, Histogram)


class Metrics:
    """The metrics of one process. Each method counts one kind of event."""

    def __init__(self) -> None:
        self._registry = CollectorRegistry()
        self._lock = threading.Lock()
        self._largest_reduction_db = 0.0
        self.load = LoadMeter()
        self._add_streams()
        self._add_lateness()
        self._add_limiter()
        self._add_work()
        self._add_live_messages()
        self._add_process()

    def _add_streams(self) -> None:
        self._streams = _each(self._gauge("streams", "Streams under way: HTTP, live, and plays.", "kind"), STREAM_KINDS)
        self._opened = _each(self._counter("streams_opened_total", "Streams opened.", "kind"), STREAM_KINDS)
        frames = self._counter("frames_sent_total", "Frames sent or played, each of all channels.", "kind")
        self._frames = _each(frames, STREAM_KINDS)

    def _add_lateness(self) -> None:
        lateness = self._histogram(
            "block_lateness_seconds",
            "Time from the moment at which a block was due to the moment at which it was handed to the connection. An "
            "HTTP stream has RIDGEWAVE_LEAD in reserve.",
            "kind",
            bounds=LATENESS_BOUNDS,
        )
        self._lateness = _each(lateness, ("http", "live"))
        skipped = self._counter(
            "skipped_seconds_total",
            "Time for which streams were silent because the service was late, not because a reader did not read.",
            "kind",
        )
        self._skipped = _each(skipped, ("http", "live"))
        self._lag = self._histogram(
            "loop_lag_seconds", "Lateness of the event loop, measured 20 times per second.", bounds=LAG_BOUNDS
        )
        underruns = "Times that an audio device played silence for lack of samples."
        self._underruns = self._counter("underruns_total", underruns)

    def _add_limiter(self) -> None:
        self._limited_blocks = self._counter("limited_blocks_total", "Blocks whose level the safety limiter reduced.")
        self._limited_seconds = self._counter("limited_seconds_total", "Duration of the sound in these blocks.")
        largest = self._gauge("limiter_largest_reduction_decibels", "Largest reduction by the limiter since the start.")
        largest.set_function(lambda: self._largest_reduction_db)

    def _add_work(self) -> None:
        build = self._histogram(
            "build_seconds", "Time to open a voice, or to solve a change of a scene.", "what", bounds=BUILD_BOUNDS
        )
        self._build = _each(build, ("voice", "change"))
        wait = self._histogram(
            "pool_wait_seconds",
            "Time that work waited to begin: renders, plans and pictures; solves of sessions; blocks of streams.",
            "pool",
            bounds=WAIT_BOUNDS,
        )
        self._wait = _each(wait, ("render", "solve", "block"))
        self._renders = self._counter("renders_total", "Renders whose answer began.")
        refusals = self._counter("problems_total", "Problem documents sent, by type.", "type")
        self._problems = _each(refusals, tuple(problems.TYPES))

    def _add_live_messages(self) -> None:
        closes = self._counter("live_closes_total", "Live connections closed, by close code.", "code")
        self._closes = _each(closes, CLOSE_CODES)
        self._received = self._counter("updates_received_total", "Contact updates received.")
        self._applied = self._counter("updates_applied_total", "Contact updates used in a block.")
        self._dropped = self._counter(
            "updates_dropped_total", "Contact updates refused, or replaced by a newer one before the next block."
        )

    def _add_process(self) -> None:
        workers = "Running workers. Below RIDGEWAVE_WORKERS, a worker has died or is starting."
        self._gauge("workers", workers).set(1)
        versions = "Always 1; its labels are the versions of ridgewave and Python."
        self._gauge("build_info", versions, "version", "python").labels(VERSION, PYTHON).set(1)
        self.watch(CounterMetricFamily, "cpu_seconds_total", "Processor time of the workers.", time.process_time)
        memory = "Resident memory of the workers; 0 where it is unknown."
        self.watch(GaugeMetricFamily, "resident_memory_bytes", memory, _resident_bytes)

    def _counter(self, name: str, sentence: str, *labels: str) -> Counter:
        return Counter(f"ridgewave_{name}", sentence, labels, registry=self._registry)

    def _gauge(self, name: str, sentence: str, *labels: str) -> Gauge:
        return Gauge(f"ridgewave_{name}", sentence, labels, registry=self._registry)

    def _histogram(self, name: str, sentence: str, *labels: str, bounds: Sequence[float]) -> Histogram:
        return Histogram(f"ridgewave_{name}", sentence, labels, registry=self._registry, buckets=bounds)

    def watch(
        self,
        family: type[CounterMetricFamily] | type[GaugeMetricFamily],
        name: str,
        sentence: str,
        read: Callable[[], float],
    ) -> None:
        """Add the metric `name`, without the prefix; `read` is called whenever the metrics are collected."""
        self._registry.register(_Families(lambda: [family(f"ridgewave_{name}", sentence, value=read())]))

    def families(self) -> list[Metric]:
        """Return all metrics with their present values, without the times at which they were created."""
        families = list(self._registry.collect())
        for family in families:
            family.samples = [sample for sample in family.samples if not sample.name.endswith("_created")]
        return families

    def stream_opened(self, kind: str) -> None:
        """Count a stream that opened. kind: http, live or play."""
        self._streams[kind].inc()
        self.load.streams += 1
        self.load.live += kind == "live"
        self._opened[kind].inc()

    def stream_closed(self, kind: str) -> None:
        """Count a stream that ended; call it once for each that was opened."""
        self._streams[kind].dec()
        self.load.streams -= 1
        self.load.live -= kind == "live"

    def block_sent(self, kind: str, frames: int, late_seconds: float | None = None, skipped: float = 0.0) -> None:
        """Count a block that was sent.

        late_seconds: its lateness, negative if it was early; None where no block is due at a time (a play, `pull`).
        skipped: seconds for which the stream was silent before this block because the service was late.
        """
        self._frames[kind].inc(frames)
        if late_seconds is not None:
            late = max(0.0, late_seconds) + skipped
            self._lateness[kind].observe(late)
            self.load.sent(late)
        if skipped:
            self._skipped[kind].inc(skipped)

    def lagged(self, seconds: float) -> None:
        """Count one measurement of the event loop's lateness, and measure its load. Call it in its thread."""
        self._lag.observe(max(0.0, seconds))
        self.load.look()

    def underran(self, count: int) -> None:
        """Count underruns of a device."""
        self._underruns.inc(count)

    def limited(self, reduction_db: float, seconds: float, blocks: int = 1) -> None:
        """Count blocks that the limiter reduced: their duration in all, and the largest reduction in them."""
        self._limited_blocks.inc(blocks)
        self._limited_seconds.inc(seconds)
        with self._lock:
            self._largest_reduction_db = max(self._largest_reduction_db, reduction_db)

    def built(self, what: str, seconds: float) -> None:
        """Count the time to open a voice ("voice") or to solve a change ("change")."""
        self._build[what].observe(seconds)

    def waited(self, pool: str, seconds: float) -> None:
        """Count the time that work waited to begin. pool: render, solve or block."""
        self._wait[pool].observe(seconds)

    def timed(
        self, what: str, work: Callable[Arguments, Result], *arguments: Arguments.args, **named: Arguments.kwargs
    ) -> Result:
        """Return what `work` returns, and count its time as `built`."""
        began = time.perf_counter()
        made = work(*arguments, **named)
        self.built(what, time.perf_counter() - began)
        return made

    def render_began(self) -> None:
        """Count a render whose answer begins."""
        self._renders.inc()

    def refused(self, kind: str) -> None:
        """Count a problem document of this type (service.problems.TYPES), sent over HTTP or live."""
        self._problems[kind].inc()

    def live_closed(self, code: int) -> None:
        """Count a live connection that was closed with this code; 1006 is a connection that broke."""
        self._closes.get(str(code), self._closes["other"]).inc()

    def updates(self, received: int = 0, applied: int = 0, dropped: int = 0) -> None:
        """Count contact updates; calling it once per block is enough."""
        self._received.inc(received)
        self._applied.inc(applied)
        self._dropped.inc(dropped)


def snapshot(families: Iterable[Metric]) -> Snapshot:
    """Return the values of one worker, to be stored."""
    return {_series(sample): sample.value for family in families for sample in family.samples}


def merged(own: Iterable[Metric], present: Sequence[Snapshot] = (), ended: Sequence[Snapshot] = ()) -> Iterator[Metric]:
    """Yield the metrics of the whole service.

    own: the metrics of the worker that received the request.
    present: the snapshots of the other workers that are running.
    ended: the snapshots of workers that have ended. They count in counters and histograms, not in gauges.
    """
    for family in own:
        largest = family.name in LARGEST
        others = present if family.type == "gauge" and not largest else [*present, *ended]
        total = Metric(family.name, family.documentation, family.type)
        for sample in family.samples:
            values = [sample.value, *(other[_series(sample)] for other in others)]
            total.add_sample(sample.name, sample.labels, max(values) if largest else sum(values))
        yield total


def exposition(families: Iterable[Metric], accept: str = "") -> tuple[bytes, str]:
    """Return (text, media type) for a scraper that accepts `accept`. Takes some milliseconds: call it from a thread."""
    registry = CollectorRegistry()
    registry.register(_Families(lambda: families))
    encode, media_type = choose_encoder(accept)
    return encode(registry), media_type


class _Families(Collector):
    """Hands metrics to a registry."""

    def __init__(self, read: Callable[[], Iterable[Metric]]) -> None:
        self._read = read

    def collect(self) -> Iterable[Metric]:
        """Return the present values, at each scrape."""
        return self._read()

    def describe(self) -> Iterable[Metric]:
        """Return nothing: the metrics are known only when they are collected."""
        return []


def _each(metric: Kind, values: Sequence[str]) -> dict[str, Kind]:
    """Return the series of `metric` by the value of its label, so that no later call has to look it up."""
    return {value: metric.labels(value) for value in values}


def _series(sample: Sample) -> str:
    return json.dumps([sample.name, sample.labels])


def _resident_bytes() -> float:
    try:
        with open("/proc/self/statm") as table:
            return float(int(table.read().split()[1]) * os.sysconf("SC_PAGE_SIZE"))
    except OSError:
        return 0.0
