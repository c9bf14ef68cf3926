"""`AsyncLive`: a live stream for programs with an event loop.

    async with AsyncLive(scene) as touch:
        touch.move(position, load)
        block = await touch.read(frames)

`live_protocol` decides what to send and what a message means. This module only waits: one task connects and receives,
another sends. `read` may be called from one task, every other method from any task of the same loop.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable, Iterator
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self, Unpack

from websockets.asyncio.client import ClientConnection, connect

from clients.live_client.live_interface import LiveHand, LiveOptions
from clients.live_client.live_protocol import LiveCore, not_open
from clients.live_client.reconnection import Closed
from clients.live_client.websocket_connection import (
    CLOSE_SECONDS,
    FAILURES,
    READY_SECONDS,
    Address,
    AsyncConnect,
    AsyncConnection,
    check_subprotocol,
    closure_of,
    not_ready,
)
from clients.pcm_buffer import Block

if TYPE_CHECKING:
    from clients.http_client.async_client import AsyncClient


class AsyncLive(LiveHand):
    """A live stream; see `LiveHand` for the arguments.

    connect: makes the connection, `websockets` unless given; see `AsyncConnection`.
    client: the `AsyncClient` that fetches the recording; None makes one of `url` and `key`.
    """

    def __init__(
        self,
        scene: Any = None,
        *,
        connect: AsyncConnect | None = None,
        client: AsyncClient | None = None,
        **options: Unpack[LiveOptions],
    ) -> None:
        super().__init__(scene, **options)
        self._connect = connect or open_connection
        self._client = client
        self._changed = asyncio.Event()
        self._connection: AsyncConnection | None = None
        self._task: asyncio.Task[None] | None = None

    async def __aenter__(self) -> Self:
        assert self._task is None, "a stream is opened once"
        self._task = asyncio.create_task(self._live(), name="ridgewave-live")
        core = self._core
        try:
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(READY_SECONDS):
                    await self._until(lambda: core.ready is not None or core.over is not None)
            if core.ready is None:
                raise core.over or not_ready()
        except BaseException:
            await self.close()
            raise
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self.close()

    async def read(self, frames: int) -> Block:
        """As `Live.read`; bounded by `asyncio.timeout`, after which, as after any cancellation, nothing is missing."""
        with self._guarded():
            self._open().want(frames)
        await self._until(lambda: self._core.may_take(frames))
        with self._guarded():
            return self._core.take(frames)

    async def stop(self) -> Block:
        """As `Live.stop`."""
        with self._guarded():
            self._open().stop()
        await self._until(lambda: self._core.over is not None)
        return self._core.take_rest()

    async def recording(self) -> dict[str, Any]:
        """As `Live.recording`."""
        from clients.http_client.async_client import AsyncClient

        if self._client is not None:
            return await self._client.recording(self.session)
        async with AsyncClient(self._address.service, key=self._key) as client:
            return await client.recording(self.session)

    async def close(self) -> None:
        """As `Live.close`."""
        with self._guarded():
            goodbye, connection = self._core.leave(), self._connection
        if connection is not None:
            with contextlib.suppress(Closed, TimeoutError):
                if goodbye is not None:
                    async with asyncio.timeout(CLOSE_SECONDS):
                        await connection.send(goodbye)
                await connection.close()  # which ends the task; cancelled, it would leave the socket open
        elif self._task is not None:
            self._task.cancel()
        if self._task is not None:
            await asyncio.gather(self._task, return_exceptions=True)

    # Inside

    @contextlib.contextmanager
    def _guarded(self) -> Iterator[None]:
        yield
        self._changed.set()
        self._changed = asyncio.Event()

    async def _until(self, happened: Callable[[], bool]) -> None:
        while not happened():
            await self._changed.wait()

    def _open(self) -> LiveCore:
        if self._core.ready is None:
            raise not_open()
        return self._core

    async def _live(self) -> None:
        """Connect, and connect again, until the stream is over."""
        try:
            while (delay := self._next_try()) is not None:
                await asyncio.sleep(delay)
                try:
                    await self._carry(await self._connect(self._address.resuming(self._core.resume_url)))
                except Closed as closed:
                    with self._guarded():
                        self._core.lost(closed.closure)
        except Exception as bug:  # whoever reads must learn of it
            with self._guarded():
                self._core.over = bug

    def _next_try(self) -> float | None:
        with self._guarded():
            return self._core.next_try()

    async def _carry(self, connection: AsyncConnection) -> None:
        """Receive over one connection until it ends, which raises Closed, or until the stream is over."""
        self._connection = connection
        sender = asyncio.create_task(self._send(connection), name="ridgewave-live-send")
        try:
            while self._core.over is None:
                message = await connection.recv()
                with self._guarded():
                    self._core.receive(message)
                await self._until(lambda: not self._core.congested or self._core.over is not None)
        finally:
            sender.cancel()
            with contextlib.suppress(Closed):
                await connection.close()
            self._connection = None

    async def _send(self, connection: AsyncConnection) -> None:
        """Send `hello`, then what is due."""
        with contextlib.suppress(Closed):  # whoever receives learns of it too
            await connection.send(self._core.hello())
            while True:
                while (message := self._core.next_message()) is None:
                    await self._changed.wait()
                await connection.send(message)


class AsyncWebSocketConnection:
    """A connection of `websockets`, with its ways of ending as `Closed`."""

    def __init__(self, connection: ClientConnection) -> None:
        self._connection = connection

    async def send(self, message: str | bytes) -> None:
        """Send one message."""
        with _closed():
            await self._connection.send(message)

    async def recv(self) -> str | bytes:
        """Wait for one message."""
        with _closed():
            return await self._connection.recv()

    async def close(self) -> None:
        """Close."""
        with _closed():
            await self._connection.close()


async def open_connection(address: Address) -> AsyncConnection:
    """Return a connection to `address`; raises Closed."""
    with _closed():
        connection = await connect(address.url, **address.options)
    made = AsyncWebSocketConnection(connection)
    try:
        check_subprotocol(connection.subprotocol)
    except Closed:
        await made.close()
        raise
    return made


@contextlib.contextmanager
def _closed() -> Iterator[None]:
    try:
        yield
    except FAILURES as error:
        raise Closed(closure_of(error)) from error
