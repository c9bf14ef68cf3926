"""The clock of a stream: when the next block is due, whose fault it is when it is late, and sleeps until then.

Model: the block at frame n is due at start + (n - first) / rate - lead, absolute, so that errors of single sleeps do
    not add up (sleeping one block at a time drifts by 2-5 %). Time spent in writes that waited for the reader is the
    reader's. A live stream is read too slowly where more than half of what it is behind is the reader's; somebody looks
    often while its writes wait: of the time between two looks no more than LOOK_SECONDS counts, since a service that
    did not look did not write either.
    Live streams share one alarm clock (`BlockTimer`): a timer and a task for each block of each stream would cost more
    than the block.
Limits: a stream that is behind for up to `FORGIVEN_SECONDS`, beyond its lead, catches up in a burst. Behind for longer,
    its clock starts anew: the reader had silence for that time, and every later block comes later by as much. The event
    loop's timer counts in milliseconds: whoever is due within one is served at its end.
"""

from __future__ import annotations

import asyncio
import heapq
import math
import time
from collections.abc import Callable
from enum import Enum
from itertools import count

FORGIVEN_SECONDS = 1.0  # shorter: a network hiccup costs the lead; longer: a long stall is answered by a long burst
WAITED_SECONDS = 0.001  # a write that takes longer has waited for the reader
LOOK_SECONDS = 0.1  # twice as long as it is between two looks of a service that is not late itself


class Behind(Enum):
    """What a late block means."""

    FINE = "on time, or late by our fault"
    SLOW = "half of what a slow reader may be behind"
    TOO_SLOW = "more than a slow reader may be behind"


class Pacer:
    """The clock of one stream.

    rate: frames a second.
    now: s, of any clock; the same for all methods.
    lead: s by which blocks are sent ahead.
    slow_reader: s that a reader may be behind; None: as long as it likes, and nobody looks while a write waits.
    """

    def __init__(self, rate: int, now: float, *, lead: float = 0.0, slow_reader: float | None = None) -> None:
        self._lead, self._slow_reader = lead, slow_reader
        self.begin(0, rate, now)
        self.in_write = False  # seen from outside the writer: the reader does not take what is sent
        self._skipped = self._skipped_waiting = 0.0  # s by which the clock began anew, and the reader's part of them
        self._blocked = 0.0  # s that writes waited since the stream was last on time
        self._waited, self._looked = 0.0, now  # s that the present write has waited, as of the latest look

    @property
    def skipped(self) -> float:
        """Return the seconds by which the clock has begun anew and that nobody was told of."""
        return self._skipped

    def begin(self, frame: int, rate: int, now: float) -> None:
        """Let `frame` be heard now: it is due `lead` before."""
        self._start, self._first, self._rate = now, frame, rate
        self.due = now - self._lead

    def advance(self, frame: int) -> None:
        """Let `frame` be the next one."""
        self.due = self._start + (frame - self._first) / self._rate - self._lead

    def late(self, now: float) -> float:
        """Return by how many seconds the next block is late if it goes out now; while the lead is filled, none is."""
        return now - max(self._start, self.due)

    def take_skipped(self, *, own: bool = False) -> float:
        """Return `skipped`, once; own: less what of it the reader made writes wait."""
        skipped = max(0.0, self._skipped - self._skipped_waiting) if own else self._skipped
        self._skipped = self._skipped_waiting = 0.0
        return skipped

    def writing(self, now: float) -> None:
        """Take note that a write begins."""
        self._waited, self._looked, self.in_write = 0.0, now, True

    def written(self, now: float) -> None:
        """Take note that it is over."""
        self._look(now)
        self.in_write = False
        if self._waited > WAITED_SECONDS:
            self._blocked += self._waited
        if now < self.due + self._lead:
            self._blocked = 0.0

    def behind(self, now: float) -> Behind:
        """Return what it means that the next block has not gone out yet; the clock may start anew."""
        if self.in_write:
            self._look(now)
        late = now - self.due - self._lead
        slow = math.inf if self._slow_reader is None else self._slow_reader
        if late <= min(slow / 2, FORGIVEN_SECONDS):
            return Behind.FINE
        waited = self._blocked + (self._waited if self.in_write else 0.0)
        if waited > late / 2 and self._slow_reader is not None:
            if late <= slow / 2:
                return Behind.FINE
            return Behind.TOO_SLOW if late > slow else Behind.SLOW
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
    """Rings once, for good, and ends the sleep that is under way. Of one event loop; one task sleeps on it."""

    def __init__(self) -> None:
        self._rung = asyncio.Event()
        self._sleep: asyncio.Future[None] | None = None

    @property
    def rung(self) -> bool:
        """Return whether it has rung."""
        return self._rung.is_set()

    def ring(self) -> None:
        """Ring; again is the same as once."""
        self._rung.set()
        if self._sleep is not None:
            _wake(self._sleep)

    async def wait(self) -> None:
        """Return once it has rung."""
        await self._rung.wait()

    async def sleep(self, seconds: float) -> None:
        """Return after `seconds` or when it rings, and let others run in any case."""
        if self.rung or seconds <= 0:
            await asyncio.sleep(0)
            return
        loop = asyncio.get_running_loop()
        self._sleep = loop.create_future()
        timer = loop.call_later(seconds, _wake, self._sleep)
        try:
            await self._sleep
        finally:
            timer.cancel()
            self._sleep = None


def _wake(sleep: asyncio.Future[None]) -> None:
    if not sleep.done():
        sleep.set_result(None)


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
