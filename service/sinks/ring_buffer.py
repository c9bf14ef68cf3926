"""A ring buffer of frames between one thread that renders and one audio callback.

Model: a preallocated float32 array, and the numbers of frames written and read, which only grow. The writer changes one
    number and the reader the other, each in a single assignment after the copy. Therefore no lock is needed, and the
    callback neither waits nor allocates.
Limits: one writer and one reader.
"""

from __future__ import annotations

import numpy as np

from synth.encode.formats import Block


class Ring:
    """A queue of at most `capacity` frames."""

    def __init__(self, capacity: int, channels: int) -> None:
        self.capacity = capacity
        self._frames = np.zeros((capacity, channels), dtype=np.float32)
        self._written = 0
        self._read = 0

    @property
    def filled(self) -> int:
        """Return the number of frames in the ring."""
        return self._written - self._read

    def write(self, block: Block) -> int:
        """Append as many frames of `block` [frames, channels] as fit; return their number."""
        count = min(len(block), self.capacity - self.filled)
        start = self._written % self.capacity
        first = min(count, self.capacity - start)
        self._frames[start : start + first] = block[:first]
        self._frames[: count - first] = block[first:count]
        self._written += count
        return count

    def drop(self) -> int:
        """Drop all frames; return their number. For the reader."""
        written = self._written
        count, self._read = written - self._read, written
        return count

    def read_into(self, out: Block) -> int:
        """Move frames into the beginning of `out` [frames, channels]; return their number."""
        count = min(len(out), self.filled)
        start = self._read % self.capacity
        first = min(count, self.capacity - start)
        out[:first] = self._frames[start : start + first]
        out[first:count] = self._frames[: count - first]
        self._read += count
        return count
