"""A thread that solves rows of load ahead of a hand, so that a live voice never waits for them.

Stage   3 (VOICE), beside it.
Model   First the usual range of loads, coarsely; then finely: the load where the hand is, more and more round it, and
        the usual range. A hand that moves on is followed at once. A row is solved without the GIL.
Source  USUAL_LOADS: the loads at which roughness is usefully perceived, 0.05 to 1.8 N (Fagiani & Barbieri, 2016,
        section 2).
Limits  what plays until a row is ready is the nearest one: on a slow machine a fast press sounds late in its load.
"""

from __future__ import annotations

import threading

from synth.contact.rows import COARSE, FINEST, Rows

USUAL_LOADS = (0.05, 1.8)  # N
NEIGHBOURHOOD = 1.1  # the octave of a load this much higher or lower is solved too, before the hand is there
MOVED = 1.02  # a load this much higher or lower than the last is a new one
ROUND = (1.0, 1.05, 1.25)  # how far round the hand's load rows are made fine, in turn


class RowSolver:
    """Solves `rows` in a thread of its own, which ends with `stop` or with the program."""

    def __init__(self, rows: Rows, load: float) -> None:
        self._rows = rows
        self._load = load
        self._low, self._high = load / MOVED, load * MOVED
        self._usual = threading.Event()
        self._ended = threading.Event()
        self._moved = threading.Event()
        self._moved.set()
        self._thread = threading.Thread(target=self._run, name="ridgewave-rows", daemon=True)
        self._thread.start()

    @property
    def usual_range_ready(self) -> bool:
        """True when the usual range of loads is solved."""
        return self._usual.is_set()

    def wait(self, seconds: float) -> bool:
        """Wait until the usual range of loads is solved, `seconds` at most; return whether it is."""
        return self._usual.wait(seconds)

    def now_at(self, load: float) -> None:
        """Tell where the hand is (N). Costs nothing while it rests."""
        if not self._low <= load <= self._high:
            self._load = load
            self._low, self._high = load / MOVED, load * MOVED
            self._moved.set()

    def stop(self) -> None:
        """End the thread after the row that it is at."""
        self._ended.set()
        self._moved.set()
        self._thread.join()

    def _run(self) -> None:
        stopped = self._ended.is_set
        self._rows.cover(*USUAL_LOADS, COARSE, stopped)
        if not stopped():
            self._usual.set()
        while not stopped():
            self._moved.wait()
            self._moved.clear()
            load = self._load
            self._rows.cover(load / NEIGHBOURHOOD, load * NEIGHBOURHOOD, COARSE, stopped)
            for reach in ROUND:
                self._rows.cover(load / reach, load * reach, FINEST, self._moved.is_set)
            self._rows.cover(*USUAL_LOADS, FINEST, self._moved.is_set)
