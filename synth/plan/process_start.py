"""START-UP: what a process takes before it can compute, once: its start, its imports, and its compiled kernels.

Model   `begun` notes the processor time of the process when the first scene is prepared: until then it has started and
        imported. numba announces when it loads a kernel from disk, and when it compiles one; the times are added up.
Source  numba's event API (`numba.core.event`): "numba:compiler_lock" is held to load and to compile a kernel,
        "numba:compile" to compile it.
Limits  in a process that did other work before its first scene, that work is counted as its start.
"""

from __future__ import annotations

import threading
from time import perf_counter, process_time
from typing import Any

from numba.core import event


class _Time(event.Listener):
    """Seconds in which at least one event of a kind was under way."""

    def __init__(self, kind: str) -> None:
        self._lock, self._open, self._since, self._total = threading.Lock(), 0, 0.0, 0.0
        event.register(kind, self)  # type: ignore[no-untyped-call]

    def on_start(self, event: Any) -> None:
        """Take note of a beginning."""
        with self._lock:
            if self._open == 0:
                self._since = perf_counter()
            self._open += 1

    def on_end(self, event: Any) -> None:
        """Take note of an end."""
        with self._lock:
            self._open -= 1
            if self._open == 0:
                self._total += perf_counter() - self._since

    @property
    def seconds(self) -> float:
        """Seconds so far."""
        with self._lock:
            return self._total + (perf_counter() - self._since if self._open else 0.0)

    @property
    def under_way(self) -> bool:
        """True while such an event is under way."""
        return self._open > 0


_kernels = _Time("numba:compiler_lock")
_compiling = _Time("numba:compile")
_started: list[float] = []


def begun() -> None:
    """Note that the imports are over, and the first scene is about to be prepared; later calls do nothing."""
    if not _started:
        _started.append(process_time())


def kernel_seconds() -> float:
    """Return the seconds that this process has spent so far on loading and compiling kernels."""
    return _kernels.seconds


def compile_seconds() -> float:
    """Return the part of `kernel_seconds` in which kernels were compiled; 0 where all came from disk."""
    return _compiling.seconds


def compiling() -> bool:
    """Return whether a kernel is being compiled now."""
    return _compiling.under_way


def process_seconds() -> float:
    """Return the seconds of start, imports and kernels of this process so far."""
    return (_started[0] if _started else process_time()) + kernel_seconds()
