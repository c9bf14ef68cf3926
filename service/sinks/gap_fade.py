"""The edges of a gap, softened: where a ring runs dry, and where its sound begins again.

Model: from the last frame before the gap a straight line leads to zero in `frames` frames, and one from zero to one
    leads back into the sound: a voice coil cut off in full swing is felt as a knock. Without a gap nothing is touched.
Limits: called by one audio callback, a buffer at a time; allocates nothing larger than a buffer.
"""

from __future__ import annotations

import numpy as np

from synth.encode.formats import Block


class Joins:
    """What is still to be softened after a gap, from one buffer to the next."""

    def __init__(self, frames: int, channels: int) -> None:
        self._falling = np.linspace(1.0, 0.0, frames, dtype=np.float32)[:, np.newaxis]
        self._rising = np.ascontiguousarray(self._falling[::-1])
        self._last = np.zeros(channels, dtype=np.float32)  # the frame that was given out last
        self._from = np.zeros(channels, dtype=np.float32)  # the frame that the present fall began at
        self._fallen = self._risen = frames  # frames of each line that are done: all
        self._frames = frames
        self._silent = False

    def cut(self) -> None:
        """Take note that what follows does not belong to what was given out last."""
        self._break_off(self._last)
        self._silent = True

    def soften(self, out: Block, sounding: int) -> None:
        """Soften `out` [frames, channels], not empty, whose first `sounding` frames are sound and the rest zeros."""
        if sounding and self._silent:
            self._silent, self._risen = False, 0
        self._rise(out[:sounding])
        if sounding == len(out) or self._silent:
            self._fall(out)
        else:
            self._fall(out[:sounding])
            self._break_off(out[sounding - 1] if sounding else self._last)
            self._fall(out[sounding:])
            self._silent = True
        self._last[:] = out[-1]

    def _break_off(self, frame: Block) -> None:
        self._from[:] = frame
        self._fallen = 0

    def _rise(self, out: Block) -> None:
        count = min(len(out), self._frames - self._risen)
        if count:
            out[:count] *= self._rising[self._risen : self._risen + count]
            self._risen += count

    def _fall(self, out: Block) -> None:
        count = min(len(out), self._frames - self._fallen)
        if count:
            out[:count] += self._from * self._falling[self._fallen : self._fallen + count]
            np.clip(out[:count], -1.0, 1.0, out=out[:count])  # a fall and a rise add up to 1 but for rounding
            self._fallen += count
