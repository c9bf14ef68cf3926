"""The clock of a realtime stream: when the next block is due, and whose fault it is when it is late.

Model: the block at frame n is due at start + (n - first) / rate, absolute. Time spent in writes that waited for the
    peer is the peer's; a stream that is behind is read too slowly where more than half of that is so. Somebody looks
    often while a write waits: of the time between two looks no more than LOOK_SECONDS counts, since a service that did
    not look did not write either.
Limits: behind by our own fault for up to `FORGIVEN_SECONDS`, the stream catches up in a burst. Behind for longer, its
    clock starts anew: the peer had silence for that time, and every later block comes later by as much.
"""

from __future__ import annotations

from enum import Enum

FORGIVEN_SECONDS = 1.0
WAITED_SECONDS = 0.001  # a write that takes longer has waited for the peer
LOOK_SECONDS = 0.1  # twice as long as it is between two looks of a service that is not late itself


class Behind(Enum):
    """What a late block means."""

    FINE = "on time, or late by our fault"
    SLOW = "half of what a slow reader may be behind"
    TOO_SLOW = "more than a slow reader may be behind"


class Pace:
    """The clock of one connection; slow_reader: s."""

    def __init__(self, slow_reader: float, now: float) -> None:
        self.due = now
        self.skipped = 0.0  # s by which the clock has begun anew and that the peer was not told of
        self._slow_reader = slow_reader
        self._start, self._first, self._rate = now, 0, 1
        self._blocked = 0.0  # s that writes waited since the stream was last on time
        self._waited, self._looked = 0.0, now  # s that the present write has waited, as of the latest look
        self.in_write = False  # seen from outside the writer: the peer does not take what is sent

    def begin(self, frame: int, rate: int, now: float) -> None:
        """Let `frame` be due now."""
        self._start, self._first, self._rate = now, frame, rate
        self.due = now

    def advance(self, frame: int) -> None:
        """Let `frame` be the next one."""
        self.due = self._start + (frame - self._first) / self._rate

    def take_skipped(self) -> float:
        """Return `skipped`, once."""
        skipped, self.skipped = self.skipped, 0.0
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
        if now < self.due:
            self._blocked = 0.0

    def behind(self, now: float) -> Behind:
        """Return what it means that the next block has not gone out yet."""
        if self.in_write:
            self._look(now)
        late = now - self.due
        if late <= min(self._slow_reader / 2, FORGIVEN_SECONDS):
            return Behind.FINE
        waited = self._blocked + (self._waited if self.in_write else 0.0)
        if waited > late / 2:
            if late <= self._slow_reader / 2:
                return Behind.FINE
            return Behind.TOO_SLOW if late > self._slow_reader else Behind.SLOW
        if late > FORGIVEN_SECONDS:
            self._start += late
            self.skipped += late
            self.due = now
        return Behind.FINE

    def _look(self, now: float) -> None:
        self._waited += min(now - self._looked, LOOK_SECONDS)
        self._looked = now
