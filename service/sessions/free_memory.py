"""Gives memory that ended sessions have freed back to the system.

Model: the C library keeps freed memory for later use. Blocks up to 32 MB, as of the arrays of a height map, then stay
    resident: 250 MB after six maps of 4 million heights, with nothing in use. To map each block apart (a fixed
    M_MMAP_THRESHOLD) gives all of it back too, but opening such a map then takes 1.35 times the processor time. So the
    library is asked to return what is free (`malloc_trim`) once TRIMMED_BYTES were in use by sessions that have ended
    one or two PERIODs ago: they have faded out.
Limits: only with glibc; elsewhere nothing is done. Takes 80 ms for 300 MB, in a thread. The event loop waits up to 4 ms
    for it meanwhile. A thread that shares the arena of the freed memory waits until it is over.
"""

from __future__ import annotations

import ctypes
from contextlib import suppress

from service.compute.threads import ThreadWork

TRIMMED_BYTES = 32 << 20
PERIOD = 3.0  # s; a last block on a busy machine takes less


class FreeMemory:
    """Counts the memory of ended sessions."""

    def __init__(self) -> None:
        self._ended = self._freed = 0
        self._looked = 0.0

    def ended(self, size: int) -> None:
        """Count a session that kept `size` bytes alive."""
        self._ended += size

    def look(self, now: float) -> None:
        """Give memory back if enough was freed. Call it some times per second, in the loop. now: monotonic, s."""
        if now - self._looked < PERIOD:
            return
        self._looked = now
        if self._freed >= TRIMMED_BYTES:
            self._freed = 0
            ThreadWork(give_back, "free memory")
        self._freed, self._ended = self._freed + self._ended, 0


def give_back() -> None:
    """Return free memory to the system."""
    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).malloc_trim(0)
