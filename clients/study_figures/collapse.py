"""Dimensional scenes over the period of the texture, and the same over the groups, on which they fall together."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from clients.figure_look import BLUE, FAINT, INK, ORANGE, new_figure
from clients.study_figures import cannot_draw

if TYPE_CHECKING:
    from xarray import Dataset

NEEDS = ("finger.ridge_period", "finger.ridge_amplitude", "groups.load", "groups.period_ratio")
COLOURS = (BLUE, ORANGE, INK, FAINT)


def check(found: Dataset) -> None:
    """Refuse a study with other axes."""
    some = found.squeeze()
    if set(some.reason.dims) != set(NEEDS) or some.sizes[NEEDS[2]] > len(COLOURS):
        cannot_draw("collapse", f"the axes {', '.join(NEEDS)}, and at most {len(COLOURS)} loads")


def drawn(found: Dataset) -> Figure:
    """Return the figure."""
    some = found.squeeze()
    periods, amplitudes, loads, ratios = (some[name].values for name in NEEDS)
    figure = new_figure(8.6, 3.4)
    left, right = figure.subplots(1, 2)
    spread = 0.0
    for load, colour in zip(loads, COLOURS, strict=False):
        moved = some.rms.sel({"quantity": "displacement", NEEDS[2]: load})
        together = []
        for period, amplitude in product(periods, amplitudes):
            one = moved.sel({NEEDS[0]: period, NEEDS[1]: amplitude}).values
            left.plot(1e3 * period * ratios, 1e6 * one, color=colour, lw=0.6)
            together.append(one / amplitude)
            label = f"W = {load:g}: {len(periods) * len(amplitudes)} fingers" if len(together) == 1 else None
            right.plot(ratios, together[-1], color=colour, lw=0.8, label=label)
        spread = max(spread, float(np.nanmax(np.ptp(together, axis=0) / np.nanmax(together))))
    left.set(xscale="log", yscale="log", xlabel="period of the texture (mm)", ylabel="rms displacement (um)")
    left.set_title("as they are", fontsize=8.5)
    right.set(xscale="log", yscale="log", xlabel="period of the texture over that of the ridges, Lambda")
    right.set_ylabel("rms displacement over ridge amplitude")
    right.set_title(f"on the groups: they differ by at most {spread:.0e} of the largest", fontsize=8.5)
    figure.legend(*right.get_legend_handles_labels(), frameon=False, fontsize=7.5, loc="outside lower center", ncols=4)
    return figure
