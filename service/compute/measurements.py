"""Measurements of what accuracy costs: one at a time in each process of the service.

Model: a measurement runs in a process of its own (`accuracy_process`), and one thread here waits for it. It takes no
    slot and no thread of the renders. A second request is refused with Retry-After, because a queued request would
    hold its connection for minutes, and two measurements at a time would distort each other's timings. A client that
    disconnects, or a shutdown, ends the measurement.
"""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from starlette.types import Receive

from service.engine import Engine
from service.http.chunked_answer import departure
from service.problems import Problem, refused
from synth.errors import CannotRender, shown
from synth.scene.scene import Scene
from synth.scene.text import json_text

RETRY_SECONDS = 20  # a measurement takes up to a minute; on average, half of it is left


class Measurements:
    """The measurements of one process."""

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="measurement")
        self._under_way = False
        self._given_up = threading.Event()
        self._closed = False

    def close(self) -> None:
        """End the measurement under way, and accept no more."""
        self._closed = True
        self._given_up.set()
        self._pool.shutdown(wait=False, cancel_futures=True)

    async def answer(
        self, read: Callable[[], Scene], quantity: str | None, receive: Receive, *, live: bool = False
    ) -> bytes:
        """Return the JSON for the scene that `read` returns. `receive` reports when the client disconnects.

        Raises what the scene and the engine raise, and Problem (503) during another measurement or at a shutdown.
        """
        if self._closed:
            raise Problem("closing", "The service is shutting down.")
        if self._under_way:
            retry = {"Retry-After": str(RETRY_SECONDS)}
            raise Problem("full", "Another measurement is under way; the service runs one at a time.", headers=retry)
        given_up = threading.Event()
        self._under_way, self._given_up = True, given_up
        gone: asyncio.Future[None] = asyncio.ensure_future(departure(receive))
        try:
            work: asyncio.Future[Any] = asyncio.get_running_loop().run_in_executor(
                self._pool, self._measure, read, quantity, given_up, live
            )
            waits: list[asyncio.Future[Any]] = [work, gone]
            await asyncio.wait(waits, return_when=asyncio.FIRST_COMPLETED)
            given_up.set()
            answer: bytes = await work
            return answer
        except CannotRender:
            if not self._closed:
                raise
            raise Problem("closing", "The service is shutting down.") from None
        finally:
            given_up.set()
            self._under_way = False
            gone.cancel()

    def _measure(self, read: Callable[[], Scene], quantity: str | None, given_up: threading.Event, live: bool) -> bytes:
        scene = read()
        names = [channel.quantity for channel in scene.output.channel_list]
        if quantity is not None and quantity not in names:
            raise refused("?quantity", shown(quantity), " or ".join(names), "Name a channel of the scene.")
        return json_text(self._engine.accuracy(scene, quantity, given_up, live=live))
