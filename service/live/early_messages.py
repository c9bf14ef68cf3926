"""What a client says while its voice is still being opened, kept until there is a stream to say it to."""

from __future__ import annotations

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
