"""START-UP: what a process takes before it can compute, once: its start, its imports, and its compiled kernels.

Model   `begun` notes the processor time of the process when the first scene is prepared: until then it has started and
        imported. numba announces when it loads a kernel from disk, and when it compiles one; the times are added up.
Source  numba's event API (`numba.core.event`): "numba:compiler_lock" is held to load and to compile a kernel,
        "numba:compile" to compile it.
Limits  in a process that did other work before its first scene, that work is counted as its start. A kernel counts
        when it is ready.
"""

from __future__ import annotations

from time import process_time

from numba.core import event


class _Timer(event.TimingListener):
    """Seconds in which at least one event of a kind was under way."""

    def __init__(self, kind: str) -> None:
        super().__init__()  # type: ignore[no-untyped-call]
        event.register(kind, self)  # type: ignore[no-untyped-call]

    def seconds(self) -> float:
        """Return the seconds so far."""
        return float(self.duration) if self.done else 0.0

    def under_way(self) -> bool:
        """Return whether such an event is under way."""
        return bool(self._depth > 0)


_kernels, _compiling = _Timer("numba:compiler_lock"), _Timer("numba:compile")
_started: list[float] = []
kernel_seconds = _kernels.seconds  # that this process has spent so far on loading and compiling kernels
compile_seconds = _compiling.seconds  # the part of them in which kernels were compiled; 0 where all came from disk
compiling = _compiling.under_way


def begun() -> None:
    """Note that the imports are over, and the first scene is about to be prepared; later calls do nothing."""
    if not _started:
        _started.append(process_time())


def process_seconds() -> float:
    """Return the seconds of start, imports and kernels of this process so far."""
    return (_started[0] if _started else process_time()) + kernel_seconds()
