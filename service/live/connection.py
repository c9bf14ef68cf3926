"""One live connection: connects a WebSocket (ASGI) and its session through the state machine `Conversation`.

Model: one task reads, one task writes (`connection_writer`). Both run in the event loop, so the state machine needs no
    locks. Messages, the clock and the sessions put their inputs into the state machine; the connection performs the
    actions that it requests.
"""

from __future__ import annotations

import asyncio
import contextvars
import time
from collections.abc import Callable, Coroutine
from typing import Any

from starlette.types import Receive, Scope, Send

from service import problems
from service.http.rate_limits import KEY
from service.http.security import our_bug
from service.live import actions
from service.live.connection_writer import FLUSH_SECONDS, ConnectionWriter
from service.live.conversation import Conversation, Phase
from service.live.live_connections import LiveConnections
from service.live.live_metrics import ConnectionLog
from service.live.live_stream import LiveStream
from service.live.message_limits import PAUSE_SECONDS
from service.live.messages import Version
from service.live.transport import PlainWire, Wire
from service.problems import Problem
from service.sessions.session import Session
from service.sessions.voice_stream import grace_seconds
from synth.errors import CannotRender, RidgewaveError


class Connection:
    """One accepted WebSocket. Implements `service.sessions.session.Peer` and `service.live.transport.Receiver`.

    version: of the protocol.
    client: name under which the client's work is limited.
    wire: the interface of the server beyond ASGI, None for a plain ASGI server.
    """

    def __init__(
        self,
        scope: Scope,
        receive: Receive,
        send: Send,
        live: LiveConnections,
        version: Version,
        *,
        client: str = "",
        wire: Wire | None = None,
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self._scope, self._receive = scope, receive
        self.owner: int | None = scope.get(KEY)
        self.client = client
        self._wire: Wire = wire or PlainWire(send)
        self._live, self._clock = live, clock
        self._context = contextvars.copy_context()  # so that log records of a message name this connection
        self.conversation = Conversation(live.settings, clock(), version, live.metrics)
        self.session: Session | None = None
        self._writer = ConnectionWriter(
            self.conversation, self._wire, send, live, clock, perform=self._perform, failed=self._voice_failed
        )
        self._log = ConnectionLog(live.metrics, clock)
        self._tasks: set[asyncio.Task[None]] = set()

    async def run(self) -> None:
        """Serve the connection until it is closed."""
        self._live.enter(self)
        self._wire.deliver(self)
        reader, writer = asyncio.create_task(self._read()), asyncio.create_task(self._writer.write())
        try:
            await asyncio.wait([reader, writer], return_when=asyncio.FIRST_COMPLETED)
            if not writer.done():
                self._lose()
                await writer
            elif self._writer.closing is None:
                await asyncio.wait([reader], timeout=FLUSH_SECONDS)  # for the close code of the client
        finally:
            reader.cancel()
            writer.cancel()
            self._writer.stop()
            self._wire.deliver(None)
            self._lose()
            self._live.leave(self)
            closing = self._writer.closing
            self._log.ended(
                None if closing is None else (closing.code, closing.reason), self.conversation.blocks.position
            )
            self.conversation.stream = None  # as in `Sessions.finish`

    def _lose(self) -> None:
        self.conversation.lost()
        self._perform()
        self._writer.wake()

    # The interface `Peer`, for the sessions

    @property
    def ending(self) -> bool:
        """Return whether the stream fades out or has ended."""
        return self.conversation.phase in (Phase.ENDING, Phase.OVER)

    def check(self, now: float) -> None:
        """End or warn the connection if it is too late by the clock."""
        self.conversation.check(now)
        self._perform()

    def refuse(self, problem: RidgewaveError | Problem) -> None:
        """Report a problem; the stream continues."""
        self.conversation.refuse(problem if isinstance(problem, Problem) else problems.of(problem))
        self._perform()

    def failed(self) -> None:
        """End because of the exception that is being handled, a mistake of the service."""
        self.conversation.broken(our_bug(self._scope))
        self._perform()

    def displaced(self) -> None:
        """End, because another connection has taken over the session."""
        self.session = None
        self.conversation.displaced()
        self._perform()

    def end(self, reason: str, *, at_once: bool = False) -> None:
        """Fade out and end. at_once: cut off a client that does not read for 10 ms."""
        self.conversation.end(reason)
        self._perform()
        self._writer.wake()
        asyncio.get_running_loop().call_later(grace_seconds(at_once=at_once), self._cut)

    def _cut(self) -> None:
        """Cancel a write that has been waiting since before the end."""
        if self.conversation.blocks.pace.in_write:
            self.conversation.cut()
            self._perform()

    # Reading

    def message(self, message: str | bytes) -> None:
        """See `Receiver`."""
        if isinstance(message, bytes):
            self._take(message)
        else:
            self._context.run(self._take, message)

    def _take(self, message: str | bytes) -> None:
        conversation = self.conversation
        try:
            if isinstance(message, str):
                conversation.text(message, self._clock())
                self._writer.wake()
            elif conversation.binary(message, self._clock()):
                self._writer.wake()
            if conversation.lacks_credit:
                self._wire.acknowledge()
        except Exception:
            self.failed()
        if conversation.actions:
            self._perform()

    def frame(self, size: int) -> None:
        """See `Receiver`."""
        self.conversation.rate.spend(size)

    def pause(self) -> float:
        """See `Receiver`."""
        if self.session is not None and self.session.has_too_many_changes(self._live.settings.max_message):
            return PAUSE_SECONDS
        return self.conversation.pause(self._clock)

    def behind(self, seconds: float) -> None:
        """See `Receiver`."""
        self.conversation.behind(seconds)
        if self.conversation.actions:
            self._perform()

    async def _read(self) -> None:
        """Wait until the client leaves. A plain ASGI server also passes messages this way."""
        while True:
            message = await self._receive()
            if message["type"] == "websocket.disconnect":
                self._log.left(message)
                return
            data = message.get("bytes")
            received = data if data is not None else message["text"]
            self.frame(len(received))
            self.message(received)
            while pause := self.pause():
                await asyncio.sleep(pause)

    def _perform(self) -> None:
        """Perform the actions of the state machine."""
        asked = self.conversation.take_actions()
        for action in asked:
            match action:
                case actions.Send():
                    self._writer.put(action.message)
                case actions.OpenVoice():
                    self._start(self._open(self._live.open(action.scene, action.options, self)))
                case actions.Resume():
                    self._start(self._open(self._live.resume(action.session, action.frame, self)))
                case actions.Close():
                    self._writer.close(action)
                case _ if self.session is None:
                    pass
                case actions.Prepare():
                    self.session.change_live(action.patch, action.size)
                case actions.Detach():
                    self.session.detach(self)
                case actions.Finish():
                    self._live.sessions.finish(self.session)
        if asked:
            self._writer.wake()

    async def _open(self, opening: Coroutine[Any, Any, Session]) -> None:
        """Begin with the session that `opening` returns, or end."""
        conversation = self.conversation
        try:
            session = await opening
        except CannotRender as error:
            conversation.end("cannot render", problems.of(error))
        except RidgewaveError as error:
            conversation.end("policy", problems.of(error))
        except Problem as problem:
            if problem.kind == "closing":
                conversation.end("shutting down", problem)
            else:
                conversation.end("policy", problem, code=1013 if problem.kind == "full" else None)
        except Exception:
            conversation.broken(our_bug(self._scope))
        else:
            self._begin(session)
        self._perform()

    def _begin(self, session: Session) -> None:
        stream = session.stream
        assert isinstance(stream, LiveStream)
        if self.conversation.phase is Phase.OPENING:
            self.session = session
            self.conversation.opened(stream, self._clock())
            if self.conversation.stream is not None:
                what = f"{stream.options.pacing}, {stream.rate} Hz, blocks of {stream.block}"
                self._log.began(session.id, what, self.conversation.blocks.position)
        elif stream.frame:
            session.detach(self)  # the connection broke during the opening
        else:
            self._live.sessions.finish(session)  # the same, before the client knew the session's id

    def _voice_failed(self, error: Exception) -> None:
        """End because of the exception of the voice that is being handled."""
        if isinstance(error, RidgewaveError):
            self.conversation.broken(problems.of(error), "cannot render")
        else:
            self.conversation.broken(our_bug(self._scope))
        self._perform()

    def _start(self, work: Coroutine[Any, Any, None]) -> None:
        task = asyncio.get_running_loop().create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
