"""Progress on standard error: a bar on a terminal, elsewhere a line per tenth.

Work that ends within SHOW_AFTER shows nothing and does not import rich.
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

SHOW_AFTER = 0.5  # s; if shorter, quick renders flicker; if longer, a render seems to hang
WAIT_AFTER = 1.0  # s before the first message on work of unknown length, and between messages
LINES = 10  # lines in total without a terminal; more would fill a log


class Progress:
    """A context manager that shows progress; `advance` reports it. A bar on a terminal is removed at the end."""

    def __init__(self, label: str, total: float, unit: str, wanted: bool | None) -> None:
        """Count to `total` in `unit`. wanted: True shows at once, False never, None only on a terminal."""
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
        """Report that `amount` more is done."""
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
    """A context manager for work of unknown length: after WAIT_AFTER it shows the elapsed time, once per second.

    wanted: as for `Progress`. On a terminal one line is updated, and removed at the end.
    """

    def __init__(self, label: str, wanted: bool | None) -> None:
        self._label = label
        self._terminal = sys.stderr.isatty()
        self._shown = self._terminal if wanted is None else wanted
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._show, name="waiting", daemon=True)

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

    def _show(self) -> None:
        began, shown = time.monotonic(), False
        while not self._over.wait(WAIT_AFTER):
            text = f"{_with_compiling(self._label)}: {time.monotonic() - began:.0f} s"
            print(f"\r{text}\x1b[K" if self._terminal else text, end="" if self._terminal else "\n", file=sys.stderr)
            sys.stderr.flush()
            shown = True
        if shown and self._terminal:
            print("\r\x1b[K", end="", file=sys.stderr)


def _with_compiling(label: str) -> str:
    """Return the label, with a note while kernels are compiled."""
    start_up = sys.modules.get("synth.plan.process_start")  # imported before the wait begins
    if start_up is not None and start_up.compiling():
        return f"{label} (compiling, once on this machine)"
    return label
