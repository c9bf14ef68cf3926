"""How many messages a connection may send: a number a second, the rest dropped unread, a flood closed.

Model: messages, and frames that are none (pings, parts of messages), are counted in windows of a second. A window
    begins anew only when its count is used up, so the usual message costs one comparison. A burst of up to twice the
    rate may pass across two windows.
"""

from __future__ import annotations

from service.problems import Problem

FLOOD = 10  # times the rate that is allowed: no slip any more
LEAST_FLOOD = 20_000  # frames in a row that could not be read as they came; fewer may pile up while the service stalls
SCOLD_SECONDS = 1.0  # between two problems that tell of it


class MessageRate:
    """The count of one connection; `now` in seconds."""

    def __init__(self, allowed: int, now: float) -> None:
        self.allowed = allowed
        self.flood = max(FLOOD * allowed, LEAST_FLOOD)
        self._count, self._window, self._scolded = 0, now, now - SCOLD_SECONDS

    def admits(self, now: float) -> bool:
        """Count a message; return whether it may be read."""
        self._count += 1
        if self._count <= self.allowed:
            return True
        if now - self._window < 1.0:
            return False
        self._window, self._count = now, 1
        return True

    @property
    def flooded(self) -> bool:
        """Return whether the messages of this window are beyond a slip."""
        return self._count >= FLOOD * self.allowed

    def problem(self) -> Problem:
        """Return what the peer is told."""
        allowed = f"{self.allowed} messages a second (RIDGEWAVE_MAX_UPDATES)"
        return Problem("too-fast", f"More than {allowed}: the rest of this second is dropped unread.")

    def scolds(self, now: float) -> bool:
        """Return whether the peer is to be told now."""
        if now - self._scolded < SCOLD_SECONDS:
            return False
        self._scolded = now
        return True


def may_be_stop(text: str) -> bool:
    """Return whether `text` is short and names stop: that is read, whatever the rate."""
    return len(text) < 100 and '"stop"' in text
