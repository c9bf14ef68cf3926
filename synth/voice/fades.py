"""Fades at the start and at the end of a finite sound.

Model   A raised cosine over `output.fade` at the start and at the end of a finite render. A half cosine where a stream
        must end within a block that is already rendered.
Source  design, section 4.
"""

from __future__ import annotations

import math

import numpy as np

from synth.arrays import Array, Block


def faded(block: Block, fade_frames: int) -> Block:
    """Return the first `fade_frames` of `block` (or all, if it is shorter) under a half cosine that ends at zero."""
    frames = min(len(block), fade_frames)
    return under(block[:frames], end_gains(frames))


def end_gains(frames: int) -> Array:
    """Return the gains [frames] of a half cosine from 1 to 0; the last is 0."""
    return 0.5 + 0.5 * np.cos(math.pi * np.arange(1, frames + 1) / frames)


def under(block: Block, gains: Array) -> Block:
    """Return `block` with each frame multiplied by its gain."""
    return np.asarray(block * gains[:, np.newaxis], dtype=np.float32)


def fade_envelope(first: int, frames: int, total: int, fade_frames: int) -> Array:
    """Return the gains [frames] from frame `first` on of a render of `total` frames with fades of `fade_frames`."""
    n = np.arange(first, first + frames)
    near = np.minimum(n + 0.5, total - n - 0.5) / fade_frames
    return np.asarray(0.5 - 0.5 * np.cos(math.pi * np.clip(near, 0.0, 1.0)))


def reduction_warning(decibels: float) -> tuple[str, ...]:
    """Return a warning about the largest gain reduction (dB), or none if there was no reduction."""
    if decibels <= 0.0:
        return ()
    return (f"The safety limiter reduced the gain by up to {decibels:.1f} dB: give a larger full_scale.",)
