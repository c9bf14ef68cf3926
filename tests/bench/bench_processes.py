"""The command line as whole processes, measured as `bench_startup` does: help, first and later render, an hour."""

from __future__ import annotations

import tempfile
from pathlib import Path

from tests.bench.bench_startup import SCENE, measured
from tests.bench.timing import Figure, figure

RENDER = ["render", str(SCENE), "-o", "out.wav"]


def figures(quick: bool) -> list[Figure]:
    """Return the lines of short processes; on all cores."""
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
    """Return the peak memory of a one-hour render to a file (700 MB on disk while it runs)."""
    with tempfile.TemporaryDirectory() as name:
        took, peak = measured([*RENDER, "--duration", "1 h"], Path(name), Path(name) / "cache")
    how = f"largest resident size of the process, once; it took {took:.1f} s"
    return [figure("an hour at 48 kHz, peak memory", [peak], "MB", 300.0, how)]
