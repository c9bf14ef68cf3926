"""Threads that do not delay the end of the process, unlike those of `concurrent.futures`.

Model: `Solves` runs each call in a thread of its own, within slots (`work_places`). `BlockThreads` is an executor with
    a few threads, for blocks of streams, which come a hundred times per second. All threads are daemons.
Limits: a thread can neither be stopped nor have a lower priority. Work that must be stoppable runs in a process
    (`service.compute.render_process`).
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
    """One call in a thread of its own. The future `done` has its outcome; `over` is called in the loop when it ends."""

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
        with suppress(RuntimeError):  # the loop is closed
            self._loop.call_soon_threadsafe(self._tell, result, error)

    def _tell(self, result: Any, error: BaseException | None) -> None:
        self._over()
        if self.done.done():
            return  # cancelled
        if error is None:
            self.done.set_result(result)
        else:
            self.done.set_exception(error)


class Solves:
    """Solves for sessions that open, for changes of their scenes, and for tables."""

    def __init__(self, places: Places) -> None:
        self._places = places

    async def run(self, client: str, work: Callable[..., Result], *arguments: Any) -> Result:
        """Return what `work` returns, from a thread, once `client` has a slot for it."""
        place = await self._places.enter(client)
        result: Result = await ThreadWork(partial(work, *arguments), "solve", place.leave).done
        return result


class BlockThreads(Executor):
    """An executor of at most `most` threads. `waited` is called with the seconds that each call waited for a thread."""

    def __init__(self, most: int, waited: Callable[[float], None]) -> None:
        self._most, self._waited = most, waited
        self._calls: queue.SimpleQueue[tuple[float, Future[Any], Callable[[], Any]] | None] = queue.SimpleQueue()
        self._threads = self._busy = 0
        self._lock = threading.Lock()

    def submit(self, work: Callable[..., Result], /, *arguments: Any, **named: Any) -> Future[Result]:
        """Call `work` in a thread."""
        future: Future[Result] = Future()
        with self._lock:
            self._busy += 1
            if self._busy > self._threads < self._most:
                self._threads += 1
                threading.Thread(target=self._run, name="blocks", daemon=True).start()
        self._calls.put((time.monotonic(), future, partial(work, *arguments, **named)))
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the threads after the calls that are queued; wait for none."""
        with self._lock:
            for _ in range(self._threads):
                self._calls.put(None)

    def _run(self) -> None:
        while self._called(self._calls.get()):
            pass

    def _called(self, call: tuple[float, Future[Any], Callable[[], Any]] | None) -> bool:
        """Do one call, None for the end; return whether there was one. An idle thread keeps no voice alive."""
        if call is None:
            return False
        asked, future, work = call
        if future.set_running_or_notify_cancel():
            self._waited(time.monotonic() - asked)
            try:
                future.set_result(work())
            except BaseException as error:
                future.set_exception(error)
        with self._lock:
            self._busy -= 1
        return True
