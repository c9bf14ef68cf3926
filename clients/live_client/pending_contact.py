"""The newest contact update of a hand, and whether it is still to be sent.

Model: a newer update replaces one that waits. An update without a load or direction keeps the last one. The service may
not have that one, because its update was replaced or the connection broke. The next update then includes both.
"""

from __future__ import annotations

from clients.live_client import wire_messages as wire


class PendingContact:
    """The newest update.

    newest: None before the first. unsent: whether it waits. first: whether it is sent before changes and credit.
    """

    def __init__(self) -> None:
        self.newest: wire.Contact | wire.Place | None = None
        self.unsent = self.first = False
        self._load: float | None = None  # the last that was given, N
        self._direction: float | None = None  # the last that was given, rad
        self._may_lack = False

    def put(self, update: wire.Contact | wire.Place) -> None:
        """Let `update` wait, in place of the one before it."""
        self._may_lack |= self.unsent
        self.newest, self.unsent = update, True
        self._load = self._load if update.load is None else update.load
        if isinstance(update, wire.Place) and update.direction is not None:
            self._direction = update.direction

    def message(self, credit: int = 0) -> bytes:
        """Return the message of the newest update, with `credit` in frames, and mark it as sent."""
        assert self.newest is not None
        update = self.newest.completed(self._load, self._direction) if self._may_lack else self.newest
        self.drop()
        self._may_lack = False
        return update.message(credit)

    def drop(self) -> None:
        """Do not send the newest update again."""
        self.unsent = self.first = False

    def connect_again(self, applied: int | None, oldest: float) -> None:
        """Send the newest update (again) after a break, first of all, unless it was applied or is from before `oldest`.

        applied: number of the newest update that was applied. oldest: s, of the clock of the updates.
        """
        last = self.newest
        self.unsent = self.first = last is not None and last.time >= oldest and (applied is None or applied < last.seq)
        self._may_lack = True
