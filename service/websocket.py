"""The server's end of a WebSocket: uvicorn's own, with what a live stream needs when it ends.

Model: the WebSocket itself is uvicorn's (`websockets-sansio`). Added: a peer that does not read has a while to take
    what it is still owed, its close code at last, and cannot hold its connection open beyond that; on a shutdown
    streams fade before they are closed; headers, which hold keys, are never logged. Binary contacts that come whole,
    as nearly all messages do, are taken out of their frames here, and whole messages are framed here: the library
    takes a tenth of what a stream costs for that.
Limits: overrides methods of uvicorn's class, whose names another version may change; the tests of the wire tell then.
    Where the parser of another version of websockets waits elsewhere, it gets every message.
"""

from __future__ import annotations

import asyncio
import logging
import struct
from collections.abc import Callable
from typing import Any

from uvicorn.protocols.utils import ClientDisconnected
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.exceptions import InvalidState
from websockets.frames import Frame
from websockets.http11 import Request
from websockets.protocol import State
from websockets.streams import StreamReader

try:
    from websockets.speedups import apply_mask
except ImportError:  # a system for which it was not compiled
    from websockets.utils import apply_mask

from service.live.contact import LAYOUT
from service.live.wire import WIRE, Messages, Sink
from service.logs import WEBSOCKETS

WAITING_MESSAGES = 64  # that a connection may be ahead of its reader before its socket is paused
CLOSE_SECONDS = 1.0  # for the peer to answer a close; what it sends afterwards is not looked at
LINGER_SECONDS = 10.0  # from then on, for a peer that slept to read up to the close; longer: dead peers hold memory
DISCARD_SECONDS = 0.02  # between two looks at what such a peer sends: however much it is, it costs next to nothing
SHUTDOWN_SECONDS = 0.5  # for streams to fade, which the signal has told them to
CONTACT_HEAD = bytes([0x82, 0x80 | LAYOUT.size])  # of a frame (RFC 6455, 5.2): the whole message, binary, masked
MASK_END = len(CONTACT_HEAD) + 4
CONTACT_BYTES = MASK_END + LAYOUT.size
BETWEEN_FRAMES = StreamReader.at_eof.__code__  # where the library's parser waits when it has given all that came
TEXT, BINARY = 0x81, 0x82  # the first byte of a frame that is a whole message


def frame_head(kind: int, size: int) -> bytes:
    """Return what precedes a payload of `size` bytes from a server, which masks nothing (RFC 6455, 5.2)."""
    if size < 126:
        return bytes((kind, size))
    return struct.pack("!BBH", kind, 126, size) if size < 1 << 16 else struct.pack("!BBQ", kind, 127, size)


class LiveProtocol(WebSocketsSansIOProtocol):
    """One connection."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.conn.debug = False  # it would log the headers
        self.logger = self.conn.logger = logging.getLogger(WEBSOCKETS)
        self._leaving: asyncio.TimerHandle | None = None
        self._discarding: asyncio.TimerHandle | None = None
        self._lingers = False
        self._sink: Sink | None = None

    def handle_connect(self, event: Request) -> None:
        """Offer itself to the application, as a `service.live.wire.Wire`."""
        super().handle_connect(event)
        if hasattr(self, "scope"):
            offered: dict[str, Any] = {**(self.scope["extensions"] or {}), WIRE: self}
            self.scope["extensions"] = offered

    def unblock(self) -> None:
        """See `Wire`."""
        self.writable.set()

    def can_send(self) -> bool:
        """See `Wire`."""
        open_still = self.conn.state is State.OPEN and not self.disconnected and not self.close_sent
        return open_still and self.writable.is_set()

    def send_now(self, messages: Messages) -> None:
        """See `Wire`: with one write to the socket, which costs more than all of their framing."""
        if self.conn.state is not State.OPEN:
            raise InvalidState("nothing is sent behind a close")
        pieces = self.conn.data_to_send()
        for message in messages:
            payload = message if isinstance(message, bytes) else message.encode()
            pieces += frame_head(BINARY if payload is message else TEXT, len(payload)), payload
        self.transport.write(b"".join(pieces))

    async def send_all(self, messages: Messages) -> None:
        """See `Wire`."""
        await self.writable.wait()
        if self.disconnected or self.close_sent:
            raise ClientDisconnected
        try:
            self.send_now(messages)
        except InvalidState as error:
            raise ClientDisconnected from error

    def deliver(self, sink: Sink | None) -> None:
        """See `Wire`."""
        self._sink = sink

    def data_received(self, data: bytes) -> None:
        """Take what has come from the network."""
        done, size = 0, len(data)
        while size - done >= CONTACT_BYTES and data.startswith(CONTACT_HEAD, done) and self._up_to_date():
            payload, done = done + MASK_END, done + CONTACT_BYTES
            assert self._sink is not None
            self._sink(apply_mask(data[payload:done], data[payload - 4 : payload]))
        if done == size:
            return
        if self._lingers:
            self.transport.pause_reading()
            self._discarding = self.loop.call_later(DISCARD_SECONDS, self.transport.resume_reading)
        else:
            super().data_received(data[done:] if done else data)

    def _up_to_date(self) -> bool:
        """Return whether a message that begins now is the next one for the sink."""
        if self._sink is None:
            return False
        conn = self.conn
        waits: Any = conn.parser
        while waits.gi_yieldfrom is not None:
            waits = waits.gi_yieldfrom
        return (
            waits.gi_code is BETWEEN_FRAMES
            and conn.state is State.OPEN
            and conn.current_size is None
            and not self.close_sent
            and self.queue.empty()
        )

    def handle_bytes(self, event: Frame) -> None:
        """Hand a whole binary message over, or queue it behind those that wait, without pausing the socket.

        Pausing costs more than the message: only where many wait is it done.
        """
        waiting = self.queue.qsize()
        if not event.fin or self.close_sent or waiting >= WAITING_MESSAGES:
            super().handle_bytes(event)
        elif self._sink is not None and not waiting:
            self._sink(bytes(event.data))
        else:
            self.queue.put_nowait({"type": "websocket.receive", "bytes": bytes(event.data)})

    def send_receive_event_to_app(self) -> None:
        """Close with 1007 on text that is not UTF-8, without a traceback in the log."""
        if self.curr_msg_data_type == "text" and not self.close_sent:
            try:
                b"".join(self.frames).decode()
            except UnicodeDecodeError:
                self.conn.send_close(1007)
                self.handle_parser_exception()
                return
        super().send_receive_event_to_app()

    def keepalive_timeout(self) -> None:
        """Drop a peer that does not answer pings, though it may not take the close either."""
        super().keepalive_timeout()
        self._after(CLOSE_SECONDS, self.transport.abort)

    def on_task_complete(self, task: asyncio.Task[None]) -> None:
        """Give a peer that the application is done with a moment to close."""
        super().on_task_complete(task)
        if self._leaving is None:
            self._after(CLOSE_SECONDS, self._linger)

    def shutdown(self) -> None:
        """Close on a shutdown: a stream that fades is left to end by itself."""
        if self.handshake_complete and not self.close_sent and not self.disconnected:
            self.loop.call_later(SHUTDOWN_SECONDS, super().shutdown)
        else:
            super().shutdown()

    def connection_lost(self, exc: Exception | None) -> None:
        """Let go of the timers."""
        super().connection_lost(exc)
        for timer in (self._leaving, self._discarding):
            if timer is not None:
                timer.cancel()

    def _after(self, seconds: float, act: Callable[[], object]) -> None:
        """Do what comes next on the way out."""
        if self._leaving is not None:
            self._leaving.cancel()
        self._leaving = None if self.disconnected else self.loop.call_later(seconds, act)

    def _linger(self) -> None:
        """End the sending half behind what is still unsent, and wait for the peer to take it and to close.

        The socket is not closed before: with something unread in it, the kernel would drop what is unsent.
        """
        self.transport.resume_reading()  # else its end is not seen
        if self.close_sent and not self.transport.is_closing() and self.transport.can_write_eof():
            self._lingers = True
            self.transport.write_eof()
            self._after(LINGER_SECONDS, self.transport.abort)
        else:
            self.transport.abort()
