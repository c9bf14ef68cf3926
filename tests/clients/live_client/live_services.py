"""Where the tests of the live client have their service: in memory, or behind a real WebSocket at any address.

`LIVE_SERVICES` are the services behind WebSockets: the fake one and, where its plain engine can follow a hand, the
service itself. The last of them is what the examples of docs/ talk to.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Iterator
from contextlib import (
    AbstractAsyncContextManager,
    AbstractContextManager,
    ExitStack,
    asynccontextmanager,
    contextmanager,
)
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from clients import AsyncLive, Live
from clients.live_client.reconnection import Backoff
from tests.clients.live_client.fake_live import Service
from tests.clients.live_client.loopback import LoopbackService, cutting
from tests.clients.live_client.memory_connection import LoopNetwork, ThreadNetwork
from tests.service.harness import serving
from tests.service.plain_engine import PlainEngine

LIVE_SERVICES = ("fake", "service") if hasattr(PlainEngine, "open_hand") else ("fake",)
Block = npt.NDArray[np.float32]
Cuts = tuple[int | None, ...]


@contextmanager
def serving_live() -> Iterator[dict[str, str]]:
    """Yield the address of the live protocol of each of LIVE_SERVICES."""
    with LoopbackService(Service()) as fake, serving(PlainEngine()) as running:
        yield {"fake": fake.url, "service": running.url.replace("http", "ws", 1) + "/v1/live"}


def at_once() -> Backoff:
    """Return a backoff without delays."""
    return Backoff(0.0, 0.0)


class Place(Protocol):
    """A service to connect to. cuts: the byte from the service after which each connection breaks."""

    def live(self, scene: Any = None, cuts: Cuts = (), **options: Any) -> AbstractContextManager[Live]: ...
    def live_async(
        self, scene: Any = None, cuts: Cuts = (), **options: Any
    ) -> AbstractAsyncContextManager[AsyncLive]: ...


class MemoryPlace:
    """A service in memory, without a socket."""

    def __init__(self) -> None:
        self.service = Service()

    @contextmanager
    def live(self, scene: Any = None, cuts: Cuts = (), **options: Any) -> Iterator[Live]:
        options.setdefault("backoff", at_once())
        with Live(scene, connect=ThreadNetwork(self.service, cuts), **options) as touch:
            yield touch

    @asynccontextmanager
    async def live_async(self, scene: Any = None, cuts: Cuts = (), **options: Any) -> AsyncIterator[AsyncLive]:
        options.setdefault("backoff", at_once())
        async with AsyncLive(scene, connect=LoopNetwork(self.service, cuts), **options) as touch:
            yield touch


class WebSocketPlace:
    """A real WebSocket to `url`, through a proxy if there are cuts."""

    def __init__(self, url: str) -> None:
        self.url = url

    @contextmanager
    def live(self, scene: Any = None, cuts: Cuts = (), **options: Any) -> Iterator[Live]:
        options.setdefault("backoff", at_once())
        with ExitStack() as opened:
            url = opened.enter_context(cutting(self.url, cuts)) if cuts else self.url
            yield opened.enter_context(Live(scene, url=url, **options))

    @asynccontextmanager
    async def live_async(self, scene: Any = None, cuts: Cuts = (), **options: Any) -> AsyncIterator[AsyncLive]:
        options.setdefault("backoff", at_once())
        with ExitStack() as opened:
            url = opened.enter_context(cutting(self.url, cuts)) if cuts else self.url
            async with AsyncLive(scene, url=url, **options) as touch:
                yield touch


def stroke(touch: Live, reads: list[int]) -> Block:
    """Move before each read; return all that was read."""
    blocks = []
    for number, frames in enumerate(reads):
        touch.move(0.001 * number, 0.3)
        blocks.append(touch.read(frames, timeout=60.0))
    return np.concatenate(blocks)


async def stroke_async(touch: AsyncLive, reads: list[int]) -> Block:
    blocks = []
    for number, frames in enumerate(reads):
        touch.move(0.001 * number, 0.3)
        async with asyncio.timeout(60.0):
            blocks.append(await touch.read(frames))
    return np.concatenate(blocks)


READS = [80, 1, 200, 80, 37, 160, 800]
