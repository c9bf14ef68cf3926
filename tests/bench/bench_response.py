"""Building what a voice plays: the response at one load, and the rows of load that are solved while a hand plays."""

from __future__ import annotations

import statistics
from collections.abc import Iterator
from itertools import cycle
from time import perf_counter, sleep, thread_time

from synth import Motion, open_voice, parse_scene
from synth.plan.usual_hand import HAND_LOADS
from tests.bench.bench_voice import FRAMES, RATE, hand
from tests.bench.timing import Figure, figure, repeated

BLOCK_SECONDS = FRAMES / RATE
PATIENCE = 60.0  # s


def figures(quick: bool) -> list[Figure]:
    """Return the lines of the response; on one core."""
    quantities = ("displacement", "acceleration")
    built = [response(quantity, 3 if quick else 25) for quantity in quantities]
    return [*built, *(line for quantity in quantities for line in usual_range(quantity, 1 if quick else 7))]


def response(quantity: str, repeats: int) -> Figure:
    """Return how long a voice of the default scene takes to open, and how much of that the core worked on it."""
    scene = parse_scene({"output": {"quantity": quantity, "bandwidth": "full"}})
    worked: list[float] = []

    def opened() -> None:
        began = thread_time()
        open_voice(scene)
        worked.append(thread_time() - began)

    took = repeated(opened, repeats)
    busy = 1e3 * statistics.median(worked)
    how = f"tolerance 1e-3, constant load, only kernels cached, {busy:.1f} ms of work, median of {repeats}"
    return figure(f"response, {quantity}", took, "ms", 50.0, how, scale=1e3)


def usual_range(quantity: str, repeats: int) -> list[Figure]:
    """Return how long the rows of the usual range take beside a voice that plays, and what its blocks take."""
    runs = [played_meanwhile(quantity) for _ in range(repeats)]
    low, high = HAND_LOADS
    blocks = sum(len(times) for _ready, times in runs) // repeats
    how = f"{low:g} to {high:g} N in a thread, about {blocks} blocks played meanwhile, median of {repeats}"
    ready = figure(f"rows of load, {quantity}", [ready for ready, _times in runs], "s", 1.0, how)
    worst = [max(times) for _ready, times in runs]
    usual = 1e3 * statistics.median(time for _ready, times in runs for time in times)
    how = f"of each run, median of {repeats}; the median block took {usual:.3f} ms of its 10"
    return [ready, figure(f"worst block meanwhile, {quantity}", worst, "ms", None, how, scale=1e3)]


def played_meanwhile(quantity: str) -> tuple[float, list[float]]:
    """Return when the rows were ready, counted from the call that opened the voice, and the seconds of each block.

    A block is asked for when it is due, one each 10 ms; what a busy core makes it wait for counts.
    """
    scene = parse_scene({"output": {"quantity": quantity, "bandwidth": "full"}})
    motions = pressing()
    began = perf_counter()
    voice = open_voice(scene, live=True)
    times: list[float] = []
    try:
        due = perf_counter()
        while not voice.usual_loads_ready:
            voice.render(FRAMES, next(motions))
            times.append(perf_counter() - due)
            due = max(due + BLOCK_SECONDS, perf_counter())
            if due - began > PATIENCE:
                raise TimeoutError(f"the rows of load were not ready after {PATIENCE:g} s")
            sleep(max(0.0, due - perf_counter()))
        return perf_counter() - began, times
    finally:
        voice.close()


def pressing() -> Iterator[Motion]:
    """Yield the blocks of `hand` for ever."""
    return cycle(hand())
