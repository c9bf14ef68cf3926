"""Preparing a voice: the response at one load, and everything that a hand needs before its first block."""

from __future__ import annotations

import statistics
from collections.abc import Callable
from time import thread_time

from synth import ResponseCache, open_voice, parse_scene
from synth.voice.voice import Voice
from tests.bench.bench_voice import FRAMES, hand
from tests.bench.timing import Figure, figure, repeated


def figures(quick: bool) -> list[Figure]:
    """Return the lines of the response, on one core."""
    quantities = ("displacement", "acceleration")
    built = [response(quantity, 3 if quick else 25) for quantity in quantities]
    return [*built, *(first_block(quantity, 1 if quick else 7) for quantity in quantities)]


def response(quantity: str, repeats: int) -> Figure:
    """Return the time to open a voice of the default scene, and how much of it is processor time."""
    scene = parse_scene({"output": {"quantity": quantity, "bandwidth": "full"}})
    return opening(f"response, {quantity}", lambda: open_voice(scene, cache=ResponseCache()), repeats, 50.0)


def first_block(quantity: str, repeats: int) -> Figure:
    """Return the time until a hand on a new scene has its first block."""
    scene, motion = parse_scene({"output": {"quantity": quantity}}), hand()[0]

    def opened() -> Voice:
        voice = open_voice(scene, cache=ResponseCache(), live=True)
        voice.render(FRAMES, motion)
        return voice

    return opening(f"first block of a hand, {quantity}", opened, repeats, 500.0)


def opening(name: str, opened: Callable[[], Voice], repeats: int, limit: float) -> Figure:
    """Return the time of `opened`, and how much of it is processor time."""
    worked: list[float] = []

    def once() -> None:
        began = thread_time()
        opened()
        worked.append(thread_time() - began)

    took = repeated(once, repeats)
    busy = 1e3 * statistics.median(worked)
    how = f"tolerance 1e-3, only kernels cached, {busy:.1f} ms of work, median of {repeats}"
    return figure(name, took, "ms", limit, how, scale=1e3)
