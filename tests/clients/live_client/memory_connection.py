"""Connections of the live client in memory, to the service of `fake_live`: no socket, breaks where a test says.

A break is counted in bytes of the messages that come: the message in which it falls is lost, as on a wire.
"""

from __future__ import annotations

import asyncio
import queue
from collections.abc import Iterable, Iterator
from typing import Generic, TypeVar

from clients.live_client.reconnection import Closed, Closure
from clients.live_client.websocket_connection import Address
from tests.clients.live_client.fake_live import Answer, Close, Message, Service

BROKEN = Close(None, "cut")


class Line:
    """The direction from the service, which breaks after `limit` bytes (None: never)."""

    def __init__(self, limit: int | None) -> None:
        self._left = limit
        self.broken = False

    def carried(self, answer: Answer) -> Answer:
        """Return the part of `answer` that arrives."""
        size = 0 if isinstance(answer, Close) else len(answer)
        if self.broken or (self._left is not None and size > self._left):
            self.broken = True
            return BROKEN
        if self._left is not None:
            self._left -= size
        return answer


Connection = TypeVar("Connection")


class Network(Generic[Connection]):
    """Makes connections. cuts: the byte after which each breaks; later ones never break."""

    def __init__(self, service: Service, cuts: Iterable[int | None] = ()) -> None:
        self.service = service
        self.addresses: list[Address] = []
        self.connections: list[Connection] = []
        self.refuse: list[Closure] = []
        self._cuts: Iterator[int | None] = iter(cuts)

    def line(self, address: Address) -> Line:
        self.addresses.append(address)
        if self.refuse:
            raise Closed(self.refuse.pop(0))
        return Line(next(self._cuts, None))


class MemoryConnection:
    """The connection of `Live`."""

    def __init__(self, service: Service, line: Line) -> None:
        self._line = line
        self._came: queue.SimpleQueue[Answer] = queue.SimpleQueue()
        self.peer = service.connect(self._deliver)
        self._end: Close | None = None

    def _deliver(self, answer: Answer) -> None:
        arrived = self._line.carried(answer)
        self._came.put(arrived)
        if arrived is BROKEN:
            self.peer.lost()

    def send(self, message: Message) -> None:
        if self._line.broken:
            raise Closed(Closure(None, "cut"))
        self.peer.receive(message)

    def recv(self) -> Message:
        answer = self._end or self._came.get()
        if isinstance(answer, Close):
            self._end = answer
            raise Closed(Closure(answer.code, answer.reason))
        return answer

    def close(self) -> None:
        self.peer.lost()
        self._came.put(Close(1000, "closed here"))

    def cut(self) -> None:
        """Break now."""
        self._line.broken = True
        self.peer.lost()
        self._came.put(BROKEN)


class AsyncMemoryConnection:
    """The connection of `AsyncLive`."""

    def __init__(self, service: Service, line: Line) -> None:
        self._line = line
        self._came: asyncio.Queue[Answer] = asyncio.Queue()
        self.peer = service.connect(self._deliver)

    def _deliver(self, answer: Answer) -> None:
        arrived = self._line.carried(answer)
        self._came.put_nowait(arrived)
        if arrived is BROKEN:
            self.peer.lost()

    async def send(self, message: Message) -> None:
        if self._line.broken:
            raise Closed(Closure(None, "cut"))
        self.peer.receive(message)

    async def recv(self) -> Message:
        answer = await self._came.get()
        if isinstance(answer, Close):
            raise Closed(Closure(answer.code, answer.reason))
        return answer

    async def close(self) -> None:
        self.peer.lost()
        self._came.put_nowait(Close(1000, "closed here"))


class ThreadNetwork(Network[MemoryConnection]):
    def __call__(self, address: Address) -> MemoryConnection:
        connection = MemoryConnection(self.service, self.line(address))
        self.connections.append(connection)
        return connection


class LoopNetwork(Network[AsyncMemoryConnection]):
    async def __call__(self, address: Address) -> AsyncMemoryConnection:
        connection = AsyncMemoryConnection(self.service, self.line(address))
        self.connections.append(connection)
        return connection
