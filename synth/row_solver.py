"""A thread that solves rows of load ahead of hands, so that a live voice never waits for them.

Stage   3 (VOICE), beside it.
Model   First the usual range of loads, coarsely; then, finely, the loads where hands are, one after another, and more
        and more round them while no other hand asks, and the usual range where that is soon done; then, for fingers
        that lift, all that is lighter. A hand that moves on is followed at once; hands that rest cost nothing. A row is
        solved without the GIL. The thread lives while somebody follows.
Source  USUAL_LOADS: the loads at which roughness is usefully perceived, 0.05 to 1.8 N (Fagiani & Barbieri, 2016,
        section 2).
Limits  what plays until a row is ready is the nearest one: on a slow machine a fast press sounds late in its load, and
        with many hands that press differently each waits for those before it.
"""

from __future__ import annotations

import os
import sys
import threading
from collections import deque
from contextlib import suppress
from time import monotonic

from synth.contact.rows import COARSE, FINEST, PASSING, Rows

USUAL_LOADS = (0.05, 1.8)  # N
NEIGHBOURHOOD = 1.1  # the octave of a load this much higher or lower is solved too, before the hand is there
ROUND = (1.003, 1.03)  # how far round the hand's load rows are made fine, in turn
SOON = 2.0  # s from the start in which the usual range is made fine, if it can be
POLITENESS = 10  # of Linux's 0 to 19: a tenth of a busy core; less and streams are late, more and rows never come
INSIDE = 1.001  # a load this much within the ends of what is fine needs nothing new,
MOVED = 1.001  # nor does one that is no further than this from the load that is worked at: a hand that is still

Range = tuple[float, float]


class Followed:
    """One hand that a solver follows.

    calm: the loads (N) between which it calls for nothing new; beyond them, tell `now_at`.
    """

    def __init__(self, solver: RowSolver, load: float) -> None:
        self._solver = solver
        self.load = load
        self.calm = (load / MOVED, load * MOVED)

    @property
    def solver(self) -> RowSolver:
        """Who solves for it."""
        return self._solver

    def now_at(self, load: float) -> None:
        """Tell where the hand is (N)."""
        fine = self._solver.fine_round(load)
        if fine is not None:
            self.calm = fine
        elif not self.calm[0] <= load <= self.calm[1]:
            self.calm = (load / MOVED, load * MOVED)
            self.load = load
            self._solver.ask(self)

    def leave(self, *, wait: bool = True) -> None:
        """Be followed no more; the last to leave ends the thread after the row that it is at, and may wait for that."""
        self._solver.leave(self, wait=wait)


class RowSolver:
    """Solves `rows` for the hands that it follows, in a thread of its own."""

    def __init__(self, rows: Rows) -> None:
        self._rows = rows
        self._fine: list[Range] = []  # disjoint, rising
        self._hands: set[Followed] = set()
        self._asking: deque[Followed] = deque()
        self._usual, self._resting = threading.Event(), threading.Event()
        self._changed = threading.Condition()
        self._thread: threading.Thread | None = None

    def follow(self, load: float) -> Followed:
        """Return a new hand at `load` (N), with its rows asked for; begins the thread where there is none."""
        hand = Followed(self, load)
        with self._changed:
            self._hands.add(hand)
            self._asking.append(hand)
            self._resting.clear()
            if self._thread is None:
                self._thread = threading.Thread(target=self._run, name="ridgewave-rows", daemon=True)
                self._thread.start()
            self._changed.notify()
        return hand

    def ask(self, hand: Followed) -> None:
        """Have the rows round a hand's load solved."""
        with self._changed:
            if hand in self._hands and hand not in self._asking:
                self._asking.append(hand)
                self._resting.clear()
                self._changed.notify()

    def leave(self, hand: Followed, *, wait: bool = True) -> None:
        """Follow `hand` no more; the last ends the thread, and waits for it unless told not to."""
        with self._changed:
            self._hands.discard(hand)
            if hand in self._asking:
                self._asking.remove(hand)
            thread = self._thread if not self._hands else None
            self._changed.notify()
        while wait and thread is not None and thread.is_alive() and not self._hands:  # one may come while it ends
            thread.join(0.05)

    def fine_round(self, load: float) -> Range | None:
        """Return the loads round `load` (N) that need nothing new, None where it does."""
        for low, high in self._fine:
            if low * INSIDE <= load <= high / INSIDE:
                return low * INSIDE, high / INSIDE
        return None

    @property
    def usual_range_ready(self) -> bool:
        """True when the usual range of loads is solved."""
        return self._usual.is_set()

    @property
    def resting(self) -> bool:
        """True when the rows round the hands are solved too, and nothing is left to do until one moves on."""
        return self._resting.is_set()

    def wait(self, seconds: float) -> bool:
        """Wait until the usual range of loads is solved, `seconds` at most; return whether it is."""
        return self._usual.wait(seconds)

    def _run(self) -> None:
        _let_others_first()
        until = monotonic() + SOON
        self._rows.cover(*USUAL_LOADS, COARSE, self._left)
        if not self._left():
            self._usual.set()
        light = False
        while self._goes_on():
            hand = self._next(wait=light)
            if hand is not None:
                self._solve_round(hand.load, until)
            elif not light:
                self._rows.cover(0.0, USUAL_LOADS[0], PASSING, self._wanted_elsewhere)
                light = not self._wanted_elsewhere()

    def _goes_on(self) -> bool:
        """Return whether anybody is left; where nobody is, the next to come begins another thread."""
        with self._changed:
            if not self._hands:
                self._thread = None
            return bool(self._hands)

    def _next(self, *, wait: bool) -> Followed | None:
        """Return the hand that asked first; None where none asks, or, after waiting for one, when all have left."""
        with self._changed:
            while wait and self._hands and not self._asking:
                self._resting.set()
                self._changed.wait()
            return self._asking.popleft() if self._asking else None

    def _left(self) -> bool:
        return not self._hands

    def _wanted_elsewhere(self) -> bool:
        return bool(self._asking) or not self._hands

    def _solve_round(self, load: float, until: float) -> None:
        self._rows.cover(load / NEIGHBOURHOOD, load * NEIGHBOURHOOD, COARSE, self._left)
        self._rows.cover(load, load, FINEST, self._left)
        for reach in ROUND:
            around = load / reach, load * reach
            self._rows.cover(*around, FINEST, self._wanted_elsewhere)
            if self._wanted_elsewhere():
                return
            self._fine = _joined(self._fine, around)
        if monotonic() > until:
            return
        self._rows.cover(*USUAL_LOADS, FINEST, lambda: self._wanted_elsewhere() or monotonic() > until)
        if monotonic() <= until and not self._wanted_elsewhere():
            self._fine = _joined(self._fine, USUAL_LOADS)


def _let_others_first() -> None:
    """Have this thread wait for those that render, where the system knows a priority of threads (Linux)."""
    if sys.platform == "linux":
        with suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), POLITENESS)


def _joined(ranges: list[Range], new: Range) -> list[Range]:
    """Return disjoint ranges that hold `ranges` and `new`."""
    low, high = new
    apart = []
    for one in ranges:
        if one[1] < low or one[0] > high:
            apart.append(one)
        else:
            low, high = min(low, one[0]), max(high, one[1])
    return sorted([*apart, (low, high)])
