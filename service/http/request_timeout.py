"""Closes HTTP connections whose request stays incomplete, and reads costly requests in turns.

Model: `RequestTimeout` stands between the event loop and `connection_limit.Connection`, which does the work of HTTP.
    A clock of HEAD_SECONDS runs while no request is being answered: from the start of the connection, and from the
    first byte after an answer. A complete head reaches the application, which stops the clock; single bytes do not.
    A body has BODY_SECONDS, and one more second for each BODY_RATE bytes that have arrived. An idle connection
    between requests, a slow answer and an endless stream are not bounded here.
    Received data is parsed in pieces. After TURN_SECONDS the rest waits for one of the `Turns`, and the socket is not
    read meanwhile: a body in chunks of one byte takes the parser 0.7 us per byte.
Limits: a connection whose body the application does not read is closed HEAD_SECONDS after the answer. After its
    handshake, a WebSocket has its own protocol (`service.live.websocket`).
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
from service.http.request_target import use_origin_form

HEAD_SECONDS = 10.0  # far more than a slow link needs; longer lets incomplete requests use up the descriptors
BODY_SECONDS = 20.0  # shorter closes a radio link after a short interruption
BODY_RATE = 1024  # bytes per second of the slowest link that is waited for
PIECE_BYTES = 2048  # parsed at once: 1.5 ms if sent in chunks of one byte, far less in an ordinary body
TIMED_OUT = b"HTTP/1.1 408 Request Timeout\r\nContent-Length: 0\r\nConnection: close\r\n\r\n"


class RequestTimeout(asyncio.Protocol):
    """One connection; uvicorn passes these arguments to the class that its option `http` names."""

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
        self._held = b""  # received, not parsed yet
        self._answering = 0
        self._has_begun = False  # whether a byte of the next request has arrived
        self._clock: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Start the clock."""
        self.transport = cast(asyncio.Transport, transport)
        self._start_clock()
        self._inner.connection_made(transport)

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop the clock."""
        self._stop_clock()
        self._held = b""
        self._inner.connection_lost(exc)

    def pause_writing(self) -> None:
        """Pass the event on."""
        self._inner.pause_writing()

    def resume_writing(self) -> None:
        """Pass the event on."""
        self._inner.resume_writing()

    def eof_received(self) -> bool | None:
        """Pass the event on."""
        self._inner.eof_received()
        return None

    def data_received(self, data: bytes) -> None:
        """Parse the data for one turn; the rest waits."""
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
        """Parse the held data until the turn is over; return whether nothing is left."""
        until, held, place = perf_counter() + TURN_SECONDS, self._held, 0
        while place < len(held) and (not place or perf_counter() < until):
            self._inner.data_received(held[place : place + PIECE_BYTES])
            place += PIECE_BYTES
            if self.transport.is_closing() or self.transport.get_protocol() is not self:
                place = len(held)  # a client must not send before its handshake is answered
        self._held = held[place:]
        return not self._held

    def _next_turn(self) -> bool:
        """Use a turn; return False if no data waited."""
        if not self._held:
            return False
        if not self._parse():
            self._turns.wait(self._next_turn)
        elif not self._inner.flow.read_paused:
            self.transport.resume_reading()
        return True

    async def _answer(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request to the application."""
        self._stop_clock()
        self._answering += 1
        use_origin_form(scope)
        try:
            await self._application(scope, self._timed(receive) if scope["type"] == "http" else receive, send)
        finally:
            self._answering -= 1
            self._has_begun = False

    def _timed(self, receive: Receive) -> Receive:
        """Return `receive` with a time limit: a body that takes too long ends as if the client had disconnected."""
        until, complete = 0.0, False

        async def timed() -> Message:
            """Return the next message, or a disconnect when the body is later than BODY_RATE allows."""
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
