"""A thread that solves rows of load ahead of a hand, so that a live voice never waits for them.

Stage   3 (VOICE), beside it.
Model   First the usual range of loads, coarsely; then, wherever the hand is, the octaves round its load: coarse where
        they are missing, fine where they are coarse. A row is solved without the GIL.
Source  USUAL_LOADS: the loads at which roughness is usefully perceived, 0.05 to 1.8 N (Fagiani & Barbieri, 2016,
        section 2).
Limits  what plays until a row is ready is the nearest one: on a slow machine a fast press sounds late in its load.
"""

from __future__ import annotations

import threading

from synth.contact.rows import COARSE, Rows

USUAL_LOADS = (0.05, 1.8)  # N
FINE = 1.0 / 128.0  # of an octave, where the hand rests
NEIGHBOURHOOD = 1.1  # the octave of a load this much higher or lower is solved too, before the hand is there


class RowSolver:
    """Solves `rows` in a thread of its own, which ends with `stop` or with the program."""

    def __init__(self, rows: Rows, load: float) -> None:
        self._rows = rows
        self._load = load
        self._low, self._high = rows.bounds(rows.octave(load))
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
        """Tell where the hand is (N). Costs nothing while it stays in its octave."""
        if not self._low <= load < self._high:
            self._load = load
            self._low, self._high = self._rows.bounds(self._rows.octave(load))
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
            self._rows.cover(load, load, FINE, stopped)
