"""Which parameters decide: first-order and total Sobol indices, with the interval of 95 % of the bootstrap.

Of the level of the whole finger over its threshold or, over the groups, of log10 of the rms displacement over the
amplitude of the ridges. The rms acceleration of slow scenes needs far more phases (`ridgewave study --accuracy`).
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from clients.figure_look import BLUE, FAINT, INK, Real, new_figure
from clients.study_figures import cannot_draw
from clients.study_figures.axes import in_unit
from clients.study_figures.period_ratio import ridge_amplitude
from synth.study.samples import SALTELLI, indices_of

if TYPE_CHECKING:
    from xarray import Dataset

LEAST, LOWEST = 1e-6, -120.0  # of the largest rms; dB: a silent scene
SYMBOLS = {
    "groups.ridges": "tau", "groups.period_ratio": "Lambda", "groups.amplitude_ratio": "A", "groups.load": "W",
}  # fmt: skip


def check(found: Dataset) -> None:
    """Refuse a study whose scenes are not drawn for Sobol indices."""
    if (json.loads(found.attrs["spec"])["sample"] or {}).get("kind") != SALTELLI:
        cannot_draw("sensitivity", f'the sample {{"kind": "{SALTELLI}", "count": n}}')


def drawn(found: Dataset) -> Figure:
    """Return the figure."""
    spec = json.loads(found.attrs["spec"])
    names, of_groups = list(spec["axes"]), any(name in SYMBOLS for name in spec["axes"])
    answer = _over_ridges(found) if of_groups else np.nan_to_num(found.sensation_level.values, nan=LOWEST)
    indices, spread = indices_of(answer, len(names))
    figure = new_figure(1.6 + 1.1 * len(names), 3.2)
    axes = figure.subplots()
    places = np.arange(len(names))
    kinds = (("first_order", -0.18, BLUE, "first order"), ("total_order", 0.18, FAINT, "total"))
    for name, shift, colour, label in kinds:
        values, interval = getattr(indices, name), getattr(spread, name).confidence_interval
        bars = np.abs(np.stack([values - interval.low, interval.high - values]))
        ticks = {"ecolor": INK, "elinewidth": 0.8}
        axes.bar(places + shift, values, 0.34, yerr=bars, color=colour, label=label, error_kw=ticks)
    ends = {name: (axis["from"], axis["to"]) for name, axis in spec["axes"].items()}
    axes.set_xticks(places, [_label(found, name, ends[name]) for name in names])
    axes.axhline(0.0, color=INK, lw=0.6)
    axes.set(title=f"{found.sizes['sample']:,} scenes; bars: 95 % of the bootstrap", ylim=(-0.1, 1.1))
    of = "log10 rms displacement\nover ridge amplitude" if of_groups else "the level over\nthreshold (dB)"
    axes.set_ylabel(f"Sobol index of {of}")
    axes.legend(frameon=False, fontsize=7.5)
    return figure


def _over_ridges(found: Dataset) -> Real:
    name = "finger.ridge_amplitude"
    ridges = found[name].values if name in found.coords else ridge_amplitude(found)
    moved = np.nan_to_num(found.rms.sel(quantity="displacement").values / ridges)
    return np.asarray(np.log10(np.maximum(moved, LEAST * np.max(moved))), np.float64)


def _label(found: Dataset, name: str, ends: tuple[float, float]) -> str:
    """Return an axis with its range, in two or three lines."""
    values, words = in_unit(found, name)
    shown = np.array(ends) * (float(values[0]) / float(found[name].values[0]))
    span = f"{shown[0]:.4g}-{shown[1]:.4g}"
    if name in SYMBOLS:
        return f"{SYMBOLS[name]}\n{span}"
    what, _, unit = words.partition(" (")
    return f"{what.split(' ', 1)[-1].replace(' ', chr(10))}\n{span} {unit.rstrip(')')}"
