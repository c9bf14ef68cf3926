"""Prints the resident memory of the service while height maps are opened live and closed, round after round.

    python -m tests.bench.memory_curve [--maps 6] [--points 2000] [--rounds 10]

Model   Random maps are imported, all distinct. Before the first round, a catalogue texture and one of the maps are
        opened and closed, so that every kernel is loaded. In each round all maps are opened as live streams, touched
        for 0.2 s, and closed. Resident memory is that of all processes of the service, SETTLED after the last
        stream, then that of each process, the service first.
Limits  Needs /proc. Resident memory also holds free memory that the allocator has not given back to the system.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from contextlib import ExitStack, closing
from pathlib import Path
from typing import Any

import httpx
import numpy as np

from clients.client_errors import ConnectionLost
from clients.http_client.sync_client import Client
from clients.live_client.sync_live import Live
from synth.scene.catalogue import FINGER
from tests.bench.process_use import family, resident_bytes
from tests.service.harness import Child, roomy_environment

SPACING = 5e-6  # m: a map of 2,000 x 2,000 heights has 10 mm x 10 mm
SHORTEST = 5e-4  # m, wave of a map
ROUGHNESS = 1e-5  # m, Rq of a map
GAUGES = ("ridgewave_cache_bytes", "ridgewave_live_bytes")
ALONG_LINE = "grating-1mm-31um"  # a finger on it cannot turn
STEPS, TURN = 20, 0.01  # updates in a stream, and rad between two
TRIES = 5  # of opening a stream
SETTLED = 8.0  # s after the last stream: free memory goes back 3 to 6 s after it


def main() -> None:
    """Print one line for each round."""
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--maps", type=int, default=6)
    asked.add_argument("--points", type=int, default=2000, help="along and across each map")
    asked.add_argument("--rounds", type=int, default=10)
    asked.add_argument("--comb", action="store_true", help="with the paper's comb in place of a fingertip")
    options = asked.parse_args()
    finger = {} if options.comb else FINGER
    with tempfile.TemporaryDirectory() as folder:
        places = {"RIDGEWAVE_DATA_FOLDER": str(Path(folder) / "data"), **roomy_environment()}
        child = Child("service", Path(folder), **places)
        try:
            url = child.url()
            names = [_import(url, Path(folder), number, options.points) for number in range(options.maps)]
            print(f"{'':12}{'open':>8}{'closed':>8} {'cache':>8} {'live':>8} {'s':>8}  MB; each process", flush=True)
            _round("nothing", url, child.process.pid, finger, [])
            _round("warm-up", url, child.process.pid, finger, [ALONG_LINE, names[0]])
            for number in range(options.rounds):
                _round(f"round {number + 1}", url, child.process.pid, finger, names)
        finally:
            child.terminate()


def _import(url: str, folder: Path, seed: int, points: int) -> str:
    path = folder / f"map-{seed}.npy"
    np.save(path, random_map(points, seed))
    with Client(url) as client:
        made = client.import_texture(path, unit="m", pixel=f"{SPACING} m", level="none")
    path.unlink()
    name: str = made["name"]
    return name


def random_map(points: int, seed: int) -> np.ndarray[Any, np.dtype[np.float32]]:
    """Return random heights [points, points], m, with waves of SHORTEST and longer."""
    turns = np.fft.fftfreq(points, SPACING)
    kept = np.hypot(turns[:, np.newaxis], turns[np.newaxis, : points // 2 + 1]) < 1.0 / SHORTEST
    noise = np.random.default_rng(seed).standard_normal((points, points), np.float32)
    heights = np.fft.irfft2(np.fft.rfft2(noise) * kept, (points, points))
    return (heights * (ROUGHNESS / np.std(heights))).astype(np.float32)


def _round(name: str, url: str, pid: int, finger: dict[str, Any], textures: list[str]) -> None:
    began = time.perf_counter()
    with ExitStack() as streams:
        for texture in textures:
            live = streams.enter_context(closing(_opened(url, {"finger": finger, "texture": {"kind": texture}})))
            for step in range(STEPS):  # along the surface, and turned by a few degrees
                turned = None if texture == ALONG_LINE else TURN * step
                live.move(x=2e-4 * step, y=1e-4 * step, direction=turned, load=0.3)
                live.read(480)
        opened = sum(map(_megabytes, family(pid)))
    took = time.perf_counter() - began
    time.sleep(SETTLED)
    lines = httpx.get(f"{url}/metrics", timeout=30.0).text.splitlines()
    found = dict(line.split(" ", 1) for line in lines if line.startswith(GAUGES))
    gauges = " ".join(f"{1e-6 * float(found[gauge]):8.1f}" for gauge in GAUGES)
    each = " + ".join(f"{_megabytes(one):.0f}" for one in family(pid))
    print(f"{name:12}{opened:8.0f}{sum(map(_megabytes, family(pid))):8.0f} {gauges} {took:8.1f}  {each}", flush=True)


def _opened(url: str, scene: dict[str, Any]) -> Live:
    """Return a live stream. On a busy machine the first one is ready only at a later try."""
    for left in reversed(range(TRIES)):
        try:
            return Live(scene, url=f"{url.replace('http', 'ws', 1)}/v1/live").__enter__()
        except ConnectionLost:
            if not left:
                raise
    raise AssertionError("there is a last try")


def _megabytes(pid: int) -> float:
    return 1e-6 * resident_bytes(pid)


if __name__ == "__main__":
    main()
