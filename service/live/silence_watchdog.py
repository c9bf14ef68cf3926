"""The watchdog of a live stream: lifts the finger when updates stop.

Model: after the first update, the next one must arrive within `max_silence`. A service that is late has not read its
    messages either. So if the block is late, the watchdog waits for one more block. The service usually reads before
    that block, but not if the block timer calls a stream twice within EARLY_SECONDS.
Limits: the watchdog acts when a block begins. A client that pulls nothing has no blocks.
"""

from __future__ import annotations

LATE_SECONDS = 0.02  # lateness of a block that shows a busy service; ordinary load causes less


class SilenceWatchdog:
    """The watchdog of one stream. max_silence: s. It starts with the first update, since a scan may move by itself."""

    __slots__ = ("_doubtful", "_heard", "_lifted", "_max_silence")

    def __init__(self, max_silence: float) -> None:
        self._max_silence = max_silence
        self._heard: float | None = None
        self._lifted = self._doubtful = False

    def heard(self, now: float) -> None:
        """Record that an update arrived."""
        self._heard, self._lifted, self._doubtful = now, False, False

    def lifts(self, now: float, late: float) -> bool:
        """Return whether to lift the finger now; true once per silence. late: lateness of the block, in s."""
        if self._heard is None or self._lifted or now - self._heard <= self._max_silence:
            return False
        if late > LATE_SECONDS and not self._doubtful:
            self._doubtful = True
            return False
        self._lifted = True
        return True
