"""What a live stream and its connection report to the metrics and the log.

Model: a stream counts updates and blocks in plain numbers, which cost little. `StreamCounts.tell` adds the increase
    since its last call to the metrics. A thread may render meanwhile; its counts are included in the next call.
"""

from __future__ import annotations

import logging
from collections.abc import Callable

from starlette.types import Message

from service.operations.logs import about_session
from service.operations.metrics import Metrics


class StreamCounts:
    """Updates received and applied; blocks and frames that the limiter reduced.

    reduction_db: the largest reduction.
    """

    __slots__ = ("_reported", "applied", "limited_blocks", "limited_frames", "received", "reduction_db")

    def __init__(self) -> None:
        self.received = self.applied = 0
        self.limited_blocks = self.limited_frames = 0
        self.reduction_db = 0.0
        self._reported = (0, 0, 0, 0, 0)

    def tell(self, metrics: Metrics, rate: int, waiting: int = 0) -> None:
        """Add the increase to `metrics`. waiting: updates that may still be applied; the others were dropped."""
        received, applied = self.received, self.applied
        now = (received, applied, received - applied - waiting, self.limited_blocks, self.limited_frames)
        if now == self._reported:
            return
        new = [count - before for count, before in zip(now, self._reported, strict=True)]
        self._reported = now
        metrics.updates(*new[:3])
        if new[0]:
            metrics.load.moved(id(self))
        if new[3]:
            metrics.limited(self.reduction_db, new[4] / rate, new[3])


log = logging.getLogger("ridgewave.service")

BROKEN = 1006  # close code of a connection that ended without a close frame
NO_CODE = 1005  # close code of a close frame without a code


class ConnectionLog:
    """The begin and end of one connection. clock: seconds, of any origin."""

    def __init__(self, metrics: Metrics, clock: Callable[[], float]) -> None:
        self._metrics, self._clock = metrics, clock
        self._left = BROKEN
        self._began: tuple[float, int] | None = None

    def began(self, session: str, stream: str, frame: int) -> None:
        """Record that the stream of `session` begins or continues at `frame`. Log records name it from now on.

        stream: its description for the log.
        """
        about_session(session)
        self._began = self._clock(), frame
        self._metrics.stream_opened("live")
        log.info("live stream began: %s, frame %d", stream, frame)

    def left(self, disconnected: Message) -> None:
        """Record the close code of the client."""
        self._left = code_of(disconnected)

    def ended(self, close: tuple[int, str] | None, frame: int) -> None:
        """Record the end of the connection.

        close: code and reason of the close, None if the client left.
        frame: the next frame.
        """
        code, reason = (self._left, "the peer is gone") if close is None else close
        self._metrics.live_closed(code)
        if self._began is not None:
            self._metrics.stream_closed("live")
            seconds, frames = self._clock() - self._began[0], frame - self._began[1]
            log.info("live stream ended: %s, code %d, %d frames in %.1f s", reason, code, frames, seconds)


def code_of(disconnected: Message) -> int:
    """Return the close code. uvicorn reports 1005 without a reason for a connection that broke."""
    code = int(disconnected.get("code", BROKEN))
    return BROKEN if code == NO_CODE and "reason" not in disconnected else code
