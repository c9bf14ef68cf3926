"""An answer that is sent chunk by chunk: its reader may leave at any time, its generator is closed in any case.

Limits: async generators only. A chunk that waits to be taken when the end is asked for is dropped, and the connection
    cut, if the reader does not take it within the grace that `ended` returns: a reader that slept through a stop is not
    sent, when it wakes, what was rendered before.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Awaitable, Callable, Mapping
from typing import Any

from starlette.responses import Response
from starlette.types import Receive, Scope, Send


class HeadResponse(Response):
    """The answer to HEAD: the headers that GET would have, whose length is only there where it is promised."""

    def __init__(self, headers: Mapping[str, str], media_type: str) -> None:
        super().__init__(None, 200, headers, media_type)
        _promise_only(self, headers)


class PumpedResponse(Response):
    """Sends `chunks`; `released` is called once when all is over, even if nothing was sent. cut: ends it, wherever it
    is."""

    def __init__(
        self,
        chunks: AsyncGenerator[bytes, None],
        headers: Mapping[str, str],
        media_type: str,
        *,
        released: Callable[[], None],
        ended: Callable[[], Awaitable[float]] | None = None,
        cut: asyncio.Event | None = None,
    ) -> None:
        super().__init__(None, 200, headers, media_type)
        _promise_only(self, headers)
        self._chunks = chunks
        self._released = released
        self._ended, self._cut = ended, cut
        self._taken = 0

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send the answer; raises what the generator raises, after which the server cuts the answer short."""
        tasks: list[asyncio.Task[Any]] = []
        try:
            await send({"type": "http.response.start", "status": 200, "headers": self.raw_headers})
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
        """Return once a chunk that waited when the end was asked for has not been taken within the grace."""
        assert self._ended is not None
        grace = await self._ended()
        taken = self._taken
        await asyncio.sleep(grace)
        if self._taken != taken:
            await asyncio.Event().wait()


def _promise_only(response: Response, headers: Mapping[str, str]) -> None:
    """Take back the Content-Length that an empty body got, unless `headers` give one."""
    if "content-length" not in {name.lower() for name in headers}:
        del response.headers["content-length"]


async def departure(receive: Receive) -> None:
    """Return when the reader has left."""
    while (await receive())["type"] != "http.disconnect":
        pass
