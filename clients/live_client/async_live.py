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

from clients.live_client.live_interface import LiveInterface, LiveOptions, not_open
from clients.live_client.live_protocol import LiveProtocol
from clients.live_client.reconnection import Closed
from clients.live_client.websocket_connection import (
    CLOSE_SECONDS,
    READY_SECONDS,
    Address,
    AsyncConnect,
    AsyncConnection,
    check_subprotocol,
    failures_as_closed,
    not_ready,
)
from clients.pcm_buffer import Block

if TYPE_CHECKING:
    from clients.http_client.async_client import AsyncClient


class AsyncLive(LiveInterface):
    """A live stream; see `LiveInterface` for the other arguments.

    connect: opens the connection in place of `websockets`; see `AsyncConnection`.
    client: the `AsyncClient` that fetches the recording; None opens one with `url` and `key`.
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
        assert self._task is None, "a stream can be opened once"
        self._task = asyncio.create_task(self._run(), name="ridgewave-live")
        protocol = self._protocol
        try:
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(READY_SECONDS):
                    await self._until(lambda: protocol.ready is not None or protocol.over is not None)
            if protocol.ready is None:
                raise protocol.over or not_ready()
        except BaseException:
            await self.close()
            raise
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self.close()

    async def read(self, frames: int) -> Block:
        """As `Live.read`; limit the wait with `asyncio.timeout`. A cancelled read loses no frame."""
        with self._changing():
            frames = self._open().want(frames)
        await self._until(lambda: self._protocol.may_take(frames))
        with self._changing():
            return self._protocol.take(frames)

    async def stop(self) -> Block:
        """As `Live.stop`."""
        with self._changing():
            self._open().stop()
        await self._until(lambda: self._protocol.over is not None)
        return self._protocol.take_rest()

    async def recording(self) -> dict[str, Any]:
        """As `Live.recording`."""
        from clients.http_client.async_client import AsyncClient

        if self._client is not None:
            return await self._client.recording(self.session)
        async with AsyncClient(self._address.service, key=self._key) as client:
            return await client.recording(self.session)

    async def close(self) -> None:
        """As `Live.close`."""
        with self._changing():
            goodbye, connection = self._protocol.leave(), self._connection
        if connection is not None:
            with contextlib.suppress(Closed, TimeoutError):
                if goodbye is not None:
                    async with asyncio.timeout(CLOSE_SECONDS):
                        await connection.send(goodbye)
                await connection.close()  # this ends the task; a cancelled task would leave the socket open
        elif self._task is not None:
            self._task.cancel()
        if self._task is not None:
            await asyncio.gather(self._task, return_exceptions=True)

    # Internals

    @contextlib.contextmanager
    def _changing(self) -> Iterator[None]:
        yield
        self._changed.set()
        self._changed = asyncio.Event()

    async def _until(self, happened: Callable[[], bool]) -> None:
        while not happened():
            await self._changed.wait()

    def _open(self) -> LiveProtocol:
        if self._protocol.ready is None:
            raise not_open()
        return self._protocol

    async def _run(self) -> None:
        """Connect, again after each break, until the stream is over."""
        try:
            while (delay := self._next_try()) is not None:
                await asyncio.sleep(delay)
                try:
                    await self._use(await self._connect(self._address.resuming(self._protocol.resume_url)))
                except Closed as closed:
                    with self._changing():
                        self._protocol.lost(closed.closure)
        except Exception as bug:  # `read` raises it
            with self._changing():
                self._protocol.over = bug

    def _next_try(self) -> float | None:
        with self._changing():
            return self._protocol.next_try()

    async def _use(self, connection: AsyncConnection) -> None:
        """Receive from one connection until the stream is over; raises Closed if the connection ends first."""
        self._connection = connection
        sender = asyncio.create_task(self._send(connection), name="ridgewave-live-send")
        try:
            while self._protocol.over is None:
                message = await connection.recv()
                with self._changing():
                    self._protocol.receive(message)
                await self._until(lambda: not self._protocol.congested or self._protocol.over is not None)
        finally:
            sender.cancel()
            with contextlib.suppress(Closed):
                await connection.close()
            self._connection = None

    async def _send(self, connection: AsyncConnection) -> None:
        """Send `hello`, then what is due."""
        with contextlib.suppress(Closed):  # the receiver gets it too
            await connection.send(self._protocol.hello())
            while True:
                while (message := self._protocol.next_message()) is None:
                    await self._changed.wait()
                await connection.send(message)


class AsyncWebSocketConnection:
    """A connection of `websockets` that raises `Closed` when it ends."""

    def __init__(self, connection: ClientConnection) -> None:
        self._connection = connection

    async def send(self, message: str | bytes) -> None:
        """Send one message."""
        with failures_as_closed():
            await self._connection.send(message)

    async def recv(self) -> str | bytes:
        """Wait for one message."""
        with failures_as_closed():
            return await self._connection.recv()

    async def close(self) -> None:
        """Close."""
        with failures_as_closed():
            await self._connection.close()


async def open_connection(address: Address) -> AsyncConnection:
    """Return a connection to `address`; raises Closed."""
    with failures_as_closed():
        connection = await connect(address.url, **address.options)
    made = AsyncWebSocketConnection(connection)
    try:
        check_subprotocol(connection.subprotocol)
    except Closed:
        await made.close()
        raise
    return made
