"""Draws accuracy.svg and accuracy.png from the JSON document of `ridgewave accuracy`.

    python -m clients.accuracy_report.figure FOLDER      draws FOLDER/accuracy.json again

Horizontal axis: computing time per second of sound, with the set-up spread over the duration of the scene. Vertical
axis: largest error, relative to the peak-to-peak. Both are logarithmic; a method without error is an
arrow on the lower edge. docs/accuracy.md explains how to read the figure.

Limits: requires the extra `plots`. The same versions of the packages draw the same bytes. Text in the SVG stays text: a
viewer without DejaVu Sans shows another font.
"""

from __future__ import annotations

import io
import json
import math
import sys
import textwrap
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import RendererAgg
from matplotlib.figure import Figure
from matplotlib.markers import CARETDOWNBASE
from matplotlib.text import Annotation
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter, NullLocator

from clients.accuracy_report.method_series import (
    Document,
    Row,
    Series,
    chosen_row,
    cost_of,
    error_levels,
    felt_error,
    front_of,
    series_of,
    size_of,
    start_sentence,
    with_unit,
)

SIZE = (6.0, 6.3)  # inches: printed 12 cm wide, the smallest text is 6 points high
DOTS_PER_INCH = 300
SMALL = 7.6  # points, of labels and notes
NOTE_LETTERS, LEGEND_LETTERS = 96, 48  # letters of SMALL per line
INK, GREY, PALE = "#1d2733", "#6b7682", "#c3cad2"
LOOK: Any = {
    "font.sans-serif": ["DejaVu Sans", "Verdana"],
    "font.size": 9.0,
    "axes.linewidth": 0.6,
    "axes.edgecolor": INK,
    "svg.fonttype": "none",
    "svg.hashsalt": "ridgewave",
    "figure.dpi": 72,
}
STYLES = {
    "baseline": ("#b8480a", "s", 3.9),
    "sampled": ("#d18f00", "D", 3.7),
    "exact": ("#0072b2", "o", 4.4),
    "cells": ("#7a5230", "p", 4.6),
    "steps": ("#3f6fd1", "P", 4.8),
    "table": ("#00785a", "^", 4.6),
    "harmonics": ("#b35a8f", "v", 4.6),
    "closed": ("#111111", "*", 8.0),
}
"""Colour (after Okabe & Ito), marker and its size in points, for each family."""
OTHER_STYLE = ("#555555", "X", 4.2)
LABEL_PLACES = (
    (5, 0, "left", "center"), (-5, 0, "right", "center"), (0, 5, "center", "bottom"), (0, -5, "center", "top"),
    (4, 3, "left", "bottom"), (4, -3, "left", "top"), (-4, 3, "right", "bottom"), (-4, -3, "right", "top"),
)  # fmt: skip
"""Places of a label beside its point: offset in points, alignment."""


def main(folder: Path) -> None:
    """Write accuracy.svg and accuracy.png into `folder`, from its accuracy.json."""
    document = json.loads((folder / "accuracy.json").read_text("utf-8"))
    for name, drawn in drawings(document).items():
        (folder / name).write_bytes(drawn)


def drawings(document: Document) -> dict[str, bytes]:
    """Return the files of the figure, by name."""
    svg, png = io.BytesIO(), io.BytesIO()
    with matplotlib.rc_context(LOOK):
        figure = draw(document)
        figure.savefig(svg, format="svg", metadata={"Date": None, "Creator": None})
        figure.savefig(png, format="png", dpi=DOTS_PER_INCH, metadata={"Software": None})
    return {"accuracy.svg": svg.getvalue(), "accuracy.png": png.getvalue()}


def draw(document: Document) -> Figure:
    """Return the figure; call it within `matplotlib.rc_context(LOOK)`."""
    figure = Figure(figsize=SIZE)
    axes = figure.add_axes((0.11, 0.35, 0.755, 0.49))
    _set_up_axes(axes, document)
    for series in series_of(document):
        _draw_series(axes, document, series)
    _draw_front_and_choice(axes, document)
    _draw_levels(axes, document)
    _label_sizes(axes, document)
    lines = _write_title_and_notes(figure, document)
    above = 0.012 + 1.35 * SMALL * lines / (72.0 * SIZE[1])
    figure.legend(loc="lower left", bbox_to_anchor=(0.1, above), ncols=2, fontsize=SMALL, frameon=False)
    return figure


def _set_up_axes(axes: Axes, document: Document) -> None:
    costs = [cost_of(document, row) for row in document["methods"]]
    errors = [error for row in document["methods"] if (error := row["max_error"]) > 0.0]
    errors += [level for level, _ in error_levels(document) if level < 1.0] + [1.0]
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlim(_decade(min(costs) / 1.5, math.floor), max(10.0, _decade(max(costs) * 1.5, math.ceil)))
    axes.set_ylim(_decade(min(errors) / 3.0, math.floor), 3.0 * max(errors))
    axes.grid(color="#e8ebee", linewidth=0.5)
    axes.set_axisbelow(True)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(numticks=12))
        axis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _place: _seconds(value)))
    axes.set_xlabel("computing time for a second of sound, set-up included")
    axes.set_ylabel(f"largest error of the {document['quantity']} (of its peak-to-peak)")
    top = axes.secondary_xaxis("top", functions=(_inverse, _inverse))
    top.set_xlabel("times faster than real time")
    top.xaxis.set_major_formatter(FuncFormatter(lambda value, _place: f"{value:g}"))
    top.xaxis.set_minor_formatter(NullFormatter())


def _inverse(values: Any) -> Any:
    return 1.0 / np.maximum(np.asarray(values, dtype=np.float64), 1e-300)


def _seconds(value: float) -> str:
    return f"{value:g} s" if value >= 0.999 else with_unit(value, "s").replace(" u", " µ")


def _decade(value: float, rounding: Any) -> float:
    return float(10.0 ** rounding(math.log10(value)))


def _draw_series(axes: Axes, document: Document, series: Series) -> None:
    colour, marker, size = STYLES.get(series.family, OTHER_STYLE)
    tabled = series.kind == "tabled"  # drawn in the colour of the series without tables
    look: Any = {
        "color": colour,
        "markersize": size,
        "markerfacecolor": "white" if tabled else colour,
        "markeredgewidth": 0.9,
        "zorder": 3,
    }
    places = [(cost_of(document, row), row["max_error"]) for row in series.rows]
    shown = np.array([place for place in places if place[1] > 0.0]).reshape(-1, 2)
    line = (0, (3, 1.6)) if tabled else "-"
    axes.plot(shown[:, 0], shown[:, 1], marker=marker, linestyle=line, linewidth=1.0, label=series.name, **look)
    costs = [cost for cost, error in places if not error]
    if costs:
        arrow = look | {"marker": CARETDOWNBASE, "markersize": 7.0, "linestyle": "none", "clip_on": False}
        axes.plot(costs, [axes.get_ylim()[0]] * len(costs), label="_zero", **arrow)


def _draw_front_and_choice(axes: Axes, document: Document) -> None:
    """Draw the staircase of the Pareto front, and a ring round the method that the plan selects."""
    front = [_place(axes, document, row) for row in front_of(document)]
    axes.plot(
        *zip(*front, strict=True), drawstyle="steps-post", color=PALE, linewidth=4.0, label="Pareto front", zorder=1
    )
    row = chosen_row(document)
    if row is not None:
        x, y = _place(axes, document, row)
        ring: Any = {"markersize": 11.0, "markerfacecolor": "none", "markeredgewidth": 1.3, "linestyle": "none"}
        label = textwrap.fill(f"the plan's choice: {document['chosen']}", LEGEND_LETTERS)
        axes.plot([x], [y], "o", color=INK, label=label, zorder=5, **ring)


def _place(axes: Axes, document: Document, row: Row) -> tuple[float, float]:
    """Return the coordinates of a method; one without error is placed a little above the lower edge."""
    return cost_of(document, row), row["max_error"] or 1.5 * axes.get_ylim()[0]


def _draw_levels(axes: Axes, document: Document) -> None:
    """Draw the levels of error, with labels right of the axes, and the line of real time."""
    line: Any = {"color": GREY, "linewidth": 0.8, "zorder": 2}
    bottom = -math.inf  # points, where the next label may begin
    for level, words in sorted(error_levels(document)):
        axes.axhline(level, linestyle=(0, (5, 2)), **line)
        height = axes.transData.transform((1.0, level))[1]
        bottom = max(bottom, height - 0.5 * SMALL)
        label = textwrap.fill(words, 10)
        axes.annotate(
            label, (1.0, level), (4.0, bottom - height), xycoords=("axes fraction", "data"), textcoords="offset points",
            fontsize=SMALL, color=GREY, va="bottom",
        )  # fmt: skip
        bottom += 1.3 * SMALL * (1 + label.count("\n"))
    axes.axvline(1.0, **line)
    axes.annotate(
        "real time", (1.0, 0.0), (2.0, 4.0), xycoords=("data", "axes fraction"), textcoords="offset points",
        fontsize=SMALL, color=GREY, rotation=90, va="bottom",
    )  # fmt: skip


def _label_sizes(axes: Axes, document: Document) -> None:
    """Write the sizes of the first and the last method of each series, at the place that covers least of the lines.

    A label that would cover other text or leave the axes is left out.
    """
    renderer = RendererAgg(10, 10, 72)  # type: ignore[no-untyped-call]
    room = axes.get_window_extent(renderer)
    taken = [text.get_window_extent(renderer) for text in axes.texts]
    dots = np.concatenate([_dots(axes, document, series) for series in series_of(document)])

    def covered(text: Annotation) -> float:
        """Return how many dots of the lines `text` covers; infinity where a label is not allowed."""
        box = text.get_window_extent(renderer)
        if not room.contains(*box.min) or not room.contains(*box.max) or any(box.overlaps(other) for other in taken):
            return math.inf
        return float(((dots > box.min) & (dots < box.max)).all(axis=1).sum())

    for series in series_of(document):
        colour = STYLES.get(series.family, OTHER_STYLE)[0]
        for row in (series.rows[0], series.rows[-1]) if len(series.rows) > 1 else ():
            where, words = _place(axes, document, row), size_of(row["method"])
            labels = [
                axes.annotate(
                    words, where, (across, up), textcoords="offset points", ha=ha, va=va,
                    fontsize=SMALL, color=colour, zorder=6,
                )
                for across, up, ha, va in LABEL_PLACES
            ]  # fmt: skip
            best = min(labels, key=covered)
            if covered(best) < math.inf:
                labels.remove(best)
                taken.append(best.get_window_extent(renderer))
            for label in labels:
                label.remove()


def _dots(axes: Axes, document: Document, series: Series) -> Any:
    """Return dots along the line of a series, in points of the page, [dots, 2]."""
    corners = axes.transData.transform([_place(axes, document, row) for row in series.rows])
    steps = np.linspace(0.0, len(corners) - 1.0, 20 * len(corners))
    return np.stack([np.interp(steps, range(len(corners)), values) for values in corners.T], axis=1)


def _write_title_and_notes(figure: Figure, document: Document) -> int:
    """Write the title, the scene, and below the figure the notes that hold for every point; return their lines."""
    figure.text(0.018, 0.97, f"What accuracy costs: {document['quantity']}", color=INK, fontsize=11, weight="bold")
    extent = with_unit(document["peak_to_peak"], document["unit"]).replace(" u", " µ").replace("^2", "²")
    figure.text(0.018, 0.938, f"{_scene_line(document)}; peak-to-peak {extent}", color=INK, fontsize=SMALL)
    notes = [
        document["measured"],
        f"Medians of {document['repeats']} timings on one machine; set-up spread over {document['duration']:g} s of "
        f"sound at {document['sample_rate'] / 1000:g} kHz. {start_sentence(document)}",
    ]
    felt = felt_error(document)
    if felt is not None:
        what = "every harmonic of the error is" if felt < 1.0 else "even an error as large as the motion would stay"
        notes.append(f"Not felt: {what} 6 dB below the threshold ({document['threshold']}).")
    if any(not row["max_error"] for row in document["methods"]):
        notes.append("Arrows on the lower edge: no error, to round-off.")
    words = "\n".join(line for note in notes for line in textwrap.wrap(note, NOTE_LETTERS))
    figure.text(0.018, 0.012, words, color=GREY, fontsize=SMALL, linespacing=1.35)
    return 1 + words.count("\n")


def _scene_line(document: Document) -> str:
    """Return ridges, texture and scan of the scene in one line, with their usual symbols."""
    finger, texture, scan = (document["scene"][part] for part in ("finger", "texture", "scan"))
    lengths = (("λ₁", finger["ridge_period"]), ("λ₂", texture["period"]), ("L", finger["contact_length"]))
    words = [f"{name} = {1e3 * value:.4g} mm" for name, value in lengths]
    if scan.get("trajectory"):
        return ", ".join([*words, "recorded motion"])
    moving = scan.get("stroke") or scan
    words += [f"u = {1e3 * moving['speed']:.4g} mm/s", f"w = {with_unit(moving['load'], 'N')}"]
    return ", ".join(words) + (", back and forth" if scan.get("stroke") else "")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
