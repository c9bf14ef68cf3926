"""The changes of the scene that a live stream requested, so that a broken connection loses none.

A change that waits replaces an earlier one that waits and names the same fields: a dragged slider is one change. After
a break, changes that the service did not answer are sent again; merging a partial scene twice is the same as merging
it once. A new session gets every change that was not refused, in order.

Limits: the service answers changes that it applied together once, and does not say which change it refused. A refusal
is that of the newest unanswered change that names one of the refused fields. If none does, no change is taken to be
refused; in a new session it is refused again.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

Shape = tuple[tuple[str, ...], ...]
Partial = Mapping[str, Any]

UNANSWERED = 64  # sent changes that may still be refused; older ones count as accepted


def shape_of(partial: Partial) -> Shape:
    """Return the paths of the fields that `partial` names."""
    return tuple(sorted(_paths(partial, ())))


def _paths(partial: Partial, root: tuple[str, ...]) -> Iterator[tuple[str, ...]]:
    for name, value in partial.items():
        if isinstance(value, Mapping) and value:
            yield from _paths(value, (*root, name))
        else:
            yield (*root, name)


class Changes:
    """The changes of one stream: to be sent, sent but unanswered, and accepted."""

    def __init__(self) -> None:
        self._waiting: list[Partial] = []
        self._unanswered: deque[Partial] = deque()
        self._accepted: list[Partial] = []

    def ask(self, partial: Partial) -> None:
        """Add a change."""
        self._waiting = [*_of_other_fields(self._waiting, partial), partial]

    @property
    def waits(self) -> bool:
        """Return whether a change is to be sent."""
        return bool(self._waiting)

    def next_to_send(self) -> Partial | None:
        """Return the next change and mark it as sent; None if there is none."""
        if not self._waiting:
            return None
        self._unanswered.append(self._waiting.pop(0))
        partial = self._unanswered[-1]
        if len(self._unanswered) > UNANSWERED:
            self.answered()
        return partial

    def answered(self) -> None:
        """Note that the service accepted the oldest unanswered change."""
        if self._unanswered:
            partial = self._unanswered.popleft()
            self._accepted = [*_of_other_fields(self._accepted, partial), partial]

    def refused(self, pointers: Iterable[str]) -> None:
        """Note that the service refused the fields at `pointers`."""
        refused = [tuple(pointer.split("/")[1:]) for pointer in pointers]
        for place in reversed(range(len(self._unanswered))):
            if len(self._unanswered) == 1 or _names(self._unanswered[place], refused):
                del self._unanswered[place]
                return

    def resume(self) -> None:
        """Prepare for a connection that resumes the session."""
        self._waiting = [*self._unanswered, *self._waiting]
        self._unanswered.clear()

    def begin_new_session(self) -> None:
        """Prepare for a new session, which has none of the changes."""
        self.resume()
        self._waiting, self._accepted = [*self._accepted, *self._waiting], []


def _of_other_fields(changes: Iterable[Partial], partial: Partial) -> list[Partial]:
    """Return those of `changes` that do not name the same fields as `partial`."""
    shape = shape_of(partial)
    return [change for change in changes if shape_of(change) != shape]


def _names(partial: Partial, refused: Iterable[tuple[str, ...]]) -> bool:
    """Return whether `partial` names one of the fields in `refused`, a part of one, or what holds one."""
    return any(path[: len(other)] == other[: len(path)] for path in _paths(partial, ()) for other in refused if other)
