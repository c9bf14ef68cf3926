"""The results of the load generator in numbers: missing blocks, lateness of blocks, and latency of updates.

Model: the clock of a stream runs at its rate. Its zero is the least delayed block of the first second of the measured
    time. A block's lateness is its arrival minus that clock. A block is missing if it was due in the measured time and
    did not arrive by the end of the drain. An update is felt when the block arrives that follows an `applied` with its
    seq, or with a later one.
Limits: arrivals are those at the load generator, including its own delay; `own.pass_ms` reports how long that can be.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from tests.bench.live_stream import Stream

PERCENTILES = (50.0, 90.0, 99.0, 99.9)
ZERO_SECONDS = 1.0  # s at the start that give the least delayed block; a drift of the server's clock shows later
SHOWN_MISTAKES = 10

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Window:
    """The measured time, in seconds of perf_counter."""

    begin: float
    end: float

    @property
    def seconds(self) -> float:
        """Return its length."""
        return self.end - self.begin


def lateness(arrivals: Array, period: float, window: Window) -> tuple[Array, int]:
    """Return the lateness (s) of each block that was due in `window`, and the number of those that did not arrive.

    arrivals: of every block of a stream from the first on, s.
    period: of its blocks, s.
    """
    first = np.searchsorted(arrivals, window.begin)
    early = np.searchsorted(arrivals, window.begin + ZERO_SECONDS)
    if early == first:
        return np.zeros(0), round(window.seconds / period)
    clock = arrivals - period * np.arange(len(arrivals))
    zero = float(np.min(clock[first:early]))
    begin = int(np.ceil((window.begin - zero) / period))
    end = int(np.ceil((window.end - zero) / period))
    came = clock[begin:end] - zero
    return came, max(0, end - begin - len(came))


def spread(values: Array) -> dict[str, float | None]:
    """Return percentiles and the largest of `values` (s), in milliseconds; None without values."""
    if not len(values):
        return {name: None for name in ("p50", "p90", "p99", "p99.9", "max")}
    found = {f"p{share:g}": float(np.percentile(values, share)) for share in PERCENTILES}
    return {name: round(1e3 * value, 3) for name, value in (found | {"max": float(np.max(values))}).items()}


def report(streams: Sequence[Stream], window: Window, own: dict[str, Any], servers: dict[str, Any]) -> dict[str, Any]:
    """Return the JSON document of a run."""
    late, felt, missing, drifts = [], [], 0, []
    for stream in streams:
        if stream.ready is None:
            missing += 1
            continue
        period = stream.block / stream.ready["sample_rate"]
        came, lost = lateness(np.array(stream.arrivals), period, window)
        missing += lost
        late.append(came)
        felt.append(_felt(stream, window))
        drifts.append(_drift(came))
    lates, felts = (np.concatenate(parts) if parts else np.zeros(0) for parts in (late, felt))
    mistakes = [f"stream {index}: {what}" for index, one in enumerate(streams) for what in one.mistakes]
    problems = [said for one in streams for said in one.told]
    return {
        "streams": len(streams),
        "opened": sum(one.ready is not None for one in streams),
        "seconds": round(window.seconds, 3),
        "blocks_expected": len(lates) + missing,
        "blocks_received": len(lates),
        "missing": missing,
        "blocks_per_second": round(sum(_came(one, window) for one in streams) / window.seconds, 1),
        "received_bytes": sum(one.received_bytes for one in streams),
        "updates_sent": sum(len(one.sent) for one in streams),
        "updates_blocked": sum(one.blocked for one in streams),
        "lateness_ms": spread(lates),
        "later_than_10_ms": int(np.count_nonzero(lates > 0.01)),
        "drift_ms": round(1e3 * max((abs(drift) for drift in drifts), default=0.0), 3),
        "latency_ms": spread(felts),
        "mistakes": mistakes[:SHOWN_MISTAKES],
        "mistaken_streams": sum(one.mistaken > 0 for one in streams),
        "problems": problems[:SHOWN_MISTAKES],
        "own": own,
        "servers": servers,
    }


def _came(stream: Stream, window: Window) -> int:
    """Return the number of blocks that arrived in `window`, whenever they were due."""
    begin, end = np.searchsorted(np.array(stream.arrivals), (window.begin, window.end))
    return int(end - begin)


def _felt(stream: Stream, window: Window) -> Array:
    """Return the seconds from sending each update of `window` to the first block with the update applied."""
    felt = np.array(stream.felt)
    sent = np.array(stream.sent)[: len(felt)]
    within = (sent >= window.begin) & (sent < window.end)
    return np.asarray((felt - sent)[within])


def _drift(late: Array) -> float:
    """Return the lag (s) that the server's clock gained over the window: median of the last tenth minus the first."""
    tenth = max(1, len(late) // 10)
    return float(np.median(late[-tenth:]) - np.median(late[:tenth])) if len(late) else 0.0
