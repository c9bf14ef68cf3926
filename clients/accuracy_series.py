"""The methods of an accuracy document, as its table and its figure show them: grouped, sized, and beside what matters.

Stage: the JSON of `ridgewave accuracy` -> series of methods, costs, levels of error. Nothing else is needed, so a kept
    document can be shown again.
Model: the cost of a method is set-up / duration + time for a second of sound, in seconds a second. Methods that differ
    only in the numbers of their name are one series.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

Document = Mapping[str, Any]
Row = Mapping[str, Any]

FAMILIES: Mapping[str, str] = {
    "baseline": "trapezoid and brentq",
    "sampled": "sampled solver",
    "exact": "exact solver",
    "table": "response table",
    "harmonics": "sum of harmonics",
    "closed": "closed form",
}
"""The families in the order in which they are shown, and what each is called."""

ROUNDING = 2.0**-25  # of the peak-to-peak: a float32 sample near full scale is off by 2^-25 of full scale at most
EXACT = 1e-6  # of the peak-to-peak: what the tolerance "exact" promises of the folded harmonics (design, section 4)
MARGIN_DB = 6.0  # below the detection threshold: what the tolerance "imperceptible" keeps


@dataclass(frozen=True, slots=True)
class Series:
    """Methods of one kind: their family, what else tells them from its other series, and their rows, sizes rising."""

    family: str
    kind: str
    rows: tuple[Row, ...]


def series_of(document: Document) -> list[Series]:
    """Return the methods of `document` as series, families in their order; unknown families come last."""
    groups: dict[tuple[str, str], list[Row]] = {}
    for row in document["methods"]:
        groups.setdefault((row["family"], re.sub(r"\d+", "#", row["method"])), []).append(row)
    order = [*FAMILIES, *(row["family"] for row in document["methods"])]
    return [
        Series(family, _kind(pattern), tuple(sorted(rows, key=lambda row: number_of(row["method"]))))
        for (family, pattern), rows in sorted(groups.items(), key=lambda item: order.index(item[0][0]))
    ]


def name_of(series: Series) -> str:
    """Return what a series is called, such as "trapezoid and brentq, tabled"."""
    name = FAMILIES.get(series.family, series.family)
    return f"{name}, {series.kind}" if series.kind else name


def number_of(method: str) -> int:
    """Return the first number in the name of a method, 0 where there is none."""
    found = re.search(r"\d+", method)
    return int(found[0]) if found else 0


def size_of(method: str) -> str:
    """Return the part of a method's name that tells its size, such as "1024 phases"; the name where none does."""
    parts = [part.strip() for part in method.split(",")]
    told = next((part for part in parts[1:] if re.search(r"\d", part)), None)
    found = re.search(r"\d.*", parts[0])
    return told or (found[0] if found else method)


def rest_of(method: str) -> str:
    """Return a method's name without its first part, which the methods of a family share; the name if that is all."""
    return method.partition(",")[2].strip() or method


def cost_of(document: Document, row: Row) -> float:
    """Return the seconds of computing for a second of sound, with the set-up spread over the duration of the scene."""
    return float(row["setup_seconds"] / document["duration"] + row["seconds_per_second"])


def front_of(document: Document) -> list[Row]:
    """Return the methods that nothing measured beats in both error and cost, the cheapest first."""
    return sorted((row for row in document["methods"] if row["pareto"]), key=lambda row: cost_of(document, row))


def chosen_row(document: Document) -> Row | None:
    """Return the row of what the scene's plan takes; None where it is not among the methods."""
    return next((row for row in document["methods"] if row["method"] == document["chosen"]), None)


def tolerance_of(document: Document) -> float | None:
    """Return the tolerance that the scene asks for; None for "imperceptible", which is `felt_error`."""
    asked = document["scene"]["accuracy"]["tolerance"]
    if isinstance(asked, str):
        return EXACT if asked == "exact" else None
    return float(asked)


def felt_error(document: Document) -> float | None:
    """Return the error at which the first of the methods would come within `MARGIN_DB` of the detection threshold.

    Each method's error spectrum is thought to grow as a whole, by its margin less MARGIN_DB; the least of the errors
    reached so is returned. So every method with a smaller error keeps the margin; one with a larger error may keep it
    too, if its error lies where the skin is less sensitive. None where no method has a margin, as without any error.
    """
    reached = [
        row["max_error"] * 10.0 ** ((row["threshold_margin_db"] - MARGIN_DB) / 20.0)
        for row in document["methods"]
        if row["max_error"] and row["threshold_margin_db"] is not None
    ]
    return min(reached, default=None)


def levels_of(document: Document) -> list[tuple[float, str]]:
    """Return the errors that are worth a line across the figure, each with its words."""
    asked, felt = tolerance_of(document), felt_error(document)
    levels = [(ROUNDING, "float32 rounding")]
    if asked is not None:
        levels.append((asked, f"tolerance {asked:.2g}"))
    if felt is not None and felt < 1.0:
        levels.append((felt, "not felt below"))
    return levels


def in_words(value: float, unit: str) -> str:
    """Return a value of SI `unit` as a person reads it, such as "1.93 um" or "37.9 m/s^2"."""
    for factor, prefix in ((1.0, ""), (1e-3, "m"), (1e-6, "u"), (1e-9, "n"), (1e-12, "p")):
        if abs(value) >= 0.9995 * factor:
            return f"{value / factor:.3g} {prefix}{unit}"
    return f"{value:.0e} {unit}" if value else f"0 {unit}"


def scene_in_words(document: Document) -> str:
    """Return the scene in a line: its ridges, its texture and its scan, with their usual symbols."""
    finger, texture, scan = (document["scene"][part] for part in ("finger", "texture", "scan"))
    lengths = (("λ₁", finger["ridge_period"]), ("λ₂", texture["period"]), ("L", finger["contact_length"]))
    words = [f"{name} = {1e3 * value:.4g} mm" for name, value in lengths]
    if scan.get("trajectory"):
        return ", ".join([*words, "recorded motion"])
    stroke = scan.get("stroke")
    moving = stroke or scan
    words += [f"u = {1e3 * moving['speed']:.4g} mm/s", f"w = {in_words(moving['load'], 'N')}"]
    return ", ".join(words) + (", back and forth" if stroke else "")


def _kind(pattern: str) -> str:
    return ", ".join(part.strip() for part in pattern.split(",")[1:] if not re.search(r"[#\d]", part))


def start_in_words(document: Document) -> str:
    """Return what a process takes once before it can compute, as a sentence."""
    once = f"Once a process: {in_words(document['process_seconds'], 's')} to start, import, and load its kernels"
    compiling = document["compile_seconds"]
    return f"{once}; {in_words(compiling, 's')} of it compiled them, once a machine." if compiling else f"{once}."
