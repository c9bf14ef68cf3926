"""What a service of several workers tells of itself as one: its metrics, also those of workers that have died.

Model: each worker keeps its snapshot in a file of the workers' private folder: when it is asked, every few seconds, and
    at its end. A scrape asks all the others to write theirs, waits a bounded time, and adds the files up. One that
    answers late counts with what it wrote last, and one that died too, so no count ever falls; what is "now" counts
    only for those that are there.
Limits: a worker that is killed takes with it what it counted since it last wrote. Files of the dead stay, some 5 kB
    each, until the service ends.
"""

from __future__ import annotations

import asyncio
import json
import logging
import os
from pathlib import Path
from typing import Any

from service.operations.metrics import Metrics, Snapshot
from service.operations.metrics_text import exposition, merged
from service.operations.worker_messages import Siblings

log = logging.getLogger("ridgewave.service")

ANSWER_SECONDS = (
    1.0  # for the others to write theirs: less misses a busy one, more holds a scrape up for one that hangs
)
WRITE_SECONDS = 5.0  # between snapshots kept of a worker that nobody asks: a killed one loses at most so much


class Telling:
    """The metrics of one worker, and through its siblings those of the service."""

    def __init__(self, metrics: Metrics, siblings: Siblings, folder: Path | None) -> None:
        self._metrics = metrics
        self._siblings = siblings
        self._folder = folder

    async def metrics(self, accept: str) -> tuple[bytes, str]:
        """Return the answer of `/metrics` and its media type."""
        question = self._siblings.ask("metrics")
        own = self._metrics.snapshot()
        self._keep(own)  # what was told once must not be lost with this worker
        await question.wait(ANSWER_SECONDS)
        return await asyncio.to_thread(self._written, own, self._siblings.present(), accept)

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
        part = self._folder / f"{self._siblings.name}.part"
        try:
            part.write_text(json.dumps(snapshot))
            os.replace(part, self._folder / f"{self._siblings.name}.json")
        except OSError:
            log.exception("our mistake: the metrics of a worker could not be kept")

    def _written(self, own: Snapshot, present: set[str], accept: str) -> tuple[bytes, str]:
        here: list[Snapshot] = [own]
        gone: list[Snapshot] = []
        for path in () if self._folder is None else sorted(self._folder.glob("*.json")):
            if path.stem != self._siblings.name:
                (here if path.stem in present else gone).append(json.loads(path.read_text()))
        return exposition(merged(here, gone), accept)
