"""Fades within a block, and the gain reduction of the limiter in words.

Model   A half cosine where a stream must end within a block that is already rendered. `plan.motion_peak.fades` has the
        fades of a finite render.
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


def reduction_warning(decibels: float) -> tuple[str, ...]:
    """Return a warning about the largest gain reduction (dB), or none if there was no reduction."""
    if decibels <= 0.0:
        return ()
    return (f"The safety limiter reduced the gain by up to {decibels:.1f} dB: give a larger full_scale.",)
