"""What stands between an HTTP connection and the event loop: half-sent requests end, and costly ones are read in turns.

Model: `connection_limit.Connection` does the work. This class stands between it and the event loop, and runs a
    clock of HEAD_SECONDS while the connection has no request that is being answered: from its opening on, and from the
    first byte behind an answer. The head of a request that has come whole reaches the application, which stops the
    clock; more bytes do not stop it. A body has BODY_SECONDS, and a second more for each BODY_RATE bytes of it that
    have come. So a connection that is kept alive, an answer that takes long and an endless stream have no bound here.
    What comes is parsed in pieces. After TURN_SECONDS the rest waits for one of the `Turns` that floods of WebSockets
    wait for too, and the socket is not read meanwhile: a body in chunks of one byte costs the parser 0.7 us a byte.
Limits: a body that nobody reads is not waited for: its connection is closed HEAD_SECONDS behind the answer. A WebSocket
    is on its own from its handshake on (`service.live.websocket`).
"""

from __future__ import annotations

import asyncio
import copy
from time import monotonic, perf_counter
from typing import Any, cast

from starlette.types import Message, Receive, Scope, Send
from uvicorn import Config
from uvicorn.server import ServerState

from service.http.connection_limit import Connection
from service.http.read_turns import TURN_SECONDS, Turns, shared_turns

HEAD_SECONDS = 10.0  # a slow link has sent its kilobyte long before; more lets half-sent requests take the descriptors
BODY_SECONDS = 20.0  # less closes a radio link that was away for a moment
BODY_RATE = 1024  # bytes a second, of the slowest link that is waited for
PIECE_BYTES = 2048  # parsed at once: 1.5 ms of chunks of one byte, and next to nothing of an ordinary body
TIMED_OUT = b"HTTP/1.1 408 Request Timeout\r\nContent-Length: 0\r\nConnection: close\r\n\r\n"


class RequestTimeout(asyncio.Protocol):
    """One connection; the arguments are those that uvicorn gives to every class named by its option `http`."""

    transport: asyncio.Transport

    def __init__(
        self,
        config: Config,
        server_state: ServerState,
        app_state: dict[str, Any],
        _loop: asyncio.AbstractEventLoop | None = None,
    ) -> None:
        self._application: Any = config.loaded_app
        config = copy.copy(config)
        config.loaded_app = self._answer
        self._inner = Connection(config, server_state, app_state, _loop)
        self._turns: Turns = shared_turns(app_state)
        self._held = b""  # has come and waits to be parsed
        self._answering = 0
        self._has_begun = False  # the request that the clock runs for
        self._clock: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Begin."""
        self.transport = cast(asyncio.Transport, transport)
        self._start_clock()
        self._inner.connection_made(transport)

    def connection_lost(self, exc: Exception | None) -> None:
        """End."""
        self._stop_clock()
        self._held = b""
        self._inner.connection_lost(exc)

    def pause_writing(self) -> None:
        """Hand it on."""
        self._inner.pause_writing()

    def resume_writing(self) -> None:
        """Hand it on."""
        self._inner.resume_writing()

    def eof_received(self) -> bool | None:
        """Hand it on."""
        self._inner.eof_received()
        return None

    def data_received(self, data: bytes) -> None:
        """Hand on what has come, for one turn."""
        if not self._answering:
            self._has_begun = True
            self._start_clock()
        waits, self._held = bool(self._held), self._held + data
        if waits:
            self.transport.pause_reading()
        elif not self._parse():
            self.transport.pause_reading()
            self._turns.wait(self._next_turn)

    def _parse(self) -> bool:
        """Hand on what waits until the turn is over; return whether that was all."""
        until, held, place = perf_counter() + TURN_SECONDS, self._held, 0
        while place < len(held) and (not place or perf_counter() < until):
            self._inner.data_received(held[place : place + PIECE_BYTES])
            place += PIECE_BYTES
            if self.transport.is_closing() or self.transport.get_protocol() is not self:
                place = len(held)  # nobody may send before a handshake is answered
        self._held = held[place:]
        return not self._held

    def _next_turn(self) -> bool:
        """Take one of the turns; return False where there was nothing to do."""
        if not self._held:
            return False
        if not self._parse():
            self._turns.wait(self._next_turn)
        elif not self._inner.flow.read_paused:
            self.transport.resume_reading()
        return True

    async def _answer(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Have the application answer a request."""
        self._stop_clock()
        self._answering += 1
        try:
            await self._application(scope, self._timed(receive) if scope["type"] == "http" else receive, send)
        finally:
            self._answering -= 1
            self._has_begun = False

    def _timed(self, receive: Receive) -> Receive:
        """Return `receive`, which ends a request whose body takes too long as if the peer had gone."""
        until, complete = 0.0, False

        async def timed() -> Message:
            """Return the next message of the request, or that the peer is gone."""
            nonlocal until, complete
            if complete:
                return await receive()
            until = until or monotonic() + BODY_SECONDS
            try:
                async with asyncio.timeout(until - monotonic()):
                    message = await receive()
            except TimeoutError:
                self.transport.close()
                return {"type": "http.disconnect"}
            complete = not message.get("more_body", False)
            until += len(message.get("body", b"")) / BODY_RATE
            return message

        return timed

    def _start_clock(self) -> None:
        if self._clock is None:
            self._clock = asyncio.get_running_loop().call_later(HEAD_SECONDS, self._end)

    def _stop_clock(self) -> None:
        if self._clock is not None:
            self._clock.cancel()
            self._clock = None

    def _end(self) -> None:
        if not self.transport.is_closing():
            if self._has_begun:
                self.transport.write(TIMED_OUT)
            self.transport.close()
