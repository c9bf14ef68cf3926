"""The effect of each route's largest valid input on another stream: the largest gap between two blocks.

Model: one service of one worker. A neighbour (`live_load`: one realtime stream of 10 ms blocks, 100 updates per second)
    runs in a separate process all the time. This process sends one kind of request (`largest_inputs`) five times a
    second, each kind in turn, and before each kind nothing for as long. The value is what the requests add to the
    largest gap; median of the runs.
Limits: the service, its processes, the neighbour and this process share the machine's cores. A request that finds
    AT_A_TIME others unanswered is left out, so that a route that takes long is asked less often; the line counts the
    answers.
"""

from __future__ import annotations

import json
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import numpy as np
import numpy.typing as npt

from tests.bench.largest_inputs import Ask, kinds
from tests.bench.live_report import Window
from tests.bench.timing import Figure
from tests.service.harness import ROOT, Child, roomy_environment

RUNS = 5
SECONDS = 3.0  # of each kind in a run, and of the quiet before it
EACH = 0.2  # s from request to request
AT_A_TIME = 8  # unanswered requests
ADDED_MS = 50.0  # five blocks: a player that has five blocks queued does not run dry
ANSWERED = 60.0  # s for the last answers
QUICK = ("GET /openapi.json", "GET /v1/threshold")

Arrivals = npt.NDArray[np.float64]


def figures(quick: bool, names: tuple[str, ...] = ()) -> list[Figure]:
    """Return a line for each kind of request. names: of the kinds; all of them if there is none."""
    runs, seconds = (1, 0.5) if quick else (RUNS, SECONDS)
    wanted = names or (QUICK if quick else ())
    with tempfile.TemporaryDirectory() as folder:
        own = {"DATA_FOLDER": str(Path(folder) / "data"), "MAX_UPDATES": "100000", "SESSION_IDLE": "3600"}
        child = Child(
            "service",
            Path(folder),
            **roomy_environment(),
            **{f"RIDGEWAVE_{name}": value for name, value in own.items()},
        )
        try:
            url = child.url()
            asks = {kind.name: kind.prepare() for kind in kinds(url) if not wanted or kind.name in wanted}
            found: dict[str, list[Run]] = {name: [] for name in asks}
            arrivals = Path(folder) / "arrivals.npz"
            with neighbour(url, arrivals):
                for _ in range(runs):
                    for name, ask in asks.items():
                        found[name].append(run(ask, seconds))
            with np.load(arrivals) as kept:
                return [line(name, made, kept["stream0"]) for name, made in found.items()]
        finally:
            child.terminate()


@dataclass(frozen=True, slots=True)
class Run:
    """The times of one run of one kind, and how often each answer came."""

    quiet: Window
    busy: Window
    answers: Counter[str]


def run(ask: Ask, seconds: float) -> Run:
    """Wait for `seconds`, then ask for as long."""
    begin = perf_counter()
    time.sleep(seconds)
    between = perf_counter()
    answers = asked_often(ask, seconds)
    return Run(Window(begin, between), Window(between, perf_counter()), answers)


def line(name: str, runs: list[Run], arrived: Arrivals) -> Figure:
    """Return the line of the kind `name`."""
    without = [largest_gap_ms(arrived, one.quiet) for one in runs]
    beside = [largest_gap_ms(arrived, one.busy) for one in runs]
    added = [one - other for one, other in zip(beside, without, strict=True)]
    answers = sum((one.answers for one in runs), Counter[str]())
    told = ", ".join(f"{count} x {answer}" for answer, count in sorted(answers.items()))
    gaps = f"{statistics.median(beside):.0f} ms beside it, {statistics.median(without):.0f} without"
    how = f"{gaps}, median of {len(runs)}; answers: {told}"
    return Figure(f"inputs, {name}", statistics.median(added), min(added), "ms", ADDED_MS, how)


def largest_gap_ms(arrived: Arrivals, during: Window) -> float:
    """Return the largest time between two blocks of the neighbour in a window, ms."""
    inside = arrived[(arrived >= during.begin - 0.1) & (arrived <= during.end + 0.1)]
    return 1e3 * float(np.diff(inside).max()) if len(inside) > 1 else 1e3 * during.seconds


def asked_often(ask: Ask, seconds: float) -> Counter[str]:
    """Ask for `seconds`, once each EACH seconds, and wait for the answers. Return how often each came."""
    places, threads, answers = threading.Semaphore(AT_A_TIME), [], Counter[str]()

    def once() -> None:
        try:
            answers[str(ask())] += 1
        except Exception as error:  # a benchmark tells what happened
            answers[type(error).__name__] += 1
        finally:
            places.release()

    began = perf_counter()
    for number in range(max(1, round(seconds / EACH))):
        time.sleep(max(0.0, began + number * EACH - perf_counter()))
        if places.acquire(blocking=False):
            threads.append(threading.Thread(target=once, daemon=True))
            threads[-1].start()
        else:
            answers["left out"] += 1
    until = perf_counter() + ANSWERED
    for thread in threads:
        thread.join(max(0.0, until - perf_counter()))
    return answers


@contextmanager
def neighbour(url: str, arrivals: Path) -> Iterator[None]:
    """Let a neighbour stream meanwhile; at the end the arrival times of its blocks are in the file `arrivals`."""
    words = ["--streams", "1", "--seconds", "3600", "--settle", "1", "--drain", "0.2", "--arrivals", str(arrivals)]
    command = [sys.executable, "-m", "tests.bench.live_load", url, *words]
    process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        assert process.stderr is not None
        if process.stderr.readline() != "measuring\n":
            raise RuntimeError(process.stderr.read())
        yield
        time.sleep(0.5)
        process.terminate()
        json.loads(process.communicate(timeout=30.0)[0])
    finally:
        if process.poll() is None:
            process.kill()
            process.communicate()
