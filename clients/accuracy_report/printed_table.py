"""Prints an accuracy document as a table for people."""

from __future__ import annotations

import math
from collections.abc import Iterator

from clients.accuracy_report.method_series import Document, Row, series_of, start_sentence, with_unit
from clients.command_line.printing import print_table

ON_FRONT, CHOSEN, NOTHING = "*", "<", "-"
POINTS = " points a ridge"  # the heading of a family says "points", so that no row wraps
COLUMNS = (
    "", "method", "max\nerror", "rms\nerror", "error", "harm.\ndB", "margin\ndB",
    "set-up", "per\nsecond", "x real\ntime", "memory",
)  # fmt: skip


def print_accuracy(name: str, document: Document) -> None:
    """Print the document. name: what the scene is called."""
    extent = with_unit(document["peak_to_peak"], document["unit"])
    print(
        f"{name}: {document['quantity']}, peak-to-peak {extent}; timings are medians of {document['repeats']} on this "
        f"machine; threshold: {document['threshold']}"
    )
    print(f"{document['measured']} Error of the reference: {document['reference_error']:.1e}.\n")
    print_table("", COLUMNS, _rows(document), numbers=COLUMNS[2:])
    print(
        f"\n{ON_FRONT}  on the Pareto front: no measured method is both more accurate and cheaper (set-up and "
        f"{document['duration']:g} s of sound)"
    )
    print(f"{CHOSEN}  the method that the plan of this scene takes: {document['chosen']}")
    for note in _notes(document):
        print(note)
    print(start_sentence(document))
    for left in document["left_out"]:
        print(f"Left out: {left['method']}. {left['reason']}")


def _notes(document: Document) -> Iterator[str]:
    """Yield what the rows of the table need to be understood."""
    rows = document["methods"]
    if not all(row["max_error"] and row["rms_error"] for row in rows):
        yield f"0 and {NOTHING}: no error, to round-off"
    if any(POINTS in row["method"] for row in rows):
        yield "points: per ridge"
    if any("tabled" in row["method"] for row in rows):
        yield "tabled: one period, solved at the given number of phases and kept as a table"


def _rows(document: Document) -> Iterator[tuple[str, ...] | None]:
    """Yield a heading for each family and a row for each of its methods; None separates families."""
    family = ""
    for series in series_of(document):
        if family != series.family:
            if family:
                yield None
            heading = series.heading
            heading += " (points)" if POINTS in series.rows[0]["method"] else ""
            yield ("", heading, *([""] * (len(COLUMNS) - 2)))
        family = series.family
        yield from (_cells(document, row) for row in series.rows)


def _cells(document: Document, row: Row) -> tuple[str, ...]:
    chosen = row["method"] == document["chosen"]
    return (
        (ON_FRONT if row["pareto"] else "") + (CHOSEN if chosen else ""),
        "  " + _short_name(row["method"]),
        _share(row["max_error"]),
        _share(row["rms_error"]),
        with_unit(row["error_m"], "m") if row["error_m"] else "0",
        _decibels(row["worst_harmonic_db"]),
        _decibels(row["threshold_margin_db"]),
        with_unit(row["setup_seconds"], "s"),
        with_unit(row["seconds_per_second"], "s"),
        _times(row["times_real_time"]),
        _bytes(row["memory_bytes"]),
    )


def _short_name(method: str) -> str:
    """Return the name of a method without the words of its heading."""
    rest = method.partition(",")[2].strip() or method
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
