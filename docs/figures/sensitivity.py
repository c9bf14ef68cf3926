"""Draws which parameters decide the vibration: sensitivity.svg and sensitivity.png, for docs/study.md.

    python -m docs.figures.sensitivity [FOLDER]

First-order and total Sobol indices of log10 of the rms acceleration, with the interval of 95 % of the bootstrap.
Left: a comb over the groups of eq. 7. Right: a fingertip over speed, load, period and amplitude of the texture.
Needs the extras `plots` and `study`. The same versions draw the same bytes.
Source: Saltelli et al. (2010), as scipy.stats.sobol_indices has it.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from scipy.stats import sobol_indices, uniform

import ridgewave as rw
from docs.figures.look import BLUE, FAINT, INK, LOOK, Real, new_figure, saved

HERE = Path(__file__).resolve().parent
Ranges = Mapping[str, tuple[float, float]]
GROUPS: Ranges = {
    "groups.ridges": (8.0, 40.0), "groups.period_ratio": (0.3, 8.0), "groups.amplitude_ratio": (0.05, 1.0),
    "groups.load": (0.1, 10.0),
}  # fmt: skip
FIELDS: Ranges = {
    "scan.speed": (0.01, 0.3), "scan.load": (0.05, 2.0), "texture.period": (1e-4, 5e-3),
    "texture.amplitude": (1e-6, 2e-5),
}  # fmt: skip
NAMES = {
    "groups.ridges": "tau\n8-40", "groups.period_ratio": "Lambda\n0.3-8", "groups.amplitude_ratio": "A\n0.05-1",
    "groups.load": "W\n0.1-10",
    "scan.speed": "speed\n10-300 mm/s", "scan.load": "load\n0.05-2 N", "texture.period": "period\n0.1-5 mm",
    "texture.amplitude": "amplitude\n1-20 um",
}  # fmt: skip
COUNTS, RESAMPLES, LEAST = (1024, 256), 400, 1e-6  # samples; of the bootstrap; of the largest: a silent scene


def indices(finger: str, ranges: Ranges, count: int) -> tuple[Any, Any]:
    """Return the Sobol indices and their bootstrap of a finger over `ranges`, of `count` (2 + parameters) scenes."""

    def solved(points: Real) -> Real:
        """Return log10 rms acceleration [1, scenes] at `points` [parameters, scenes], each from 0 to 1."""
        axes = {
            name: low * (high / low) ** part
            for part, (name, (low, high)) in zip(points, ranges.items(), strict=True)
        }  # fmt: skip
        scene = {"finger": {"kind": finger}, "output": {"bandwidth": "full"}}
        found = rw.sweep(scene, axes, sample={"kind": "points"}, phases=256, lines=1)
        rms = found.rms.sel(quantity="acceleration").values
        return np.asarray(np.log10(np.maximum(rms, LEAST * np.max(rms))), np.float64)[np.newaxis]

    found = sobol_indices(func=solved, n=count, dists=[uniform()] * len(ranges), rng=np.random.default_rng(7))
    np.random.seed(7)  # `bootstrap` of the result takes no other generator
    return found, found.bootstrap(n_resamples=RESAMPLES)


def main(words: list[str]) -> None:
    """Write sensitivity.svg and sensitivity.png into the folder that `words` names, or beside this file."""
    folder = Path(words[0]) if words else HERE
    matplotlib.use("Agg")
    with matplotlib.rc_context(LOOK):
        figure = new_figure(8.6, 3.2)
        for axes, finger, ranges, count in zip(
            figure.subplots(1, 2, sharey=True), ("comb", "fingertip"), (GROUPS, FIELDS), COUNTS, strict=True
        ):
            _draw(axes, finger, ranges, count)
        saved(figure, folder, "sensitivity")


def _draw(axes: Axes, finger: str, ranges: Ranges, count: int) -> None:
    found, spread = indices(finger, ranges, count)
    places = np.arange(len(ranges))
    kinds = (("first_order", -0.18, BLUE, "first order"), ("total_order", 0.18, FAINT, "total"))
    for name, shift, colour, label in kinds:
        values, interval = getattr(found, name), getattr(spread, name).confidence_interval
        bars = np.abs(np.stack([values - interval.low, interval.high - values]))
        ticks = {"ecolor": INK, "elinewidth": 0.8}
        axes.bar(places + shift, values, 0.34, yerr=bars, color=colour, label=label, error_kw=ticks)
    axes.set_xticks(places, [NAMES[name] for name in ranges])
    axes.axhline(0.0, color=INK, lw=0.6)
    axes.set(title=f"{finger}: {count * (2 + len(ranges)):,} scenes", ylim=(-0.1, 1.1))
    axes.set_ylabel("Sobol index of log10 rms acceleration")
    axes.legend(frameon=False, fontsize=7.5)


if __name__ == "__main__":
    main(sys.argv[1:])
