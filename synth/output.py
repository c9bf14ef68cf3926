"""What leaves a voice: fades of a finite render, and the safety limiter.

Model   Fade: a raised cosine over `output.fade` at the start and at the end of a finite render.
        Limiter: samples within full scale pass unchanged. Where one would pass full scale, the gain of all channels
        falls at once to what holds it at full scale, and comes back over RELEASE_TIME.
Source  design, sections 4 and 8. The release time is an unverified default.
Limits  without look-ahead the gain falls within one sample: a peak beyond full scale is cut flat. It never exceeds 1.0.
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
    """Holds a stream of blocks within full scale. State: the present gain, and the frames that are looked at ahead.

    ahead: frames by which the output is late, and over which the gain comes down before a peak; 0 lets it fall at once.
    """

    def __init__(self, channels: int, sample_rate: int, ahead: int = 0) -> None:
        self.channels = channels
        self._recovery = 1.0 - math.exp(-1.0 / (RELEASE_TIME * sample_rate))
        self._gain = np.ones(1)
        self._recent = np.ones(ahead + 1)
        self._pending: Block = np.zeros((ahead, channels), dtype=np.float32)

    @property
    def reduction_db(self) -> float:
        """The present gain reduction in dB, 0 where the limiter does nothing."""
        return max(0.0, -20.0 * math.log10(float(self._recent.mean())))

    def prime(self, block: Block) -> None:
        """Give the first `ahead` frames, so that the next block of output begins with them and nothing is late."""
        self._pending = block

    def process(self, block: Block) -> Block:
        """Return as many frames as `block` (float32 [frames, channels]) has, `ahead` frames late, none beyond -1..1."""
        if block.shape[1] != self.channels:
            raise ValueError(f"a block of {block.shape[1]} channels came to a limiter of {self.channels}")
        seen = np.concatenate([self._pending, block]) if len(self._pending) else block
        out = np.array(seen[: len(block)])
        self._pending = seen[len(block) :]
        hold_within(seen, out, self._gain, self._recent, self._recovery)
        return out


@kernel
def hold_within(seen: Block, out: Block, gain: Gains, recent: Gains, recovery: float) -> None:
    """Scale `out`, the first frames of `seen`, so that no channel passes full scale.

    gain[0]: the gain before smoothing at the last frame; recent: that of the last frames, over which it is averaged.
    Every gain in the average already allows for the peak, so the average does.
    """
    needed = np.ones(len(seen))
    touched = gain[0] < 1.0 or np.min(recent) < 1.0
    for i in range(len(seen)):
        peak = 0.0
        for channel in range(seen.shape[1]):
            peak = max(peak, abs(np.float64(seen[i, channel])))
        if peak > 1.0:
            needed[i] = 1.0 / peak
            touched = True
    if not touched:
        return
    ahead = len(recent) - 1
    for i in range(len(out)):
        gain[0] = gain[0] + (1.0 - gain[0]) * recovery if gain[0] < 0.999999 else 1.0
        gain[0] = min(gain[0], np.min(needed[i : i + ahead + 1]))
        recent[:-1] = recent[1:]
        recent[-1] = gain[0]
        level = np.mean(recent)
        if level < 1.0:
            for channel in range(out.shape[1]):
                out[i, channel] = max(-1.0, min(1.0, out[i, channel] * level))


def fade_envelope(first: int, frames: int, total: int, fade_frames: int) -> Gains:
    """Return the gain [frames] of a finite render of `total` frames from frame `first` on, fades of `fade_frames`
    frames.
    """
    n = np.arange(first, first + frames)
    near = np.minimum(n + 0.5, total - n - 0.5) / fade_frames
    return np.asarray(0.5 - 0.5 * np.cos(math.pi * np.clip(near, 0.0, 1.0)))
