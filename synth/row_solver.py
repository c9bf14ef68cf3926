"""A thread that solves rows of load ahead of a hand, so that a live voice never waits for them.

Stage   3 (VOICE), beside it.
Model   First the usual range of loads, coarsely; then, finely, the load where the hand is and more and more round it,
        and the usual range where that is soon done. A hand that moves on is followed at once; one that rests costs
        nothing. A row is solved without the GIL.
Source  USUAL_LOADS: the loads at which roughness is usefully perceived, 0.05 to 1.8 N (Fagiani & Barbieri, 2016,
        section 2).
Limits  what plays until a row is ready is the nearest one: on a slow machine a fast press sounds late in its load.
"""

from __future__ import annotations

import threading
from time import monotonic

from synth.contact.rows import COARSE, FINEST, Rows

USUAL_LOADS = (0.05, 1.8)  # N
NEIGHBOURHOOD = 1.1  # the octave of a load this much higher or lower is solved too, before the hand is there
ROUND = (1.03, 1.1)  # how far round the hand's load rows are made fine, in turn
SOON = 2.0  # s from the start in which the usual range is made fine, if it can be
INSIDE = 1.03  # a load this much within the ends of what is fine needs nothing new,
MOVED = 1.02  # nor does one that is no further than this from the load that is worked at


class RowSolver:
    """Solves `rows` in a thread of its own, which ends with `stop` or with the program.

    calm: the loads (N) between which a hand calls for nothing new; beyond them, tell `now_at`.
    """

    def __init__(self, rows: Rows, load: float) -> None:
        self._rows = rows
        self._load = load
        self._fine = (load, load)
        self.calm = (load / MOVED, load * MOVED)
        self._usual = threading.Event()
        self._ended = threading.Event()
        self._moved = threading.Event()
        self._resting = threading.Event()
        self._moved.set()
        self._thread = threading.Thread(target=self._run, name="ridgewave-rows", daemon=True)
        self._thread.start()

    @property
    def usual_range_ready(self) -> bool:
        """True when the usual range of loads is solved."""
        return self._usual.is_set()

    @property
    def resting(self) -> bool:
        """True when the rows round the hand are solved too, and nothing is left to do until it moves on."""
        return self._resting.is_set() and not self._moved.is_set()

    def wait(self, seconds: float) -> bool:
        """Wait until the usual range of loads is solved, `seconds` at most; return whether it is."""
        return self._usual.wait(seconds)

    def now_at(self, load: float) -> None:
        """Tell where the hand is (N)."""
        low, high = self._fine[0] * INSIDE, self._fine[1] / INSIDE
        if low <= load <= high:
            self.calm = (low, high)
        elif not self.calm[0] <= load <= self.calm[1]:
            self.calm = (load / MOVED, load * MOVED)
            self._load = load
            self._moved.set()

    def stop(self) -> None:
        """End the thread after the row that it is at."""
        self._ended.set()
        self._moved.set()
        self._thread.join()

    def _run(self) -> None:
        stopped = self._ended.is_set
        until = monotonic() + SOON
        self._rows.cover(*USUAL_LOADS, COARSE, stopped)
        if not stopped():
            self._usual.set()
        while not stopped():
            self._moved.wait()
            self._resting.clear()
            self._moved.clear()
            load = self._load
            self._rows.cover(load / NEIGHBOURHOOD, load * NEIGHBOURHOOD, COARSE, stopped)
            self._rows.cover(load, load, FINEST, stopped)
            for reach in ROUND:
                self._rows.cover(load / reach, load * reach, FINEST, self._moved.is_set)
                if self._moved.is_set():
                    break
                self._fine = _joined(self._fine, (load / reach, load * reach))
            else:
                self._rows.cover(*USUAL_LOADS, FINEST, lambda: self._moved.is_set() or monotonic() > until)
                if monotonic() <= until and not self._moved.is_set():
                    self._fine = _joined(self._fine, USUAL_LOADS)
                self._resting.set()


def _joined(one: tuple[float, float], other: tuple[float, float]) -> tuple[float, float]:
    """Return the range that two ranges make together, or `other` where there is a gap between them."""
    if other[0] > one[1] or other[1] < one[0]:
        return other
    return min(one[0], other[0]), max(one[1], other[1])
