"""What a live stream and its connection tell the metrics and the log.

Model: a stream counts in plain numbers that only rise, since it counts every update and every block.
    `StreamCounts.tell` adds what is new since it was last called. Blocks may be rendered in a thread meanwhile: what it
    misses it finds the next time. A connection tells that its stream began, and how it ended.
"""

from __future__ import annotations

import logging
from collections.abc import Callable

from starlette.types import Message

from service.operations.logs import about_session
from service.operations.metrics import Metrics


class StreamCounts:
    """Updates that came and that a block was rendered with; blocks and frames that the limiter turned down."""

    __slots__ = ("_told", "applied", "limited_blocks", "limited_frames", "received", "reduction_db")

    def __init__(self) -> None:
        self.received = self.applied = 0
        self.limited_blocks = self.limited_frames = 0
        self.reduction_db = 0.0  # the largest
        self._told = (0, 0, 0, 0, 0)

    def tell(self, metrics: Metrics, rate: int, waiting: int = 0) -> None:
        """Add what is new to `metrics`; waiting: updates that may still be applied, the others are dropped."""
        received, applied = self.received, self.applied
        now = (received, applied, received - applied - waiting, self.limited_blocks, self.limited_frames)
        if now == self._told:
            return
        new = [count - told for count, told in zip(now, self._told, strict=True)]
        self._told = now
        metrics.updates(*new[:3])
        if new[3]:
            metrics.limited(self.reduction_db, new[4] / rate, new[3])


log = logging.getLogger("ridgewave.service")

BROKEN = 1006  # the code of a connection that ended without one
NO_CODE = 1005  # of a close frame that has none


class ConnectionLog:
    """Of one connection; clock: seconds of any origin."""

    def __init__(self, metrics: Metrics, clock: Callable[[], float]) -> None:
        self._metrics, self._clock = metrics, clock
        self._left = BROKEN
        self._began: tuple[float, int] | None = None

    def began(self, session: str, stream: str, frame: int) -> None:
        """Take note that the stream of `session` goes on here, from `frame` on; records of the connection name it now.

        stream: what the log says of it.
        """
        about_session(session)
        self._began = self._clock(), frame
        self._metrics.stream_opened("live")
        log.info("live stream began: %s, frame %d", stream, frame)

    def left(self, disconnected: Message) -> None:
        """Take note that the peer is gone."""
        self._left = code_of(disconnected)

    def ended(self, close: tuple[int, str] | None, frame: int) -> None:
        """Take note that the connection is over; `frame` would be the next.

        close: the code and reason that it was closed with, None where the peer has gone.
        """
        code, reason = (self._left, "the peer is gone") if close is None else close
        self._metrics.live_closed(code)
        if self._began is not None:
            self._metrics.stream_closed("live")
            seconds, frames = self._clock() - self._began[0], frame - self._began[1]
            log.info("live stream ended: %s, code %d, %d frames in %.1f s", reason, code, frames, seconds)


def code_of(disconnected: Message) -> int:
    """Return the code that a connection ended with; the server tells 1005 without a reason where it only broke off."""
    code = int(disconnected.get("code", BROKEN))
    return BROKEN if code == NO_CODE and "reason" not in disconnected else code
