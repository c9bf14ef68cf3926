"""Softens the edges of a gap: where the ring runs dry, and where sound begins again.

Model: a straight line of `frames` frames leads from the last frame before the gap to zero, and a gain that rises from
    zero to one in as many frames leads back into the sound. An abrupt end of a voice coil is felt as a knock. Without
    a gap nothing is changed.
Limits: for one audio callback; allocates nothing larger than a buffer.
"""

from __future__ import annotations

import numpy as np

from synth.encode.formats import Block


class Joins:
    """The state of the fades, from one buffer to the next."""

    def __init__(self, frames: int, channels: int) -> None:
        self._falling = np.linspace(1.0, 0.0, frames, dtype=np.float32)[:, np.newaxis]
        self._rising = np.ascontiguousarray(self._falling[::-1])
        self._last = np.zeros(channels, dtype=np.float32)  # the last frame of the previous buffer
        self._from = np.zeros(channels, dtype=np.float32)  # the frame at which the present fall began
        self._fallen = self._risen = frames  # frames of each fade that are done; at first all
        self._frames = frames
        self._silent = False

    def cut(self) -> None:
        """Begin a gap: the next buffer does not continue the previous one."""
        self._break_off(self._last)
        self._silent = True

    def soften(self, out: Block, sounding: int) -> None:
        """Soften `out` [frames, channels], not empty. Its first `sounding` frames are sound, the rest zeros."""
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
            np.clip(out[:count], -1.0, 1.0, out=out[:count])  # rounding may exceed 1
            self._fallen += count
