"""Measurements of what accuracy costs: one at a time in a process of the service, apart from all that sounds.

Model: a measurement occupies no place among the renders and none of their threads: it has one thread, which waits for
    another process (`accuracy_process`). A second is refused at once, with Retry-After, since to queue would
    hold a connection for minutes and two at a time would time each other. Whoever asked and leaves ends it, and so
    does a shutdown.
"""

from __future__ import annotations

import asyncio
import threading
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from starlette.types import Receive

from service.engine import Engine
from service.http.chunked_answer import departure
from service.problems import Problem, refused
from synth.errors import shown
from synth.scene.scene import parse_scene_text

RETRY_SECONDS = 20  # a measurement takes up to a minute: on average somewhat more than this is left of one


class Measurements:
    """The measurements of one process."""

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="measurement")
        self._under_way = False
        self._given_up = threading.Event()
        self._closed = False

    def close(self) -> None:
        """End the one under way, and take no more."""
        self._closed = True
        self._given_up.set()
        self._pool.shutdown(wait=False, cancel_futures=True)

    async def answer(self, body: bytes, quantity: str | None, receive: Receive) -> dict[str, Any]:
        """Return the document for the scene that `body` holds; `receive` tells whether the client is still there.

        Raises what the scene and the engine raise, and Problem: 503 while there is another, or at a shutdown.
        """
        if self._closed:
            raise Problem("closing", "The service is shutting down.")
        if self._under_way:
            retry = {"Retry-After": str(RETRY_SECONDS)}
            raise Problem("full", "One measurement at a time, and there is one.", headers=retry)
        given_up = threading.Event()
        self._under_way, self._given_up = True, given_up
        left: asyncio.Future[None] = asyncio.ensure_future(departure(receive))
        try:
            work: asyncio.Future[Any] = asyncio.get_running_loop().run_in_executor(
                self._pool, self._measure, body, quantity, given_up
            )
            waited: list[asyncio.Future[Any]] = [work, left]
            await asyncio.wait(waited, return_when=asyncio.FIRST_COMPLETED)
            given_up.set()
            document: dict[str, Any] = await work
            return document
        finally:
            given_up.set()
            self._under_way = False
            left.cancel()

    def _measure(self, body: bytes, quantity: str | None, given_up: threading.Event) -> dict[str, Any]:
        scene = parse_scene_text(body)
        names = [channel.quantity for channel in scene.output.channel_list]
        if quantity is not None and quantity not in names:
            raise refused("?quantity", shown(quantity), " or ".join(names), "Name a channel of the scene.")
        return self._engine.accuracy(scene, quantity, given_up)
