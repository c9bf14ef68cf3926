"""Draws what accuracy costs: accuracy.svg and accuracy.png from the JSON document of `ridgewave accuracy`.

    python -m clients.accuracy_plot FOLDER      draws FOLDER/accuracy.json again

Model: across, the time for a second of sound, set-up spread over the scene's duration; up, the largest error of a
    period relative to the peak-to-peak; both in decades. A line joins the methods of a series, the broad one the Pareto
    front. An error of zero stands as an arrow on the lower edge. Level lines: the tolerance of the scene, the rounding
    to float32 (2^-25 of the peak-to-peak), and the error at which the first of the methods would come within 6 dB of
    the detection threshold (`accuracy_series.felt_error`): what lies below it is not felt.
Limits: needs the extra `plots`. The same versions draw the same bytes. Words stay words in the SVG: a viewer without
    DejaVu Sans shows them in Verdana or another font.
"""

from __future__ import annotations

import io
import json
import math
import sys
import textwrap
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.markers import CARETDOWNBASE
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter
from matplotlib.transforms import Bbox

from clients.accuracy_labels import ASIDE, UP_OR_DOWN, Label, Placing
from clients.accuracy_series import (
    FAMILIES,
    Document,
    Row,
    Series,
    chosen_row,
    cost_of,
    felt_error,
    front_of,
    in_words,
    levels_of,
    number_of,
    scene_in_words,
    series_of,
    size_of,
)

SIZE = (6.0, 5.1)  # inches: printed 12 cm wide, the smallest words are 6 points high
DOTS_PER_INCH = 300
SMALL, SMALLEST = 8.0, 7.6
NOTE_LETTERS = 96  # of SMALLEST in a line
INK, FAINT, FRONT = "#1d2733", "#6b7682", "#c3cad2"
LOOK: Any = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans", "Verdana"],
    "font.size": 9.0,
    "axes.linewidth": 0.6,
    "axes.edgecolor": INK,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.minor.visible": False,
    "ytick.minor.visible": False,
    "svg.fonttype": "none",
    "svg.hashsalt": "ridgewave",
    "figure.facecolor": "white",
    "figure.dpi": 72,
}


@dataclass(frozen=True, slots=True)
class Style:
    """How a family is drawn; colours after Okabe & Ito, told apart in grey by their markers."""

    colour: str
    marker: str
    size: float = 4.2


STYLES = {
    "baseline": Style("#b8480a", "s", 3.9),
    "sampled": Style("#d18f00", "D", 3.7),
    "exact": Style("#0072b2", "o", 4.4),
    "table": Style("#00785a", "^", 4.6),
    "harmonics": Style("#b35a8f", "v", 4.6),
    "closed": Style("#111111", "*", 8.0),
}
OTHER = Style("#555555", "X")


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
    axes = figure.add_axes((0.11, 0.19, 0.845, 0.63))
    _frame(axes, document)
    drawn = [_draw_series(axes, document, series) for series in series_of(document)]
    _draw_front(axes, document)
    points = [_place(axes, document, row) for row in document["methods"]]
    placing = Placing(axes, points, drawn, _draw_levels(axes, document))
    _ring_chosen(axes, document, placing)
    _name_levels(axes, document, placing)
    for labels in sorted((_chosen_labels(axes, document), *_series_labels(axes, document)), key=len):
        placing.put(*labels)
    _name_sizes(axes, document, placing)
    _write_words(figure, document)
    return figure


def _frame(axes: Axes, document: Document) -> None:
    """Set scales, limits and axes."""
    costs = [cost_of(document, row) for row in document["methods"]]
    errors = [error for row in document["methods"] if (error := row["max_error"]) > 0.0]
    errors += [level for level, _ in levels_of(document) if level < 1.0] + [1.0]
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlim(_decade(min(costs) / 1.5, math.floor), max(10.0, _decade(max(costs) * 1.5, math.ceil)))
    axes.set_ylim(_decade(min(errors) / 3.0, math.floor), 3.0 * max(errors))
    axes.grid(color="#e8ebee", linewidth=0.5)
    axes.set_axisbelow(True)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(numticks=12))
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
    return f"{value:g} s" if value >= 0.999 else in_words(value, "s").replace(" u", " µ")


def _decade(value: float, rounding: Any) -> float:
    return float(10.0 ** rounding(math.log10(value)))


def _place(axes: Axes, document: Document, row: Row) -> tuple[float, float]:
    """Return where a method stands; one without error a little above the lower edge."""
    return cost_of(document, row), row["max_error"] or 1.5 * axes.get_ylim()[0]


def _draw_series(axes: Axes, document: Document, series: Series) -> Any:
    """Draw a series and return its line, [n, 2]."""
    style, hollow = STYLES.get(series.family, OTHER), "linear" in series.kind
    places = np.array([_place(axes, document, row) for row in series.rows])
    seen = np.array([row["max_error"] > 0.0 for row in series.rows])
    look: Any = {
        "color": style.colour,
        "marker": style.marker,
        "markersize": style.size,
        "markerfacecolor": "white" if hollow else style.colour,
        "markeredgewidth": 0.9,
        "linewidth": 1.0,
        "linestyle": (0, (3, 1.6)) if hollow else "-",
        "zorder": 3,
    }
    axes.plot(places[seen, 0], places[seen, 1], label=_series_name(series), **look)
    if not seen.all():
        arrow = look | {"marker": CARETDOWNBASE, "markersize": 7.0, "linestyle": "none", "clip_on": False}
        axes.plot(places[~seen, 0], np.full((~seen).sum(), axes.get_ylim()[0]), **arrow, label="_zero")
    return places


def _draw_front(axes: Axes, document: Document) -> None:
    """Draw the staircase under which nothing measured lies."""
    places = [_place(axes, document, row) for row in front_of(document)]
    if places:
        xs, ys = [x for x, _ in places], [y for _, y in places]
        axes.plot(
            xs, ys, drawstyle="steps-post", color=FRONT, linewidth=4.0, solid_joinstyle="round", label="Pareto front",
            zorder=1,
        )  # fmt: skip


def _draw_levels(axes: Axes, document: Document) -> list[Any]:
    """Draw the level lines and the line of real time; return them, [2, 2] each."""
    for level, _ in levels_of(document):
        axes.axhline(level, color=FAINT, linewidth=0.8, linestyle=(0, (5, 2)), zorder=2)
    axes.axvline(1.0, color=FAINT, linewidth=0.8, zorder=2)
    across, up = axes.get_xlim(), axes.get_ylim()
    return [*([(x, level) for x in across] for level, _ in levels_of(document)), [(1.0, y) for y in up]]


def _name_levels(axes: Axes, document: Document, placing: Placing) -> None:
    """Write along each level line, and along that of real time, what it is."""
    heights = np.geomspace(*axes.get_ylim(), 31)
    placing.put(
        *(Label("real time", 1.0, y, FAINT, SMALLEST, keep=True, close=True, directions=ASIDE) for y in heights)
    )
    for level, words in levels_of(document):
        places = np.geomspace(*axes.get_xlim(), 31)[::-1]
        placing.put(
            *(Label(words, x, level, FAINT, SMALLEST, keep=True, close=True, directions=UP_OR_DOWN) for x in places)
        )


def _ring_chosen(axes: Axes, document: Document, placing: Placing) -> None:
    """Ring what the plan takes."""
    row = chosen_row(document)
    if row is None:
        return
    x, y = _place(axes, document, row)
    axes.plot([x], [y], "o", markersize=11.0, markerfacecolor="none", color=INK, markeredgewidth=1.3, zorder=5)
    centre = axes.transData.transform((x, y))
    placing.take(Bbox.from_bounds(centre[0] - 6.0, centre[1] - 6.0, 12.0, 12.0))


def _chosen_labels(axes: Axes, document: Document) -> list[Label]:
    """Return the ways to write beside its ring what the plan takes."""
    row = chosen_row(document)
    if row is None:
        return []
    x, y = _place(axes, document, row)
    name = document["chosen"].replace(", ", ",\n", 1)
    ways = (f"the plan's choice: {name}", f"the plan's choice:\n{name}")
    return [Label(words, x, y, INK, SMALL, bold=True, keep=True) for words in ways]


def _series_labels(axes: Axes, document: Document) -> list[list[Label]]:
    """Return, for each series and for the front, its name beside each of its points; one of each is to be placed.

    The plan's choice has its name already.
    """
    labels: dict[str, list[Label]] = {}
    for series in series_of(document):
        words, colour = _series_name(series), STYLES.get(series.family, OTHER).colour
        places = [_place(axes, document, row) for row in series.rows if row["method"] != document["chosen"]]
        labels.setdefault(words, [Label(words, x, y, colour, SMALL, bold=True, keep=True) for x, y in places])
    places = [_place(axes, document, row) for row in front_of(document)]
    if len(places) > 1:
        labels["front"] = [Label("Pareto front", x, y, FAINT, SMALL) for x, y in places]
    return list(labels.values())


def _name_sizes(axes: Axes, document: Document, placing: Placing) -> None:
    """Write sizes beside the ends of each series, and beside its middle where there is room."""
    for series in series_of(document):
        last = len(series.rows) - 1
        colour = STYLES.get(series.family, OTHER).colour
        for place in sorted({0, last, last // 2} if last > 3 else {0, last} if last else set()):
            row = series.rows[place]
            words = str(number_of(row["method"])) if 0 < place < last else size_of(row["method"])
            placing.put(Label(words, *_place(axes, document, row), colour, SMALLEST))


def _series_name(series: Series) -> str:
    name = FAMILIES.get(series.family, series.family)
    return f"{name}, {series.kind}" if series.kind else name


def _write_words(figure: Figure, document: Document) -> None:
    """Write the title and, below, what holds for every point."""
    figure.text(0.018, 0.965, f"What accuracy costs: {document['quantity']}", color=INK, fontsize=11, weight="bold")
    extent = in_words(document["peak_to_peak"], document["unit"]).replace(" u", " µ").replace("^2", "²")
    figure.text(0.018, 0.928, f"{scene_in_words(document)}; peak-to-peak {extent}", color=INK, fontsize=SMALL)
    notes = [
        f"Medians of {document['repeats']} timings on one machine; set-up spread over {document['duration']:g} s of "
        f"sound at {document['sample_rate'] / 1000:g} kHz."
    ]
    felt = felt_error(document)
    if felt is not None:
        what = "every harmonic of the error is" if felt < 1.0 else "even an error as large as the motion would stay"
        notes.append(f"Not felt: {what} 6 dB below the threshold ({document['threshold']}).")
    if any(not row["max_error"] for row in document["methods"]):
        notes.append("Arrows on the lower edge: no error, to round-off.")
    words = "\n".join(line for note in notes for line in textwrap.wrap(note, NOTE_LETTERS))
    figure.text(0.018, 0.018, words, color=FAINT, fontsize=SMALLEST, linespacing=1.35)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
