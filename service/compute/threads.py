"""Threads that nothing waits for at the end of the process, unlike those of `concurrent.futures`.

Model: `Solves` runs each call in a thread of its own, within `places`. `BlockThreads` is an executor of a few threads,
    for blocks of streams, which come a hundred a second. All are daemons: a process that is told to end, ends.
Limits: a thread cannot be stopped, nor have a lower priority: on a busy machine it would hold the interpreter, and all
    streams would wait for it. What must be stopped runs in a process (`service.compute.render_process`).
"""

from __future__ import annotations

import asyncio
import queue
import threading
import time
from collections.abc import Callable
from concurrent.futures import Executor, Future
from contextlib import suppress
from functools import partial
from typing import Any, TypeVar

from service.compute.work_places import Places

Result = TypeVar("Result")


class ThreadWork:
    """One call in a thread of its own. done: what it returned or raised. over: called in the loop when it has ended."""

    def __init__(self, work: Callable[[], Any], name: str, over: Callable[[], None] = lambda: None) -> None:
        self._loop, self._work, self._over = asyncio.get_running_loop(), work, over
        self.done: asyncio.Future[Any] = self._loop.create_future()
        threading.Thread(target=self._run, name=name, daemon=True).start()

    def _run(self) -> None:
        result, error = None, None
        try:
            result = self._work()
        except BaseException as raised:
            error = raised
        with suppress(RuntimeError):  # the loop is closed: nobody waits
            self._loop.call_soon_threadsafe(self._tell, result, error)

    def _tell(self, result: Any, error: BaseException | None) -> None:
        self._over()
        if self.done.done():
            return  # whoever waited has gone
        if error is None:
            self.done.set_result(result)
        else:
            self.done.set_exception(error)


class Solves:
    """Solving for whoever moves or steers a sound: sessions that open, changes of their scenes, and tables."""

    def __init__(self, places: Places) -> None:
        self._places = places

    async def run(self, client: str, work: Callable[..., Result], *arguments: Any) -> Result:
        """Return what `work` returns, from a thread, once there is a place for this work of `client`."""
        place = await self._places.enter(client)
        result: Result = await ThreadWork(partial(work, *arguments), "solve", place.leave).done
        return result


class BlockThreads(Executor):
    """`most` threads; waited: told how long (s) each call waited for one."""

    def __init__(self, most: int, waited: Callable[[float], None]) -> None:
        self._most, self._waited = most, waited
        self._calls: queue.SimpleQueue[tuple[float, Future[Any], Callable[[], Any]] | None] = queue.SimpleQueue()
        self._threads = self._busy = 0
        self._lock = threading.Lock()

    def submit(self, work: Callable[..., Result], /, *arguments: Any, **named: Any) -> Future[Result]:
        """Have a thread call `work`."""
        future: Future[Result] = Future()
        with self._lock:
            self._busy += 1
            if self._busy > self._threads < self._most:
                self._threads += 1
                threading.Thread(target=self._run, name="blocks", daemon=True).start()
        self._calls.put((time.monotonic(), future, partial(work, *arguments, **named)))
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Let the threads go; none is waited for."""
        with self._lock:
            for _ in range(self._threads):
                self._calls.put(None)

    def _run(self) -> None:
        while (call := self._calls.get()) is not None:
            asked, future, work = call
            if future.set_running_or_notify_cancel():
                self._waited(time.monotonic() - asked)
                try:
                    future.set_result(work())
                except BaseException as error:
                    future.set_exception(error)
            with self._lock:
                self._busy -= 1
