"""The safety limiter: the cost of a frame of a live block, while nothing is limited and while every frame is."""

from __future__ import annotations

from functools import partial

import numpy as np

from synth.arrays import Block
from synth.voice.limiter import Limiter, look_ahead
from tests.bench.timing import Figure, figure, repeated

FRAMES = 480  # a block: 10 ms at 48 kHz
BLOCKS = 100  # one second
RATE = 48000


def figures(quick: bool) -> list[Figure]:
    """Return the lines of the limiter, on one core."""
    repeats = 3 if quick else 400
    return [
        limiting("limiter, nothing to limit", 0.9, 1, repeats),
        limiting("limiter, nothing to limit", 0.9, 4, repeats),
        limiting("limiter, every frame limited", 9.0, 1, repeats),
        limiting("limiter, every frame limited", 9.0, 4, repeats),
    ]


def limiting(name: str, loudness: float, channels: int, repeats: int) -> Figure:
    """Return the cost of a frame of noise of this loudness."""
    samples = loudness * np.random.default_rng(1).uniform(-1, 1, (FRAMES, channels))
    block: Block = samples.astype(np.float32)
    limiter, out = Limiter(channels, RATE, look_ahead(RATE)), np.empty_like(block)
    took = repeated(partial(_many, limiter, block, out), repeats)
    how = f"blocks of {FRAMES}, {channels} channel{'s' if channels > 1 else ''}, median of {repeats}"
    return figure(name, took, "ns/frame", None, how, scale=1e9 / (FRAMES * BLOCKS))


def _many(limiter: Limiter, block: Block, out: Block) -> None:
    for _ in range(BLOCKS):
        limiter.process_into(block, out)
