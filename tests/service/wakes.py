"""How late the machine itself wakes processes, so that a test of lateness does not blame the service for its host.

Model: a process on each core sleeps for `STEP` again and again and writes down how much longer it slept. A virtual
    machine that its host stops, and a core that others hold, delay these processes as they delay the service.
Limits: what is shorter than `NOTED` is not written down. Times are those of perf_counter, which all processes of a
    Linux machine share.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tests.bench.live_report import Window
from tests.service.harness import PATIENCE, ROOT, until

STEP = 0.001  # s
NOTED = 0.001  # s
WRITTEN = 0.05  # s until what was seen is in the file


class Wakes:
    """The sleepers of all cores, running, each with its file."""

    def __init__(self, files: list[Path]) -> None:
        self.files = files

    def latest(self, window: Window) -> float:
        """Return the longest delay of a wake that fell in `window`, s."""
        time.sleep(WRITTEN)
        lines = [line.split() for file in self.files for line in file.read_text().splitlines()]
        delays = [(float(woken), float(late)) for woken, late in lines]
        return max((late for woken, late in delays if woken >= window.begin and woken - late <= window.end), default=0)


@contextmanager
def wakes(folder: Path) -> Iterator[Wakes]:
    """Yield the sleepers of all cores that this process may use; their files are in `folder`."""
    sleepers, files = [], []
    try:
        for core in sorted(os.sched_getaffinity(0)):
            files.append(folder / f"wakes{core}.txt")
            command = [sys.executable, "-m", "tests.service.wakes", str(core)]
            with files[-1].open("w") as kept:
                sleepers.append(subprocess.Popen(command, cwd=ROOT, stdout=kept))
        until(lambda: all(file.read_text() for file in files))
        yield Wakes(files)
    finally:
        for sleeper in sleepers:
            sleeper.kill()
            sleeper.wait(PATIENCE)


def sleep_on(core: int) -> None:
    """Sleep on one core and print when this process woke late and by how much, s, until it is killed."""
    os.sched_setaffinity(0, {core})
    print(time.perf_counter(), 0.0, flush=True)
    while True:
        due = time.perf_counter() + STEP
        time.sleep(STEP)
        woken = time.perf_counter()
        if woken - due > NOTED:
            print(woken, woken - due, flush=True)


if __name__ == "__main__":
    sleep_on(int(sys.argv[1]))
