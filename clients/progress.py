"""Progress of a long render, on standard error: a bar on a terminal, a line every tenth elsewhere.

Nothing shows, and rich is not imported, for work that is over within SHOW_AFTER.
"""

from __future__ import annotations

import sys
import time
from types import TracebackType
from typing import TYPE_CHECKING, Self

if TYPE_CHECKING:
    from rich.progress import Progress as RichProgress
    from rich.progress import TaskID

SHOW_AFTER = 0.5  # s; shorter, and every quick render flickers; longer, and people wonder whether it hangs
LINES = 10  # lines in all where there is no terminal; many more would drown a log


class Progress:
    """Use in a `with`; `advance` says how much more is done. What was shown on a terminal is gone at the end."""

    def __init__(self, label: str, total: float, unit: str, wanted: bool | None) -> None:
        """Count up to `total` of `unit`; wanted: True at once, False never, None only on a terminal."""
        self._label, self._total, self._unit = label, total, unit
        self._terminal = sys.stderr.isatty()
        self._shown = self._terminal if wanted is None else wanted
        self._show_at = time.monotonic() + (0.0 if wanted else SHOW_AFTER)
        self._done = 0.0
        self._lines = 0
        self._bar: tuple[RichProgress, TaskID] | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, _kind: type[BaseException] | None, _error: BaseException | None, _trace: TracebackType | None
    ) -> None:
        if self._bar is not None:
            self._bar[0].stop()

    def advance(self, amount: float) -> None:
        """Say that `amount` more is done."""
        self._done += amount
        if not self._shown:
            return
        if not self._terminal:
            self._print_line()
        elif self._bar is not None or time.monotonic() >= self._show_at:
            rich, task = self._started_bar()
            rich.update(task, completed=self._done)

    def _started_bar(self) -> tuple[RichProgress, TaskID]:
        if self._bar is None:
            from rich.console import Console
            from rich.progress import Progress as RichProgress

            rich = RichProgress(console=Console(stderr=True), transient=True)
            rich.start()
            self._bar = rich, rich.add_task(self._label, total=self._total)
        return self._bar

    def _print_line(self) -> None:
        reached = int(LINES * min(self._done / self._total, 1.0)) if self._total > 0 else LINES
        if reached > self._lines:
            self._lines = reached
            share = f"{100 * reached // LINES} %"
            print(f"{self._label}: {share}, {self._done:.6g} of {self._total:.6g} {self._unit}", file=sys.stderr)
