"""Whether the blocks of a voice are rendered in the event loop, or in a thread because they would make others late.

Model: a block that takes longer than QUICK_SECONDS is slow; PATIENCE slow ones in a row send the next ones to a thread,
    and a quick one brings them back. In the event loop the clock is the wall's, since a thread's own costs half a block
    to read; a busy machine delays a block now and then, but not always the same voice's.
Limits: threads that render share the interpreter: many of them at a time make each other and the event loop late. They
    are for the few voices whose every block is dear.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from concurrent.futures import Executor
from typing import TypeVar

QUICK_SECONDS = 0.001  # a tenth of a block of 10 ms; more and ten such voices make each other late
PATIENCE = 8  # slow blocks in a row; fewer, and a hand that meets new tables on a busy machine is sent to threads

Rendered = TypeVar("Rendered")


class Quickness:
    """Of one voice."""

    __slots__ = ("_slow", "quick")

    def __init__(self) -> None:
        self.quick = True
        self._slow = 0

    def begin_anew(self) -> None:
        """Have the next block rendered in a thread."""
        self.quick = False

    def took(self, seconds: float) -> None:
        """Take note of how long a block took."""
        if seconds < QUICK_SECONDS:
            self.quick, self._slow = True, 0
        else:
            self._slow += 1
            if self._slow >= PATIENCE:
                self.quick = False

    async def rendered(self, render: Callable[[int], Rendered], frames: int, pool: Executor) -> Rendered:
        """Return `render(frames)`, rendered here while that is quick and in `pool` while it is not."""
        if self.quick:
            return self.rendered_here(render, frames)
        block, seconds = await asyncio.get_running_loop().run_in_executor(pool, _timed_apart, render, frames)
        self.took(seconds)
        return block

    def rendered_here(self, render: Callable[[int], Rendered], frames: int) -> Rendered:
        """Return `render(frames)`, rendered here."""
        block, seconds = _timed(render, frames)
        self.took(seconds)
        return block


def _timed_apart(render: Callable[[int], Rendered], frames: int) -> tuple[Rendered, float]:
    """Do as `_timed` by the thread's own clock: beside other threads, every block would seem slow by the wall's."""
    began = time.thread_time()
    return render(frames), time.thread_time() - began


def _timed(render: Callable[[int], Rendered], frames: int) -> tuple[Rendered, float]:
    began = time.perf_counter()
    return render(frames), time.perf_counter() - began
