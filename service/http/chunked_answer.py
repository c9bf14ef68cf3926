"""An answer that is sent chunk by chunk, until its end or until the reader leaves.

Limits: async generators only. When a stop is requested, a chunk that the reader has not taken within the grace is
    dropped and the connection is closed. A reader that stalls through a stop is therefore not sent older sound when it
    reads again.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Awaitable, Callable, Coroutine, Mapping
from typing import Any, TypeVar

from starlette.requests import ClientDisconnect
from starlette.responses import StreamingResponse
from starlette.types import Receive, Scope, Send

from service.problems import Problem

Result = TypeVar("Result")


class PumpedResponse(StreamingResponse):
    """Sends `chunks`, and closes the generator in any case.

    status: of the answer.
    released: called once when the answer is over, even if nothing was sent.
    ended: returns the grace, in seconds, once the answer is to end.
    cut: ends the answer at once.
    """

    def __init__(
        self,
        chunks: AsyncGenerator[bytes, None],
        headers: Mapping[str, str],
        media_type: str,
        *,
        status: int = 200,
        released: Callable[[], None],
        ended: Callable[[], Awaitable[float]] | None = None,
        cut: asyncio.Event | None = None,
    ) -> None:
        super().__init__(chunks, status, headers=headers, media_type=media_type)
        self._chunks = chunks
        self._released = released
        self._ended, self._cut = ended, cut
        self._taken = 0

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send the answer; raises what the generator raises, after which the server closes the connection."""
        tasks: list[asyncio.Task[Any]] = []
        try:
            await send({"type": "http.response.start", "status": self.status_code, "headers": self.raw_headers})
            pump = asyncio.create_task(self._pump(send))
            tasks = [pump, asyncio.create_task(departure(receive))]
            if self._ended is not None:
                tasks.append(asyncio.create_task(self._stall()))
            if self._cut is not None:
                tasks.append(asyncio.create_task(self._cut.wait()))
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            if pump.done():
                pump.result()
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            await self._chunks.aclose()
            self._released()

    async def _pump(self, send: Send) -> None:
        async for chunk in self._chunks:
            await send({"type": "http.response.body", "body": chunk, "more_body": True})
            self._taken += 1
        await send({"type": "http.response.body", "body": b"", "more_body": False})

    async def _stall(self) -> None:
        """Return if a chunk that waited when the end was requested has not been taken within the grace."""
        assert self._ended is not None
        grace = await self._ended()
        taken = self._taken
        await asyncio.sleep(grace)
        if self._taken != taken:
            await asyncio.Event().wait()


async def departure(receive: Receive) -> None:
    """Return when the client has disconnected."""
    while (await receive())["type"] != "http.disconnect":
        pass


async def while_wanted(work: Coroutine[Any, Any, Result], receive: Receive, cut: asyncio.Event | None = None) -> Result:
    """Return what `work` returns.

    Cancels it and raises ClientDisconnect as soon as the client disconnects, or Problem (closing) once `cut` is set.
    It returns after the work has ended. Call it after the whole body was read.
    """
    task = asyncio.ensure_future(work)
    gone = asyncio.ensure_future(departure(receive))
    waits: list[asyncio.Future[Any]] = [task, gone]
    if cut is not None:
        waits.append(asyncio.ensure_future(cut.wait()))
    try:
        await asyncio.wait(waits, return_when=asyncio.FIRST_COMPLETED)
        if gone.done():
            raise ClientDisconnect
        if task.done():
            return task.result()
        raise Problem("closing", "The service is shutting down.")
    finally:
        for one in waits:
            one.cancel()
        await asyncio.gather(*waits, return_exceptions=True)
