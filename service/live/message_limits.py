"""How much a live connection may send: messages per second, and messages before its voice is open.

Model: messages, pings, pongs and parts of messages are counted in windows of a second. Excess messages are dropped
    unread, and a flood closes the connection. A new window begins only when the count of the last one is used up, so
    an ordinary message costs two comparisons. A refusal costs some ten times as much as an ordinary message. Only so
    many are made in a window: a peer that sends nothing else is then read fast enough to be recognised as a flood.
Limits: a burst of up to twice the rate may pass across two windows.
"""

from __future__ import annotations

from service.problems import Problem

FLOOD = 10  # multiple of the allowed rate that is a flood
LEAST_FLOOD = 20_000  # fewer frames without a pause are no flood: they may pile up while the service stalls
MOST_REFUSED = 200  # per second; more would be late messages to a client that does not heed them
REPORT_SECONDS = 1.0  # between two problems that report the excess


class MessageRate:
    """The messages of one connection. allowed: per second. now: a time in seconds."""

    def __init__(self, allowed: int, now: float) -> None:
        self.allowed = allowed
        self.flood = max(FLOOD * allowed, LEAST_FLOOD)
        self._count, self._refused, self._window, self._reported = 0, 0, now, now - REPORT_SECONDS

    def admits(self, now: float) -> bool:
        """Count a message; return whether it is within the rate."""
        self._count += 1
        if self._count <= self.allowed and self._refused < MOST_REFUSED:
            return True
        if now - self._window < 1.0:
            return False
        self._window, self._count, self._refused = now, 1, 0
        return True

    def refused(self) -> None:
        """Count a refusal."""
        self._refused += 1

    @property
    def flooded(self) -> bool:
        """Return whether the messages of this window are a flood."""
        return self._count >= FLOOD * self.allowed

    def problem(self) -> Problem:
        """Return the problem that reports the excess."""
        excess = f"More than {self.allowed} messages a second (RIDGEWAVE_MAX_UPDATES)"
        if self._refused >= MOST_REFUSED:
            excess = f"{MOST_REFUSED} messages were refused in a second"
        return Problem("too-fast", f"{excess}: further messages in this second are dropped unread.")

    def reports(self, now: float) -> bool:
        """Return whether the excess is to be reported now."""
        if now - self._reported < REPORT_SECONDS:
            return False
        self._reported = now
        return True


def may_be_stop(text: str) -> bool:
    """Return whether `text` is short and names stop. Such a message is read at any rate."""
    return len(text) < 100 and '"stop"' in text


MOST_MESSAGES = 256  # more are a mistake of the client; fewer would lose contacts while a slow scene opens
MOST_BYTES = 1 << 18  # of one connection


class EarlyMessages:
    """The messages that arrive while the voice is being opened, in order.

    Beyond the bounds the oldest contact or change of the scene is dropped.
    """

    def __init__(self) -> None:
        self._kept: list[str | bytes] = []

    def keep(self, message: str | bytes) -> None:
        """Keep `message` for `take`."""
        self._kept.append(message)
        while len(self._kept) > MOST_MESSAGES or sum(map(len, self._kept)) > MOST_BYTES:
            replaceable = (place for place, early in enumerate(self._kept) if _replaceable(early))
            del self._kept[next(replaceable, -1)]

    def take(self) -> list[str | bytes]:
        """Return the messages, and forget them."""
        taken, self._kept = self._kept, []
        return taken


def _replaceable(message: str | bytes) -> bool:
    return isinstance(message, bytes) or ('"more"' not in message and '"stop"' not in message)
