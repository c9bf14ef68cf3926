"""`Live`: a live stream for programs with threads.

    with Live(scene) as touch:
        touch.move(position, load)
        block = touch.read(frames)

`live_protocol` decides what to send and what a message means. This module only waits: one thread connects and
receives, another sends. Therefore only `read` and `stop` wait for the network. `read` may be called from one thread,
every other method from any thread.
"""

from __future__ import annotations

import contextlib
import socket
import struct
import sys
import threading
from collections.abc import Callable, Iterator
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self, Unpack

from websockets.sync.client import ClientConnection, connect

from clients.client_errors import ConnectionLost
from clients.live_client.live_interface import LiveHand, LiveOptions
from clients.live_client.live_protocol import LiveCore, not_open
from clients.live_client.reconnection import Closed
from clients.live_client.websocket_connection import (
    FAILURES,
    READY_SECONDS,
    Address,
    Connect,
    Connection,
    check_subprotocol,
    closure_of,
    not_ready,
)
from clients.pcm_buffer import Block

if TYPE_CHECKING:
    from clients.http_client.sync_client import Client

STALL_SECONDS = 5.0  # s for a peer to take a message; without a bound, one that reads nothing holds `close` up for ever


class Live(LiveHand):
    """A live stream; see `LiveHand` for the arguments.

    connect: makes the connection, `websockets` unless given; see `Connection`.
    client: the `Client` that fetches the recording; None makes one of `url` and `key`.
    """

    def __init__(
        self,
        scene: Any = None,
        *,
        connect: Connect | None = None,
        client: Client | None = None,
        **options: Unpack[LiveOptions],
    ) -> None:
        super().__init__(scene, **options)
        self._connect = connect or open_connection
        self._client = client
        self._changed = threading.Condition()
        self._connection: Connection | None = None
        self._thread: threading.Thread | None = None

    def __enter__(self) -> Self:
        assert self._thread is None, "a stream is opened once"
        self._thread = threading.Thread(target=self._live, name="ridgewave-live", daemon=True)
        self._thread.start()
        core = self._core
        try:
            with self._changed:
                self._changed.wait_for(lambda: core.ready is not None or core.over is not None, READY_SECONDS)
                if core.ready is None:
                    raise core.over or not_ready()
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def read(self, frames: int, timeout: float | None = None) -> Block:
        """Return the next `frames`, float32 [frames, channels], in units of `full_scale`; exactly so many.

        Waits for them, at most `timeout` seconds (None: as long as it takes), and through a break of the connection.
        Raises TimeoutError, after which nothing is missing; StreamEnded, whose `rest` holds what came before the end;
        ConnectionLost, ResumeLost.
        """
        with self._guarded():
            self._open().want(frames)
        return self._awaited(lambda: self._core.may_take(frames), timeout, lambda: self._core.take(frames))

    def stop(self, timeout: float | None = None) -> Block:
        """End the stream with a fade, and return what is left to play, the fade included; float32 [frames, channels].

        Raises what else ended it, and TimeoutError.
        """
        with self._guarded():
            self._open().stop()
        return self._awaited(lambda: self._core.over is not None, timeout, self._core.take_rest)

    def recording(self) -> dict[str, Any]:
        """Return what the hand did, as `ridgewave render` renders it to the same samples; of a stream with `record`."""
        from clients.http_client.sync_client import Client

        if self._client is not None:
            return self._client.recording(self.session)
        with Client(self._address.service, key=self._key) as client:
            return client.recording(self.session)

    def close(self) -> None:
        """End the stream where it stands; what was not read is gone. A second call does nothing."""
        with self._guarded():
            goodbye, connection = self._core.leave(), self._connection
        if connection is not None:
            with contextlib.suppress(Closed):
                if goodbye is not None:
                    connection.send(goodbye)
                connection.close()
        if self._thread is not None:
            self._thread.join()

    # Inside

    @contextlib.contextmanager
    def _guarded(self) -> Iterator[None]:
        with self._changed:
            yield
            self._changed.notify_all()

    def _open(self) -> LiveCore:
        if self._core.ready is None:
            raise not_open()
        return self._core

    def _awaited(self, happened: Callable[[], bool], timeout: float | None, result: Callable[[], Block]) -> Block:
        with self._guarded():
            if not self._changed.wait_for(happened, timeout):
                raise TimeoutError(f"no sound within {timeout:g} s")
            return result()

    def _live(self) -> None:
        """Connect, and connect again, until the stream is over."""
        try:
            while (delay := self._next_try()) is not None:
                with self._changed:
                    if self._changed.wait_for(lambda: self._core.over is not None, delay):
                        continue
                try:
                    self._carry(self._connect(self._address.resuming(self._core.resume_url)))
                except Closed as closed:
                    with self._guarded():
                        self._core.lost(closed.closure)
        except BaseException as bug:  # whoever reads must learn of it
            with self._guarded():
                self._core.over = bug if isinstance(bug, Exception) else ConnectionLost(repr(bug))

    def _next_try(self) -> float | None:
        with self._guarded():
            return self._core.next_try()

    def _carry(self, connection: Connection) -> None:
        """Receive over one connection until it ends, which raises Closed, or until the stream is over."""
        with self._guarded():
            self._connection = connection
            hello = self._core.hello()
        sender = threading.Thread(target=self._send, args=(connection,), name="ridgewave-live-send", daemon=True)
        try:
            connection.send(hello)
            sender.start()
            while True:
                with self._changed:
                    self._changed.wait_for(lambda: not self._core.congested or self._core.over is not None)
                    if self._core.over is not None:
                        return
                message = connection.recv()
                with self._guarded():
                    self._core.receive(message)
        finally:
            with self._guarded():
                self._connection = None
            with contextlib.suppress(Closed):
                connection.close()
            if sender.ident is not None:
                sender.join()

    def _send(self, connection: Connection) -> None:
        """Send what is due while `connection` is the one."""
        while True:
            with self._changed:
                message = None
                while self._connection is connection and (message := self._core.next_message()) is None:
                    self._changed.wait()
            if message is None:
                return
            try:
                connection.send(message)
            except Closed:
                return  # whoever receives learns of it too


class WebSocketConnection:
    """A connection of `websockets`, with its ways of ending as `Closed`."""

    def __init__(self, connection: ClientConnection) -> None:
        self._connection = connection

    def send(self, message: str | bytes) -> None:
        """Send one message."""
        with _closed():
            self._connection.send(message)

    def recv(self) -> str | bytes:
        """Wait for one message."""
        with _closed():
            return self._connection.recv()

    def close(self) -> None:
        """Close."""
        with _closed():
            self._connection.close()


def open_connection(address: Address) -> Connection:
    """Return a connection to `address`; raises Closed."""
    with _closed():
        connection = connect(address.url, **address.options).__enter__()  # as `with`, which ends elsewhere
    made = WebSocketConnection(connection)
    try:
        check_subprotocol(connection.subprotocol)
    except Closed:
        made.close()
        raise
    with contextlib.suppress(OSError):  # one that has ended already says so where it is used
        _bound_sends(connection.socket)
    return made


def _bound_sends(sock: socket.socket) -> None:
    """Let a send fail that a peer does not take: `websockets` would hold its lock meanwhile, and `close` needs it."""
    if sys.platform != "win32":
        whole = int(STALL_SECONDS)
        interval = struct.pack("@ll", whole, round(1e6 * (STALL_SECONDS - whole)))  # a timeval: s and us
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, interval)


@contextlib.contextmanager
def _closed() -> Iterator[None]:
    try:
        yield
    except FAILURES as error:
        raise Closed(closure_of(error)) from error
