"""The clock of a realtime stream: when the next block is due, and whose fault it is when it is late.

Model: the block at frame n is due at start + (n - first) / rate, absolute. Time spent in writes that waited for the
    peer is the peer's; a stream that is behind is read too slowly where more than half of that is so.
Limits: behind by our own fault for more than `FORGIVEN_SECONDS`, the clock starts anew: the sound has a gap, and the
    peer is not sent a long burst.
"""

from __future__ import annotations

from enum import Enum

FORGIVEN_SECONDS = 1.0
WAITED_SECONDS = 0.001  # a write that takes longer has waited for the peer


class Behind(Enum):
    """What a late block means."""

    FINE = "on time, or late by our fault"
    SLOW = "half of what a slow reader may be behind"
    TOO_SLOW = "more than a slow reader may be behind"


class Pace:
    """The clock of one connection; slow_reader: s."""

    def __init__(self, slow_reader: float, now: float) -> None:
        self.due = now
        self._slow_reader = slow_reader
        self._start, self._first, self._rate = now, 0, 1
        self._blocked, self._sending = 0.0, now
        self.in_write = False  # seen from outside the writer: the peer does not take what is sent

    def begin(self, frame: int, rate: int, now: float) -> None:
        """Let `frame` be due now."""
        self._start, self._first, self._rate = now, frame, rate
        self.due = now

    def advance(self, frame: int) -> None:
        """Let `frame` be the next one."""
        self.due = self._start + (frame - self._first) / self._rate

    def writing(self, now: float) -> None:
        """Take note that a write begins."""
        self._sending, self.in_write = now, True

    def written(self, now: float) -> None:
        """Take note that it is over."""
        self.in_write = False
        took = now - self._sending
        if took > WAITED_SECONDS:
            self._blocked += took
        if now < self.due:
            self._blocked = 0.0

    def behind(self, now: float) -> Behind:
        """Return what it means that the next block has not gone out yet."""
        late = now - self.due
        if late <= self._slow_reader / 2:
            return Behind.FINE
        waited = self._blocked + (now - self._sending if self.in_write else 0.0)
        if waited > late / 2:
            return Behind.TOO_SLOW if late > self._slow_reader else Behind.SLOW
        if late > FORGIVEN_SECONDS:
            self._start += late
            self.due = now
        return Behind.FINE
