"""The tables of a moving voice: for each level and each interval of load one block of coefficients, built when it is met.

Model   see `tables` and `levels`. All blocks lie in one pool, so that the compiled loop needs one array.
Source  design, sections 1 and 4.
Limits  the pool is emptied when it passes POOL_BYTES; what plays next is built anew.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from synth.contact.exact import Array
from synth.contact.levels import Levels
from synth.contact.rows import Rows
from synth.contact.tables import surface

POOL_BYTES = 256 << 20  # what a voice may hold in tables: the whole default range in acceleration is about 60 MB


class Surfaces:
    """Coefficients of one degree for every level and interval that was met.

    cells_per_harmonic: cells of a level for each of its harmonics, from the tolerance.
    """

    def __init__(self, rows: Rows, levels: Levels, degree: int, cells_per_harmonic: float) -> None:
        self.rows, self.levels, self.degree = rows, levels, degree
        sizes = [max(16, 1 << int(np.ceil(np.log2(cells_per_harmonic * n)))) for n in levels.highest]
        self.bits = np.array([size.bit_length() - 1 for size in sizes], dtype=np.uint64)
        self.fades = np.stack([levels.fade_from, levels.fade_to])
        self.edges: Array = rows.edges
        self.pool: Array = np.empty(0)
        self.used = 0
        self.offsets: np.ndarray[Any, np.dtype[np.int64]] = np.empty((0, 0), dtype=np.int64)
        self._placed: dict[tuple[int, float, float], int] = {}
        self.refresh()

    @property
    def memory_bytes(self) -> int:
        """Bytes that the tables hold."""
        return self.pool.nbytes

    def refresh(self) -> None:
        """Take over the rows that have become ready since; tables that are built stay."""
        self.edges = self.rows.edges
        self.offsets = np.full((len(self.levels.highest), len(self.edges) - 1), -1, dtype=np.int64)
        for (level, low, high), offset in list(self._placed.items()):
            interval = int(np.searchsorted(self.edges, low))
            if interval + 1 < len(self.edges) and self.edges[interval] == low and self.edges[interval + 1] == high:
                self.offsets[level, interval] = offset

    def build(self, level: int, interval: int) -> None:
        """Build the table of one level over one interval of `edges`."""
        if self.offsets[level, interval] >= 0:
            return
        low, high = float(self.edges[interval]), float(self.edges[interval + 1])
        series = self.rows.cubic(low, high, self.levels.highest[level])
        block = surface(series, self.degree, 1 << int(self.bits[level])).ravel()
        if self.used + block.size > POOL_BYTES // 8:
            self._empty()
        if self.used + block.size > self.pool.size:
            grown = np.empty(max(2 * self.pool.size, self.used + block.size))
            grown[: self.used] = self.pool[: self.used]
            self.pool = grown
        self.pool[self.used : self.used + block.size] = block
        self.offsets[level, interval] = self.used
        self._placed[level, low, high] = self.used
        self.used += block.size

    def _empty(self) -> None:
        self.used = 0
        self._placed.clear()
        self.offsets[:] = -1
