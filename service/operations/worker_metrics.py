"""The metrics of all workers, collected by the one that receives the request.

Model: each worker stores its metrics in a file in the private folder of the workers: when another worker asks, every
    few seconds, and at its end. A scrape asks the others, waits a bounded time, and merges the files. A worker that
    answers late counts with its last file, and so does one that has ended: no counter ever falls.
Limits: what a killed worker counted since its last file is lost. Files of ended workers (8 kB each) stay until the
    service ends.
"""

from __future__ import annotations

import asyncio
import json
import logging
import os
from pathlib import Path
from typing import Any

from prometheus_client.core import Metric

from service.operations.metrics import Metrics, Snapshot, exposition, merged, snapshot
from service.operations.worker_messages import WorkerMessages

log = logging.getLogger("ridgewave.service")

ANSWER_SECONDS = 1.0  # for the other workers to store theirs; a longer wait delays the scrape where a worker hangs
WRITE_SECONDS = 5.0  # between files; a killed worker loses what it counted in this time


class WorkerMetrics:
    """The metrics of one worker, and through the others those of the service."""

    def __init__(self, metrics: Metrics, messages: WorkerMessages, folder: Path | None) -> None:
        self._metrics = metrics
        self._messages = messages
        self._folder = folder

    async def metrics(self, accept: str) -> tuple[bytes, str]:
        """Return the answer of `/metrics` and its media type."""
        question = self._messages.ask("metrics")
        own = self._metrics.families()
        self._store(snapshot(own))  # a count that a scrape has seen must outlive this worker
        await question.wait(ANSWER_SECONDS)
        return await asyncio.to_thread(self._exposition, own, accept)

    def write(self) -> dict[str, Any]:
        """Store the metrics; does nothing where there is only one worker."""
        if self._folder is not None:
            self._store(snapshot(self._metrics.families()))
        return {}

    async def keep_writing(self) -> None:
        """Store the metrics every few seconds, until cancelled."""
        while self._folder is not None:
            self.write()
            await asyncio.sleep(WRITE_SECONDS)

    def _store(self, values: Snapshot) -> None:
        if self._folder is None:
            return
        part = self._folder / f"{self._messages.name}.part"
        try:
            part.write_text(json.dumps(values))
            os.replace(part, self._folder / f"{self._messages.name}.json")
        except OSError:
            log.exception("our mistake: the metrics of a worker could not be stored")

    def _exposition(self, own: list[Metric], accept: str) -> tuple[bytes, str]:
        files = () if self._folder is None else sorted(self._folder.glob("*.json"))
        others = {path.stem: json.loads(path.read_text()) for path in files if path.stem != self._messages.name}
        running = self._messages.present()
        present = [values for name, values in others.items() if name in running]
        ended = [values for name, values in others.items() if name not in running]
        return exposition(merged(own, present, ended), accept)
