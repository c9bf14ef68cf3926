"""The end of a WebSocket's connection: what a peer still gets after the close, and for how long.

Model: a peer that does not read gets LINGER_SECONDS to read the rest and the close code. Then its connection is
    aborted. What it sends meanwhile is read, so that its own end is noticed, and discarded.
Source: RFC 6455, 7.1.1.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable

CLOSE_SECONDS = 1.0  # for the peer to answer a close; what it sends later is not read
LINGER_SECONDS = 10.0  # after that, for a slow peer to read the rest; longer: dead peers occupy memory
DISCARD_SECONDS = 0.02  # between two reads that discard what such a peer sends


class Leaving:
    """The end of one connection. A later step replaces the one that was scheduled before.

    lingers: the sending half has ended, and what the peer sends is to be discarded.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop, transport: asyncio.Transport) -> None:
        self._loop, self._transport = loop, transport
        self.lingers = self._gone = False
        self._next_step: asyncio.TimerHandle | None = None
        self._next_read: asyncio.TimerHandle | None = None

    def close(self) -> None:
        """Close after the unsent bytes; abort a peer that has not read them after CLOSE_SECONDS."""
        self._transport.close()
        self._after(CLOSE_SECONDS, self._transport.abort)

    def close_after_rest(self) -> None:
        """Close after the unsent bytes; abort a peer that has not read them after LINGER_SECONDS."""
        self._transport.close()
        self._after(LINGER_SECONDS, self._transport.abort)

    def wait_for_close(self) -> None:
        """Give the peer CLOSE_SECONDS to answer a close that was sent, then linger."""
        self._after(CLOSE_SECONDS, self.linger)

    def linger(self) -> None:
        """End the sending half after the unsent bytes, and wait until the peer has read them and closes.

        The socket stays open until then. If it were closed with unread bytes in it, the kernel would drop unsent ones.
        """
        if self._gone or self._transport.is_closing() or not self._transport.can_write_eof():
            self._transport.abort()
            return
        self.lingers = True
        self._transport.resume_reading()  # otherwise the end is not noticed
        self._transport.write_eof()
        self._after(LINGER_SECONDS, self._transport.abort)

    def discard(self) -> None:
        """Discard what the peer sends, a bounded amount at a time."""
        self._transport.pause_reading()
        self._next_read = self._loop.call_later(DISCARD_SECONDS, self._transport.resume_reading)

    def gone(self) -> None:
        """Cancel what was scheduled: the connection is gone."""
        self._gone = True
        for scheduled in (self._next_step, self._next_read):
            if scheduled is not None:
                scheduled.cancel()

    def _after(self, seconds: float, act: Callable[[], object]) -> None:
        if self._next_step is not None:
            self._next_step.cancel()
        self._next_step = None if self._gone else self._loop.call_later(seconds, act)
