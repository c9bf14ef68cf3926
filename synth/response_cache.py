"""A cache of solved responses, tables and other prepared parts, keyed by what determines them, with a limit in bytes.

Model   The least recently used entry is evicted first. If two threads request one key at once, one builds the entry
        and the other waits. An evicted entry can still be found while it is in use elsewhere. With `files`, an entry
        that has a file is read from it if possible, and built otherwise. The size of an entry is what it keeps alive
        with its key (`held_memory`). What several entries share counts once.
Limits  An entry larger than the limit is built and returned, but not cached. The size of an entry is that at the end
        of its building.
"""

from __future__ import annotations

import threading
from collections import Counter, OrderedDict
from collections.abc import Callable, Hashable
from contextlib import suppress
from functools import partial, wraps
from typing import Any, ParamSpec, TypeVar
from weakref import WeakValueDictionary

from synth.held_memory import CountsItself, Held, bytes_together, held_by
from synth.kept_files import FileEntry, KeptFiles

DEFAULT_BYTES = 256 << 20
PART_BYTES = 512 << 20
LEAST_PARTS = 32 << 20  # a fingertip on a line makes its parts in 12 MB; with less they are made again for each load

T = TypeVar("T")
Arguments = ParamSpec("Arguments")


class ResponseCache(CountsItself):
    """A thread-safe cache of responses and tables, at most `max_bytes` large. files: store of entries on disk."""

    def __init__(self, max_bytes: int = DEFAULT_BYTES, files: KeptFiles | None = None) -> None:
        self.max_bytes, self.files = max_bytes, files
        self.hits = 0
        self.misses = 0
        self._entries: OrderedDict[Hashable, tuple[Any, Held]] = OrderedDict()
        self.used_bytes = 0
        self._large: dict[int, int] = {}
        self._holders: Counter[int] = Counter()
        self._in_use: WeakValueDictionary[Hashable, Any] = WeakValueDictionary()
        self._lock = threading.Lock()
        self._building: dict[Hashable, threading.Lock] = {}

    def get(self, key: Hashable, build: Callable[[], T], file: Callable[[], FileEntry[T] | None] = lambda: None) -> T:
        """Return the entry of `key`, building it at the first call. Errors of `build` are raised and not cached.

        file: returns the key of the entry among the files, or None if the entry is not kept in a file.
        """
        kept = self.find(key)
        if kept is not None:
            return kept  # type: ignore[no-any-return]
        with self._lock:
            gate = self._building.setdefault(key, threading.Lock())
        with gate:
            kept = self.find(key)
            if kept is not None:
                return kept  # type: ignore[no-any-return]
            try:
                entry = file() if self.files is not None else None
                made = build() if entry is None or self.files is None else self.files.get(entry, build)
                self._keep(key, made, held_by(key, made))
                return made
            finally:
                with self._lock:
                    self._building.pop(key, None)

    def find(self, key: Hashable) -> Any:
        """Return the entry of `key`, or None."""
        with self._lock:
            if key in self._entries:
                self._entries.move_to_end(key)
            found = self._entries[key][0] if key in self._entries else self._in_use.get(key)
            self.hits += found is not None
            return found

    def resize(self, max_bytes: int) -> None:
        """Set the limit."""
        with self._lock:
            self.max_bytes = max_bytes
            self._bound()

    @property
    def entries(self) -> list[tuple[Hashable, Any]]:
        """All entries with their keys, the least recently used first."""
        with self._lock:
            return [(key, one) for key, (one, _held) in self._entries.items()]

    @property
    def held(self) -> Held:
        """The memory of all entries."""
        with self._lock:
            return Held(self.used_bytes - sum(self._large.values()), dict(self._large))

    def _keep(self, key: Hashable, made: object, held: Held) -> None:
        with self._lock:
            self.misses += 1
            with suppress(TypeError):  # objects without weak references are small, and are solved again
                self._in_use[key] = made
            if key in self._entries:  # built twice, because it was evicted while another caller waited for it
                self._drop(self._entries.pop(key)[1])
            if held.bytes <= self.max_bytes:
                self._entries[key] = made, held
                self._add(held)
            self._bound()

    def _bound(self) -> None:
        while self.used_bytes > self.max_bytes:
            self._drop(self._entries.popitem(last=False)[1][1])

    def _add(self, held: Held) -> None:
        self.used_bytes += held.small
        for one, size in held.large.items():
            if not self._holders[one]:
                self._large[one] = size
                self.used_bytes += size
            self._holders[one] += 1

    def _drop(self, held: Held) -> None:
        self.used_bytes -= held.small
        for one in held.large:
            self._holders[one] -= 1
            if not self._holders[one]:
                del self._holders[one]
                self.used_bytes -= self._large.pop(one)


SHARED = ResponseCache(64 << 20)
"""The default cache. A scene that a process opens twice is solved once."""

PARTS = ResponseCache(PART_BYTES)
"""Surfaces, cells of fingers and solvers, of which prepared scenes are made. Those in use are shared, and a scene that
is opened again is quick. The service sets the limit (`RIDGEWAVE_CACHE_BYTES`)."""


def kept(make: Callable[Arguments, T]) -> Callable[Arguments, T]:
    """Return `make`, whose results are kept in PARTS, by its arguments, which are positional."""

    @wraps(make)
    def found(*arguments: Arguments.args, **named: Arguments.kwargs) -> T:
        assert not named, "arguments are positional"
        return PARTS.get((make, arguments), partial(make, *arguments))

    return found


def bytes_of(*caches: ResponseCache) -> int:
    """Return the memory of all entries of `caches`; what they share counts once."""
    return bytes_together(cache.held for cache in caches)
