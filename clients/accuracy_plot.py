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
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.markers import CARETDOWNBASE
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter
from matplotlib.transforms import Bbox

from clients.accuracy_labels import Placing
from clients.accuracy_look import FAINT, FRONT, INK, LOOK, place_of, style_of
from clients.accuracy_series import (
    Document,
    Series,
    chosen_row,
    cost_of,
    front_of,
    in_words,
    levels_of,
    name_of,
    series_of,
)
from clients.accuracy_words import write_names, write_title_and_notes

SIZE = (6.0, 5.1)  # inches: printed 12 cm wide, the smallest words are 6 points high
DOTS_PER_INCH = 300
HOLLOW = ("tabled",)  # kinds that share their colour with another


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
    points = [place_of(axes, document, row) for row in document["methods"]]
    placing = Placing(axes, points, drawn, _draw_levels(axes, document))
    _ring_chosen(axes, document, placing)
    write_names(axes, document, placing)
    write_title_and_notes(figure, document)
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


def _draw_series(axes: Axes, document: Document, series: Series) -> Any:
    """Draw a series and return its line, [n, 2]."""
    style, hollow = style_of(series.family), series.kind in HOLLOW
    places = np.array([place_of(axes, document, row) for row in series.rows])
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
    axes.plot(places[seen, 0], places[seen, 1], label=name_of(series), **look)
    if not seen.all():
        arrow = look | {"marker": CARETDOWNBASE, "markersize": 7.0, "linestyle": "none", "clip_on": False}
        axes.plot(places[~seen, 0], np.full((~seen).sum(), axes.get_ylim()[0]), **arrow, label="_zero")
    return places


def _draw_front(axes: Axes, document: Document) -> None:
    """Draw the staircase under which nothing measured lies."""
    places = [place_of(axes, document, row) for row in front_of(document)]
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


def _ring_chosen(axes: Axes, document: Document, placing: Placing) -> None:
    """Ring what the plan takes."""
    row = chosen_row(document)
    if row is None:
        return
    x, y = place_of(axes, document, row)
    axes.plot([x], [y], "o", markersize=11.0, markerfacecolor="none", color=INK, markeredgewidth=1.3, zorder=5)
    centre = axes.transData.transform((x, y))
    placing.take(Bbox.from_bounds(centre[0] - 6.0, centre[1] - 6.0, 12.0, 12.0))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
