"""How much a live connection may send: messages a second, and what it says before its voice is open.

Model: messages, and frames that are none (pings, parts of messages), are counted in windows of a second; the rest is
    dropped unread, and a flood is closed. A window begins anew only when its count is used up, so the usual message
    costs one comparison. A burst of up to twice the rate may pass across two windows. What comes while the voice is
    being opened is kept within a bound.
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


MOST_MESSAGES = 256  # more are a mistake of the client; fewer lose the contacts of a slow scene
MOST_BYTES = 1 << 18  # of one connection, in all


class EarlyMessages:
    """The messages of one connection, in the order in which they came.

    Beyond the bounds the oldest goes that newer ones make up for: a contact, or a change of the scene.
    """

    def __init__(self) -> None:
        self._kept: list[str | bytes] = []

    def keep(self, message: str | bytes) -> None:
        """Keep `message`."""
        self._kept.append(message)
        while len(self._kept) > MOST_MESSAGES or sum(map(len, self._kept)) > MOST_BYTES:
            overtaken = (place for place, early in enumerate(self._kept) if _may_be_overtaken(early))
            del self._kept[next(overtaken, -1)]

    def take(self) -> list[str | bytes]:
        """Return the messages, once."""
        taken, self._kept = self._kept, []
        return taken


def _may_be_overtaken(message: str | bytes) -> bool:
    return isinstance(message, bytes) or ('"more"' not in message and '"stop"' not in message)
