"""Calls into a driver that may never return, given a time to do so.

Model: the call runs in a thread of its own, which is left behind where it takes too long: nothing can end it. What it
    returns too late is handed to `too_late`, so that a device that opens after all is closed again.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import TypeVar

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
