"""The tables of a moving voice: for each level and each interval of load one block of coefficients, built when it is
met.

Model   see `tables` and `levels`. All blocks lie in one pool, so that the compiled loop needs one array. The blocks
        are the same for every voice of a response: a `TableStore` builds and keeps them for many voices, in any
        thread; the `Surfaces` of a voice is its own view of them, with the intervals that it has taken over.
        Arrays that were handed out are never changed where a view could look.
Source  design, sections 1 and 4.
Limits  the pool is begun anew when it would pass its room (`table_budget`); what plays next is built anew, however
        large. It is asked of the system whole, which gives memory only as it is written to.
"""

from __future__ import annotations

import threading
from collections.abc import Iterable
from itertools import pairwise
from typing import Any, Protocol

import numpy as np

from synth.arrays import Array
from synth.response.phase_cells import FEWEST_CELLS, fill_surface
from synth.response.spectrum import Complex, Spectrum
from synth.response.speed_levels import Levels
from synth.response.table_budget import TableBudget

FULL = 0.75  # of the room that is filled beforehand: the rest is for what hands meet
EVERYWHERE = 4e3  # N: beyond any load, the end of the one interval of a response that does not vary with the load

Offsets = np.ndarray[Any, np.dtype[np.int64]]


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


class TableStore:
    """Coefficients of one degree for every level and interval that some voice met. Thread-safe.

    cells_per_harmonic: cells of a level for each of its harmonics, from the tolerance. single: keep the coefficients
    as float32, which holds 3e-7 of the largest value and half the memory; a hand that presses meets megabytes a second.
    budget: shared with other stores; one of its own unless given.
    """

    def __init__(
        self,
        rows: RowSource,
        levels: Levels,
        degree: int,
        cells_per_harmonic: float,
        *,
        single: bool = False,
        budget: TableBudget | None = None,
    ) -> None:
        self.rows, self.levels, self.degree = rows, levels, degree
        self._type = np.dtype(np.float32 if single else np.float64)
        sizes = [max(FEWEST_CELLS, 1 << int(np.ceil(np.log2(cells_per_harmonic * n)))) for n in levels.highest]
        self._bits = np.array([size.bit_length() - 1 for size in sizes], dtype=np.int64)
        self._lock = threading.Lock()
        self._pool = np.empty(0, self._type)
        self._used = 0
        self._placed: dict[tuple[float, float], Offsets] = {}  # by interval: where the table of each level begins
        self._budget = budget or TableBudget()
        self._budget.enter(self)

    @property
    def memory_bytes(self) -> int:
        """Bytes that the tables hold."""
        return self._used * self._type.itemsize

    def has_room(self, levels: range) -> bool:
        """Return whether tables of `levels` over one more interval may be built beforehand: what does not fit pushes
        all others out.
        """
        return self._used == 0 or self._used + self._size(levels) <= FULL * self._room()

    def view(self, edges: Array) -> tuple[Array, Offsets]:
        """Return the pool, and where in it the tables of each level and interval of `edges` begin."""
        with self._lock:
            return self._pool, self._tables(edges, self._placed)

    def build(self, levels: range, interval: int, edges: Array) -> tuple[Array, Offsets]:
        """Return a view of `edges` that holds the tables of `levels` over one interval, building what is missing."""
        low, high = float(edges[interval]), float(edges[interval + 1])
        with self._lock:
            begins = self._claimed(levels, low, high)
            pool, offsets = self._pool, self._offsets(low, high).copy()
        self._fill(pool, begins, low, high)  # the others go on meanwhile
        with self._lock:
            kept = pool is self._pool  # else it was begun anew meanwhile: this view keeps the old one
            placed = self._placed if kept else {(low, high): offsets}
            for level, begin in begins.items():
                placed[low, high][level] = begin
            return pool, self._tables(edges, placed)

    def _claimed(self, levels: range, low: float, high: float) -> dict[int, int]:
        """Return where in the pool those tables may begin that are missing, all of `levels` where it is begun anew."""
        missing, room = self._missing(levels, low, high), self._room()
        if self._used + self._size(missing) > min(room, self._pool.size):
            missing = list(levels)
            self._placed.clear()
            fits = max(room, self._size(missing))
            self._pool, self._used = np.empty(fits, self._type), 0  # views that still read the old one keep it
        begins = {}
        for level in missing:
            begins[level], self._used = self._used, self._used + self._size((level,))
        return begins

    def _fill(self, pool: Array, begins: dict[int, int], low: float, high: float) -> None:
        """Write the coefficients of one interval at the places claimed for its levels."""
        if not begins:
            return
        highest = self.levels.highest
        series = self.rows.cubic(low, high, max(highest[level] for level in begins))
        for level, begin in begins.items():
            shape = 1 << int(self._bits[level]), self.degree + 1, 4
            cut = tuple(power[: highest[level] + 1] for power in series)
            fill_surface(cut, self.degree, pool[begin : begin + self._size((level,))].reshape(shape))

    def _room(self) -> int:
        """Return how many coefficients the pool may have now."""
        return self._budget.room_of(self) // self._type.itemsize

    def _size(self, levels: Iterable[int]) -> int:
        """Return how many coefficients the tables of `levels` over one interval have."""
        return sum((self.degree + 1) * 4 << int(self._bits[level]) for level in levels)

    def _missing(self, levels: range, low: float, high: float) -> list[int]:
        found = self._placed.get((low, high))
        return [level for level in levels if found is None or found[level] < 0]

    def _offsets(self, low: float, high: float) -> Offsets:
        found = self._placed.get((low, high))
        if found is None:
            found = self._placed[low, high] = np.full(len(self._bits), -1, dtype=np.int64)
        return found

    def _tables(self, edges: Array, placed: dict[tuple[float, float], Offsets]) -> Offsets:
        tables = np.full((len(self._bits), len(edges)), -1, dtype=np.int64)
        tables[:, 0] = self._bits
        loads = edges.tolist()
        for interval, ends in enumerate(pairwise(loads)):
            found = placed.get(ends)
            if found is not None:
                tables[:, 1 + interval] = found
        return tables


class Surfaces:
    """The view that one voice has of a store.

    pool, tables: as `reading` takes them. edges: loads (N) between the intervals.
    """

    def __init__(self, store: TableStore, edges: Array) -> None:
        self.store = store
        self.use(edges)

    def layout(self, constants: list[float]) -> Array:
        """Return what `reading` calls the layout: `constants`, the fades of the levels, the edges of the intervals."""
        levels = self.store.levels
        return np.concatenate([constants, levels.fade_from, levels.fade_to, self.edges])

    def use(self, edges: Array) -> None:
        """Take over the rows at `edges` (N), an array of the store's rows."""
        self.edges = edges
        self.pool, self.tables = self.store.view(edges)

    def build(self, levels: range, interval: int) -> None:
        """Have the tables of `levels` over one interval of `edges`, together: a loop that fades needs them at once."""
        self.pool, self.tables = self.store.build(levels, interval, self.edges)
