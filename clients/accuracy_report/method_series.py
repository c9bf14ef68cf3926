"""Groups the methods of an accuracy document into series; returns their costs and the error levels of the figure.

The document is the JSON of `ridgewave accuracy`. Nothing else is needed, so a stored document can be shown again.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

Document = Mapping[str, Any]
Row = Mapping[str, Any]

FAMILIES = ("baseline", "sampled", "exact", "cells", "steps", "table", "harmonics", "closed")
"""The families, in the order in which they are shown."""

ROUNDING = 2.0**-25  # of the peak-to-peak: largest rounding error of a float32 sample near full scale
EXACT = 1e-6  # of the peak-to-peak: bound of the tolerance "exact" on the folded harmonics
MARGIN_DB = 6.0  # of errors below the detection threshold with the tolerance "imperceptible"


@dataclass(frozen=True, slots=True)
class Series:
    """Methods of one family whose names differ in their numbers only.

    kind: words that distinguish the series from others of its family, such as "tabled"; often empty.
    rows: the methods, by increasing size.
    """

    family: str
    kind: str
    rows: tuple[Row, ...]

    @property
    def name(self) -> str:
        """The name of the series, such as "trapezoid and brentq, tabled"."""
        return f"{self.heading}, {self.kind}" if self.kind else self.heading

    @property
    def heading(self) -> str:
        """What its methods have in common, such as "trapezoid and brentq": their name without sizes."""
        return str(self.rows[0]["method"]).partition(",")[0]


def series_of(document: Document) -> list[Series]:
    """Return the series of `document` in the order of FAMILIES; unknown families come last."""
    groups: dict[tuple[str, str], list[Row]] = {}
    for row in document["methods"]:
        groups.setdefault((row["family"], re.sub(r"\d+", "#", row["method"])), []).append(row)
    order = [*FAMILIES, *(row["family"] for row in document["methods"])]
    return [
        Series(family, _kind(pattern), tuple(sorted(rows, key=lambda row: _first_number(row["method"]))))
        for (family, pattern), rows in sorted(groups.items(), key=lambda item: order.index(item[0][0]))
    ]


def size_of(method: str) -> str:
    """Return the part of a method's name that gives its size, such as "1024 phases"; the name if no part does."""
    parts = [part.strip() for part in method.split(",")]
    sized = next((part for part in parts[1:] if re.search(r"\d", part)), None)
    found = re.search(r"\d.*", parts[0])
    return sized or (found[0] if found else method)


def cost_of(document: Document, row: Row) -> float:
    """Return the seconds of computing per second of sound, with the set-up spread over the duration of the scene."""
    return float(row["setup_seconds"] / document["duration"] + row["seconds_per_second"])


def front_of(document: Document) -> list[Row]:
    """Return the methods on the Pareto front, the cheapest first."""
    return sorted((row for row in document["methods"] if row["pareto"]), key=lambda row: cost_of(document, row))


def chosen_row(document: Document) -> Row | None:
    """Return the method that the scene's plan selects; None if it was not measured."""
    return next((row for row in document["methods"] if row["method"] == document["chosen"]), None)


def felt_error(document: Document) -> float | None:
    """Return the error below which every method stays `MARGIN_DB` below the detection threshold.

    The error spectrum of each method is scaled until its margin is MARGIN_DB. The smallest of the resulting errors is
    returned. A method with a larger error may keep the margin too, if skin is less sensitive at its frequencies.
    None if no method has a margin, for example because none has an error.
    """
    reached = [
        row["max_error"] * 10.0 ** ((row["threshold_margin_db"] - MARGIN_DB) / 20.0)
        for row in document["methods"]
        if row["max_error"] and row["threshold_margin_db"] is not None
    ]
    return min(reached, default=None)


def error_levels(document: Document) -> list[tuple[float, str]]:
    """Return the errors that get a line across the figure, each with its label."""
    levels = [(ROUNDING, "float32 rounding")]
    tolerance = document["scene"]["accuracy"]["tolerance"]
    if tolerance != "imperceptible":  # its level is `felt_error`
        value = EXACT if tolerance == "exact" else float(tolerance)
        levels.append((value, f"tolerance {value:.2g}"))
    felt = felt_error(document)
    if felt is not None and felt < 1.0:
        levels.append((felt, "not felt below"))
    return levels


def with_unit(value: float, unit: str) -> str:
    """Return a value in the SI unit `unit` with a prefix, such as "1.93 um" or "37.9 m/s^2"."""
    for factor, prefix in ((1.0, ""), (1e-3, "m"), (1e-6, "u"), (1e-9, "n"), (1e-12, "p")):
        if abs(value) >= 0.9995 * factor:
            return f"{value / factor:.3g} {prefix}{unit}"
    return f"{value:.0e} {unit}" if value else f"0 {unit}"


def start_sentence(document: Document) -> str:
    """Return a sentence on the time that a process needs once before it can compute."""
    once = f"Once a process: {with_unit(document['process_seconds'], 's')} to start, import, and load its kernels"
    compiling = document["compile_seconds"]
    return f"{once}; {with_unit(compiling, 's')} of it compiled them, once a machine." if compiling else f"{once}."


def _first_number(method: str) -> int:
    found = re.search(r"\d+", method)
    return int(found[0]) if found else 0


def _kind(pattern: str) -> str:
    return ", ".join(part.strip() for part in pattern.split(",")[1:] if not re.search(r"[#\d]", part))
