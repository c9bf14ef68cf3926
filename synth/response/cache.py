"""What was solved once is kept: contact responses by what they depend on, within a bound of bytes.

Model   Least recently used goes first. Two threads that ask for the same thing at once: one builds, the other waits.
        What was dropped while somebody still uses it is found again as long as that lasts. What grows while it is
        kept says so (`grows`) and is counted anew whenever something is added; all else is counted once.
Limits  an entry larger than the bound is built and handed out, but not kept.
"""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from contextlib import suppress
from typing import Protocol, TypeVar
from weakref import WeakValueDictionary

from synth.response.table_budget import DEFAULT_LIMIT, TableBudget

DEFAULT_BYTES = 256 << 20


class Kept(Protocol):
    """What a cache can hold: it tells its size, and with an attribute `grows` whether that changes."""

    @property
    def memory_bytes(self) -> int:
        """Bytes that it holds."""
        ...


T = TypeVar("T", bound=Kept)


class ResponseCache:
    """A thread-safe cache of responses, at most `max_bytes` large.

    tables: what the tables of hands may take together, in use or kept.
    """

    def __init__(self, max_bytes: int = DEFAULT_BYTES, table_bytes: int = DEFAULT_LIMIT) -> None:
        self.max_bytes = max_bytes
        self.tables = TableBudget(table_bytes)
        self.hits = 0
        self.misses = 0
        self._entries: OrderedDict[Hashable, Kept] = OrderedDict()
        self._sizes: dict[Hashable, int] = {}  # of the entries that do not grow
        self._growing: dict[Hashable, Kept] = {}
        self._steady_bytes = 0
        self._in_use: WeakValueDictionary[Hashable, Kept] = WeakValueDictionary()
        self._lock = threading.Lock()
        self._building: dict[Hashable, threading.Lock] = {}

    @property
    def used_bytes(self) -> int:
        """Bytes held now."""
        with self._lock:
            return self._used()

    @property
    def table_bytes(self) -> int:
        """Bytes of the tables of hands, in use or kept."""
        return self.tables.used_bytes

    def get(self, key: Hashable, build: Callable[[], T]) -> T:
        """Return what is kept under `key`, building it at the first call; errors of `build` reach every caller's own
        call.
        """
        kept = self._find(key)
        if kept is not None:
            return kept  # type: ignore[return-value]
        with self._lock:
            gate = self._building.setdefault(key, threading.Lock())
        with gate:
            kept = self._find(key)
            if kept is not None:
                return kept  # type: ignore[return-value]
            made = build()
            self._keep(key, made)
            return made

    def _find(self, key: Hashable) -> Kept | None:
        with self._lock:
            entry = self._entries.get(key)
            if entry is not None:
                self._entries.move_to_end(key)
            else:
                entry = self._in_use.get(key)
            self.hits += entry is not None
            return entry

    def _keep(self, key: Hashable, made: Kept) -> None:
        with self._lock:
            self.misses += 1
            self._building.pop(key, None)
            with suppress(TypeError):  # what has slots only is small, and is solved again
                self._in_use[key] = made
            size = made.memory_bytes
            if size > self.max_bytes:
                return
            if key in self._entries:  # built twice: it had been dropped while a caller waited to look for it
                self._forget(key)
            self._entries[key] = made
            if getattr(made, "grows", False):
                self._growing[key] = made
            else:
                self._sizes[key] = size
                self._steady_bytes += size
            while self._used() > self.max_bytes:
                self._forget(self._entries.popitem(last=False)[0])

    def _forget(self, key: Hashable) -> None:
        if self._growing.pop(key, None) is None:
            self._steady_bytes -= self._sizes.pop(key)

    def _used(self) -> int:
        """Return the bytes of all entries now."""
        return self._steady_bytes + sum(entry.memory_bytes for entry in self._growing.values())
