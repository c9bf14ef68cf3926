"""Many hands on the live protocol: the service compared with the same service that sends zeros, and the most streams.

Model: the two are served in turn, A B A B, each in its own processes, so that a temporary slowdown of the machine
    affects both. The load comes from a separate process (`live_load`). A ratio of 1 means that the synthesis has no
    effect on the streams. The most streams are found by doubling until a block is missing or one in a
    thousand is later than `LATE`, then by bisection. A step that fails is tried once more. Each run is reported
    on stderr as it ends.
Limits: server and load share the machine: on two cores two workers and the load compete. It takes minutes.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from tests.bench.timing import Figure
from tests.service.harness import ROOT, Child, roomy_environment

REAL, ZEROS = "service", "tests.service.serve_zeros"
LATE = 0.01  # s: a block of 10 ms that is one block late finds a player with one queued block empty
SEARCH_SECONDS = 10.0  # of one step of the search: a thousand blocks per stream
SCENES = 8  # different textures and loads, in turn
FIRST_STEP = 25  # first number of streams of the search
MOST = 1600  # largest number of streams of the search
UPDATES_HZ = 100.0
SETTLE = 10.0  # s that all streams run before the measured time, while the tables of new scenes are solved
Report = dict[str, Any]


def figures(
    quick: bool, *, seconds: float = 60.0, streams: int = 200, workers: int = 2, times: int = 1, search: bool = False
) -> list[Figure]:
    """Return the lines of the live protocol, each run `times` times.

    search: also find the most streams of a worker.
    quick: a few streams for a second, and no search.
    """
    if quick:
        seconds, streams, workers, search = 1.0, 4, 1, False
    turns = [(served(ZEROS, streams, seconds, workers), served(REAL, streams, seconds, workers)) for _ in range(times)]
    how = (
        f"{streams} streams, {workers} workers, {UPDATES_HZ:g} updates per second each, {SCENES} scenes, {seconds:g} s"
        f" after {min(SETTLE, seconds):g} s, {times} times"
    )
    lines = compared(turns, how)
    if search:
        for module, name in ((REAL, "live"), (ZEROS, "live, zeros")):
            most = float(most_streams(module))
            told = f"one worker, no block missing, one in 1000 later than {1e3 * LATE:g} ms, in {SEARCH_SECONDS:g} s"
            lines.append(Figure(f"{name}, most streams", most, most, "streams", None, told))
    return lines


def compared(turns: list[tuple[Report, Report]], how: str) -> list[Figure]:
    """Return the lines of alternated runs, (zeros, real) each."""
    zeros, real = ([turn[side] for turn in turns] for side in (0, 1))
    ratios = [one["blocks_per_second"] / other["blocks_per_second"] for other, one in turns]
    lines = [line_of("live, of the blocks of zeros", ratios, "x zeros", how)]
    for name, runs in (("live", real), ("live, zeros", zeros)):
        lines += [
            line_of(f"{name}, blocks", [run["blocks_per_second"] for run in runs], "1/s", how),
            line_of(f"{name}, blocks missing", [run["missing"] for run in runs], "blocks", how),
            line_of(f"{name}, broken streams", [run["mistaken_streams"] for run in runs], "streams", said(runs)),
            line_of(f"{name}, server", [100.0 * run["servers"]["processor"] for run in runs], "% core", how),
            line_of(f"{name}, load", [100.0 * run["own"]["processor"] for run in runs], "% core", "the load's own"),
        ]
        for kind, title in (("lateness_ms", "late"), ("latency_ms", "update to wire")):
            for share in ("p50", "p99", "p99.9", "max"):
                values = [run[kind][share] for run in runs if run[kind][share] is not None]
                lines += [line_of(f"{name}, {title} {share}", values, "ms", how)] if values else []
    return lines


def line_of(name: str, values: list[float], unit: str, how: str) -> Figure:
    """Return the line of a few runs: their mean, and the smallest."""
    return Figure(name, sum(values) / len(values), float(min(values)), unit, None, how)


def said(runs: list[Report]) -> str:
    """Return the first mistake that a run reports."""
    return next((what for run in runs for what in run["mistakes"]), "mistakes in the protocol: none")


def served(module: str, streams: int, seconds: float, workers: int) -> Report:
    """Return the report of `streams` streams on a service that is started for them."""
    environment = roomy_environment() | {"RIDGEWAVE_WORKERS": str(workers)}
    with tempfile.TemporaryDirectory() as folder:
        child = Child(module, Path(folder), **environment)
        try:
            return loaded(child.url(), child.process.pid, streams, seconds)
        finally:
            child.terminate()


def loaded(url: str, pid: int, streams: int, seconds: float, *words: str) -> Report:
    """Return the report of the load generator, run in a separate process, against `url`, served by `pid`."""
    words = ("--streams", str(streams), "--seconds", str(seconds), "--pid", str(pid), "--scenes", str(SCENES), *words)
    words = ("--updates", str(UPDATES_HZ), "--settle", str(min(SETTLE, seconds)), *words)
    command = [sys.executable, "-m", "tests.bench.live_load", url, *words]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=2.0 * seconds + 180.0, check=False)
    if done.returncode not in (0, 1) or not done.stdout:
        raise RuntimeError(f"the load generator failed: {done.stderr[-2000:]}")
    report: Report = json.loads(done.stdout)
    if not report["opened"]:
        raise RuntimeError(f"no stream opened: {report['mistakes'][:1]}")
    late = {share: round(value, 1) for share, value in report["lateness_ms"].items()}
    print(f"{streams} streams, {report['missing']} missing, late (ms) {late}", file=sys.stderr, flush=True)
    return report


def most_streams(module: str) -> int:
    """Return the most streams that one worker of `module` serves on time; 0 for none."""
    good, bad = 0, FIRST_STEP
    while bad <= MOST and carried(module, bad):
        good, bad = bad, 2 * bad
    while bad - good > max(1, good // 10):
        middle = (good + bad) // 2
        good, bad = (middle, bad) if carried(module, middle) else (good, middle)
    return good


def carried(module: str, streams: int) -> bool:
    """Return whether all blocks were on time in one of two runs; the second run is made only if the first fails."""
    return any(in_time(served(module, streams, SEARCH_SECONDS, 1)) for _ in range(2))


def in_time(report: Report) -> bool:
    """Return whether every block of every stream arrived, all but one in a thousand by `LATE`."""
    whole = report["missing"] == 0 and report["mistaken_streams"] == 0 and report["opened"] == report["streams"]
    return bool(whole and report["lateness_ms"]["p99.9"] <= 1e3 * LATE)
