"""Progress of a long render, on standard error: a bar on a terminal, a line every tenth elsewhere.

Nothing shows, and rich is not imported, for work that is over within SHOW_AFTER.
"""

from __future__ import annotations

import sys
import threading
import time
from types import TracebackType
from typing import TYPE_CHECKING, Self

if TYPE_CHECKING:
    from rich.progress import Progress as RichProgress
    from rich.progress import TaskID

SHOW_AFTER = 0.5  # s; shorter, and every quick render flickers; longer, and people wonder whether it hangs
WAIT_AFTER = 1.0  # s before work of unknown length says that it goes on, and between two such words
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


class Waiting:
    """Use in a `with`, round work whose length nobody knows: after WAIT_AFTER it says, each second, how long it takes.

    wanted: as for `Progress`. On a terminal one line is written again and again, and gone at the end.
    """

    def __init__(self, label: str, wanted: bool | None) -> None:
        self._label = label
        self._terminal = sys.stderr.isatty()
        self._shown = self._terminal if wanted is None else wanted
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._tell, name="waiting", daemon=True)

    def __enter__(self) -> Self:
        if self._shown:
            self._thread.start()
        return self

    def __exit__(
        self, _kind: type[BaseException] | None, _error: BaseException | None, _trace: TracebackType | None
    ) -> None:
        self._over.set()
        if self._shown:
            self._thread.join()

    def _tell(self) -> None:
        began, told = time.monotonic(), False
        while not self._over.wait(WAIT_AFTER):
            text = f"{_doing(self._label)}: {time.monotonic() - began:.0f} s"
            print(f"\r{text}\x1b[K" if self._terminal else text, end="" if self._terminal else "\n", file=sys.stderr)
            sys.stderr.flush()
            told = True
        if told and self._terminal:
            print("\r\x1b[K", end="", file=sys.stderr)


def _doing(label: str) -> str:
    """Return what takes the time: compiling, while that is so."""
    start_up = sys.modules.get("synth.plan.process_start")  # known once there is anything to wait for
    if start_up is not None and start_up.compiling():
        return f"{label} (compiling, once on this machine)"
    return label
