"""The changes of the scene that a live stream requested, so that a broken connection loses none.

A change replaces an earlier one that names the same fields: a dragged slider is one change. After a break, changes that
the service did not answer are sent again; merging a partial scene twice is the same as merging it once. A new session
gets every change that was not refused, in order.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

Shape = tuple[tuple[str, ...], ...]
Partial = Mapping[str, Any]


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
    """The changes of one stream: to be sent, sent but unanswered, and all that apply."""

    def __init__(self) -> None:
        self._waiting: dict[Shape, Partial] = {}
        self._unanswered: dict[Shape, Partial] = {}
        self._applying: dict[Shape, Partial] = {}

    def ask(self, partial: Partial) -> None:
        """Add a change."""
        for kept in (self._waiting, self._applying):
            kept.pop(shape_of(partial), None)
            kept[shape_of(partial)] = partial

    def next_to_send(self) -> Partial | None:
        """Return the next change and mark it as sent; None if there is none."""
        if not self._waiting:
            return None
        shape, partial = next(iter(self._waiting.items()))
        del self._waiting[shape]
        self._unanswered.pop(shape, None)
        self._unanswered[shape] = partial
        return partial

    def answered(self) -> None:
        """Note that the service accepted the oldest unanswered change."""
        self._oldest()

    def refused(self) -> None:
        """Note that the service refused the oldest unanswered change."""
        oldest = self._oldest()
        if oldest is not None and self._applying.get(oldest[0]) is oldest[1]:
            del self._applying[oldest[0]]

    def resume(self) -> None:
        """Prepare for a connection that resumes the session."""
        self._waiting, self._unanswered = {**self._unanswered, **self._waiting}, {}

    def begin_new_session(self) -> None:
        """Prepare for a new session, which has none of the changes."""
        self._waiting, self._unanswered = dict(self._applying), {}

    def _oldest(self) -> tuple[Shape, Partial] | None:
        if not self._unanswered:
            return None
        shape = next(iter(self._unanswered))
        return shape, self._unanswered.pop(shape)
