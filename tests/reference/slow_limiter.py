"""The safety limiter, one frame at a time in whole numbers, with each average summed anew: the twin of the compiled
    loop.

Model   needed(f) = 1 / peak(f) or 1; g(f) = min(needed of the last ahead + 1 frames, g + (1.01 - g) recovery, 1). The
        gain is g averaged over ahead // 2 + 1 frames, and then over ahead - ahead // 2 + 1 frames. Gains are
        multiples of 2^-40, rounded down. Frames before the first need no gain.
Source  design, section 8.
Limits  The work per frame grows with the square of `ahead`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

ONE = 2**40
RELEASE = 0.05  # s
SMALLEST_NORMAL = 2.0**-126

Block = npt.NDArray[np.float32]


def limited(block: Block, sample_rate: int, ahead: int) -> tuple[Block, list[float]]:
    """Return `block` [frames, channels] limited, `ahead` frames late, and the gain of each output frame."""
    needed = [_needed(frame) for frame in block]
    held = _held(needed, ahead, round((1.0 - np.exp(-1.0 / (RELEASE * sample_rate))) * 2**22))
    one, other = ahead // 2 + 1, ahead - ahead // 2 + 1
    first = [sum(_window(held, frame, one, ONE)) for frame in range(len(block))]
    gains = [sum(_window(first, frame, other, one * ONE)) / (one * other * ONE) for frame in range(len(block))]
    out = np.zeros_like(block)
    for frame in range(ahead, len(block)):
        for channel in range(block.shape[1]):
            out[frame, channel] = _sample(block[frame - ahead, channel], gains[frame])
    return out, gains


def _needed(frame: Any) -> int:
    if not np.isfinite(frame).all():
        return 1
    peak = max(abs(float(sample)) for sample in frame)
    return ONE if peak <= 1.0 else max(1, int(ONE / peak))


def _held(needed: list[int], ahead: int, recovery: int) -> list[int]:
    gain, held = ONE, []
    for frame in range(len(needed)):
        back = gain + (ONE + ONE // 100 - gain) * recovery // 2**22
        gain = min(ONE, back, *_window(needed, frame, ahead + 1, ONE))
        held.append(gain)
    return held


def _window(values: list[int], frame: int, frames: int, before: int) -> list[int]:
    """The last `frames` values up to `frame`, with `before` for those before the first."""
    found = values[max(0, frame + 1 - frames) : frame + 1]
    return [before] * (frames - len(found)) + found


def _sample(sample: Any, gain: float) -> float:
    if not np.isfinite(sample):
        return 0.0
    turned = float(sample) if gain == 1.0 else float(np.float32(min(1.0, max(-1.0, float(sample) * gain))))
    return turned if abs(turned) >= SMALLEST_NORMAL else 0.0
