"""Studies: many steady scenes of a comb and of a fingertip, in processes of this machine and on Dask workers.

Model: samples of period, amplitude, speed and load, 256 phases and 32 lines each, kernels compiled. The wall time of
    the whole run, parts and all, and that of twice as many Dask workers over once.
Limits: two processes on two cores; a fingertip is the same finger in every scene.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from time import perf_counter
from typing import Any

from synth.study.dataset import numbers_of, write_result
from synth.study.running import run
from synth.study.spec import StudySpec, read_spec
from tests.bench.timing import Figure, figure

COMBS, TIPS, ON_CLUSTER = 100_000, 10_000, 8_000
SECONDS = 240.0
AXES = {
    "texture.period": {"from": "0.2 mm", "to": "4 mm", "spacing": "log"},
    "texture.amplitude": {"from": "2 um", "to": "40 um"},
    "scan.speed": {"from": "10 mm/s", "to": "160 mm/s"},
    "scan.load": {"from": "0.05 N", "to": "1.8 N"},
}


def figures(quick: bool) -> list[Figure]:
    """Return the lines of two fingers, and of one and two workers; quick: a hundredth of the scenes."""
    part = 100 if quick else 1
    lines = []
    for finger, count in (("comb", COMBS // part), ("fingertip", TIPS // part)):
        seconds = timed(spec_of(finger, count), workers=2)
        limit = None if quick else SECONDS
        lines.append(figure(f"study, {finger}", [seconds], "s", limit, f"{count} scenes in two processes"))
    return [*lines, on_cluster(ON_CLUSTER // part)]


def spec_of(finger: str, count: int) -> StudySpec:
    """Return a study of `count` samples."""
    sample = {"kind": "latin_hypercube", "count": count, "seed": 1}
    return read_spec({"scene": {"finger": {"kind": finger}}, "axes": AXES, "sample": sample})


def timed(spec: StudySpec, *, begin: Callable[[], object] = lambda: None, **how: Any) -> float:
    """Return the wall time (s) from an empty folder to a NetCDF file."""
    with tempfile.TemporaryDirectory() as folder:
        parts = Path(folder) / "parts"
        begin()
        began = perf_counter()
        run(spec, parts, **how)
        write_result(spec, numbers_of(spec, parts), Path(folder) / "map.nc")
        return perf_counter() - began


def on_cluster(count: int) -> Figure:
    """Return the speed of two Dask workers over twice that of one."""
    distributed: Any = import_module("distributed")
    spec, seconds = spec_of("comb", count), []
    for workers in (1, 2):
        options = {"processes": True, "threads_per_worker": 1, "dashboard_address": None, "host": "127.0.0.1"}
        with distributed.LocalCluster(n_workers=workers, **options) as cluster:
            address = cluster.scheduler_address
            warm = spec_of("comb", 600)  # every worker loads its kernels
            timed(warm, scheduler=address)
            seconds.append(timed(spec, scheduler=address))
    how = f"{count} combs: {seconds[0]:.3g} s on one, {seconds[1]:.3g} s on two"
    return figure("study, two Dask workers over two times one", [seconds[0] / seconds[1] / 2.0], "", None, how)
