"""`ridgewave accuracy SCENE [-o DIR]`: what accuracy costs in time, as a table, as JSON, and as a figure in DIR.

Model: the figure needs the extra `plots`, so whether it is there, and whether DIR can be written, is found out before
    the measuring, which takes up to a minute. Without -o matplotlib is never imported.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from clients.accuracy_series import FAMILIES, Document, Row, in_words, rest_of, series_of, start_in_words
from clients.outcome import DONE, print_json, say
from clients.output_folder import opened_folder
from clients.progress import Progress
from clients.scene_argument import read_scene
from clients.tables import print_table
from clients.target import replaces
from synth.accuracy.report import measure_accuracy
from synth.errors import CannotRender
from synth.plan.process_start import begun

DOCUMENT = "accuracy.json"
FILES = (DOCUMENT, "accuracy.svg", "accuracy.png")
NO_PLOTS = (
    "cannot draw the figures: matplotlib is not installed. Run: pip install 'ridgewave[plots]', or leave out -o: "
    "--json prints what the figures show."
)
ON_FRONT, CHOSEN = "*", "<"
NOTHING = "-"
POINTS = " points a ridge"  # "points" stands in the heading: the rows would wrap
COLUMNS = (
    "", "method", "max\nerror", "rms\nerror", "error", "harm.\ndB", "margin\ndB",
    "set-up", "per\nsecond", "x real\ntime", "memory",
)  # fmt: skip


def run(arguments: argparse.Namespace) -> int:
    """Carry out the command; raises InvalidRequest, CannotRender, OSError."""
    begun()  # before matplotlib is imported: it is no part of what a render takes
    scene = read_scene(arguments)
    replaced = []
    if arguments.output is not None:
        replaced = [name for name in FILES if replaces(Path(arguments.output) / name, arguments.no_clobber)]
    with _folder(arguments.output) as write:
        with _progress(arguments.progress) as told:
            document = measure_accuracy(scene, quantity=arguments.quantity, progress=told).document()
        if write is not None:
            write(document)
    if arguments.json:
        print_json(document)
    else:
        print_accuracy(arguments.scene, document)
        if write is not None:
            print(f"Written to {arguments.output}: {', '.join(FILES)}")
    if replaced and not arguments.json:
        say(f"replaced {', '.join(replaced)} in {arguments.output}; --no-clobber keeps what is there")
    return DONE


def print_accuracy(name: str, document: Document) -> None:
    """Print the document for a person to read; name: what the scene is called."""
    extent = in_words(document["peak_to_peak"], document["unit"])
    print(
        f"{name}: {document['quantity']}, peak-to-peak {extent}; timings are medians of {document['repeats']} on this "
        f"machine; threshold: {document['threshold']}\n"
    )
    print_table("", COLUMNS, _rows(document), numbers=COLUMNS[2:])
    spread = f"set-up and {document['duration']:g} s of sound together"
    print(f"\n{ON_FRONT}  on the Pareto front: nothing measured is both nearer and cheaper, {spread}")
    print(f"{CHOSEN}  what the plan of this scene takes: {document['chosen']}")
    print(f"0 and {NOTHING}: no error, to round-off")
    print("points: a ridge; tabled: one period, of so many phases, solved once and kept as a table")
    print(start_in_words(document))
    for left in document["left_out"]:
        print(f"Left out: {left['method']}. {left['reason']}")


def _rows(document: Document) -> Iterator[tuple[str, ...] | None]:
    """Yield a heading for each family, and a row for each of its methods; None stands between two families."""
    family = ""
    for series in series_of(document):
        if family != series.family:
            if family:
                yield None
            heading = FAMILIES.get(series.family, series.family)
            heading += " (points)" if POINTS in series.rows[0]["method"] else ""
            yield ("", heading, *([""] * (len(COLUMNS) - 2)))
        family = series.family
        yield from (_cells(document, row) for row in series.rows)


def _cells(document: Document, row: Row) -> tuple[str, ...]:
    chosen = row["method"] == document["chosen"]
    return (
        (ON_FRONT if row["pareto"] else "") + (CHOSEN if chosen else ""),
        "  " + _shown(row["method"]),
        _share(row["max_error"]),
        _share(row["rms_error"]),
        in_words(row["error_m"], "m") if row["error_m"] else "0",
        _decibels(row["worst_harmonic_db"]),
        _decibels(row["threshold_margin_db"]),
        in_words(row["setup_seconds"], "s"),
        in_words(row["seconds_per_second"], "s"),
        _times(row["times_real_time"]),
        _bytes(row["memory_bytes"]),
    )


def _shown(method: str) -> str:
    """Return what tells a method from others of its family, short enough for its column."""
    rest = rest_of(method)
    return rest.replace(POINTS, "").replace(" phases", "") if POINTS in rest else rest


def _share(error: float) -> str:
    return f"{error:.1e}" if error else "0"


def _decibels(level: float | None) -> str:
    return NOTHING if level is None else f"{level:.0f}"


def _times(times: float | None) -> str:
    return NOTHING if times is None else f"{times:.3g}" if times < 1000 else f"{times:.0f}"


def _bytes(count: int) -> str:
    power = min(3, int(math.log(count, 1000)) if count else 0)
    return f"{count / 1000**power:.3g} {('B', 'kB', 'MB', 'GB')[power]}"


@contextlib.contextmanager
def _folder(output: str | None) -> Iterator[Callable[[Document], None] | None]:
    """Yield what writes the files into the folder that -o names, all of them; None without -o."""
    if output is None:
        yield None
        return
    try:
        from clients.accuracy_plot import drawings
    except ImportError as error:
        raise CannotRender(NO_PLOTS) from error
    with opened_folder(Path(output), FILES) as folder:

        def write(document: Document) -> None:
            text = json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
            folder.write({DOCUMENT: text.encode(), **drawings(document)})

        yield write


@contextlib.contextmanager
def _progress(wanted: bool | None) -> Iterator[Callable[[str, int, int], None]]:
    """Yield what the measuring reports to: (method, how many are done, of how many)."""
    with contextlib.ExitStack() as stack:
        bars: list[Any] = []
        reached = 0

        def told(_method: str, done: int, of: int) -> None:
            nonlocal reached
            if not bars:
                bars.append(stack.enter_context(Progress("measuring", of, "methods", wanted)))
            bars[0].advance(done - reached)
            reached = done

        yield told
