"""The server's end of one WebSocket, between uvicorn and the application.

Model: uvicorn passes a connection on with its upgrade request. The library websockets (`ServerProtocol`, its public
    interface without I/O) reads the handshake (`websocket_handshake`) and the frames. `websocket_frames` bounds how
    much is read in one turn of the event loop. A peer that sends more than the receiver takes is not read for a while,
    so TCP makes it wait. Outgoing messages are framed here, several per write.
    On a shutdown, streams fade before they are closed. `websocket_leaving` has the steps after a close. A peer that
    does not answer a ping is dropped. So is a peer that leaves a frame half-sent, because its pong cannot interrupt the
    frame.
Source: RFC 6455; the ASGI specification, 2.4, "WebSocket".
Limits: no compression. `receive` reports only connect and disconnect; messages are passed on by
    `transport.Wire.deliver`.
"""

from __future__ import annotations

import asyncio
import logging
import os
import socket
from typing import Any, cast

from starlette.types import Message
from uvicorn import Config
from uvicorn.server import ServerState
from websockets.frames import Frame, Opcode
from websockets.server import ServerProtocol

from service.http.read_turns import shared_turns
from service.http.request_target import use_origin_form
from service.http.security import our_bug
from service.live.transport import WIRE, Messages, Receiver
from service.live.websocket_frames import WHOLE_BINARY, WHOLE_TEXT, FrameReader, frame_head
from service.live.websocket_handshake import Handshake, refusal_bytes, scope_of
from service.live.websocket_leaving import Leaving
from service.operations.logs import WithoutHeaders
from service.problems import Problem

log = logging.getLogger("ridgewave.service")

SHUTDOWN_SECONDS = 0.5  # for streams to fade on a shutdown
DOUBT_SECONDS = 0.25  # extra time for a pong, because a late service may not have read it yet
TCP = (socket.AF_INET, socket.AF_INET6)
QUICK_ACK = getattr(socket, "TCP_QUICKACK", None)  # Linux only
CLOSING = Problem("closing", "The service is shutting down.")
BROKEN, RESTART, NOT_TEXT, OURS = 1006, 1012, 1007, 1011  # close codes (RFC 6455, 7.4.1; 1012: its registry)


class PeerGone(ConnectionError):
    """Raised by `send` when the peer is gone."""


class LiveProtocol(asyncio.Protocol):
    """One connection. The arguments are those that uvicorn passes to the class of its option `ws`."""

    transport: asyncio.Transport
    _leaving: Leaving

    def __init__(
        self,
        config: Config,
        server_state: ServerState,
        app_state: dict[str, Any],
        _loop: asyncio.AbstractEventLoop | None = None,
    ) -> None:
        self.loop = _loop or asyncio.get_running_loop()
        self.conn = ServerProtocol(max_size=config.ws_max_size, logger=WithoutHeaders(log))
        self._config, self._server, self._state = config, server_state, app_state
        self._turns = shared_turns(app_state)
        self._frames = FrameReader(self.conn, self._control, lambda: self.conn.fail(NOT_TEXT))
        self._events: asyncio.Queue[Message] = asyncio.Queue()
        self._writable = asyncio.Event()
        self._writable.set()
        self._handshake = Handshake(self.conn)
        self._refusal: Message | None = None  # the head of the refusal that the application sends
        self._answered = self._open = self._listening = self._behind = self._over = self._gone = False
        self._behind_since = 0.0
        self._ping: bytes | None = None  # the ping whose pong is awaited
        self._doubted = False
        self._owed_pong = b""  # the pong to send when the peer reads again
        self._timer: asyncio.TimerHandle | None = None  # of the next ping

    # Called by uvicorn and the event loop

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Keep the transport."""
        self.transport = cast(asyncio.Transport, transport)
        self._leaving = Leaving(self.loop, self.transport)
        self._server.connections.add(self)  # type: ignore[arg-type]

    def connection_lost(self, exc: Exception | None) -> None:
        """Report the disconnect to the application, and cancel the timers."""
        self._server.connections.discard(self)
        self._open, self._gone = False, True
        self._events.put_nowait({"type": "websocket.disconnect", "code": BROKEN})
        self._writable.set()
        self._leaving.gone()
        if self._timer is not None:
            self._timer.cancel()

    def pause_writing(self) -> None:
        """The peer has stopped reading."""
        self._writable.clear()

    def resume_writing(self) -> None:
        """The peer reads again."""
        self._writable.set()
        if self._owed_pong:
            pong, self._owed_pong = self._owed_pong, b""
            self.transport.write(pong)

    def data_received(self, data: bytes) -> None:
        """Read what the peer has sent."""
        if self._leaving.lingers:
            self._leaving.discard()
        elif self._handshake.answer is None:
            self._shake_hands(data)
        elif self._behind or not self._listening:
            self._frames.hold(data)
        elif not self._frames.take_whole(data):
            self._after_turn(self._frames.take(data))

    def shutdown(self) -> None:
        """Close on a shutdown, after the time in which streams fade and end by themselves."""
        if self._open:
            self.loop.call_later(SHUTDOWN_SECONDS, self._shut)
        else:
            self._shut()

    def _shut(self) -> None:
        if self._open:
            self._close(RESTART, "")
        elif not self._answered:
            self._reject(CLOSING)
        if not self._gone:
            self.transport.close()

    # The handshake

    def _shake_hands(self, request: bytes) -> None:
        asked = self._handshake.read(request)
        if isinstance(asked, Problem):
            self._reject(asked)
            return
        self.transport.pause_reading()  # until `deliver`
        self._events.put_nowait({"type": "websocket.connect"})
        scope = scope_of(asked, self.transport, self._config) | {"state": self._state.copy()}
        scope["extensions"] = {"websocket.http.response": {}, WIRE: self}
        use_origin_form(scope)
        task = self.loop.create_task(self._serve(scope))
        self._server.tasks.add(task)
        task.add_done_callback(self._server.tasks.discard)

    async def _serve(self, scope: dict[str, Any]) -> None:
        """Run the application, and close what it leaves open."""
        refusal = CLOSING  # cancelled by a shutdown, unless the application fails
        try:
            await self._config.loaded_app(scope, self._events.get, self._send)
        except PeerGone:
            log.debug("a WebSocket's peer went while its application was sending")
        except Exception:
            refusal = our_bug(scope)
        finally:
            if not self._answered and not self._gone:
                self._reject(refusal)
            elif self._open:
                self._leaving.close()

    async def _send(self, message: Message) -> None:
        """Take a message from the application."""
        await self._writable.wait()
        if self._gone:
            raise PeerGone
        match message["type"]:
            case "websocket.accept":
                self._accept(message)
            case "websocket.http.response.start":
                self._refusal = {**message, "body": b""}
            case "websocket.http.response.body" if self._refusal is not None:
                self._refusal["body"] += message.get("body", b"")
                if not message.get("more_body", False):
                    self._refuse(self._refusal)
            case "websocket.send":
                await self.send_all([message["bytes"] if message.get("bytes") is not None else message["text"]])
            case "websocket.close" if self._answered:
                self._close(message.get("code", 1000), message.get("reason") or "")
            case "websocket.close":  # the router knows no such path
                self._reject(Problem("not-found", "No WebSocket is served at this path."))

    def _accept(self, message: Message) -> None:
        assert not self._answered
        self._handshake.accept(message)
        self._answered = self._open = True
        self._flush()
        if self._config.ws_ping_interval:
            self._timer = self.loop.call_later(self._config.ws_ping_interval, self._beat)

    def _refuse(self, refusal: Message) -> None:
        """Answer without an upgrade."""
        self._answered = True
        self.transport.write(refusal_bytes(refusal))
        self._events.put_nowait({"type": "websocket.disconnect", "code": BROKEN})
        self.transport.close()

    def _reject(self, problem: Problem) -> None:
        answer = problem.response(self._state.get("root_path", ""))
        self._refuse({"status": answer.status_code, "headers": answer.raw_headers, "body": answer.body})

    # The interface `service.live.transport.Wire`

    def unblock(self) -> None:
        """See `Wire`."""
        self._writable.set()

    def can_send(self) -> bool:
        """See `Wire`."""
        return self._open and self._writable.is_set()

    def send_now(self, messages: Messages) -> None:
        """See `Wire`. One write for all messages: a write to the socket costs more than their framing."""
        pieces: list[bytes] = []
        for message in messages:
            payload = message if isinstance(message, bytes) else message.encode()
            pieces += frame_head(WHOLE_BINARY if payload is message else WHOLE_TEXT, len(payload)), payload
        self.transport.write(b"".join(pieces))

    async def send_all(self, messages: Messages) -> None:
        """See `Wire`."""
        await self._writable.wait()
        if not self._open:
            raise PeerGone
        self.send_now(messages)

    def acknowledge(self) -> None:
        """See `Wire`. Without TCP_NODELAY a peer's second small write waits 40 ms for this."""
        own = self.transport.get_extra_info("socket")
        if QUICK_ACK is not None and self._open and not self.transport.is_closing() and own.family in TCP:
            own.setsockopt(socket.IPPROTO_TCP, QUICK_ACK, 1)

    def deliver(self, receiver: Receiver | None) -> None:
        """See `Wire`."""
        self._frames.receiver = receiver
        if receiver is not None and not self._listening:
            self._listening = True
            self.transport.resume_reading()

    # Reading

    def _after_turn(self, done: bool) -> None:
        """Send what the parser has to send, and continue in another turn if there is more to read."""
        self._flush()
        if self._over or (self._open and self.conn.close_expected()):
            self._left()
        elif not done:
            self._wait_for_turn()
        elif self._behind:
            self._behind = False
            self.transport.resume_reading()

    def _wait_for_turn(self) -> None:
        """Read on in another turn, once the receiver takes more. The socket is not read until then."""
        if not self._behind:
            self._behind, self._behind_since = True, self.loop.time()
            self.transport.pause_reading()
        elif self._frames.receiver is not None:
            self._frames.receiver.behind(self.loop.time() - self._behind_since)
        if self._frames.pause:
            self.loop.call_later(self._frames.pause, self._turns.wait, self._turn)
        else:
            self._turns.wait(self._turn)

    def _turn(self) -> bool:
        if self._gone or self._leaving.lingers:
            return False
        self._after_turn(self._frames.read())
        return True

    def _control(self, frame: Frame) -> None:
        if frame.opcode is Opcode.CLOSE:
            self._over = True
        elif frame.opcode is Opcode.PONG and self._ping is not None and bytes(frame.data) == self._ping:
            self._ping, self._frames.awaits_pong = None, False

    def _flush(self) -> None:
        """Write what the parser has to send. For a peer that does not read, keep only the newest pong."""
        pieces = self.conn.data_to_send()
        if not pieces:
            return
        if self._writable.is_set() or not self._open or self.conn.close_expected():
            self.transport.write(b"".join(pieces))
        else:
            self._owed_pong = pieces[-1]

    def _beat(self) -> None:
        """Ping the peer, or drop it if it has not answered the last ping."""
        if not self._open:
            return
        wait = self._config.ws_ping_interval
        assert wait is not None
        if self._ping is None:
            self._ping, self._doubted, self._frames.awaits_pong = os.urandom(4), False, True
            self.conn.send_ping(self._ping)
            self.transport.write(b"".join(self.conn.data_to_send()))
        elif self._behind:
            self._doubted = False  # the pong may be in what has not been read
        elif not self._doubted:
            self._doubted, wait = True, DOUBT_SECONDS
        else:
            self._open = False
            self.conn.fail(OURS, "keepalive ping timeout")
            self.transport.write(b"".join(self.conn.data_to_send()))
            self._leaving.close()
            return
        self._timer = self.loop.call_later(wait, self._beat)

    # Leaving

    def _close(self, code: int, reason: str) -> None:
        """Send the close, and give the peer CLOSE_SECONDS to answer it."""
        if self._open:
            self._open = False
            self._events.put_nowait({"type": "websocket.disconnect", "code": code, "reason": reason})
            self.conn.send_close(code, reason)
            self.transport.write(b"".join(self.conn.data_to_send()))
            self._leaving.wait_for_close()

    def _left(self) -> None:
        """End the connection with a peer that has closed, or that has been closed for an error of protocol."""
        if self._open:
            self._open = False
            close = self.conn.close_rcvd or self.conn.close_sent
            assert close is not None
            self._events.put_nowait({"type": "websocket.disconnect", "code": close.code, "reason": close.reason})
        if self._over:
            self._leaving.close_after_rest()
        else:
            self._leaving.linger()
