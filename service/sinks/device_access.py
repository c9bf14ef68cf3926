"""Exclusive use of audio devices, and calls into a driver that may never return.

Model: a play claims its device by PortAudio's index, because a device would play the sum of two sounds. It releases the
    claim when its stream has ended. A new play waits briefly for a device whose play is just ending. A call into a
    driver runs in a thread of its own. A thread that takes too long is abandoned, because nothing can stop it; its late
    result goes to `too_late`, so that a device that opens after all is closed again.
Limits: claims hold within one process. Two names may lead to the same hardware: ALSA's "default" and the card behind it
    are different devices here.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import TypeVar

from synth.errors import CannotRender

PATIENCE_SECONDS = 0.5  # for a play that is ending; its fade and the rest of its ring take 0.1 s


class DeviceBusy(CannotRender):
    """The device is in use by another play."""


class Claims:
    """The devices in use. Thread-safe."""

    def __init__(self) -> None:
        self._taken: set[int] = set()
        self._changed = threading.Condition()

    def take(self, index: int, name: str, patience: float = PATIENCE_SECONDS) -> None:
        """Claim the device `index`, called `name`. Raises DeviceBusy if it is not free within `patience` seconds."""
        with self._changed:
            if not self._changed.wait_for(lambda: index not in self._taken, patience):
                raise DeviceBusy(f"{name} plays already. End that play, or name another device.")
            self._taken.add(index)

    def give_back(self, index: int) -> None:
        """Release the device."""
        with self._changed:
            self._taken.discard(index)
            self._changed.notify_all()


Result = TypeVar("Result")


def within(seconds: float, work: Callable[[], Result], too_late: Callable[[Result], None] | None = None) -> Result:
    """Return what `work` returns, or raise what it raises. Raises TimeoutError after `seconds`."""
    future: Future[Result] = Future()

    def run() -> None:
        """Do the work, and keep its result or its error for whoever waits."""
        try:
            future.set_result(work())
        except BaseException as error:
            future.set_exception(error)

    def undo(done: Future[Result]) -> None:
        """Hand a result for which nobody waits any more to `too_late`."""
        if too_late is not None and done.exception() is None:
            too_late(done.result())

    threading.Thread(target=run, name="driver", daemon=True).start()
    try:
        return future.result(seconds)
    except TimeoutError:
        future.add_done_callback(undo)
        raise
