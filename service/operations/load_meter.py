"""How loaded the event loop of one process is: how busy its thread was, and how late blocks were, in the last second.

Model: `look` is called some 20 times a second, in the thread of the event loop. `busy` is the processor time of that
    thread over the time that passed; `late` is the mean lateness of the blocks that were sent meanwhile. On a machine
    that others use too the thread gets less than a processor, so that blocks are late before it seems busy.
    A live stream takes more once a hand moves it. `expected` is `busy` if hands moved all live streams.
Limits: streams that pull have no lateness; they count by processor time alone. Work in threads and processes does not
    count, unless it makes blocks late.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

HAND_WORK = 1.5  # of a live stream with 100 updates a second, over that of one whose scan goes on by itself (250: 1.75)
WINDOW_SECONDS = 1.0  # shorter: one stall decides; longer: a burst of streams is noticed too late


@dataclass(frozen=True, slots=True)
class Look:
    """What had passed at one time: seconds, processor seconds, lateness of all blocks in seconds, their number."""

    now: float
    used: float
    late: float
    blocks: int


class LoadMeter:
    """Measures the load of one event loop. clock, used: seconds, of any origin; used: of the loop's thread."""

    def __init__(
        self, clock: Callable[[], float] = time.perf_counter, used: Callable[[], float] = time.thread_time
    ) -> None:
        self._clock, self._used = clock, used
        self._looks: deque[Look] = deque()
        self._late, self._blocks = 0.0, 0
        self._begun: deque[float] = deque()
        self._moved: dict[int, float] = {}
        self.streams = self.live = 0

    def sent(self, late: float) -> None:
        """Count a block that was `late` seconds late."""
        self._late += late
        self._blocks += 1

    def look(self) -> None:
        """Measure. Call it in the thread of the event loop."""
        looks, now = self._looks, self._clock()
        looks.append(Look(now, self._used(), self._late, self._blocks))
        while len(looks) > 2 and looks[1].now <= now - WINDOW_SECONDS:
            looks.popleft()

    @property
    def busy(self) -> float:
        """Part of the last second in which the thread of the event loop ran; 0 before two looks."""
        if len(self._looks) < 2:
            return 0.0
        first, last = self._looks[0], self._looks[-1]
        return min(1.0, (last.used - first.used) / max(last.now - first.now, 1e-9))

    @property
    def late(self) -> float:
        """Mean lateness (s) of the blocks of the last second; 0 without any."""
        if not self._looks or self._blocks == self._looks[0].blocks:
            return 0.0
        return (self._late - self._looks[0].late) / (self._blocks - self._looks[0].blocks)

    def moved(self, stream: int) -> None:
        """Note that a hand moves the live stream of this number, any that is its own."""
        self._moved[stream] = self._clock()

    @property
    def resting(self) -> int:
        """The number of live streams that no hand moved in the last second."""
        since = self._clock() - WINDOW_SECONDS
        self._moved = {stream: when for stream, when in self._moved.items() if when > since}
        return max(0, self.live - len(self._moved))

    @property
    def expected(self) -> float:
        """`busy`, if hands moved the resting live streams too; may exceed 1."""
        return self.busy * (1.0 + (HAND_WORK - 1.0) * self.resting / max(self.streams, 1))

    def begins(self) -> None:
        """Note that a stream is admitted now: its load is not measured yet."""
        self._begun.append(self._clock())

    def begun(self, seconds: float) -> int:
        """Return how many streams were admitted in the last `seconds`."""
        since = self._clock() - seconds
        while self._begun and self._begun[0] <= since:
            self._begun.popleft()
        return len(self._begun)
