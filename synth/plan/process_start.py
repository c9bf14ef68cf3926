"""START-UP: the time that a process needs once before it can compute: its start, imports and compiled kernels.

Model   `begun` records the processor time of the process when the first scene is prepared. This is the time of start
        and imports. Numba reports when it loads a kernel from disk and when it compiles one. These times are added.
Source  Numba's event API (`numba.core.event`): the event "numba:compiler_lock" lasts while a kernel is loaded or
        compiled, "numba:compile" while it is compiled.
Limits  If a process does other work before its first scene, that work counts as start. The time of a kernel counts when
        the kernel is ready.
"""

from __future__ import annotations

from time import process_time

from numba.core import event


class _Timer(event.TimingListener):
    """Measures the time during which at least one event of a kind is in progress."""

    def __init__(self, kind: str) -> None:
        super().__init__()  # type: ignore[no-untyped-call]
        event.register(kind, self)  # type: ignore[no-untyped-call]

    def seconds(self) -> float:
        """Return the seconds so far."""
        return float(self.duration) if self.done else 0.0

    def under_way(self) -> bool:
        """Return whether such an event is in progress."""
        return bool(self._depth > 0)


_kernels, _compiling = _Timer("numba:compiler_lock"), _Timer("numba:compile")
_started: list[float] = []
kernel_seconds = _kernels.seconds  # time so far in which this process loaded and compiled kernels
compile_seconds = _compiling.seconds  # the part of it in which kernels were compiled; 0 if all came from disk
compiling = _compiling.under_way


def begun() -> None:
    """Record that the imports are done, before the first scene is prepared. Later calls do nothing."""
    if not _started:
        _started.append(process_time())


def process_seconds() -> float:
    """Return the time (s) of start, imports and kernels of this process so far."""
    return (_started[0] if _started else process_time()) + kernel_seconds()
