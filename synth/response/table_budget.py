"""What the tables of several responses may hold together: a service that is touched in many scenes keeps its memory.

Model   A store of tables may hold POOL_BYTES, as long as all stores together hold less than the limit; beyond it what
        is left, and LEAST_BYTES in any case. A store that would pass its room begins anew, as large as its room then.
Limits  what is held is not taken away from who holds it: the bound is the limit, and LEAST_BYTES for each store that
        comes when it is reached. With so little room hands meet tables that have to be built again, some milliseconds
        each.
"""

from __future__ import annotations

import threading
from typing import Protocol
from weakref import WeakSet

POOL_BYTES = 256 << 20  # what a response may hold in tables of one degree; many hands that press refill smaller ones
LEAST_BYTES = 16 << 20  # the same at least; less: a hand that presses has every block wait for tables
# Of all stores together. A scene under tapping hands takes some 160 MB; where the tables of many do not fit they are
# built again and again, which takes twenty times as long as reading them (`python -m tests.bench taps`).
DEFAULT_LIMIT = 1 << 31


class Holder(Protocol):
    """What has tables."""

    @property
    def memory_bytes(self) -> int:
        """Bytes that they take."""
        ...


class TableBudget:
    """The limit (bytes) that stores share. Thread-safe."""

    def __init__(self, limit: int = DEFAULT_LIMIT) -> None:
        self.limit = limit
        self._holders: WeakSet[Holder] = WeakSet()
        self._lock = threading.Lock()

    def enter(self, holder: Holder) -> None:
        """Count what `holder` takes, for as long as it is there."""
        with self._lock:
            self._holders.add(holder)

    @property
    def used_bytes(self) -> int:
        """Bytes that all take now."""
        with self._lock:
            holders = list(self._holders)
        return sum(holder.memory_bytes for holder in holders)

    def room_of(self, holder: Holder) -> int:
        """Return how many bytes `holder` may take, those that it has included."""
        left = self.limit - self.used_bytes + holder.memory_bytes
        return min(POOL_BYTES, max(LEAST_BYTES, left))
