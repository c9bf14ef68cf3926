"""A thread that solves rows of load ahead of hands, so that a live voice never waits for them.

Stage   3 (VOICE), beside it.
Model   First the usual range of loads, coarsely; then, finely, the loads where hands are, one after another, and more
        and more round them while no other hand asks; then, for fingers that lift, all that is lighter. A hand that
        moves on is followed at once; hands that rest cost nothing. A row is solved without the GIL, and what is fine in
        half of the time only, so that streams keep theirs. The thread lives while somebody follows.
Source  HAND_LOADS: `hand`.
Limits  what plays until a row is ready is the nearest one: on a slow machine a fast press sounds late in its load, and
        with many hands that press differently each waits for those before it. Rows are fine only where a hand keeps its
        load (`synth/voice/moving.py`): under a load that trembles by more than 0.1 % they stay coarse.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from time import monotonic

from synth.plan.usual_hand import HAND_LOADS
from synth.response.load_rows import COARSE, FINEST, PASSING, Rows

NEIGHBOURHOOD = 1.1  # the octave of a load this much higher or lower is solved too, before the hand is there
ROUND = (1.003, 1.03)  # how far round the hand's load rows are made fine, in turn
LONGEST_REST = 0.1  # s between two intervals; the rows of a scene that is very slow to solve come late enough
MOVED = 1.001  # a load no further than this from the one that is worked at needs nothing new: a hand that is still

Stop = Callable[[], bool]


class Followed:
    """One hand that a solver follows.

    calm: the loads (N) between which it calls for nothing new; beyond them, tell `now_at`. fine: the loads
    between which it may use fine rows, which are solved, with what is built of them.
    """

    def __init__(self, solver: RowSolver, load: float) -> None:
        self._solver = solver
        self.load = load
        self.calm = (load / MOVED, load * MOVED)
        self.fine = (0.0, 0.0)

    @property
    def solver(self) -> RowSolver:
        """Who solves for it."""
        return self._solver

    def now_at(self, load: float) -> None:
        """Tell where the hand is (N)."""
        if not self.calm[0] <= load <= self.calm[1]:
            self.calm = (load / MOVED, load * MOVED)
            self.load = load
            self._solver.ask(self)

    def leave(self, *, wait: bool = True) -> None:
        """Be followed no more; the last to leave ends the thread after the row that it is at, and may wait for that."""
        self._solver.leave(self, wait=wait)


class RowSolver:
    """Solves `rows` for the hands that it follows, in a thread of its own."""

    def __init__(
        self,
        rows: Rows,
        build: Callable[[float, float], None] = lambda low, high: None,
        solve_usual: Callable[[Stop], None] | None = None,
    ) -> None:
        """build: makes what hands need of the rows between two loads (N). solve_usual: solves HAND_LOADS, in the order
        that suits the scene, until it is told to stop.
        """
        self._rows, self._build = rows, build
        self._solve_usual = solve_usual or (lambda stop: rows.cover(*HAND_LOADS, COARSE, stop))
        self._hands: set[Followed] = set()
        self._asking: deque[Followed] = deque()
        self._usual, self._resting = threading.Event(), threading.Event()
        self._changed = threading.Condition()
        self._thread: threading.Thread | None = None
        self._worked_from = 0.0

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
        self._worked_from = monotonic()
        self._solve_usual(self._left)
        if not self._left():
            self._usual.set()
        light = False
        while self._goes_on():
            hand = self._next(wait=light)
            if hand is not None:
                self._solve_round(hand)
            elif not light:
                self._rows.cover(0.0, HAND_LOADS[0], PASSING, self._wanted_elsewhere)
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
            self._worked_from = monotonic()
            return self._asking.popleft() if self._asking else None

    def _left(self) -> bool:
        return not self._hands

    def _wanted_elsewhere(self) -> bool:
        self._rest()
        return bool(self._asking) or not self._hands

    def _rested_and_left(self) -> bool:
        self._rest()
        return self._left()

    def _rest(self) -> None:
        """Leave the processor to others for as long as it was used since the last time, LONGEST_REST at most."""
        with self._changed:
            if self._hands:
                self._changed.wait(min(monotonic() - self._worked_from, LONGEST_REST))
        self._worked_from = monotonic()

    def _solve_round(self, hand: Followed) -> None:
        load = hand.load
        self._rows.cover(load / NEIGHBOURHOOD, load * NEIGHBOURHOOD, COARSE, self._left)
        self._rows.cover(load, load, FINEST, self._rested_and_left)
        self._build(load / MOVED, load * MOVED)
        hand.fine = (load / MOVED, load * MOVED)
        for reach in ROUND:
            self._rows.cover(load / reach, load * reach, FINEST, self._wanted_elsewhere)
