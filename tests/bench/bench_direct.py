"""Voices that solve eq. 1 along their motion: their cost, opening and memory.

Model: a hand that strokes 40 mm and presses, in blocks of 480 frames at 48 kHz; processor time over the time of the
    block. The surfaces are `rough` with a period of 20 mm, and a random track of 1 m at 5 um, mirrored at its ends.
    Over `dots` a hand circles at 100 mm/s. The track is opened in a fresh process with kernels loaded: the processor
    time from the scene to the first block of a hand, and the growth of the process. Linear algebra has one thread
    there, as in the service.
Limits: the cost of a surface depends on how much of it touches.
"""

from __future__ import annotations

import math
import os
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from synth.motion.motion import Motion
from synth.response_cache import ResponseCache
from synth.surfaces.surface_data import SurfaceData, remember
from synth.voice.voice import Voice, open_voice
from tests.bench.timing import Figure, figure

RATE, BLOCK = 48000, 480
FINGERS = ("comb", "probe", "fingertip")
SPACING, HEIGHTS = 5e-6, 200_000
SECONDS, MEGABYTES, PERCENT, OVER_AREA = 0.5, 200.0, 10.0, 25.0
PAGE = 4096  # bytes


def figures(quick: bool) -> list[Figure]:
    """Return the lines of three fingers on a rough surface and on a track; quick: few repeats."""
    blocks, lines = 20 if quick else 400, []
    for finger in FINGERS:
        costs = stroked(open_voice(rough(finger), live=True), blocks)
        lines.append(figure(f"direct, {finger}", costs, "% core", PERCENT, f"{blocks} blocks of {BLOCK} frames"))
    for finger in ("comb", "fingertip"):
        for turned in (0.0, 0.1):
            costs = led(open_voice(dots(finger), live=True), blocks, turned)
            name = f"area, {finger}, turned by {turned:g} rad" if turned else f"area, {finger}"
            lines.append(figure(name, costs, "% core", OVER_AREA, f"{blocks} blocks of {BLOCK} frames on dots"))
    how = f"{HEIGHTS} heights, {1e6 * SPACING:g} um apart"
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # of the fresh processes, as of the service
    for finger in FINGERS:
        with ProcessPoolExecutor(1, get_context("spawn")) as fresh:  # caches of another track would hide its memory
            opened, grown, costs = fresh.submit(on_track, finger, blocks).result()
        lines += [
            figure(f"track, {finger}, first block", [opened], "s", SECONDS, how),
            figure(f"track, {finger}, memory", [grown], "MB", MEGABYTES, how),
            figure(f"track, {finger}", costs, "% core", PERCENT, how),
        ]
    return lines


def on_track(finger: str, blocks: int) -> tuple[float, float, list[float]]:
    """Return the processor time to the first block on a track (s), the growth of the process (MB), and costs (%)."""
    stroked(open_voice(rough(finger), live=True), 1)  # loads the kernels
    scene, before, began = track(finger), resident(), process_time()
    voice = open_voice(scene, live=True, cache=ResponseCache())
    stroked(voice, 1)
    return process_time() - began, resident() - before, stroked(voice, blocks)


def rough(finger: str) -> dict[str, Any]:
    """Return a scene on a rough surface."""
    return {"finger": {"kind": finger}, "texture": {"kind": "rough", "period": "20 mm"}}


def dots(finger: str) -> dict[str, Any]:
    """Return a scene on dots."""
    return {"finger": {"kind": finger}, "texture": {"kind": "dots"}}


def track(finger: str) -> dict[str, Any]:
    """Return a scene on a random track of 1 m: waves of 20 um to 50 mm, 8 um rms."""
    hertz = np.fft.rfftfreq(HEIGHTS, SPACING)
    sizes = np.where((hertz > 20.0) & (hertz < 5e4), np.maximum(hertz, 1.0) ** -1.3, 0.0)
    phases = np.exp(2j * math.pi * np.random.default_rng(1).random(len(sizes)))
    heights = np.fft.irfft(sizes * phases, HEIGHTS)
    address = remember(SurfaceData((8e-6 / np.std(heights) * heights).astype(np.float32), (SPACING,)))
    return {"finger": {"kind": finger}, "texture": {"kind": "profile", "surface": address, "ends": "mirror"}}


def stroked(voice: Voice, blocks: int) -> list[float]:
    """Return the cost (% of a core) of each block of a hand that strokes and presses."""
    times = []
    for number in range(blocks):
        t = (number * BLOCK + np.arange(BLOCK)) / RATE
        place, load = 0.02 * (1.0 - np.cos(4.0 * math.pi * t)), 0.3 + 0.1 * np.sin(10.0 * math.pi * t)
        motion = Motion.of(BLOCK, position=place, load=load)
        began = process_time()
        voice.render(BLOCK, motion)
        times.append(100.0 * (process_time() - began) * RATE / BLOCK)
    return times


def led(voice: Voice, blocks: int, turned: float) -> list[float]:
    """Return the cost (% of a core) of each block of a hand that circles over an area at 100 mm/s and presses."""
    times = []
    for number in range(blocks):
        t = (number * BLOCK + np.arange(BLOCK)) / RATE
        place, across = 0.01 * np.cos(10.0 * t), 0.01 * np.sin(10.0 * t)
        load = 0.3 + 0.1 * np.sin(10.0 * math.pi * t)
        motion = Motion.of(BLOCK, position=place, across=across, direction=turned, load=load)
        began = process_time()
        voice.render(BLOCK, motion)
        times.append(100.0 * (process_time() - began) * RATE / BLOCK)
    return times


def resident() -> float:
    """Return the resident size of this process, MB."""
    return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * PAGE / 1e6
