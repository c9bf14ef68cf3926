"""Writes on the figure of what accuracy costs: the names of lines, levels and sizes, the title and the notes.

Model: what has fewest places to stand is placed first; a few points of each series carry their size.
"""

from __future__ import annotations

import textwrap

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from clients.accuracy_labels import ASIDE, UP_OR_DOWN, Label, Placing
from clients.accuracy_look import FAINT, INK, SMALL, SMALLEST, place_of, style_of
from clients.accuracy_series import (
    Document,
    chosen_row,
    felt_error,
    front_of,
    in_words,
    levels_of,
    name_of,
    number_of,
    scene_in_words,
    series_of,
    size_of,
    start_in_words,
)

NOTE_LETTERS = 96  # of SMALLEST in a line
NAME_LETTERS = 14  # of a series' name, where it stands better in two lines


def write_names(axes: Axes, document: Document, placing: Placing) -> None:
    """Write what each line, each level and some points are."""
    _name_levels(axes, document, placing)
    for labels in sorted((_chosen_labels(axes, document), *_series_labels(axes, document)), key=len):
        placing.put(*labels)
    _name_sizes(axes, document, placing)


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


def _chosen_labels(axes: Axes, document: Document) -> list[Label]:
    """Return the ways to write beside its ring what the plan takes."""
    row = chosen_row(document)
    if row is None:
        return []
    x, y = place_of(axes, document, row)
    name = document["chosen"].replace(", ", ",\n", 1)
    ways = (f"the plan's choice: {name}", f"the plan's choice:\n{name}")
    return [Label(words, x, y, INK, SMALL, bold=True, keep=True) for words in ways]


def _series_labels(axes: Axes, document: Document) -> list[list[Label]]:
    """Return, for each series and for the front, its name beside each of its points; one of each is to be placed.

    The plan's choice has its name already.
    """
    labels: dict[str, list[Label]] = {}
    for series in series_of(document):
        words, colour = name_of(series), style_of(series.family).colour
        places = [place_of(axes, document, row) for row in series.rows if row["method"] != document["chosen"]]
        ways = dict.fromkeys((words, textwrap.fill(words, NAME_LETTERS)))
        labels.setdefault(words, []).extend(
            Label(way, x, y, colour, SMALL, bold=True, keep=True) for way in ways for x, y in places
        )
    places = [place_of(axes, document, row) for row in front_of(document)]
    if len(places) > 1:
        labels["front"] = [Label("Pareto front", x, y, FAINT, SMALL) for x, y in places]
    return list(labels.values())


def _name_sizes(axes: Axes, document: Document, placing: Placing) -> None:
    """Write sizes beside the ends of each series, and beside its middle where there is room."""
    for series in series_of(document):
        last = len(series.rows) - 1
        colour = style_of(series.family).colour
        for place in sorted({0, last, last // 2} if last > 3 else {0, last} if last else set()):
            row = series.rows[place]
            words = str(number_of(row["method"])) if 0 < place < last else size_of(row["method"])
            placing.put(Label(words, *place_of(axes, document, row), colour, SMALLEST))


def write_title_and_notes(figure: Figure, document: Document) -> None:
    """Write the title and, below, what holds for every point."""
    figure.text(0.018, 0.965, f"What accuracy costs: {document['quantity']}", color=INK, fontsize=11, weight="bold")
    extent = in_words(document["peak_to_peak"], document["unit"]).replace(" u", " µ").replace("^2", "²")
    figure.text(0.018, 0.928, f"{scene_in_words(document)}; peak-to-peak {extent}", color=INK, fontsize=SMALL)
    notes = [
        f"Medians of {document['repeats']} timings on one machine; set-up spread over {document['duration']:g} s of "
        f"sound at {document['sample_rate'] / 1000:g} kHz. {start_in_words(document)}"
    ]
    felt = felt_error(document)
    if felt is not None:
        what = "every harmonic of the error is" if felt < 1.0 else "even an error as large as the motion would stay"
        notes.append(f"Not felt: {what} 6 dB below the threshold ({document['threshold']}).")
    if any(not row["max_error"] for row in document["methods"]):
        notes.append("Arrows on the lower edge: no error, to round-off.")
    words = "\n".join(line for note in notes for line in textwrap.wrap(note, NOTE_LETTERS))
    figure.text(0.018, 0.018, words, color=FAINT, fontsize=SMALLEST, linespacing=1.35)
