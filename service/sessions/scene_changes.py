"""Merges the changes of a session's scene that arrive while one is being solved.

Model: waiting partial scenes are merged in order of arrival, and the result is solved once (`merged`). So the last
    change is applied at most one solve later. A refused change does not affect the others: if several cannot be solved
    together, each half of them is tried.
Limits: beyond WAITING_BYTES the oldest waiting change is dropped. A live connection is not read before that.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from service.problems import Problem
from synth.errors import RidgewaveError
from synth.scene.scene import Scene

WAITING_BYTES = 1 << 18  # per session: thousands of small changes, or four messages of the largest size

Patch = Mapping[str, Any]
Refusal = RidgewaveError | Problem


@dataclass(frozen=True, slots=True)
class Waiting:
    """One waiting change.

    read: returns the partial scene.
    size: of its text, in bytes.
    settle: called with the reason of the refusal, or with None once the change is applied.
    """

    read: Callable[[], Patch]
    size: int
    settle: Callable[[Exception | None], None]


class Changes:
    """The changes of one session.

    apply: applies a batch and settles each change of it.
    waiting_bytes: of the waiting changes.
    """

    def __init__(self, apply: Callable[[Sequence[Waiting]], Awaitable[None]]) -> None:
        self._apply = apply
        self._waiting: deque[Waiting] = deque()
        self.waiting_bytes = 0
        self._task: asyncio.Task[None] | None = None

    def add(self, change: Waiting) -> None:
        """Apply `change`, together with those that wait already."""
        self._waiting.append(change)
        self.waiting_bytes += change.size
        while self.waiting_bytes > WAITING_BYTES and len(self._waiting) > 1:
            oldest = self._waiting.popleft()
            self.waiting_bytes -= oldest.size
            detail = "This change is dropped: too many newer changes arrived while another one was being solved."
            oldest.settle(Problem("too-fast", detail))
        if self._task is None:
            self._task = asyncio.get_running_loop().create_task(self._work())

    def drop(self) -> None:
        """Drop the waiting changes, whose sender is gone."""
        self._waiting.clear()
        self.waiting_bytes = 0

    async def _work(self) -> None:
        try:
            while self._waiting:
                batch = list(self._waiting)
                self.drop()
                try:
                    await self._apply(batch)
                except Exception as error:
                    for change in batch:
                        change.settle(error)
        finally:
            self._task = None


@dataclass(frozen=True, slots=True)
class Merged:
    """The result of a batch.

    coming: the scene, and what `prepare` returned for it; None if every change was refused.
    refused: the reason of each refusal, by index in the batch.
    """

    coming: tuple[Scene, Any] | None
    refused: Mapping[int, Refusal]


def merged(
    scene: Scene,
    batch: Sequence[Waiting],
    change: Callable[[Scene, Patch], Scene],
    prepare: Callable[[Scene], Any],
) -> Merged:
    """Return `scene` with all changes of `batch`, solved. Slow: call it from a thread.

    change: merges one partial scene. prepare: solves a scene. Both raise RidgewaveError or Problem to refuse.
    """
    refused: dict[int, Refusal] = {}
    coming: tuple[Scene, Any] | None = None

    def take(places: Sequence[int]) -> None:
        """Solve the changes at `places` together; if that is refused, try each half of them."""
        nonlocal coming
        target, kept = scene if coming is None else coming[0], []
        for place in places:
            try:
                target = change(target, batch[place].read())
                kept.append(place)
            except (RidgewaveError, Problem) as error:
                refused[place] = error
        if not kept:
            return
        try:
            coming = (target, prepare(target))
        except (RidgewaveError, Problem) as error:
            if len(kept) == 1:
                refused[kept[0]] = error
                return
            take(kept[: len(kept) // 2])
            take(kept[len(kept) // 2 :])

    take(range(len(batch)))
    return Merged(coming, refused)
