"""The changes of the scene that a live stream was asked for, so that a broken connection loses none.

Model: a change that names the same fields as an earlier one takes its place (a slider is one change, however long it is
    dragged). What the service has not answered when the connection breaks is said again: a partial scene merged twice
    is the scene merged once. A new session is told everything that was not refused, in order.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

Shape = tuple[tuple[str, ...], ...]
Partial = Mapping[str, Any]


def shape_of(partial: Partial) -> Shape:
    """Return the fields that `partial` names, each as its path."""
    return tuple(sorted(_paths(partial, ())))


def _paths(partial: Partial, root: tuple[str, ...]) -> Iterator[tuple[str, ...]]:
    for name, value in partial.items():
        if isinstance(value, Mapping) and value:
            yield from _paths(value, (*root, name))
        else:
            yield (*root, name)


class Changes:
    """Changes of one stream: to be sent, sent and not answered, and all that hold."""

    def __init__(self) -> None:
        self._waiting: dict[Shape, Partial] = {}
        self._unanswered: dict[Shape, Partial] = {}
        self._holding: dict[Shape, Partial] = {}

    def ask(self, partial: Partial) -> None:
        """Take a change."""
        for kept in (self._waiting, self._holding):
            kept.pop(shape_of(partial), None)
            kept[shape_of(partial)] = partial

    def next_to_send(self) -> Partial | None:
        """Return the next change to send, which counts as sent; None where there is none."""
        if not self._waiting:
            return None
        shape, partial = next(iter(self._waiting.items()))
        del self._waiting[shape]
        self._unanswered.pop(shape, None)
        self._unanswered[shape] = partial
        return partial

    def answered(self) -> None:
        """Note that the service took the oldest change that it had not answered."""
        self._oldest()

    def refused(self) -> None:
        """Note that the service refused it."""
        oldest = self._oldest()
        if oldest is not None and self._holding.get(oldest[0]) is oldest[1]:
            del self._holding[oldest[0]]

    def resume(self) -> None:
        """Prepare for a connection that goes on with the session."""
        self._waiting, self._unanswered = {**self._unanswered, **self._waiting}, {}

    def begin_anew(self) -> None:
        """Prepare for a session that knows none of the changes."""
        self._waiting, self._unanswered = dict(self._holding), {}

    def _oldest(self) -> tuple[Shape, Partial] | None:
        if not self._unanswered:
            return None
        shape = next(iter(self._unanswered))
        return shape, self._unanswered.pop(shape)
