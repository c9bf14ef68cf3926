"""Access to audio devices: one play a device, and calls into a driver that may never return.

Model: a play claims its device by PortAudio's index before it opens it, since a device would sound the sum of two, and
    gives it back when its stream has ended. One that is just ending is waited for, so that a play may follow another at
    once. A call into a driver runs in a thread of its own, which is left behind where it takes too long: nothing can
    end it. What it returns too late is handed to `too_late`, so that a device that opens after all is closed again.
Limits: of one process. Another process's sound is not seen, nor that two names may lead to one piece of hardware:
    ALSA's "default" is another device here than the card behind it.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import TypeVar

from synth.errors import CannotRender

PATIENCE_SECONDS = 0.5  # for a play that ends: its fade, and the ring that a device still plays, take 0.1 s


class DeviceBusy(CannotRender):
    """Something plays on the device already."""


class Claims:
    """The devices that play, for plays in any thread."""

    def __init__(self) -> None:
        self._taken: set[int] = set()
        self._changed = threading.Condition()

    def take(self, index: int, name: str, patience: float = PATIENCE_SECONDS) -> None:
        """Claim the device `index`, called `name`; raises DeviceBusy where it is not free within `patience` seconds."""
        with self._changed:
            if not self._changed.wait_for(lambda: index not in self._taken, patience):
                raise DeviceBusy(f"{name} plays already. End that play, or name another device.")
            self._taken.add(index)

    def give_back(self, index: int) -> None:
        """Let the device be claimed again."""
        with self._changed:
            self._taken.discard(index)
            self._changed.notify_all()


Result = TypeVar("Result")


def within(seconds: float, work: Callable[[], Result], too_late: Callable[[Result], None] | None = None) -> Result:
    """Return what `work` returns, or raise what it raises; TimeoutError where it takes longer than `seconds`."""
    future: Future[Result] = Future()

    def run() -> None:
        try:
            future.set_result(work())
        except BaseException as error:
            future.set_exception(error)

    def undo(done: Future[Result]) -> None:
        if too_late is not None and done.exception() is None:
            too_late(done.result())

    threading.Thread(target=run, name="driver", daemon=True).start()
    try:
        return future.result(seconds)
    except TimeoutError:
        future.add_done_callback(undo)
        raise
