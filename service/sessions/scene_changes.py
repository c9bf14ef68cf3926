"""Changes of a session's scene, as they come: those that wait are merged, and solved together.

Model: while one change is solved, partial scenes wait; all that wait are then merged in the order in which they came
    (`merged`), and what comes out is solved once. So the last is always applied, at most one solve later. One that is
    refused leaves the others be: where the sum of several cannot be solved, its halves are tried.
Limits: what waits has a bound of bytes, beyond which the oldest goes: the newest wins.
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

WAITING_BYTES = 1 << 18  # of a session: thousands of knobs turned, or four messages of the largest size

Patch = Mapping[str, Any]
Refusal = RidgewaveError | Problem


@dataclass(frozen=True, slots=True)
class Waiting:
    """One partial scene. read: returns it. settle: told why it was refused; None: it is applied."""

    read: Callable[[], Patch]
    size: int
    settle: Callable[[Exception | None], None]


class Changes:
    """The changes of one session. apply: does all of a batch, and settles each of it."""

    def __init__(self, apply: Callable[[Sequence[Waiting]], Awaitable[None]]) -> None:
        self._apply = apply
        self._waiting: deque[Waiting] = deque()
        self._bytes = 0
        self._task: asyncio.Task[None] | None = None

    def add(self, change: Waiting) -> None:
        """Have `change` applied, together with those that wait already."""
        self._waiting.append(change)
        self._bytes += change.size
        while self._bytes > WAITING_BYTES and len(self._waiting) > 1:
            oldest = self._waiting.popleft()
            self._bytes -= oldest.size
            detail = "Newer changes of the scene came while one was solved: this one is dropped."
            oldest.settle(Problem("too-fast", detail))
        if self._task is None:
            self._task = asyncio.get_running_loop().create_task(self._work())

    def drop(self) -> None:
        """Forget what waits: whoever asked for it has gone."""
        self._waiting.clear()
        self._bytes = 0

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
    """What a batch came to: the scene and what `prepare` made of it, None where all was refused; why, by its place."""

    coming: tuple[Scene, Any] | None
    refused: Mapping[int, Refusal]


def merged(
    scene: Scene,
    batch: Sequence[Waiting],
    change: Callable[[Scene, Patch], Scene],
    prepare: Callable[[Scene], Any],
) -> Merged:
    """Return `scene` with all of `batch`, solved; for a thread.

    change: merges one partial scene; prepare: solves. Both raise RidgewaveError or Problem for what they refuse.
    """
    refused: dict[int, Refusal] = {}
    coming: tuple[Scene, Any] | None = None

    def take(places: Sequence[int]) -> None:
        """Solve the changes at `places` together; where that is refused, the halves of them."""
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
