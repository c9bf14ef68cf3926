"""The watchdog of a live stream: where no update comes for too long, the load is to ramp to zero.

Model: a hand that was heard once must be heard again within `max_silence`. A service that is late has not read either
    what its peers sent meanwhile: it believes in a silence only a block later, when it has usually looked once more
    (not where the block timer calls a stream twice in one ring, which it does within EARLY_SECONDS).
Limits: it is asked when a block begins; a client that pulls nothing has no block, and no sound.
"""

from __future__ import annotations

LATE_SECONDS = 0.02  # behind its time that a block shows a busy service; less: any two blocks of usual load do


class SilenceWatchdog:
    """Of one stream; max_silence: s. It waits for the first update: a scan may move by itself."""

    __slots__ = ("_doubtful", "_heard", "_lifted", "_max_silence")

    def __init__(self, max_silence: float) -> None:
        self._max_silence = max_silence
        self._heard: float | None = None
        self._lifted = self._doubtful = False

    def heard(self, now: float) -> None:
        """Take note that an update came."""
        self._heard, self._lifted, self._doubtful = now, False, False

    def lifts(self, now: float, late: float) -> bool:
        """Return whether the hand is to be lifted now, once a silence. late: s that the block is behind its time."""
        if self._heard is None or self._lifted or now - self._heard <= self._max_silence:
            return False
        if late > LATE_SECONDS and not self._doubtful:
            self._doubtful = True
            return False
        self._lifted = True
        return True
