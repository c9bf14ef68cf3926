"""The tables of a moving voice: for each level and each interval of load one block of coefficients, built when it is
met.

Model   see `tables` and `levels`. All blocks lie in one pool, so that the compiled loop needs one array.
Source  design, sections 1 and 4.
Limits  the pool is emptied when it would pass POOL_BYTES; what plays next is built anew, however large.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from synth.contact.exact import Array
from synth.contact.levels import Levels
from synth.contact.spectrum import Complex, Spectrum
from synth.contact.tables import FEWEST_CELLS, surface

POOL_BYTES = 64 << 20  # what a voice may hold in tables of one degree; smaller pools are filled anew more often
EVERYWHERE = 4e3  # N: beyond any load, the end of the one interval of a response that does not vary with the load


class RowSource(Protocol):
    """Where the series over the load come from."""

    @property
    def edges(self) -> Array:
        """Loads (N) of the rows."""
        ...

    def cubic(self, low: float, high: float, harmonics: int) -> tuple[Complex, ...]:
        """Return the series of the cubic between two rows, cut at `harmonics`."""
        ...


class OneRow:
    """A response at one load: it does not vary with the load."""

    def __init__(self, spectrum: Spectrum) -> None:
        self.spectrum = spectrum
        self.edges: Array = np.array([-EVERYWHERE, EVERYWHERE])

    def cubic(self, low: float, high: float, harmonics: int) -> tuple[Complex, ...]:
        """Return the series itself, and nothing that varies."""
        series = np.zeros(harmonics + 1, dtype=np.complex128)
        found = self.spectrum.harmonics[: harmonics + 1]
        series[: len(found)] = found
        nothing = np.zeros_like(series)
        return series, nothing, nothing, nothing


class Surfaces:
    """Coefficients of one degree for every level and interval that was met.

    pool, tables: as `reading` takes them. edges: loads (N) between the intervals.
    cells_per_harmonic: cells of a level for each of its harmonics, from the tolerance. single: keep the coefficients
    as float32, which holds 3e-7 of the largest value and half the memory; a hand that presses meets megabytes a second.
    """

    def __init__(
        self, rows: RowSource, levels: Levels, degree: int, cells_per_harmonic: float, *, single: bool = False
    ) -> None:
        self.rows, self.levels, self.degree = rows, levels, degree
        self._type = np.dtype(np.float32 if single else np.float64)
        sizes = [max(FEWEST_CELLS, 1 << int(np.ceil(np.log2(cells_per_harmonic * n)))) for n in levels.highest]
        self._bits = np.array([size.bit_length() - 1 for size in sizes], dtype=np.int64)
        self.edges: Array = rows.edges
        self.pool = np.empty(0, self._type)
        self.used = 0
        self.tables: np.ndarray[Any, np.dtype[np.int64]] = np.empty((0, 0), dtype=np.int64)
        self._placed: dict[tuple[int, float, float], int] = {}
        self.refresh()

    @property
    def memory_bytes(self) -> int:
        """Bytes that the tables hold."""
        return self.pool.nbytes

    def layout(self, constants: list[float]) -> Array:
        """Return what `reading` calls the layout: `constants`, the fades of the levels, the edges of the intervals."""
        return np.concatenate([constants, self.levels.fade_from, self.levels.fade_to, self.edges])

    def refresh(self) -> None:
        """Take over the rows that have become ready since; tables that are built stay."""
        self.edges = self.rows.edges
        self.tables = np.full((len(self.levels.highest), len(self.edges)), -1, dtype=np.int64)
        self.tables[:, 0] = self._bits
        for (level, low, high), offset in list(self._placed.items()):
            interval = int(np.searchsorted(self.edges, low))
            if interval + 1 < len(self.edges) and self.edges[interval] == low and self.edges[interval + 1] == high:
                self.tables[level, 1 + interval] = offset

    def build(self, levels: range, interval: int) -> None:
        """Build the tables of `levels` over one interval of `edges`, together: a loop that fades needs them at once."""
        missing = [level for level in levels if self.tables[level, 1 + interval] < 0]
        size = sum((self.degree + 1) * 4 << int(self._bits[level]) for level in missing)
        if self.used and self.used + size > POOL_BYTES // self._type.itemsize:
            self._empty()
            missing = list(levels)
        for level in missing:
            self._place(level, interval)

    def _place(self, level: int, interval: int) -> None:
        low, high = float(self.edges[interval]), float(self.edges[interval + 1])
        series = self.rows.cubic(low, high, self.levels.highest[level])
        block = surface(series, self.degree, 1 << int(self._bits[level])).ravel()
        if self.used + block.size > self.pool.size:
            grown = np.empty(max(2 * self.pool.size, self.used + block.size), self._type)
            grown[: self.used] = self.pool[: self.used]
            self.pool = grown
        self.pool[self.used : self.used + block.size] = block
        self.tables[level, 1 + interval] = self.used
        self._placed[level, low, high] = self.used
        self.used += block.size

    def _empty(self) -> None:
        self.used = 0
        self._placed.clear()
        self.tables[:, 1:] = -1
