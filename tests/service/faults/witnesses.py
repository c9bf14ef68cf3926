"""Well-behaved streams beside a fault: the load generator in its own process, and the lateness of its blocks.

Model: one run spans a calm time and the time of the fault. The latest blocks of the two are compared, so that a busy
    machine affects both sides.
Limits: times are those of arrival at the witnesses (perf_counter, which all processes of a Linux machine share).
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from tests.bench.live_report import Window, lateness
from tests.service.harness import PATIENCE, ROOT

STREAMS = 4
TAIL_SECONDS = 1.0  # after the last time that is looked at
BLOCK, RATE = 480, 48000
LONGEST = 600.0  # s


@dataclass
class Witnesses:
    """The streams, running; their report is there once they have ended."""

    process: subprocess.Popen[str]
    kept: Path
    report: dict[str, Any] = field(default_factory=dict)

    def during(self, act: Callable[[], object]) -> Window:
        """Return the time that `act` takes."""
        begin = perf_counter()
        act()
        return Window(begin, perf_counter())

    def end(self) -> None:
        """End the streams properly and take their report; not at once, or their own end would seem a late block."""
        time.sleep(TAIL_SECONDS)
        self.process.terminate()
        output, errors = self.process.communicate(timeout=PATIENCE)
        assert output, errors
        self.report = json.loads(output)

    def latest(self, window: Window) -> float:
        """Return how late the latest block of a window came, over all streams, in seconds; inf where one is missing."""
        latest = 0.0
        with np.load(self.kept) as kept:
            for index in range(STREAMS):
                came, lost = lateness(kept[f"stream{index}"], BLOCK / RATE, window)
                latest = max([latest, np.inf if lost else 0.0, *came.tolist()])
        return latest


@contextmanager
def witnesses(url: str, folder: Path) -> Iterator[Witnesses]:
    """Yield witnesses whose streams run, on the service at `url`."""
    kept = folder / "arrivals.npz"
    words = ["--streams", str(STREAMS), "--seconds", str(LONGEST), "--settle", "0.2", "--drain", "0.2"]
    command = [sys.executable, "-m", "tests.bench.live_load", url, *words, "--arrivals", str(kept)]
    process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        assert process.stderr is not None
        first = process.stderr.readline()
        assert first == "measuring\n", first + process.stderr.read()
        yield Witnesses(process, kept)
    finally:
        if process.poll() is None:
            process.kill()
        process.communicate()
