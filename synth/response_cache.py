"""A cache of solved responses and tables, keyed by what determines them, with a limit in bytes.

Model   The least recently used entry is evicted first. If two threads request one key at once, one builds the entry
        and the other waits. An evicted entry can still be found while it is in use elsewhere. With `files`, an entry
        that has a file is read from it if possible, and built otherwise.
Limits  An entry larger than the limit is built and returned, but not cached.
"""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from contextlib import suppress
from typing import Protocol, TypeVar
from weakref import WeakValueDictionary

from synth.kept_files import FileEntry, KeptFiles

DEFAULT_BYTES = 256 << 20


class Kept(Protocol):
    """An entry of the cache. Its size must not change."""

    @property
    def memory_bytes(self) -> int:
        """Memory in bytes."""
        ...


T = TypeVar("T", bound=Kept)


class ResponseCache:
    """A thread-safe cache of responses and tables, at most `max_bytes` large. files: store of entries on disk."""

    def __init__(self, max_bytes: int = DEFAULT_BYTES, files: KeptFiles | None = None) -> None:
        self.max_bytes, self.files = max_bytes, files
        self.hits = 0
        self.misses = 0
        self._entries: OrderedDict[Hashable, Kept] = OrderedDict()
        self.used_bytes = 0
        self._in_use: WeakValueDictionary[Hashable, Kept] = WeakValueDictionary()
        self._lock = threading.Lock()
        self._building: dict[Hashable, threading.Lock] = {}

    def get(self, key: Hashable, build: Callable[[], T], file: Callable[[], FileEntry[T] | None] = lambda: None) -> T:
        """Return the entry of `key`, building it at the first call. Errors of `build` are raised and not cached.

        file: returns the key of the entry among the files, or None if the entry is not kept in a file.
        """
        kept = self.find(key)
        if kept is not None:
            return kept  # type: ignore[return-value]
        with self._lock:
            gate = self._building.setdefault(key, threading.Lock())
        with gate:
            kept = self.find(key)
            if kept is not None:
                return kept  # type: ignore[return-value]
            entry = file() if self.files is not None else None
            made = build() if entry is None or self.files is None else self.files.get(entry, build)
            self._keep(key, made)
            return made

    def find(self, key: Hashable) -> Kept | None:
        """Return the entry of `key`, or None."""
        with self._lock:
            if key in self._entries:
                self._entries.move_to_end(key)
            entry = self._entries.get(key, self._in_use.get(key))
            self.hits += entry is not None
            return entry

    def _keep(self, key: Hashable, made: Kept) -> None:
        with self._lock:
            self.misses += 1
            self._building.pop(key, None)
            with suppress(TypeError):  # objects without weak references are small, and are solved again
                self._in_use[key] = made
            if key in self._entries:  # built twice, because it was evicted while another caller waited for it
                self.used_bytes -= self._entries.pop(key).memory_bytes
            if made.memory_bytes <= self.max_bytes:
                self._entries[key] = made
                self.used_bytes += made.memory_bytes
            while self.used_bytes > self.max_bytes:
                self.used_bytes -= self._entries.popitem(last=False)[1].memory_bytes


SHARED = ResponseCache(64 << 20)
"""The default cache. A scene that a process opens twice is solved once."""
