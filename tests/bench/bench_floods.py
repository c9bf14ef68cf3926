"""The effect of floods on another stream: the largest gap between two blocks, and missing blocks.

Model: one service of one worker. A neighbour (`live_load`: one realtime stream of 10 ms blocks, 100 updates per second)
    runs in a separate process. Another process floods (`flood`) with one kind of frame on one or several connections;
    each kind in turn. The line "no flood" is a run of the same length without a flood.
Limits: the service, the neighbour and the flood share the machine's cores; a gap includes the neighbour's own delay.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from tests.bench.flood import KINDS
from tests.bench.live_report import Window
from tests.bench.process_use import processor_seconds
from tests.bench.timing import Figure
from tests.service.harness import ROOT, Child, roomy_environment

SECONDS = 8.0  # of each flood that is not closed earlier
CONNECTIONS = (1, 8)
BLOCK_SECONDS = 0.01
GAP_MS = 50.0  # five blocks: a player that has five blocks queued does not run dry


def figures(quick: bool) -> list[Figure]:
    """Return the lines of each kind of flood."""
    seconds, kinds = (0.5, ["pings"]) if quick else (SECONDS, list(KINDS))
    with tempfile.TemporaryDirectory() as folder:
        child = Child("service", Path(folder), **roomy_environment())
        try:
            url, pid = child.url(), child.process.pid
            lines = disturbed("no flood", lambda: time.sleep(seconds), url, pid, Path(folder))[0]
            for kind in kinds:
                for connections in CONNECTIONS:
                    lines += flooded(kind, connections, seconds, url, pid, Path(folder))[0]
            return lines
        finally:
            child.terminate()


def flooded(
    kind: str, connections: int, seconds: float, url: str, pid: int, folder: Path
) -> tuple[list[Figure], list[dict[str, Any]]]:
    """Return the lines of one flood, and the result of each of its connections."""
    command = [sys.executable, "-m", "tests.bench.flood", url, kind, "--connections", str(connections)]
    command += ["--seconds", str(seconds)]

    def work() -> list[dict[str, Any]]:
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=60.0 + seconds, check=False)
        if done.returncode:
            raise RuntimeError(done.stderr[-2000:])
        peers: list[dict[str, Any]] = json.loads(done.stdout)["peers"]
        return peers

    (gap, missing), peers = disturbed(f"{kind} x {connections}", work, url, pid, folder)
    codes = "/".join(sorted({str(peer["code"]) if peer["closed"] else "open" for peer in peers}))
    took = f"{gap.how}; closed with {codes} after {max(peer['seconds'] for peer in peers):.1f} s"
    return [replace(gap, limit=GAP_MS, how=took), missing], peers


def disturbed(name: str, work: Callable[[], Any], url: str, pid: int, folder: Path) -> tuple[list[Figure], Any]:
    """Return the effect of `work` on a neighbour, and the result of `work`."""
    kept = folder / "arrivals.npz"
    words = ["--streams", "1", "--seconds", "600", "--settle", "0.5", "--drain", "0.2", "--arrivals", str(kept)]
    command = [sys.executable, "-m", "tests.bench.live_load", url, *words]
    process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        assert process.stderr is not None
        if process.stderr.readline() != "measuring\n":
            raise RuntimeError(process.stderr.read())
        time.sleep(1.0)
        used, begin = processor_seconds(pid), perf_counter()
        found = work()
        window = Window(begin, perf_counter())
        used = processor_seconds(pid) - used
        time.sleep(0.5)
        process.terminate()
        report = json.loads(process.communicate(timeout=30.0)[0])
    finally:
        if process.poll() is None:
            process.kill()
            process.communicate()
    with np.load(kept) as arrays:
        arrivals = arrays["stream0"]
    gaps = np.diff(arrivals[(arrivals >= window.begin - 0.1) & (arrivals <= window.end + 0.1)])
    how = f"{window.seconds:.1f} s, server at {100.0 * used / window.seconds:.0f} % of a core"
    gap = 1e3 * float(gaps.max()) if len(gaps) else 1e3 * window.seconds
    return [
        Figure(f"floods, {name}, largest gap", gap, gap, "ms", None, how),
        Figure(f"floods, {name}, missing", report["missing"], report["missing"], "blocks", None, how),
    ], found
