"""The usual figure of a study: rms acceleration and level over threshold, over its longest axis of numbers.

Another axis of words makes columns; all others make lines. A line is dotted where the told error of the acceleration is
above DOUBTFUL.
"""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from clients.figure_look import INK, new_figure, shade
from clients.study_figures import cannot_draw
from clients.study_figures.axes import in_unit, is_log, is_number
from synth.study.dataset import SAMPLE

if TYPE_CHECKING:
    from xarray import Dataset

MOST_COLUMNS, MOST_LINES, LONGEST = 4, 12, 40  # letters of a name
DOUBTFUL = 0.1  # of the peak-to-peak


def check(found: Dataset) -> None:
    """Refuse a study without an axis of numbers, or with too many lines."""
    if not any(name != SAMPLE and is_number(found, name) and found.sizes[name] > 1 for name in found.reason.dims):
        cannot_draw("curves", "a grid of axes, one of them of two numbers or more")
    if np.prod([found.sizes[name] for name in _parts(found)[2]]) > MOST_LINES:
        cannot_draw("curves", f"at most {MOST_LINES} lines: values beside the longest axis")


def _parts(found: Dataset) -> tuple[str, list[str], list[str]]:
    """Return the axis that is horizontal, the one that makes columns, if any, and those that make lines."""
    axes = [str(name) for name in found.reason.dims]
    numbers = [name for name in axes if name != SAMPLE and is_number(found, name)]
    along = max(numbers, key=lambda name: found.sizes[name])
    others = [name for name in axes if name != along]
    words = [name for name in others if not is_number(found, name) and 1 < found.sizes[name] <= MOST_COLUMNS][:1]
    return along, words, [name for name in others if name not in words]


def drawn(found: Dataset) -> Figure:
    """Return the figure."""
    along, words, lines = _parts(found)
    columns = found[words[0]].values.tolist() if words else [None]
    figure = new_figure(4.3 * len(columns), 5.2)
    grid: Any = figure.subplots(2, len(columns), sharex=True, sharey="row", squeeze=False)
    for place, column in enumerate(columns):
        part = found if column is None else found.sel({words[0]: column})
        _curves(grid[:, place], part, along, lines)
        grid[0, place].set_title("" if column is None else str(column))
    grid[0, 0].set_ylabel("rms acceleration (m/s$^2$)\ndotted: told error above 10 %")
    grid[1, 0].set_ylabel("whole finger over threshold (dB)")
    if lines:
        title = ", ".join(in_unit(found, name)[1] if is_number(found, name) else name for name in lines)
        named = grid[0, 0].get_legend_handles_labels()
        figure.legend(*named, frameon=False, fontsize=7.0, title=title, title_fontsize=7.0, loc="outside right upper")
    return figure


def _curves(rows: Any, part: Dataset, along: str, lines: list[str]) -> None:
    x, label = in_unit(part, along)
    rms = part.rms.sel(quantity="acceleration")
    places = list(product(*(range(part.sizes[name]) for name in lines)))
    for number, place in enumerate(places):
        colour = shade(number, len(places))
        at = dict(zip(lines, place, strict=True))
        values, told = rms.isel(at).values, part.error.sel(quantity="acceleration").isel(at).values
        values = np.where(values > 0.0, values, np.nan)  # nothing is in the band
        rows[0].plot(x, values, ":", color=colour, lw=0.8)
        rows[0].plot(x, np.where(told <= DOUBTFUL, values, np.nan), color=colour, lw=1.0, label=_name(part, at))
        rows[1].plot(x, part.sensation_level.isel(at), color=colour, lw=1.0)
    rows[0].set_yscale("log")
    rows[1].axhline(0.0, color=INK, lw=0.6)
    rows[1].set_xlabel(label)
    if is_log(x):
        axes: Axes
        for axes in rows:
            axes.set_xscale("log")


def _name(part: Dataset, at: dict[str, int]) -> str:
    """Return what a line is called in the legend."""
    told = [in_unit(part, name)[0][n] if is_number(part, name) else part[name].values[n] for name, n in at.items()]
    return ", ".join(f"{one:.3g}" if isinstance(one, float) else _words(str(one)) for one in told)


def _words(value: str) -> str:
    """Return a value without the marks of JSON."""
    return "".join(letter for letter in value if letter not in '{}"')[:LONGEST]
