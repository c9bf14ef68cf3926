"""One alarm clock for many streams: whoever sleeps until a block is due is called when it is.

Model: a heap of times, and one timer of the event loop for the earliest; each call serves all that are due by then. A
    timer and a task for each block of each stream would cost more than the block.
Limits: the event loop's timer counts in milliseconds. One shorter than that would turn the loop round and round until
    it is due, at the cost of who has work: whoever is due within a millisecond is served at its end. Of one event loop.
"""

from __future__ import annotations

import asyncio
import heapq
import time
from collections.abc import Callable
from itertools import count

EARLY_SECONDS = 0.0002  # who is due so soon is called now: a timer of its own would come up to a millisecond late
SHORTEST_SECONDS = 0.001  # that the timer is set for


class BlockTimer:
    """Calls back at times of `clock`."""

    def __init__(self, clock: Callable[[], float] = time.perf_counter) -> None:
        self._clock = clock
        self._waiting: list[tuple[float, int, Callable[[], None]]] = []
        self._numbers = count()
        self._timer: asyncio.TimerHandle | None = None
        self._rings_at = 0.0
        self._ringing = False

    def call_at(self, when: float, callback: Callable[[], None]) -> None:
        """Have `callback` called at `when`, once; it must not raise, and may be called early by EARLY_SECONDS."""
        heapq.heappush(self._waiting, (when, next(self._numbers), callback))
        if not self._ringing and (self._timer is None or when < self._rings_at):
            self._set()

    def _set(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if self._waiting:
            self._rings_at = self._waiting[0][0]
            delay = max(SHORTEST_SECONDS, self._rings_at - self._clock())
            self._timer = asyncio.get_running_loop().call_later(delay, self._ring)

    def _ring(self) -> None:
        self._timer, self._ringing = None, True
        until = self._clock() + EARLY_SECONDS
        try:
            while self._waiting and self._waiting[0][0] <= until:
                heapq.heappop(self._waiting)[2]()
        finally:
            self._ringing = False
            self._set()
