"""Response of a comb over Lambda, the period of the texture over that of the ridges, beside the sinc law.

One panel for each number of ridges tau and amplitude ratio A, one line for each load W.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from clients.figure_look import INK, new_figure, shade
from clients.study_figures import cannot_draw

if TYPE_CHECKING:
    from xarray import Dataset

NEEDS = ("groups.ridges", "groups.amplitude_ratio", "groups.load", "groups.period_ratio")
MOST_LOADS = 6
LEAST = 1e-4  # of the ridge amplitude, lower edge of the figure


def check(found: Dataset) -> None:
    """Refuse a study with other axes."""
    if set(found.reason.dims) != set(NEEDS) or found.sizes[NEEDS[2]] > MOST_LOADS:
        cannot_draw("period-ratio", f"the axes {', '.join(NEEDS)}, and at most {MOST_LOADS} loads")


def drawn(found: Dataset) -> Figure:
    """Return the figure."""
    ridges, amplitudes, loads, ratios = (found[name].values for name in NEEDS)
    figure = new_figure(4.3 * len(amplitudes), 2.7 * len(ridges))
    grid: Any = figure.subplots(len(ridges), len(amplitudes), sharex=True, sharey=True, squeeze=False)
    moved = found.rms.sel(quantity="displacement") / ridge_amplitude(found)
    for (row, column), axes in np.ndenumerate(grid):
        tau, a = ridges[row], amplitudes[column]
        some = moved.sel({NEEDS[0]: tau, NEEDS[1]: a})
        for number, load in enumerate(loads):
            colour = shade(number, len(loads))
            axes.plot(ratios, some.sel({NEEDS[2]: load}), color=colour, lw=0.8, label=f"W = {load:g}")
        law = a / np.sqrt(2.0) * np.abs(np.sinc(tau / ratios))
        axes.plot(ratios, law, ":", color=INK, lw=1.0, label="sinc law, full contact")
        axes.axvline(tau, color=INK, lw=0.5, ls="--", label="period = contact length")
        axes.set(xscale="log", yscale="log", ylim=(LEAST, 2.0), title=f"{tau:g} ridges, A = {a:g}")
        if row == len(ridges) - 1:
            axes.set_xlabel("period of the texture over that of the ridges, Lambda")
        if column == 0:
            axes.set_ylabel("rms displacement over\nridge amplitude")
    figure.legend(
        *grid[0, 0].get_legend_handles_labels(), frameon=False, fontsize=7.5, loc="outside lower center", ncols=5
    )
    return figure


def ridge_amplitude(found: Dataset) -> float:
    """Return the amplitude of the ridges of a study that does not change it, m."""
    import json

    from synth.scene.scene import parse_scene

    return float(parse_scene(json.loads(found.attrs["spec"])["scene"]).finger.ridge_amplitude)
