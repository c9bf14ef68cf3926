"""One live connection: the state machine between a WebSocket (ASGI) and the sessions.

Model: one task reads and feeds `Conversation`, one writes what it gives; both call it in the event loop, so it needs no
    locks. Blocks are rendered here while they are quick, in threads while they are not. A peer that does not read holds
    up its own writer only; where the end cannot wait for it, the write that waits is given up.
Limits: the event loop's timer counts in milliseconds; a block goes out up to two after it is due.
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
from service.live.conversation import Conversation, Limits, Phase
from service.live.live_connections import LiveConnections
from service.live.live_metrics import ConnectionLog
from service.live.live_stream import LiveStream
from service.live.transport import PlainWire, Wire
from service.operations.settings import Settings
from service.problems import Problem
from service.sessions.session import Session
from service.sessions.voice_stream import grace_seconds
from synth.errors import CannotRender, RidgewaveError

FLUSH_SECONDS = 1.0  # for the last messages, where the server cannot be told to buffer them
WAITING_BYTES = 1 << 18  # of texts that a peer does not read; beyond, they are dropped


def limits_of(settings: Settings) -> Limits:
    """Return what `settings` allow a connection."""
    return Limits(settings.slow_reader, settings.max_updates, settings.max_duration, settings.max_stream)


class Connection:
    """One accepted WebSocket; see `service.sessions.session.Peer`.

    client: whom its work is counted for. wire: what the server can do beyond ASGI, None where it can do nothing.
    """

    def __init__(
        self,
        scope: Scope,
        receive: Receive,
        send: Send,
        live: LiveConnections,
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
        self._context = contextvars.copy_context()  # what is logged of a message names this connection
        self.conversation = Conversation(limits_of(live.settings), clock(), live.metrics)
        self.session: Session | None = None
        self._outbox: deque[str] = deque()
        self._close: actions.Close | None = None
        self._log = ConnectionLog(live.metrics, clock)
        self._waiter: asyncio.Future[None] | None = None
        self._rung = False
        self._alarm = 0
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
                await asyncio.wait([reader], timeout=FLUSH_SECONDS)  # it learns with which code the peer has gone
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

    def _lose(self) -> None:
        self.conversation.lost()
        self._perform()
        self._ring()

    # What the sessions ask of a peer

    @property
    def ending(self) -> bool:
        """Return whether its stream fades out or has ended."""
        return self.conversation.phase in (Phase.ENDING, Phase.OVER)

    def check(self, now: float) -> None:
        """Look at what only time tells."""
        self.conversation.check(now)
        self._perform()

    def refuse(self, problem: RidgewaveError | Problem) -> None:
        """Tell of a problem that leaves the stream going."""
        self.conversation.refuse(problem if isinstance(problem, Problem) else problems.of(problem))
        self._perform()

    def failed(self) -> None:
        """End, because of the exception that is being handled: our mistake."""
        self.conversation.broken(our_bug(self._scope))
        self._perform()

    def displaced(self) -> None:
        """End: another connection has the session now."""
        self.session = None
        self.conversation.displaced()
        self._perform()

    def end(self, reason: str, *, at_once: bool = False) -> None:
        """Fade out and end; at_once: a peer that does not read gets 10 ms."""
        self.conversation.end(reason)
        self._perform()
        self._ring()
        asyncio.get_running_loop().call_later(grace_seconds(at_once=at_once), self._cut)

    def _cut(self) -> None:
        """Give up the write that waits since before the end."""
        if self.conversation.pace.in_write:
            self.conversation.cut()
            self._perform()

    # Reading

    def message(self, message: str | bytes) -> None:
        """See `service.live.transport.Sink`."""
        if isinstance(message, bytes):
            self._take(message)
        else:
            self._context.run(self._take, message)  # it may start what is logged

    def _take(self, message: str | bytes) -> None:
        conversation = self.conversation
        try:
            if isinstance(message, bytes):
                conversation.binary(message, self._clock())
            else:
                conversation.text(message, self._clock())
                self._ring()
        except Exception:
            self.failed()
        if conversation.actions:
            self._perform()

    def frame(self) -> bool:
        """See `service.live.transport.Sink`."""
        within = self.conversation.frame(self._clock())
        if self.conversation.actions:
            self._perform()
        return within

    def behind(self, frames: int) -> None:
        """See `service.live.transport.Sink`."""
        self.conversation.behind(frames)
        if self.conversation.actions:
            self._perform()

    async def _read(self) -> None:
        """Wait for the peer to go; its messages come this way only where the server delivers none."""
        while True:
            message = await self._receive()
            if message["type"] == "websocket.disconnect":
                self._log.left(message)
                return
            data = message.get("bytes")
            self.message(data if data is not None else message["text"])

    def _perform(self) -> None:
        """Do what the state machine asks."""
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
            self._ring()

    async def _open(self, opening: Coroutine[Any, Any, Session]) -> None:
        """Begin with the session that `opening` gives, or end."""
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
            session.detach(self)  # the connection broke meanwhile
        else:
            self._live.sessions.finish(session)  # the same, and nobody was told of the session

    def _start(self, work: Coroutine[Any, Any, None]) -> None:
        task = asyncio.get_running_loop().create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    # Writing

    async def _write(self) -> None:
        """Write blocks until all is over, then the last messages and the close."""
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
            return  # the peer is gone, or takes nothing

    async def _write_blocks(self) -> None:
        try:
            while self._close is None and self.conversation.phase is not Phase.OVER:
                await self._next()
        except OSError:
            return  # the peer is gone; the reader learns it too

    async def _next(self) -> None:
        """Send the messages that wait, then the next block where one is due; else wait for either."""
        conversation = self.conversation
        while self._outbox:
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
            await asyncio.sleep(0)  # more is due already: let the others have their turn

    def _next_block(self) -> Block | None:
        """Return the block that is due, one without messages where the voice has failed."""
        try:
            block = self.conversation.next_block(self._clock)
        except Exception as error:
            self._voice_failed(error)
            return Block(0, [])
        if self.conversation.actions:
            self._perform()
        return block

    async def _rendered_apart(self, frames: int) -> Sequence[str | bytes]:
        """Return the messages of a block that a thread renders; none where the voice has failed."""
        stream = self.conversation.stream
        assert stream is not None
        try:
            pcm = await stream.rendered(stream.render, frames, self._live.blocks)
            return self.conversation.messages(pcm, frames, self._clock())
        except Exception as error:
            self._voice_failed(error)
        return ()

    def _voice_failed(self, error: Exception) -> None:
        """End, because of the exception that is being handled."""
        if isinstance(error, CannotRender):
            self.conversation.broken(problems.of(error), "cannot render")
        else:
            self.conversation.broken(our_bug(self._scope))
        self._perform()

    async def _send_all(self, messages: Sequence[str | bytes]) -> None:
        pace = self.conversation.pace
        pace.writing(self._clock())
        await self._wire.send_all(messages)
        pace.written(self._clock())

    def _ring(self) -> None:
        """Wake the writer."""
        self._rung = True
        if self._waiter is not None:
            _wake(self._waiter)

    async def _sleep(self, seconds: float | None) -> None:
        """Return after `seconds`, None for ever, or as soon as something rings; blocks go out meanwhile."""
        if not self._rung:
            self._waiter = asyncio.get_running_loop().create_future()
            if seconds is not None:
                self._set_alarm(self._clock() + seconds)
            try:
                await self._waiter
            finally:
                self._waiter = None
                self._alarm += 1
        self._rung = False

    def _set_alarm(self, when: float) -> None:
        """Have `_due` called at `when`, in place of what was set before."""
        self._alarm += 1
        self._live.timer.call_at(when, partial(self._due, self._alarm))

    def _due(self, alarm: int) -> None:
        """Send the block that is due, or wake the writer to do it."""
        if alarm == self._alarm and self._waiter is not None and not self._sent_at_once():
            _wake(self._waiter)

    def _sent_at_once(self) -> bool:
        """Send a block where nothing has to be waited for, as most do; return whether the writer may sleep on."""
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


def _wake(waiter: asyncio.Future[None]) -> None:
    if not waiter.done():
        waiter.set_result(None)
