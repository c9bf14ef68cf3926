"""A TCP proxy on loopback that causes faults of networks on command.

Model: asyncio in its own thread. Each connection is a link with two directions, "up" (client to server) and "down". A
    direction reads a piece, applies its present `Treatment`, and writes the piece. A treatment may change at any time.
    Bytes are lost only where a fault says so, and never reordered, as with TCP.
Limits: a stalled or throttled direction holds one or two pieces (`PIECE`) and the buffers of the kernel. These are set
    small, so that the sender soon has to wait.
"""

from __future__ import annotations

import asyncio
import random
import socket
import struct
import threading
from collections.abc import Callable, Coroutine, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any, Literal, TypeVar

Direction = Literal["up", "down"]
Result = TypeVar("Result")

PIECE = 1 << 14  # bytes read at a time
BUFFER = 1 << 14  # bytes of each kernel buffer, as far as the kernel heeds it
PATIENCE = 30.0  # s for a command to be carried out by the proxy's thread
SHORTEST = 0.002  # s: a throttled write covers at least this much time, so that timers do not make it slower


@dataclass(frozen=True, slots=True)
class Treatment:
    """What happens to one direction of a link.

    delay: s that every piece is held, which shifts and does not slow it. bytes_per_second: at most; None for as fast as
    it goes. stalled: pieces wait until it is False again. cut_after: bytes that pass in all; what follows is dropped
    without a word (half-open). splits: bytes are written in runs of random lengths up to this; 0 for as they come.
    """

    delay: float = 0.0
    bytes_per_second: float | None = None
    stalled: bool = False
    cut_after: int | None = None
    splits: int = 0


@dataclass(eq=False)
class Link:
    """One connection through the proxy. The methods may be called from any thread."""

    number: int
    loop: asyncio.AbstractEventLoop
    treatments: dict[Direction, Treatment]
    passed: dict[Direction, int] = field(default_factory=lambda: {"up": 0, "down": 0})
    closed: bool = False
    sockets: tuple[socket.socket, ...] = ()
    tasks: tuple[asyncio.Task[None], ...] = ()
    changed: asyncio.Event = field(default_factory=asyncio.Event)

    def treat(self, direction: Direction, **changes: Any) -> None:
        """Change the treatment of one direction, from its next piece on; a piece that is stalled wakes."""
        self._now(lambda: self._treat(direction, changes))

    def half_open(self) -> None:
        """Take and forward nothing any more, in either direction, no end either: the cable was pulled."""

        def pull() -> None:
            self._treat("up", {"stalled": True})
            self._treat("down", {"stalled": True})

        self._now(pull)

    def reset(self) -> None:
        """End both connections with RST, at once."""
        self._now(self._reset)

    async def flowing(self, direction: Direction) -> None:
        """Return when the direction is not stalled."""
        while self.treatments[direction].stalled:
            await self.changed.wait()

    def _treat(self, direction: Direction, changes: dict[str, Any]) -> None:
        self.treatments[direction] = replace(self.treatments[direction], **changes)
        self.changed.set()
        self.changed = asyncio.Event()

    def _reset(self) -> None:
        for task in self.tasks:
            task.cancel()
        for one in self.sockets:
            if one.fileno() >= 0:
                one.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
                one.close()
        self.closed = True

    def _now(self, act: Callable[[], object]) -> None:
        async def acted() -> None:
            act()

        asyncio.run_coroutine_threadsafe(acted(), self.loop).result(PATIENCE)


class Proxy:
    """A listening port whose connections lead to `target`; `first` is the treatment that new links begin with."""

    def __init__(self, target: tuple[str, int], seed: int = 0) -> None:
        self.target = target
        self.first: dict[Direction, Treatment] = {"up": Treatment(), "down": Treatment()}
        self.links: list[Link] = []
        self.port = 0
        self._random = random.Random(seed)
        self._loop = asyncio.new_event_loop()
        self._handlers: set[asyncio.Task[None]] = set()
        self._thread = threading.Thread(target=self._loop.run_forever, name="proxy", daemon=True)

    @property
    def url(self) -> str:
        """Return where it listens, for a client of HTTP or of a WebSocket."""
        return f"http://127.0.0.1:{self.port}"

    def start(self) -> None:
        """Listen on a free port of loopback."""
        self._thread.start()
        self._run(self._listen())

    def end(self) -> None:
        """Close everything."""
        self._run(self._finish())
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(PATIENCE)
        self._loop.close()

    def _run(self, work: Coroutine[Any, Any, Result]) -> Result:
        return asyncio.run_coroutine_threadsafe(work, self._loop).result(PATIENCE)

    async def _listen(self) -> None:
        self._listener = socket.create_server(("127.0.0.1", 0), backlog=512)
        _make_small(self._listener)
        self._listener.setblocking(False)
        self.port = self._listener.getsockname()[1]
        self._accepting = asyncio.create_task(self._accept())

    async def _accept(self) -> None:
        while True:
            client, _ = await self._loop.sock_accept(self._listener)
            handler = asyncio.create_task(self._carry(client))
            self._handlers.add(handler)
            handler.add_done_callback(self._handlers.discard)

    async def _carry(self, client: socket.socket) -> None:
        """Carry one connection until both directions have ended or it was reset."""
        server = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        for one in (client, server):
            one.setblocking(False)
            one.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        _make_small(server)
        try:
            await self._loop.sock_connect(server, self.target)
            link = Link(len(self.links), self._loop, dict(self.first))
            link.sockets = (client, server)
            up = asyncio.create_task(self._pass_on(link, "up", client, server))
            down = asyncio.create_task(self._pass_on(link, "down", server, client))
            link.tasks = (up, down)
            self.links.append(link)
            await asyncio.gather(up, down, return_exceptions=True)
            link.closed = True
        finally:
            client.close()
            server.close()

    async def _pass_on(self, link: Link, direction: Direction, source: socket.socket, sink: socket.socket) -> None:
        """Read, treat and write pieces until the source ends; then end the sink, unless the link is half-open."""
        queue: asyncio.Queue[tuple[float, bytes]] = asyncio.Queue(64)
        writer = asyncio.create_task(self._write(link, direction, queue, sink))
        try:
            while True:
                await link.flowing(direction)
                try:
                    piece = await self._loop.sock_recv(source, PIECE)
                except OSError:
                    await link.flowing(direction)
                    link._reset()
                    return
                await queue.put((self._loop.time() + link.treatments[direction].delay, piece))
                if link.treatments[direction].bytes_per_second is not None:
                    await queue.join()
                if not piece:
                    await writer
                    return
        finally:
            writer.cancel()

    async def _write(
        self, link: Link, direction: Direction, queue: asyncio.Queue[tuple[float, bytes]], sink: socket.socket
    ) -> None:
        while True:
            due, piece = await queue.get()
            await asyncio.sleep(max(0.0, due - self._loop.time()))
            await link.flowing(direction)
            try:
                if not piece:
                    if link.treatments[direction].cut_after is None:
                        sink.shutdown(socket.SHUT_WR)
                    return
                for run in self._runs(link, direction, piece):
                    await self._loop.sock_sendall(sink, run)
                    link.passed[direction] += len(run)
                    rate = link.treatments[direction].bytes_per_second
                    if rate is not None:
                        await asyncio.sleep(len(run) / rate)
                    elif link.treatments[direction].splits:
                        await asyncio.sleep(0)
                queue.task_done()
            except OSError:
                link._reset()
                return

    def _runs(self, link: Link, direction: Direction, piece: bytes) -> Iterator[bytes]:
        """Yield the runs that `piece` is written in, as the treatment stands before each of them."""
        place = 0
        while place < len(piece):
            now = link.treatments[direction]
            size = len(piece) - place
            if now.splits:
                size = min(size, self._random.randint(1, now.splits))
            if now.bytes_per_second is not None:
                size = min(size, max(1, round(now.bytes_per_second * SHORTEST)))
            if now.cut_after is not None:
                size = min(size, now.cut_after - link.passed[direction])
                if size <= 0:
                    return
            yield piece[place : place + size]
            place += size

    async def _finish(self) -> None:
        self._accepting.cancel()
        self._listener.close()
        for link in self.links:
            link._reset()
        for handler in tuple(self._handlers):
            handler.cancel()
        await asyncio.gather(self._accepting, *self._handlers, return_exceptions=True)


def _make_small(one: socket.socket) -> None:
    for option in (socket.SO_RCVBUF, socket.SO_SNDBUF):
        one.setsockopt(socket.SOL_SOCKET, option, BUFFER)


@contextmanager
def proxied(target: tuple[str, int], seed: int = 0) -> Iterator[Proxy]:
    """Yield a proxy to `target`."""
    proxy = Proxy(target, seed)
    proxy.start()
    try:
        yield proxy
    finally:
        proxy.end()
