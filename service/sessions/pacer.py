"""When the next block of a stream is due, and sleeps that can be ended early.

Model: the block at frame n is due at start + n / rate - lead on `time.perf_counter`, absolute, so that errors of single
    sleeps do not add up (sleeping one block at a time drifts by 2-5 %).
Limits: a stream that fell more than `FORGIVEN_SECONDS` behind is not sent the missed sound in a burst: its clock starts
    anew. What of that time was the service's own fault, and not waiting for the reader, is in `skipped`. Sleeps are as
    exact as the event loop's timer, about a millisecond.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable

FORGIVEN_SECONDS = 1.0  # shorter: a network hiccup costs the lead; longer: a long stall is answered by a long burst


class Pacer:
    """The clock of one stream, in frames."""

    def __init__(self, sample_rate: int, lead: float, now: Callable[[], float] = time.perf_counter) -> None:
        self._rate = sample_rate
        self._lead = lead
        self._now = now
        self._start = now()
        self._waited = 0.0  # for the reader, since the stream was last on time
        self.skipped = 0.0  # s by which the service was late when `delay` last began the clock anew; else 0

    def waited(self, seconds: float) -> None:
        """Take note of how long the reader took to take a block."""
        self._waited += seconds

    def delay(self, frames: int) -> float:
        """Return the seconds until the block that begins at frame `frames` is due; not positive: send it now."""
        now = self._now()
        ahead, self.skipped = self._start + frames / self._rate - now, 0.0
        if ahead < -FORGIVEN_SECONDS:
            self._start, self.skipped = now - frames / self._rate, max(0.0, -ahead - self._waited)
            ahead = 0.0
        if ahead >= 0.0:
            self._waited = 0.0
        return ahead - self._lead

    def late(self, frames: int) -> float:
        """Return by how many seconds a block of frame `frames` on is late if it goes out now; not before the start,
        when the lead is still being filled, is any due.
        """
        return self._now() - max(self._start, self._start + frames / self._rate - self._lead)


class Bell:
    """Rings once, for good, and ends the sleep that is under way. Of one event loop; one task sleeps on it."""

    def __init__(self) -> None:
        self._rung = asyncio.Event()
        self._sleep: asyncio.Future[None] | None = None

    @property
    def rung(self) -> bool:
        """Return whether it has rung."""
        return self._rung.is_set()

    def ring(self) -> None:
        """Ring; again is the same as once."""
        self._rung.set()
        if self._sleep is not None:
            _wake(self._sleep)

    async def wait(self) -> None:
        """Return once it has rung."""
        await self._rung.wait()

    async def sleep(self, seconds: float) -> None:
        """Return after `seconds` or when it rings, and let others run in any case."""
        if self.rung or seconds <= 0:
            await asyncio.sleep(0)
            return
        loop = asyncio.get_running_loop()
        self._sleep = loop.create_future()
        timer = loop.call_later(seconds, _wake, self._sleep)
        try:
            await self._sleep
        finally:
            timer.cancel()
            self._sleep = None


def _wake(sleep: asyncio.Future[None]) -> None:
    if not sleep.done():
        sleep.set_result(None)
