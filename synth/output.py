"""What leaves a voice: fades of a finite render, and the safety limiter.

Model   Fade: a raised cosine over `output.fade` at the start and at the end of a finite render.
        Limiter: samples within full scale pass unchanged. Where one would pass full scale, the gain of all channels
        falls at once to what holds it at full scale, and comes back over RELEASE_TIME.
Source  design, sections 4 and 8. The release time is an unverified default.
Limits  the gain falls within one sample, so a peak beyond full scale is squeezed, not softened; it never exceeds 1.0.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from synth.contact.kernels import kernel

Block = np.ndarray[Any, np.dtype[np.float32]]
Gains = np.ndarray[Any, np.dtype[np.float64]]

RELEASE_TIME = 0.05  # s; shorter is rougher, longer ducks what follows a peak


class Limiter:
    """Holds a stream of blocks within full scale. State: the present gain."""

    def __init__(self, channels: int, sample_rate: int) -> None:
        self.channels = channels
        self._recovery = 1.0 - math.exp(-1.0 / (RELEASE_TIME * sample_rate))
        self._gain = np.ones(1)

    @property
    def reduction_db(self) -> float:
        """The present gain reduction in dB, 0 where the limiter does nothing."""
        return -20.0 * math.log10(float(self._gain[0]))

    def process(self, block: Block) -> Block:
        """Return `block` (float32 [frames, channels], changed in place) with no sample beyond -1..1."""
        if block.shape[1] != self.channels:
            raise ValueError(f"a block of {block.shape[1]} channels came to a limiter of {self.channels}")
        hold_within(block, self._gain, self._recovery)
        return block


@kernel
def hold_within(block: Block, gain: Gains, recovery: float) -> None:
    """Scale each frame of `block` so that no channel passes full scale; gain[0] is the gain of the last frame."""
    present = gain[0]
    for i in range(block.shape[0]):
        peak = 0.0
        for channel in range(block.shape[1]):
            peak = max(peak, abs(np.float64(block[i, channel])))
        present += (1.0 - present) * recovery
        if present > 0.999999:
            present = 1.0
        if peak * present > 1.0:
            present = 1.0 / peak
        if present < 1.0:
            for channel in range(block.shape[1]):
                block[i, channel] = max(-1.0, min(1.0, block[i, channel] * present))
    gain[0] = present


def fade_envelope(first: int, frames: int, total: int, fade_frames: int) -> Gains:
    """Return the gain [frames] of a finite render of `total` frames from frame `first` on, fades of `fade_frames`
    frames.
    """
    n = np.arange(first, first + frames)
    near = np.minimum(n + 0.5, total - n - 0.5) / fade_frames
    return np.asarray(0.5 - 0.5 * np.cos(math.pi * np.clip(near, 0.0, 1.0)))
