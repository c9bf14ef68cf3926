"""What a service of several workers tells of itself as one: its metrics, also those of workers that have died.

Model: each worker keeps its snapshot in a file of the workers' private folder: when it is asked, every few seconds, and
    at its end. A scrape asks all the others to write theirs, waits a bounded time, and adds the files up: counts over
    all workers there are and were, what is "now" over those that are. One that answers late counts with what it wrote
    last, and one that died too, so no count ever falls. prometheus_client writes the answer, as text or OpenMetrics.
    Its own mode for several processes takes 4 us a block, these counts 1 us, and has no gauge that is read on demand.
Limits: a worker that is killed takes with it what it counted since it last wrote. Files of the dead stay, some 5 kB
    each, until the service ends.
"""

from __future__ import annotations

import asyncio
import json
import logging
import os
from collections.abc import Iterable, Iterator, Sequence
from itertools import accumulate
from pathlib import Path
from typing import Any

from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, HistogramMetricFamily, Metric
from prometheus_client.exposition import choose_encoder
from prometheus_client.registry import CollectorRegistry

from service.operations.metrics import Metrics, Series, Snapshot
from service.operations.metrics_table import TABLE, Row
from service.operations.worker_messages import WorkerMessages

log = logging.getLogger("ridgewave.service")

ANSWER_SECONDS = (
    1.0  # for the others to write theirs: less misses a busy one, more holds a scrape up for one that hangs
)
WRITE_SECONDS = 5.0  # between snapshots kept of a worker that nobody asks: a killed one loses at most so much


class WorkerMetrics:
    """The metrics of one worker, and through the others those of the service."""

    def __init__(self, metrics: Metrics, messages: WorkerMessages, folder: Path | None) -> None:
        self._metrics = metrics
        self._messages = messages
        self._folder = folder

    async def metrics(self, accept: str) -> tuple[bytes, str]:
        """Return the answer of `/metrics` and its media type."""
        question = self._messages.ask("metrics")
        own = self._metrics.snapshot()
        self._keep(own)  # what was told once must not be lost with this worker
        await question.wait(ANSWER_SECONDS)
        return await asyncio.to_thread(self._written, own, self._messages.present(), accept)

    def write(self) -> dict[str, Any]:
        """Keep the snapshot as it is now; nothing where there is one worker only."""
        if self._folder is not None:
            self._keep(self._metrics.snapshot())
        return {}

    async def keep_writing(self) -> None:
        """Keep the snapshot every few seconds, until cancelled."""
        while self._folder is not None:
            self.write()
            await asyncio.sleep(WRITE_SECONDS)

    def _keep(self, snapshot: Snapshot) -> None:
        if self._folder is None:
            return
        part = self._folder / f"{self._messages.name}.part"
        try:
            part.write_text(json.dumps(snapshot))
            os.replace(part, self._folder / f"{self._messages.name}.json")
        except OSError:
            log.exception("our mistake: the metrics of a worker could not be kept")

    def _written(self, own: Snapshot, present: set[str], accept: str) -> tuple[bytes, str]:
        here: list[Snapshot] = [own]
        gone: list[Snapshot] = []
        for path in () if self._folder is None else sorted(self._folder.glob("*.json")):
            if path.stem != self._messages.name:
                (here if path.stem in present else gone).append(json.loads(path.read_text()))
        return exposition(merged(here, gone), accept)


def merged(present: Sequence[Snapshot], gone: Sequence[Snapshot] = ()) -> Snapshot:
    """Return the snapshot of the service: of the workers that are there, and of those that were."""
    return {
        row.name: {
            value: _merge(row, [snapshot[row.name][value] for snapshot in (*present, *(gone if row.lasting else ()))])
            for value in row.values
        }
        for row in TABLE.values()
    }


def exposition(snapshot: Snapshot, accept: str = "") -> tuple[bytes, str]:
    """Return (text, media type) of `snapshot` for a scraper that accepts `accept`; some milliseconds, for a thread."""
    registry = CollectorRegistry()
    registry.register(_Collector(snapshot))
    encode, media_type = choose_encoder(accept)
    return encode(registry), media_type


class _Collector:
    """Shows one snapshot to a registry."""

    def __init__(self, snapshot: Snapshot) -> None:
        self._snapshot = snapshot

    def describe(self) -> Iterable[Metric]:
        return []

    def collect(self) -> Iterator[Metric]:
        for row in TABLE.values():
            yield _family(row, self._snapshot[row.name])


def _merge(row: Row, values: Sequence[float | list[float]]) -> float | list[float]:
    if row.kind == "histogram":
        return [sum(column) for column in zip(*(value for value in values if isinstance(value, list)), strict=True)]
    numbers = [value for value in values if not isinstance(value, list)]
    return max(numbers, default=0.0) if row.merge == "largest" else sum(numbers)


def _family(row: Row, series: Series) -> Metric:
    own = [row.label] if row.label else []
    labels, constant = [*own, *row.constant], list(row.constant.values())
    if row.kind == "histogram":
        histogram = HistogramMetricFamily(row.name, row.sentence, labels=labels)
        for value, entry in series.items():
            assert isinstance(entry, list)
            *counts, total = entry
            names = [*map(str, row.bounds), "+Inf"]
            buckets = list(zip(names, accumulate(counts), strict=True))
            histogram.add_metric([value][: len(own)] + constant, buckets, total)
        return histogram
    family = (CounterMetricFamily if row.kind == "counter" else GaugeMetricFamily)(
        row.name, row.sentence, labels=labels
    )
    for value, number in series.items():
        assert not isinstance(number, list)
        family.add_metric([value][: len(own)] + constant, number)
    return family
