"""The metrics: one table of what the service counts and measures of itself, each row with its meaning.

docs/operations.md says the same and a test compares the two with what `/metrics` answers. Names follow Prometheus:
prefix `ridgewave_`, base units, `_total` for what only grows. No label ever holds what a client wrote, nor an id of a
session: every label's values are listed here, so the number of series is fixed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from service import PYTHON, VERSION, problems

STREAM_KINDS = ("http", "live", "play")
BUILDS = ("voice", "change")
POOLS = ("render", "solve", "block")
CLOSE_CODES = ("1000", "1001", "1006", "1007", "1008", "1009", "1011", "1012", "1013", "4408", "other")
LATENESS_BOUNDS = (0.0001, 0.0002, 0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0)
"""Seconds: from far less than a hand could feel to a lead that has run dry; changed, older series do not add up."""
LAG_BOUNDS = (0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0)
"""Seconds: from what the timer rounds to, by a block of 10 ms, to a process that was stopped for a while."""
WAIT_BOUNDS = (0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0)
"""Seconds: from a free thread to a service that nobody should be sent to."""
BUILD_BOUNDS = (0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0)
"""Seconds: from a response found in the cache to a scene that asks for everything."""


@dataclass(frozen=True, slots=True)
class Row:
    """One metric. `lasting`: what a worker that has gone counted still belongs to the sum of the service.

    constant: labels, with their values, that every series of it has.
    """

    name: str
    kind: Literal["counter", "gauge", "histogram"]
    sentence: str
    label: str = ""
    values: tuple[str, ...] = ("",)
    bounds: tuple[float, ...] = ()
    merge: Literal["sum", "largest"] = "sum"
    constant: Mapping[str, str] = field(default_factory=dict)

    @property
    def lasting(self) -> bool:
        """Return whether it stays when its worker goes: counts do, what is "now" does not."""
        return self.kind != "gauge" or self.merge == "largest"


_ROWS = (
    Row("ridgewave_streams", "gauge", "Streams under way: HTTP, live, and plays.", "kind", STREAM_KINDS),
    Row("ridgewave_streams_opened_total", "counter", "Streams opened.", "kind", STREAM_KINDS),
    Row("ridgewave_sessions", "gauge", "Sessions of plain HTTP, streaming or not."),
    Row(
        "ridgewave_frames_sent_total",
        "counter",
        "Frames sent or played, a frame of all channels.",
        "kind",
        STREAM_KINDS,
    ),
    Row(
        "ridgewave_block_lateness_seconds",
        "histogram",
        "How long after its time a block was handed to the connection; an HTTP stream has RIDGEWAVE_LEAD in hand.",
        "kind",
        ("http", "live"),
        LATENESS_BOUNDS,
    ),
    Row(
        "ridgewave_skipped_seconds_total",
        "counter",
        "Time that streams fell silent because the service was late; a reader that does not read is not counted.",
        "kind",
        ("http", "live"),
    ),
    Row(
        "ridgewave_loop_lag_seconds",
        "histogram",
        "How long after its time the event loop did what was due, looked at 20 times a second.",
        bounds=LAG_BOUNDS,
    ),
    Row("ridgewave_underruns_total", "counter", "Times that an audio device played silence for want of samples."),
    Row("ridgewave_limited_blocks_total", "counter", "Blocks that the safety limiter turned down."),
    Row("ridgewave_limited_seconds_total", "counter", "Sound in those blocks."),
    Row(
        "ridgewave_limiter_largest_reduction_decibels",
        "gauge",
        "The most that the safety limiter turned down since the start.",
        merge="largest",
    ),
    Row(
        "ridgewave_build_seconds",
        "histogram",
        "Time to open a voice, or to solve a change.",
        "what",
        BUILDS,
        BUILD_BOUNDS,
    ),
    Row(
        "ridgewave_pool_wait_seconds",
        "histogram",
        "Time that work waited to begin: renders, plans and pictures; solves of sessions; blocks that need a thread.",
        "pool",
        POOLS,
        WAIT_BOUNDS,
    ),
    Row("ridgewave_cache_hits_total", "counter", "Contact responses of sessions found in the cache."),
    Row("ridgewave_cache_misses_total", "counter", "Contact responses of sessions that had to be solved."),
    Row(
        "ridgewave_cache_bytes",
        "gauge",
        "Memory of the cached responses and tables; the bound is RIDGEWAVE_CACHE_BYTES a worker.",
    ),
    Row(
        "ridgewave_live_bytes",
        "gauge",
        "Memory of live sessions beside their voices, with recordings; the bound is RIDGEWAVE_LIVE_BYTES a worker.",
    ),
    Row("ridgewave_renders_under_way", "gauge", "Renders running or waiting."),
    Row("ridgewave_renders_total", "counter", "Finite sounds begun."),
    Row("ridgewave_problems_total", "counter", "Problem documents sent, by type.", "type", tuple(problems.TYPES)),
    Row("ridgewave_live_closes_total", "counter", "Live connections closed, by code.", "code", CLOSE_CODES),
    Row("ridgewave_updates_received_total", "counter", "Movements of hands received."),
    Row("ridgewave_updates_applied_total", "counter", "Movements that were used in a block."),
    Row("ridgewave_updates_dropped_total", "counter", "Movements replaced by a newer one before a block, or refused."),
    Row("ridgewave_cpu_seconds_total", "counter", "Processor time of the workers."),
    Row(
        "ridgewave_resident_memory_bytes",
        "gauge",
        "Resident memory of the workers; 0 where unknown.",
    ),
    Row(
        "ridgewave_workers",
        "gauge",
        "Running workers. Below RIDGEWAVE_WORKERS, one has died or is starting.",
    ),
    Row(
        "ridgewave_build_info",
        "gauge",
        "Always 1; its labels give the version and the Python version.",
        merge="largest",
        constant={"version": VERSION, "python": PYTHON},
    ),
)
TABLE: Mapping[str, Row] = {row.name: row for row in _ROWS}
