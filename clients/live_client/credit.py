"""Counts the credit of a live stream, and the underruns of a device that plays it."""

from __future__ import annotations

CREDIT_SECONDS = 10.0  # s; largest credit. The service allows 60 s; less than a round trip would starve the stream


class Credit:
    """Frames that were requested and not received.

    Credit is granted again when half of CREDIT_SECONDS is left, so that a long read does not need a message per block.
    """

    def __init__(self, sample_rate: int) -> None:
        self._limit = max(1, round(CREDIT_SECONDS * sample_rate))
        self.outstanding = 0

    def reset(self) -> None:
        """Set the credit of a new connection: none."""
        self.outstanding = 0

    def spend(self, frames: int) -> None:
        """Count `frames` as received; the fade at the end needs no credit."""
        self.outstanding = max(0, self.outstanding - frames)

    def grant(self, missing: int) -> int:
        """Grant credit for `missing` frames; return the frames to request, 0 if none."""
        if missing > self._limit and self.outstanding > self._limit // 2:
            return 0
        granted = max(0, min(missing, self._limit) - self.outstanding)
        self.outstanding += granted
        return granted


class UnderrunCounter:
    """Counts the underruns of a device that plays each block when it is read, without a buffer of its own."""

    def __init__(self) -> None:
        self._busy_until: float | None = None
        self.underruns = 0

    def play(self, seconds: float, now: float) -> None:
        """Count a read that returned `seconds` of sound at `now` (monotonic seconds)."""
        if self._busy_until is not None and now > self._busy_until:
            self.underruns += 1
        start = now if self._busy_until is None else max(now, self._busy_until)
        self._busy_until = start + seconds
