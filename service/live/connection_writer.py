"""The writing half of a live connection: waiting messages, each block when it is due, and the close.

Model: one task writes. It sleeps until a block is due or something is to be sent. A quick voice renders in the event
    loop, a slow one in a thread. A client that does not read delays only its own writer; an end that cannot wait
    cancels the pending write.
Limits: the timer of the event loop has a resolution of 1 ms, so a block is sent up to 2 ms after it is due.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Sequence
from functools import partial

from starlette.types import Send

from service.live.actions import Block, Close
from service.live.conversation import Conversation, Phase
from service.live.live_connections import LiveConnections
from service.live.transport import Wire

FLUSH_SECONDS = 1.0  # for the last messages, if the server cannot buffer them
WAITING_BYTES = 1 << 18  # of unsent text messages; further ones are dropped


class ConnectionWriter:
    """Writes what the state machine of one connection has to send.

    perform: performs the actions of the state machine.
    failed: ends the stream because of the exception of its voice that is being handled.
    closing: the close to send after the last messages; None before it is requested.
    """

    def __init__(
        self,
        conversation: Conversation,
        wire: Wire,
        send: Send,
        live: LiveConnections,
        clock: Callable[[], float],
        *,
        perform: Callable[[], None],
        failed: Callable[[Exception], None],
    ) -> None:
        self._conversation, self._wire, self._send, self._live, self._clock = conversation, wire, send, live, clock
        self._perform, self._failed = perform, failed
        self.closing: Close | None = None
        self._outbox: deque[str] = deque()
        self._blocks: asyncio.Task[None] | None = None
        self._waiter: asyncio.Future[None] | None = None
        self._woken = False
        self._alarm = 0  # number of the newest alarm; older ones do nothing

    def put(self, message: str) -> None:
        """Keep a text message, to be sent before the next block. Drop it if too many wait, except after the end."""
        if sum(map(len, self._outbox)) < WAITING_BYTES or self._conversation.phase is Phase.OVER:
            self._outbox.append(message)

    def close(self, closing: Close) -> None:
        """Close after the last messages. An end that cannot wait for the client buffers the pending write."""
        self.closing = closing
        if closing.at_once and self._conversation.blocks.pace.in_write:
            self._wire.unblock()
            if not self._wire.can_send():
                self.stop()

    def wake(self) -> None:
        """Wake the writer."""
        self._woken = True
        if self._waiter is not None and not self._waiter.done():
            self._waiter.set_result(None)

    def stop(self) -> None:
        """Write no more blocks."""
        if self._blocks is not None:
            self._blocks.cancel()

    async def write(self) -> None:
        """Write blocks until the end, then the last messages and the close."""
        self._blocks = asyncio.create_task(self._write_blocks())
        await asyncio.wait([self._blocks])
        if self.closing is None:
            return
        if self.closing.at_once:
            self._wire.unblock()
        try:
            async with asyncio.timeout(FLUSH_SECONDS):
                await self._send_all(list(self._outbox))
                await self._send({"type": "websocket.close", "code": self.closing.code, "reason": self.closing.reason})
        except (OSError, TimeoutError):
            return  # the client is gone or does not read

    async def _write_blocks(self) -> None:
        try:
            while self.closing is None and self._conversation.phase is not Phase.OVER:
                await self._next()
        except OSError:
            return  # the client is gone; the reader notices it too

    async def _next(self) -> None:
        """Send waiting messages, then the next block if it is due; otherwise sleep until there is something to send."""
        conversation = self._conversation
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
            block = self._conversation.next_block(self._clock)
        except Exception as error:
            self._failed(error)
            return Block(0, [])
        if self._conversation.actions:
            self._perform()
        return block

    async def _rendered_apart(self, frames: int) -> Sequence[str | bytes]:
        """Return the messages of a block that a thread renders, none if the voice has failed."""
        stream = self._conversation.stream
        assert stream is not None
        try:
            pcm = await stream.rendered(stream.render, frames, self._live.blocks)
            return self._conversation.messages(pcm, frames, self._clock())
        except Exception as error:
            self._failed(error)
        return ()

    async def _send_all(self, messages: Sequence[str | bytes]) -> None:
        pace = self._conversation.blocks.pace
        if not self._wire.can_send():
            pace.writing(self._clock())
        await self._wire.send_all(messages)
        pace.written(self._clock())

    async def _sleep(self, seconds: float | None) -> None:
        """Return after `seconds` (None: never), or as soon as `wake` is called. `_due` may send blocks meanwhile."""
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
            self.wake()

    def _sent_at_once(self) -> bool:
        """Send the block if nothing must be awaited, as is usual; return whether the writer may keep sleeping."""
        conversation = self._conversation
        pace, stream = conversation.blocks.pace, conversation.stream
        if stream is None or not stream.can_render_here or self._outbox:
            return False
        if not conversation.paced or not self._wire.can_send():
            return False
        block = self._next_block()
        if block is None or not block.messages:
            return False
        self._wire.send_now(block.messages)
        now = self._clock()
        pace.written(now)
        self._set_alarm(max(now, pace.due))
        return not self._outbox
