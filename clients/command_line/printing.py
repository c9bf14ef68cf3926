"""Prints results on standard output, as tables or as JSON, and messages on standard error."""

from __future__ import annotations

import io
import json
import os
import sys
from collections.abc import Collection, Iterable, Sequence
from typing import TextIO

WIDTH = 120  # columns without a terminal: a file or a pager gets the same table every time


def open_closed_streams() -> None:
    """Open standard streams that the caller has closed, so that no other file gets their descriptors.

    Standard input cannot be read then, standard output cannot be written, and messages are discarded.
    """
    for name, mode, flags in (("stdin", "r", os.O_WRONLY), ("stdout", "w", os.O_RDONLY), ("stderr", "w", os.O_WRONLY)):
        if getattr(sys, name) is None:
            descriptor = os.open(os.devnull, flags)  # the lowest free one, which is that of the stream
            os.set_inheritable(descriptor, True)
            setattr(sys, name, os.fdopen(descriptor, mode, encoding="utf-8", closefd=False))


def print_every_character() -> None:
    """Let standard output write characters that its encoding lacks as escapes, as standard error does."""
    if isinstance(sys.stdout, io.TextIOWrapper) and sys.stdout.errors == "strict":
        sys.stdout.reconfigure(errors="backslashreplace")  # an escape of a surrogate is valid in JSON, too


def print_table(
    title: str, columns: Sequence[str], rows: Iterable[Sequence[str] | None], *, numbers: Collection[str] = ()
) -> None:
    """Print `rows` under `columns`, with a title unless it is empty; long cells wrap. Cells are text, never markup.

    rows: None is a line between two groups. numbers: the columns that are aligned to the right.
    """
    from rich import box
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False)
    for column in columns:
        table.add_column(column, overflow="fold", justify="right" if column in numbers else "left")
    for row in rows:
        if row is None:
            table.add_section()
        else:
            table.add_row(*(Text(cell) for cell in row))
    console = Console(file=sys.stdout, width=None if sys.stdout.isatty() else WIDTH)
    if title:
        console.print(Text(title, style="bold"))
    console.print(table)
    if title:
        console.print()


def print_json(document: object, place: TextIO | None = None) -> None:
    """Print a result as indented JSON; raises ValueError for NaN and infinities, which are bugs.

    place: stream to print on; None is standard output.
    """
    print(json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False), file=place)


def say(text: str) -> None:
    """Print a message on standard error."""
    print(f"ridgewave: {text}", file=sys.stderr)


def warn(text: str) -> None:
    """Print a warning on standard error."""
    say(f"warning: {text}")
