"""The fades at the start and at the end of a finite render: the gain of each of its frames.

Model   A raised cosine over `output.fade`.
Source  design, section 4.
"""

from __future__ import annotations

import math

import numpy as np

from synth.arrays import Array


def fade_envelope(first: int, frames: int, total: int, fade_frames: int) -> Array:
    """Return the gains [frames] from frame `first` on of a render of `total` frames with fades of `fade_frames`."""
    n = np.arange(first, first + frames)
    near = np.minimum(n + 0.5, total - n - 0.5) / fade_frames
    return np.asarray(0.5 - 0.5 * np.cos(math.pi * np.clip(near, 0.0, 1.0)))
