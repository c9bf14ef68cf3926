"""How fast the messages of a live connection are read, and how many may wait for its voice.

Model: a client has `allowed` messages per second, and saves up those of one second at most. A frame of any kind costs
    one message, and one more for each KiB; a refusal costs REFUSED more. Where the client has used up its messages,
    its socket is not read until it has one again: TCP then makes the client wait. No message is lost.
    The time is read only where the messages are used up, so an ordinary one costs a comparison.
Limits: the last message may cost more than is left; the next one waits for that too. Twice the messages of a second may
    be read within a second after a pause.
"""

from __future__ import annotations

from collections.abc import Callable

from service.problems import Problem

COST_BYTES = 1024  # of a frame that cost one message more: a text of 64 kB takes 1 to 3 ms
WAITED_SECONDS = 1.0  # for which messages wait unread until the client is told: its motion is heard that much later
REFUSED = 9  # messages that a refusal costs more: checking and answering takes ten times as long


class MessageRate:
    """The messages of one connection. allowed: per second. now: a time in seconds."""

    def __init__(self, allowed: int, now: float) -> None:
        self._allowed = allowed
        self._left, self._at = float(allowed), now
        self._told = False

    def spend(self, size: int) -> None:
        """Count a frame of `size` bytes."""
        self._left -= 1 + size // COST_BYTES

    def refused(self) -> None:
        """Count a refusal."""
        self._left -= REFUSED

    def wait(self, clock: Callable[[], float]) -> float:
        """Return the seconds until another message may be read, 0 for now."""
        if self._left < 1.0:
            now = clock()
            self._left = min(float(self._allowed), self._left + (now - self._at) * self._allowed)
            self._at = now
        return max(0.0, 1.0 - self._left) / self._allowed

    def behind(self, seconds: float) -> Problem | None:
        """Return what to tell the client, once, whose messages have been waiting for `seconds`; None for nothing."""
        if seconds <= WAITED_SECONDS or self._told:
            return None
        self._told = True
        most = f"At most {self._allowed} a second are read (RIDGEWAVE_MAX_UPDATES)"
        rest = "and none while many changes of the scene wait. Motion and changes are heard late: send fewer."
        return Problem("too-fast", f"Messages of this client have waited for a second. {most}, {rest}")


PAUSE_SECONDS = 0.01  # of reading, while a voice that is being opened or a change that is being solved has no room
MOST_MESSAGES = 256  # more are a mistake of the client; fewer would make it wait while a slow scene opens
MOST_BYTES = 1 << 18  # of one connection, and one message more


class EarlyMessages:
    """The messages that arrive while the voice is being opened, in order. No more are read while it is `full`."""

    def __init__(self) -> None:
        self._kept: list[str | bytes] = []
        self._bytes = 0

    @property
    def full(self) -> bool:
        """Return whether no further message may be read."""
        return len(self._kept) >= MOST_MESSAGES or self._bytes >= MOST_BYTES

    def keep(self, message: str | bytes) -> None:
        """Keep `message` for `take`."""
        self._kept.append(message)
        self._bytes += len(message)

    def take(self) -> list[str | bytes]:
        """Return the messages, and forget them."""
        taken, self._kept, self._bytes = self._kept, [], 0
        return taken
