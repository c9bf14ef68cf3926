"""How far a live stream may run ahead, and whether a device that plays it would have run dry.

Model: `Credit` is what was granted and has not come; at most CREDIT_SECONDS at a time, topped up when half of it is
    gone, so that a long read is not a message a block. `Playout` is a device that plays each block when it is read.
"""

from __future__ import annotations

CREDIT_SECONDS = 10.0  # s of credit at most; the service bounds it to 60 s; a few suffice for any round trip


class Credit:
    """Frames that the service may still send."""

    def __init__(self, sample_rate: int) -> None:
        self._limit = max(1, round(CREDIT_SECONDS * sample_rate))
        self.outstanding = 0

    def reset(self) -> None:
        """Begin a connection: without credit."""
        self.outstanding = 0

    def spend(self, frames: int) -> None:
        """Note that `frames` came; the fade at an end comes beyond the credit."""
        self.outstanding = max(0, self.outstanding - frames)

    def grant(self, missing: int) -> int:
        """Return the frames to grant so that `missing` may come, which count as granted; 0 where nothing is due."""
        if missing > self._limit and self.outstanding > self._limit // 2:
            return 0
        granted = max(0, min(missing, self._limit) - self.outstanding)
        self.outstanding += granted
        return granted


class Playout:
    """A device without a buffer of its own: it begins with the first read, and counts when it runs dry."""

    def __init__(self) -> None:
        self._busy_until: float | None = None
        self.underruns = 0

    def play(self, seconds: float, now: float) -> None:
        """Note that a read returned so much sound at `now`, in monotonic seconds."""
        if self._busy_until is not None and now > self._busy_until:
            self.underruns += 1
        start = now if self._busy_until is None else max(now, self._busy_until)
        self._busy_until = start + seconds
