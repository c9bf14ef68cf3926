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
from clients.live_client.live_interface import LiveInterface, LiveOptions, not_open
from clients.live_client.live_protocol import LiveProtocol
from clients.live_client.reconnection import Closed
from clients.live_client.websocket_connection import (
    READY_SECONDS,
    Address,
    Connect,
    Connection,
    check_subprotocol,
    failures_as_closed,
    not_ready,
)
from clients.pcm_buffer import Block

if TYPE_CHECKING:
    from clients.http_client.sync_client import Client

STALL_SECONDS = (
    5.0  # s for a peer to accept a message; without a bound, a peer that reads nothing blocks `close` for ever
)


class Live(LiveInterface):
    """A live stream; see `LiveInterface` for the other arguments.

    connect: opens the connection in place of `websockets`; see `Connection`.
    client: the `Client` that fetches the recording; None opens one with `url` and `key`.
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
        assert self._thread is None, "a stream can be opened once"
        self._thread = threading.Thread(target=self._run, name="ridgewave-live", daemon=True)
        self._thread.start()
        protocol = self._protocol
        try:
            with self._changed:
                self._changed.wait_for(lambda: protocol.ready is not None or protocol.over is not None, READY_SECONDS)
                if protocol.ready is None:
                    raise protocol.over or not_ready()
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def read(self, frames: int, timeout: float | None = None) -> Block:
        """Return exactly `frames` frames, float32 [frames, channels], in units of `full_scale`.

        Waits for them, through breaks of the connection, for at most `timeout` seconds (None: no limit).
        Raises TimeoutError, after which no frame is lost; StreamEnded, whose `rest` holds the frames before the end;
        ConnectionLost; ResumeLost.
        """
        with self._changing():
            frames = self._open().want(frames)
        return self._awaited(lambda: self._protocol.may_take(frames), timeout, lambda: self._protocol.take(frames))

    def stop(self, timeout: float | None = None) -> Block:
        """End the stream with a fade; return the unread frames and the fade, float32 [frames, channels].

        Raises the exception that ended the stream otherwise, and TimeoutError.
        """
        with self._changing():
            self._open().stop()
        return self._awaited(lambda: self._protocol.over is not None, timeout, self._protocol.take_rest)

    def recording(self) -> dict[str, Any]:
        """Return the recording of the hand, which `ridgewave render` renders to the same samples; requires `record`."""
        from clients.http_client.sync_client import Client

        if self._client is not None:
            return self._client.recording(self.session)
        with Client(self._address.service, key=self._key) as client:
            return client.recording(self.session)

    def close(self) -> None:
        """End the stream now and discard unread frames. A second call does nothing."""
        with self._changing():
            goodbye, connection = self._protocol.leave(), self._connection
        if connection is not None:
            with contextlib.suppress(Closed):
                if goodbye is not None:
                    connection.send(goodbye)
                connection.close()
        if self._thread is not None:
            self._thread.join()

    # Internals

    @contextlib.contextmanager
    def _changing(self) -> Iterator[None]:
        with self._changed:
            yield
            self._changed.notify_all()

    def _open(self) -> LiveProtocol:
        if self._protocol.ready is None:
            raise not_open()
        return self._protocol

    def _awaited(self, happened: Callable[[], bool], timeout: float | None, result: Callable[[], Block]) -> Block:
        with self._changing():
            if not self._changed.wait_for(happened, timeout):
                raise TimeoutError(f"no sound within {timeout:g} s")
            return result()

    def _run(self) -> None:
        """Connect, again after each break, until the stream is over."""
        try:
            while (delay := self._next_try()) is not None:
                with self._changed:
                    if self._changed.wait_for(lambda: self._protocol.over is not None, delay):
                        continue
                try:
                    self._use(self._connect(self._address.resuming(self._protocol.resume_url)))
                except Closed as closed:
                    with self._changing():
                        self._protocol.lost(closed.closure)
        except BaseException as bug:  # `read` raises it
            with self._changing():
                self._protocol.over = bug if isinstance(bug, Exception) else ConnectionLost(repr(bug))

    def _next_try(self) -> float | None:
        with self._changing():
            return self._protocol.next_try()

    def _use(self, connection: Connection) -> None:
        """Receive from one connection until the stream is over; raises Closed if the connection ends first."""
        with self._changing():
            self._connection = connection
            hello = self._protocol.hello()
        sender = threading.Thread(target=self._send, args=(connection,), name="ridgewave-live-send", daemon=True)
        try:
            connection.send(hello)
            sender.start()
            while True:
                with self._changed:
                    self._changed.wait_for(lambda: not self._protocol.congested or self._protocol.over is not None)
                    if self._protocol.over is not None:
                        return
                message = connection.recv()
                with self._changing():
                    self._protocol.receive(message)
        finally:
            with self._changing():
                self._connection = None
            with contextlib.suppress(Closed):
                connection.close()
            if sender.ident is not None:
                sender.join()

    def _send(self, connection: Connection) -> None:
        """Send what is due, as long as `connection` is in use."""
        while True:
            with self._changed:
                message = None
                while self._connection is connection and (message := self._protocol.next_message()) is None:
                    self._changed.wait()
            if message is None:
                return
            try:
                connection.send(message)
            except Closed:
                return  # the receiver gets it too


class WebSocketConnection:
    """A connection of `websockets` that raises `Closed` when it ends."""

    def __init__(self, connection: ClientConnection) -> None:
        self._connection = connection

    def send(self, message: str | bytes) -> None:
        """Send one message."""
        with failures_as_closed():
            self._connection.send(message)

    def recv(self) -> str | bytes:
        """Wait for one message."""
        with failures_as_closed():
            return self._connection.recv()

    def close(self) -> None:
        """Close."""
        with failures_as_closed():
            self._connection.close()


def open_connection(address: Address) -> Connection:
    """Return a connection to `address`; raises Closed."""
    with failures_as_closed():
        connection = connect(address.url, **address.options).__enter__()  # `close` ends what `with` would
    made = WebSocketConnection(connection)
    try:
        check_subprotocol(connection.subprotocol)
    except Closed:
        made.close()
        raise
    with contextlib.suppress(OSError):  # a connection that has ended reports this when it is used
        _bound_sends(connection.socket)
    return made


def _bound_sends(sock: socket.socket) -> None:
    """Bound the time of a send: meanwhile `websockets` holds the lock that `close` needs."""
    if sys.platform != "win32":
        whole = int(STALL_SECONDS)
        interval = struct.pack("@ll", whole, round(1e6 * (STALL_SECONDS - whole)))  # a timeval: s and us
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, interval)
