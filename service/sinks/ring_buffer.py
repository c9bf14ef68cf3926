"""A ring of frames between one thread that renders and one audio callback.

Model: a preallocated float32 array and two counts of frames, written and read, which only ever grow. The writer alone
    changes the one, the reader alone the other, and each is a single assignment after the copy, so neither side ever
    waits: no lock is needed, and the callback allocates and blocks nothing.
Limits: one writer and one reader.
"""

from __future__ import annotations

import numpy as np

from synth.encode.formats import Block


class Ring:
    """Frames on their way; `capacity` of them at most."""

    def __init__(self, capacity: int, channels: int) -> None:
        self.capacity = capacity
        self._frames = np.zeros((capacity, channels), dtype=np.float32)
        self._written = 0
        self._read = 0

    @property
    def filled(self) -> int:
        """Return how many frames wait."""
        return self._written - self._read

    def write(self, block: Block) -> int:
        """Take as many frames of `block` [frames, channels] as there is room for; return how many."""
        count = min(len(block), self.capacity - self.filled)
        start = self._written % self.capacity
        first = min(count, self.capacity - start)
        self._frames[start : start + first] = block[:first]
        self._frames[: count - first] = block[first:count]
        self._written += count
        return count

    def drop(self) -> int:
        """Let go of what waits; return how many frames that was. For the reader."""
        written = self._written
        count, self._read = written - self._read, written
        return count

    def read_into(self, out: Block) -> int:
        """Fill the beginning of `out` [frames, channels] with what waits; return how many frames that was."""
        count = min(len(out), self.filled)
        start = self._read % self.capacity
        first = min(count, self.capacity - start)
        out[:first] = self._frames[start : start + first]
        out[first:count] = self._frames[: count - first]
        self._read += count
        return count
