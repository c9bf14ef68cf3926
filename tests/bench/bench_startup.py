"""The command line as whole processes: help, the first render of an environment, a later one, and an hour of sound.

    python -m tests.bench.bench_startup [RUNS]

Times are on the wall clock, from start to end, as the median of RUNS (default 5). The first render is measured once: it
compiles its kernels into an empty cache. The hour is measured by its largest resident size. The limits are the
project's own, for two cores.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SCENE = ROOT / "docs" / "examples" / "paper-finger.json"


def measured(words: list[str], folder: Path, cache: Path) -> tuple[float, float]:
    """Return seconds and megabytes of `ridgewave WORDS` as a separate process, with its kernels cached in `cache`."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "NUMBA_CACHE_DIR": str(cache)}
    command = [sys.executable, "-m", "clients", *words]
    started = time.perf_counter()
    process = subprocess.Popen(command, cwd=folder, env=environment, stdout=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    took = time.perf_counter() - started
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, command)
    return took, used.ru_maxrss / 1024


def of_libraries() -> float:
    """Return the seconds of a process that imports NumPy and Numba only."""
    started = time.perf_counter()
    subprocess.run([sys.executable, "-c", "import numpy, numba"], check=True)
    return time.perf_counter() - started


def main(runs: int) -> None:
    """Print one line per figure."""
    with tempfile.TemporaryDirectory() as name:
        folder, cache = Path(name), Path(name) / "cache"
        render = ["render", str(SCENE), "-o", "out.wav"]
        helps = [measured(["--help"], folder, cache)[0] for _ in range(runs)]
        first, _ = measured(render, folder, cache)
        later = [measured(render, folder, cache)[0] for _ in range(runs)]
        libraries = statistics.median(of_libraries() for _ in range(runs))
        _, hour = measured([*render, "--duration", "1 h"], folder, cache)
    figures = [
        ("ridgewave --help", "s", 0.3, statistics.median(helps)),
        ("first render, kernels compiled", "s", 20.0, first),
        ("later render, kernels cached", "s", 1.5, statistics.median(later)),
        ("over that of NumPy and Numba", "", 2.5, statistics.median(later) / libraries),
        ("an hour at 48 kHz, peak memory", "MB", 300.0, hour),
    ]
    for what, unit, limit, value in figures:
        verdict = "within" if value <= limit else "OVER"
        print(f"{what:32} {value:8.3f} {unit:2}   limit {limit:5.1f} {unit:2}   {verdict}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 5)
