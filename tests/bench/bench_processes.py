"""The command line as whole processes, measured as in `bench_startup`: help, first and later render, an hour."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path

from tests.bench.bench_startup import ROOT, SCENE, measured
from tests.bench.timing import Figure, figure

SMALL = """
import json, sys
from pathlib import Path
from tests.bench.bench_startup import measured
words, folder, cache = json.loads(sys.argv[1])
print(json.dumps(measured(words, Path(folder), Path(cache))))
"""
RENDER = ["render", str(SCENE), "-o", "out.wav"]


def figures(quick: bool) -> list[Figure]:
    """Return the lines of short processes, on all cores."""
    repeats = 1 if quick else 9
    with tempfile.TemporaryDirectory() as name:
        folder, cache = Path(name), Path(name) / "cache"
        helps = [measured(["--help"], folder, cache)[0] for _ in range(repeats)]
        first = [measured(RENDER, folder, cache)[0]]
        later = [measured(RENDER, folder, cache)[0] for _ in range(repeats)]
    how = f"a process from start to end, median of {repeats}"
    return [
        figure("ridgewave --help", helps, "s", 0.3, how),
        figure("first render, kernels compiled", first, "s", 20.0, "a process with an empty cache of kernels, once"),
        figure("later render, kernels cached", later, "s", 1.5, how),
    ]


def hour(_quick: bool) -> list[Figure]:
    """Return the peak memory of a one-hour render to a file (700 MB on disk while it runs), and of compiling."""
    with tempfile.TemporaryDirectory() as name:
        folder, cache = Path(name), Path(name) / "cache"
        _, compiling = measured_from_small(RENDER, folder, cache)
        took, peak = measured_from_small([*RENDER, "--duration", "1 h"], folder, cache)
    how = f"largest resident size of the process, kernels cached, once; it took {took:.1f} s"
    return [
        figure("an hour at 48 kHz, peak memory", [peak], "MB", 300.0, how),
        figure("first render, peak memory", [compiling], "MB", None, "the same of two seconds, kernels compiled"),
    ]


def measured_from_small(words: list[str], folder: Path, cache: Path) -> tuple[float, float]:
    """Return the result of `measured`, called in a small process.

    Linux counts the memory of a process in the peak memory of its children, and this process has grown.
    """
    command = [sys.executable, "-c", SMALL, json.dumps([words, str(folder), str(cache)])]
    done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, check=True)
    took, peak = json.loads(done.stdout)
    return float(took), float(peak)
