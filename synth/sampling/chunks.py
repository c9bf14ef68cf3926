"""Reads frames from chunks that are solved together, in any order. Only the last chunk is kept.

Stage   SAMPLING, for files.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

Solve = Callable[[int], Any]
"""Returns the frames of a chunk by its number: [chunk, channels], or [chunk] of one channel."""


class Chunks:
    """The chunks of `solve`, each of `chunk` frames."""

    def __init__(self, solve: Solve, chunk: int) -> None:
        self._solve, self._chunk = solve, chunk
        self._number = -1
        self._kept: Any = None

    def read(self, first: int, out: Any) -> None:
        """Write the frames from `first` on to `out`: [frames, channels], or [frames]."""
        done = 0
        while done < len(out):
            number, place = divmod(first + done, self._chunk)
            if self._kept is None or self._number != number:
                self._number, self._kept = number, self._solve(number)
            part = self._kept[place : place + len(out) - done]
            out[done : done + len(part)] = part
            done += len(part)
