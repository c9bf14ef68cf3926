"""The answer of `/metrics`: snapshots of workers, merged into those of the service, in Prometheus's text.

Model: counts are summed over all workers there are and were, what is "now" over those that are. Text or OpenMetrics,
    as the scraper's Accept says; prometheus_client writes both.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import accumulate

from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, HistogramMetricFamily, Metric
from prometheus_client.exposition import choose_encoder
from prometheus_client.registry import CollectorRegistry

from service.operations.metrics import Series, Snapshot
from service.operations.metrics_table import TABLE, Row


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
