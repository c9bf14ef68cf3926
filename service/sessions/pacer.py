"""The pacing of a stream: when the next block is due, and whether the reader or the service makes it late.

Model: the block at frame n is due at start + (n - first) / rate - lead. The time is absolute, so errors of sleeps do
    not add up (relative sleeps drift by 2-5 %). The time that writes wait is caused by the reader. If that is more than
    half of the lateness, the reader is slow once it exceeds half of `slow_reader`, and too slow beyond that. While a
    write waits, `behind` is called often; at most LOOK_SECONDS between two calls count as caused by the reader, since a
    longer interval shows that the service itself is late.
    Live streams share one `BlockTimer`: a timer and a task per block would cost more than the block.
Limits: a stream that is late by up to FORGIVEN_SECONDS beyond its lead catches up in a burst. If it is later, its clock
    restarts: the reader had silence for that time, and every later block is due that much later. The timer of the event
    loop has a resolution of 1 ms.
"""

from __future__ import annotations

import asyncio
import heapq
import math
import time
from collections.abc import Callable
from contextlib import suppress
from enum import Enum
from itertools import count

FORGIVEN_SECONDS = 1.0  # shorter: a hiccup of the network costs the lead; longer: a long stall causes a long burst
WAITED_SECONDS = 0.001  # a longer write has waited for the reader
LOOK_SECONDS = 0.1  # twice the usual time between two calls of `behind` during a write


class Behind(Enum):
    """Whether the reader is too slow."""

    FINE = "on time, or late because of the service"
    SLOW = "behind by half of the bound"
    TOO_SLOW = "behind by more than the bound"


class Pacer:
    """The clock of one stream.

    rate: frames per second.
    now: present time in s, of any clock; the same clock for all methods.
    lead: s by which blocks are sent ahead.
    slow_reader: s by which a reader may be behind; None: without limit, and `behind` is not called during writes.
    due: time at which the next block is due, in s.
    in_write: a write is under way, so the reader has not taken its block yet.
    """

    def __init__(self, rate: int, now: float, *, lead: float = 0.0, slow_reader: float | None = None) -> None:
        self._lead, self._slow_reader = lead, slow_reader
        self.begin(0, rate, now)
        self.in_write = False
        self._skipped = self._skipped_waiting = 0.0  # s of restarts, and the reader's part of them
        self._blocked = 0.0  # s of waiting writes since the stream was last on time
        self._waited, self._looked = 0.0, now  # s that the present write has waited, and when that was updated

    @property
    def skipped(self) -> float:
        """Return the seconds of restarts since the last `take_skipped`."""
        return self._skipped

    def begin(self, frame: int, rate: int, now: float) -> None:
        """Start the clock: `frame` is heard now, so it was due `lead` ago."""
        self._start, self._first, self._rate = now, frame, rate
        self.due = now - self._lead

    def advance(self, frame: int) -> None:
        """Set the next frame."""
        self.due = self._start + (frame - self._first) / self._rate - self._lead

    def late(self, now: float) -> float:
        """Return by how many seconds a block sent now is late. While the lead is being filled, no block is late."""
        return now - max(self._start, self.due)

    def own_late(self, now: float) -> float:
        """Return by how many seconds a block sent now is late because of the service, not of the reader."""
        return self.late(now) - self._caused

    @property
    def _caused(self) -> float:
        """Seconds that writes have waited for the reader since the stream was last on time."""
        return self._blocked + (self._waited if self.in_write else 0.0)

    def take_skipped(self, *, own: bool = False) -> float:
        """Return `skipped` and reset it. own: without the part that the reader caused."""
        skipped = max(0.0, self._skipped - self._skipped_waiting) if own else self._skipped
        self._skipped = self._skipped_waiting = 0.0
        return skipped

    def writing(self, now: float) -> None:
        """Record that a write begins that may wait for the reader."""
        self._waited, self._looked, self.in_write = 0.0, now, True

    def written(self, now: float) -> None:
        """Record that a write is over. One without `writing` has not waited for the reader, however long it took."""
        if self.in_write:
            self._look(now)
            self.in_write = False
            if self._waited > WAITED_SECONDS:
                self._blocked += self._waited
        if now < self.due + self._lead:
            self._blocked = 0.0

    def behind(self, now: float) -> Behind:
        """Return whether the reader is too slow, given that the next block is not sent yet. May restart the clock."""
        if self.in_write:
            self._look(now)
        late = now - self.due - self._lead
        slow = math.inf if self._slow_reader is None else self._slow_reader
        if late <= min(slow / 2, FORGIVEN_SECONDS):
            return Behind.FINE
        waited = self._caused
        if waited > late / 2 and self._slow_reader is not None:
            if min(waited, late) <= slow / 2:
                return Behind.FINE
            return Behind.TOO_SLOW if min(waited, late) > slow else Behind.SLOW
        if late > FORGIVEN_SECONDS:
            self._start += late
            self.due = now - self._lead
            self._skipped, self._skipped_waiting = self._skipped + late, self._skipped_waiting + waited
            if self._slow_reader is None:
                self._blocked = 0.0
        return Behind.FINE

    def _look(self, now: float) -> None:
        passed = now - self._looked
        self._waited += passed if self._slow_reader is None else min(passed, LOOK_SECONDS)
        self._looked = now


class Bell:
    """A signal that ends every sleep on it, present and later."""

    def __init__(self) -> None:
        self._rung = asyncio.Event()

    @property
    def rung(self) -> bool:
        """Return whether `ring` has been called."""
        return self._rung.is_set()

    def ring(self) -> None:
        """End all sleeps."""
        self._rung.set()

    async def wait(self) -> None:
        """Return once `ring` has been called."""
        await self._rung.wait()

    async def sleep(self, seconds: float) -> None:
        """Return after `seconds` or once `ring` has been called. Other tasks run in between."""
        await asyncio.sleep(0)
        with suppress(TimeoutError):
            async with asyncio.timeout(seconds):
                await self._rung.wait()


EARLY_SECONDS = 0.0002  # by which a callback may be early; a timer for it alone would be up to 1 ms late
SHORTEST_SECONDS = 0.001  # of the timer


class BlockTimer:
    """Calls callbacks at given times of `clock`."""

    def __init__(self, clock: Callable[[], float] = time.perf_counter) -> None:
        self._clock = clock
        self._waiting: list[tuple[float, int, Callable[[], None]]] = []
        self._numbers = count()
        self._timer: asyncio.TimerHandle | None = None
        self._rings_at = 0.0
        self._ringing = False

    def call_at(self, when: float, callback: Callable[[], None]) -> None:
        """Call `callback` once at `when`, or up to EARLY_SECONDS before. It must not raise."""
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
