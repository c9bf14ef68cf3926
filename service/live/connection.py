"""One live connection: connects a WebSocket (ASGI) and its session through the state machine `Conversation`.

Model: one task reads, one task writes. Both run in the event loop, so the state machine needs no locks. A quick voice
    renders in the event loop, a slow one in a thread. A client that does not read delays only its own writer; an end
    that cannot wait cancels the pending write.
Limits: the timer of the event loop has a resolution of 1 ms, so a block is sent up to 2 ms after it is due.
"""

from __future__ import annotations

import asyncio
import contextvars
import time
from collections import deque
from collections.abc import Callable, Coroutine, Sequence
from functools import partial
from typing import Any

from starlette.types import Receive, Scope, Send

from service import problems
from service.http.rate_limits import KEY
from service.http.security import our_bug
from service.live import actions
from service.live.actions import Block
from service.live.conversation import PAUSE_SECONDS, Conversation, Phase
from service.live.live_connections import LiveConnections
from service.live.live_metrics import ConnectionLog
from service.live.live_stream import LiveStream
from service.live.messages import Version
from service.live.transport import PlainWire, Wire
from service.problems import Problem
from service.sessions.session import Session
from service.sessions.voice_stream import grace_seconds
from synth.errors import CannotRender, RidgewaveError

FLUSH_SECONDS = 1.0  # for the last messages, if the server cannot buffer them
WAITING_BYTES = 1 << 18  # of unsent text messages; further ones are dropped


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
        self._scope, self._receive, self._send = scope, receive, send
        self.owner: int | None = scope.get(KEY)
        self.client = client
        self._wire: Wire = wire or PlainWire(send)
        self._live, self._clock = live, clock
        self._context = contextvars.copy_context()  # so that log records of a message name this connection
        self.conversation = Conversation(live.settings, clock(), version, live.metrics)
        self.session: Session | None = None
        self._outbox: deque[str] = deque()
        self._close: actions.Close | None = None
        self._log = ConnectionLog(live.metrics, clock)
        self._waiter: asyncio.Future[None] | None = None
        self._woken = False
        self._alarm = 0  # number of the newest alarm; older ones do nothing
        self._blocks: asyncio.Task[None] | None = None
        self._tasks: set[asyncio.Task[None]] = set()

    async def run(self) -> None:
        """Serve the connection until it is closed."""
        self._live.enter(self)
        self._wire.deliver(self)
        reader, writer = asyncio.create_task(self._read()), asyncio.create_task(self._write())
        try:
            await asyncio.wait([reader, writer], return_when=asyncio.FIRST_COMPLETED)
            if not writer.done():
                self._lose()
                await writer
            elif self._close is None:
                await asyncio.wait([reader], timeout=FLUSH_SECONDS)  # for the close code of the client
        finally:
            reader.cancel()
            writer.cancel()
            if self._blocks is not None:
                self._blocks.cancel()
            self._wire.deliver(None)
            self._lose()
            self._live.leave(self)
            close = None if self._close is None else (self._close.code, self._close.reason)
            self._log.ended(close, self.conversation.position)
            self.conversation.stream = None  # as in `Sessions.finish`

    def _lose(self) -> None:
        self.conversation.lost()
        self._perform()
        self._wake()

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
        self._wake()
        asyncio.get_running_loop().call_later(grace_seconds(at_once=at_once), self._cut)

    def _cut(self) -> None:
        """Cancel a write that has been waiting since before the end."""
        if self.conversation.pace.in_write:
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
                self._wake()
            elif conversation.binary(message, self._clock()):
                self._wake()
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
                    if sum(map(len, self._outbox)) < WAITING_BYTES or self.conversation.phase is Phase.OVER:
                        self._outbox.append(action.message)
                case actions.OpenVoice():
                    self._start(self._open(self._live.open(action.scene, action.options, self)))
                case actions.Resume():
                    self._start(self._open(self._live.resume(action.session, action.frame, self)))
                case actions.Close():
                    self._close = action
                    if action.at_once and self._blocks is not None and self.conversation.pace.in_write:
                        self._blocks.cancel()
                case _ if self.session is None:
                    pass
                case actions.Prepare():
                    self.session.change_live(action.patch, action.size)
                case actions.Detach():
                    self.session.detach(self)
                case actions.Finish():
                    self._live.sessions.finish(self.session)
        if asked:
            self._wake()

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
                self._log.began(session.id, what, self.conversation.position)
        elif stream.frame:
            session.detach(self)  # the connection broke during the opening
        else:
            self._live.sessions.finish(session)  # the same, before the client knew the session's id

    def _start(self, work: Coroutine[Any, Any, None]) -> None:
        task = asyncio.get_running_loop().create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    # Writing

    async def _write(self) -> None:
        """Write blocks until the end, then the last messages and the close."""
        self._blocks = asyncio.create_task(self._write_blocks())
        await asyncio.wait([self._blocks])
        if self._close is None:
            return
        if self._close.at_once:
            self._wire.unblock()
        try:
            async with asyncio.timeout(FLUSH_SECONDS):
                await self._send_all(list(self._outbox))
                await self._send({"type": "websocket.close", "code": self._close.code, "reason": self._close.reason})
        except (OSError, TimeoutError):
            return  # the client is gone or does not read

    async def _write_blocks(self) -> None:
        try:
            while self._close is None and self.conversation.phase is not Phase.OVER:
                await self._next()
        except OSError:
            return  # the client is gone; `_read` notices it too

    async def _next(self) -> None:
        """Send waiting messages, then the next block if it is due; otherwise sleep until there is something to send."""
        conversation = self.conversation
        while self._outbox:
            if self._wire.can_send():
                waiting, self._outbox = self._outbox, deque()
                self._wire.send_now(list(waiting))
            else:
                await self._send_all([self._outbox.popleft()])
        block = self._next_block()
        if block is None:
            await self._sleep(conversation.wait(self._clock()))
            return
        messages = await self._rendered_apart(block.frames) if block.messages is None else block.messages
        if not messages:
            return
        await self._send_all(messages)
        if not conversation.wait(self._clock()):
            await asyncio.sleep(0)  # another block is due already; let other tasks run first

    def _next_block(self) -> Block | None:
        """Return the block that is due, without messages if the voice has failed."""
        try:
            block = self.conversation.next_block(self._clock)
        except Exception as error:
            self._voice_failed(error)
            return Block(0, [])
        if self.conversation.actions:
            self._perform()
        return block

    async def _rendered_apart(self, frames: int) -> Sequence[str | bytes]:
        """Return the messages of a block that a thread renders, none if the voice has failed."""
        stream = self.conversation.stream
        assert stream is not None
        try:
            pcm = await stream.rendered(stream.render, frames, self._live.blocks)
            return self.conversation.messages(pcm, frames, self._clock())
        except Exception as error:
            self._voice_failed(error)
        return ()

    def _voice_failed(self, error: Exception) -> None:
        """End because of the exception that is being handled."""
        if isinstance(error, RidgewaveError):
            self.conversation.broken(problems.of(error), "cannot render")
        else:
            self.conversation.broken(our_bug(self._scope))
        self._perform()

    async def _send_all(self, messages: Sequence[str | bytes]) -> None:
        pace = self.conversation.pace
        pace.writing(self._clock())
        await self._wire.send_all(messages)
        pace.written(self._clock())

    def _wake(self) -> None:
        """Wake the writer."""
        self._woken = True
        if self._waiter is not None and not self._waiter.done():
            self._waiter.set_result(None)

    async def _sleep(self, seconds: float | None) -> None:
        """Return after `seconds` (None: never), or as soon as `_wake` is called. `_due` may send blocks meanwhile."""
        if not self._woken:
            self._waiter = asyncio.get_running_loop().create_future()
            if seconds is not None:
                self._set_alarm(self._clock() + seconds)
            try:
                await self._waiter
            finally:
                self._waiter = None
                self._alarm += 1
        self._woken = False

    def _set_alarm(self, when: float) -> None:
        """Call `_due` at `when`. This replaces the previous alarm."""
        self._alarm += 1
        self._live.timer.call_at(when, partial(self._due, self._alarm))

    def _due(self, alarm: int) -> None:
        """Send the block that is due, or wake the writer to send it."""
        if alarm == self._alarm and self._waiter is not None and not self._sent_at_once():
            self._wake()

    def _sent_at_once(self) -> bool:
        """Send the block if nothing must be awaited, as is usual; return whether the writer may keep sleeping."""
        conversation = self.conversation
        pace, stream = conversation.pace, conversation.stream
        if stream is None or not stream.can_render_here or self._outbox:
            return False
        if not conversation.paced or not self._wire.can_send():
            return False
        block = self._next_block()
        if block is None or not block.messages:
            return False
        pace.writing(self._clock())
        self._wire.send_now(block.messages)
        now = self._clock()
        pace.written(now)
        self._set_alarm(max(now, pace.due))
        return not self._outbox
