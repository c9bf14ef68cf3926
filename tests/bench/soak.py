"""Long runs: a day of a voice on a fast clock, and ten minutes of fifty hands on a real service; drift and memory.

    python -m tests.bench.soak day [--seconds 86400] [--rate 48000]
    python -m tests.bench.soak hands [--minutes 10] [--streams 50] [--workers 1]

Model: day: a live voice of a constant scan renders every frame of 24 h as fast as possible. Its phase is compared with
    exact integer arithmetic: frame * speed / (rate * period) turns. The clock that paces blocks runs through the same
    day on a simulated time, whose sleeps end late.
    hands: the load generator runs on the service. The growth of the service's memory is that from the second tenth of
    the time to the ninth. Its clock is compared with this machine's: by how much blocks arrive later at the end than at
    the beginning.
Limits: a day at 48 kHz is 4.1e9 frames: a few minutes of one core. A hand's voice costs several times that. Its phase
    is that of the received positions, so only the speed of its updates could drift.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from service.sessions.pacer import Pacer
from synth.scene.scene import parse_scene
from synth.voice.live_voice import LiveVoice
from tests.bench.bench_live import loaded
from tests.bench.process_use import family, resident_bytes
from tests.service.harness import Child, roomy_environment

DAY = 86_400.0  # s
SPEED, PERIOD = "37.3 mm/s", "0.811 mm"  # without a simple ratio to each other or to a rate
BLOCK = 480
WARM_SHARE = 0.02  # of the run, after which memory is first read: caches and pools are full by then
DRIFT_LIMIT = 1e-9  # turn in a day (the design's rule)
GROWTH_LIMIT = 0.05  # of memory, after the warm-up
TURN = 1 << 64  # of the phase, which wraps


def day(seconds: float, rate: int) -> dict[str, Any]:
    """Return the effect of a day on a live voice and on the clock of its blocks."""
    scene = parse_scene(
        {
            "texture": {"period": PERIOD},
            "scan": {"speed": SPEED},
            "output": {"quantity": "displacement", "sample_rate": rate},
        }
    )
    voice = LiveVoice(scene)
    first = voice.render(BLOCK)
    blocks, warm, began = round(seconds * rate) // BLOCK, 0, perf_counter()
    largest = float(np.max(np.abs(first)))
    for number in range(1, blocks):
        block = voice.render(BLOCK)
        if number == max(1, round(WARM_SHARE * blocks)):
            warm = resident_bytes(os.getpid())
        if number % 1000 == 0:
            largest = max(largest, float(np.max(np.abs(block))))
    took, after = perf_counter() - began, resident_bytes(os.getpid())
    drift = phase_error(voice, rate)
    return {
        "simulated_seconds": voice.frame / rate,
        "sample_rate": rate,
        "frames": voice.frame,
        "took_seconds": round(took, 1),
        "times_real_time": round(voice.frame / rate / took, 1),
        "drift_turns": drift,
        "drift_within": drift < DRIFT_LIMIT,
        "largest_sample": round(largest, 4),
        "resident_bytes": {"warm": warm, "end": after},
        "growth": round(after / warm - 1.0, 5) if warm else None,
        "growth_within": bool(warm) and after <= (1.0 + GROWTH_LIMIT) * warm,
        "clock_drift_seconds": clock_drift(seconds, rate),
    }


def phase_error(voice: LiveVoice, rate: int) -> float:
    """Return the error of the phase of a voice at constant speed, from frame * speed / (rate * period), in turns."""
    inner = voice._voice
    scene = inner.scene
    exact = inner.frame * Fraction(scene.scan.speed) / (rate * Fraction(scene.texture.period)) % 1
    away = (Fraction(int(inner.phase) % TURN, TURN) - exact) % 1
    return float(min(away, 1 - away))


def clock_drift(seconds: float, rate: int) -> float:
    """Return the error (s) of the deadlines of the pacing clock after a day of blocks."""
    now = 1e5 / 3.0
    start = now
    pacer = Pacer(rate, now)
    blocks = round(seconds * rate) // BLOCK
    for number in range(blocks):
        pacer.advance(number * BLOCK)
        now += max(0.0, pacer.due - now) + 1e-4 * ((number * 7919) % 97) / 97.0  # a sleep that ends up to 0.1 ms late
    ideal = Fraction((blocks - 1) * BLOCK, rate)
    return float(Fraction(pacer.due) - Fraction(start) - ideal)


def hands(minutes: float, streams: int, workers: int, module: str = "service") -> dict[str, Any]:
    """Return the effect of `minutes` of `streams` on a service, `python -m MODULE`: the load's report, and memory."""
    environment = roomy_environment() | {"RIDGEWAVE_WORKERS": str(workers)}
    seconds, memory = 60.0 * minutes, Memory()
    with tempfile.TemporaryDirectory() as folder:
        child = Child(module, Path(folder), **environment)
        try:
            url = child.url()
            memory.watch(child.process.pid)
            report = loaded(url, child.process.pid, streams, seconds)
        finally:
            memory.end()
            child.terminate()
    grown = memory.growth()
    return report | {
        "drift_within_a_block": report["drift_ms"] <= 1e3 * BLOCK / 48_000,
        "resident_bytes_of_time": memory.read[:: max(1, len(memory.read) // 20)],
        "growth": grown,
        "growth_within": grown is not None and grown <= GROWTH_LIMIT,
    }


class Memory:
    """Reads the memory of a process and its children once a second."""

    def __init__(self) -> None:
        self.read: list[int] = []
        self._over = threading.Event()
        self._thread: threading.Thread | None = None

    def watch(self, pid: int) -> None:
        """Begin."""

        def work() -> None:
            while not self._over.wait(1.0):
                self.read.append(sum(resident_bytes(member) for member in family(pid)))

        self._thread = threading.Thread(target=work)
        self._thread.start()

    def end(self) -> None:
        """End."""
        self._over.set()
        if self._thread is not None:
            self._thread.join()

    def growth(self) -> float | None:
        """Return the growth from the second tenth of the time (after the warm-up) to the ninth, between medians."""
        tenth = len(self.read) // 10
        if tenth == 0:
            return None
        warm, last = (np.median(part) for part in (self.read[tenth : 2 * tenth], self.read[-2 * tenth : -tenth]))
        return round(float(last / warm - 1.0), 5)


def main(words: Sequence[str] | None = None) -> int:
    """Run the soak test with the arguments `words`; return 0, or 1 where something drifted, grew or was missing."""
    made = argparse.ArgumentParser(prog="python -m tests.bench.soak", description="Test long runs.")
    kinds = made.add_subparsers(dest="kind", required=True)
    one = kinds.add_parser("day", help="a day of one voice on a fast clock")
    one.add_argument("--seconds", type=float, default=DAY)
    one.add_argument("--rate", type=int, default=48_000)
    many = kinds.add_parser("hands", help="minutes of many streams on a real service")
    many.add_argument("--minutes", type=float, default=10.0)
    many.add_argument("--streams", type=int, default=50)
    many.add_argument("--workers", type=int, default=1)
    many.add_argument("--module", default="service", help="module that is served, such as tests.service.serve_zeros")
    asked = made.parse_args(words)
    began = time.time()
    if asked.kind == "day":
        report = day(asked.seconds, asked.rate)
        good = report["drift_within"] and report["growth_within"]
    else:
        report = hands(asked.minutes, asked.streams, asked.workers, asked.module)
        good = report["drift_within_a_block"] and report["growth_within"] and not report["missing"]
    print(json.dumps(report | {"good": bool(good), "seconds_of_all": round(time.time() - began, 1)}, indent=1))
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
