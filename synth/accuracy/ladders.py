"""Which sizes of the obvious way a report of accuracy measures: as few as show where it meets the tolerance.

Model   A ladder is a method with a rising number of points a ridge; ladders of a kind have a rising number of solutions
        (frames oversampled, or phases of a table). A ladder ends where it meets the tolerance, or where doubling the
        points twice has brought it no nearer. The next one begins where this one's points stopped to gain.
"""

from __future__ import annotations

from itertools import pairwise

STALLED = 0.7  # of the error before: what is left of an error that more points do not lower any more
RUNGS = 3  # rungs without a gain: a chance cancellation at one of them does not end a ladder


class Ladders:
    """The rungs measured so far."""

    def __init__(self, tolerance: float) -> None:
        self._tolerance = tolerance
        self._errors: dict[str, dict[int, float]] = {}
        self._ended: dict[str, str] = {}

    def skips(self, ladder: str, points: int, below: str) -> bool:
        """Return whether this rung shows nothing new. below: name of the ladder with fewer solutions, or ""."""
        return ladder in self._ended or points < self._first(below)

    def take(self, ladder: str, points: int, error: float) -> str:
        """Take note of the error of a rung; return why the ladder ends here, or ""."""
        errors = self._errors.setdefault(ladder, {})
        errors[points] = error
        last = list(errors.values())[-RUNGS:]
        if error <= self._tolerance:
            self._ended[ladder] = f"Fewer points meet the tolerance of {self._tolerance:.2g}."
        elif len(last) == RUNGS and _stalled(last):
            self._ended[ladder] = f"More points come no nearer than {error:.1e}: the rest comes of too few solutions."
        return self._ended.get(ladder, "")

    def end(self, ladder: str, reason: str) -> None:
        """End a ladder whose next rung takes too long."""
        self._ended[ladder] = reason

    def _first(self, ladder: str) -> int:
        """Return the fewest points that the ladder above `ladder` begins with."""
        errors = self._errors.get(ladder, {})
        if not errors:
            return 0
        last = list(errors.items())[-RUNGS:]
        stalled = len(last) == RUNGS and _stalled([error for _, error in last])
        return last[0 if stalled else -1][0]


def _stalled(errors: list[float]) -> bool:
    return all(after > STALLED * before for before, after in pairwise(errors))
