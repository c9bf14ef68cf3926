"""Hands that tap: what touching and letting go costs, where the tables that it takes fit into memory and where not.

Model: hands stroke and tap, in scenes that differ, block by block in turn, in this process: no network. A touch passes
    through every load from none to its own, and each interval of load at each speed has a table. In the first half of
    the time they are built; in the second they are there, or, in too little room, are built again and again.
Limits: the strokes and loads are those of `live_hand`; TAP_HZ and TOUCHING are unverified defaults.
"""

from __future__ import annotations

from itertools import chain
from time import perf_counter

import numpy as np

from synth.motion.update_smoothing import Update
from synth.response.cache import DEFAULT_BYTES, ResponseCache
from synth.response.phase_cells import QUINTIC, fill_surface, polynomials
from synth.response.table_budget import DEFAULT_LIMIT
from synth.scene.scene import parse_scene
from synth.voice.hand_voice import HandVoice
from tests.bench.live_hand import Hand, scene
from tests.bench.timing import Figure, alternated, figure

TAP_HZ, TOUCHING = 2.0, 0.7  # touches a second, and the part of the time that the finger is down
RATE, BLOCK = 48000, 480
LITTLE = 4  # times less room than the default
CELLS, HIGHEST = 2048, 380  # of the fullest table of the default scene


def figures(quick: bool, *, scenes: int = 8, hands: int = 24, seconds: float = 8.0) -> list[Figure]:
    """Return the lines of a table against its readable twin, and of tapping hands with room and with too little.

    quick: one scene and two hands for a fifth of a second.
    """
    if quick:
        scenes, hands, seconds = 1, 2, 0.2
    lines = [of_a_table(21 if quick else 201)]
    tapped(ResponseCache(), 1, 1, 0.1)  # compiles the loops
    for room, limit in (("room", DEFAULT_LIMIT), (f"1/{LITTLE} of it", DEFAULT_LIMIT // LITTLE)):
        cache = ResponseCache(DEFAULT_BYTES, limit)
        first, second = tapped(cache, scenes, hands, seconds)
        how = f"{hands} hands on {scenes} scenes, blocks of {BLOCK / RATE * 1e3:g} ms; a hundredth takes longer than"
        for part, took in (("tables built", first), ("after", second)):
            told = f"{how} {1e3 * np.percentile(took, 99):.2f} ms, the longest {1e3 * np.max(took):.1f}"
            mean = float(np.mean(took))
            lines.append(Figure(f"taps, {room}, {part}", 1e3 * mean, 1e3 * float(np.min(took)), "ms", None, told))
        lines.append(Figure(f"taps, {room}, tables", *2 * (cache.table_bytes / 1e6,), "MB", None, "at the end"))
    return lines


def of_a_table(repeats: int) -> Figure:
    """Return what a table takes, of what its readable twin takes."""
    random = np.random.default_rng(1)
    fall = np.arange(1, HIGHEST + 2) ** -2.5
    series = tuple((random.normal(size=HIGHEST + 1) + 1j * random.normal(size=HIGHEST + 1)) * fall for _ in range(4))
    single = np.empty((CELLS, QUINTIC + 1, 4), np.float32)

    def twin() -> None:
        for power, harmonics in enumerate(series):
            single[:, :, power] = polynomials(harmonics, QUINTIC, CELLS)

    compiled, readable = alternated([lambda: fill_surface(series, QUINTIC, single)], [twin], repeats)
    ratios = [one / other for one, other in zip(compiled, readable, strict=True)]
    return figure("table, of its readable twin's time", ratios, "x twin", None, f"{CELLS} cells, median of {repeats}")


def tapped(cache: ResponseCache, scenes: int, hands: int, seconds: float) -> tuple[list[float], list[float]]:
    """Return the seconds of each block in the first and in the second half of the time."""
    voices = [HandVoice(parse_scene(scene(index % scenes, RATE)), cache=cache) for index in range(hands)]
    moving = [Hand(index) for index in range(hands)]
    blocks = max(2, round(seconds * RATE / BLOCK))
    took = [[0.0] * hands for _ in range(blocks)]
    try:
        for number in range(blocks):
            now = np.array(number * BLOCK / RATE)
            for index, (voice, hand) in enumerate(zip(voices, moving, strict=True)):
                down = (TAP_HZ * float(now) + index / hands) % 1.0 < TOUCHING
                load = float(hand.load(now)) if down else 0.0
                voice.touch(Update(number, float(now), float(hand.position(now)), None, load))
                began = perf_counter()
                voice.render(BLOCK)
                took[number][index] = perf_counter() - began
    finally:
        for voice in voices:
            voice.close()
    half = blocks // 2
    return list(chain(*took[:half])), list(chain(*took[half:]))
