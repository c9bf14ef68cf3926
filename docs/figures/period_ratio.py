"""Draws the response over the period of the texture: period_ratio.svg and period_ratio.png, for docs/study.md.

    python -m docs.figures.period_ratio [FOLDER]

Left: rms displacement over the amplitude of the ridges of a comb with 20 ridges, over Lambda, the period of the texture
over that of the ridges, at A = 0.2 and four loads W; the heaviest one touches everywhere, where the sinc law holds.
Right: the same for a fingertip of 0.46 mm between ridges, at three loads. Needs the extras `plots` and `study`. The
same versions draw the same bytes.
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes

import ridgewave as rw
from docs.figures.look import BLUE, FAINT, GREEN, INK, LOOK, RED, Real, new_figure, saved

HERE = Path(__file__).resolve().parent
RATIOS, COUNTS = (0.3, 12.0), (600, 120)  # Lambda; scenes of a comb and of a fingertip at each load
RIDGES, A, LOADS = 20.0, 0.2, (0.3, 1.0, 3.0, 30.0)  # tau, A, W
FORCES, RIDGE, AMPLITUDE = (0.1, 0.3, 1.0), 0.46e-3, 5e-6  # N, m, m
FULL = {"bandwidth": "full"}
COLOURS = (BLUE, GREEN, RED, FAINT)


def comb() -> tuple[Real, Real]:
    """Return Lambda, and rms over a1 [loads, ratios]."""
    ratios = np.geomspace(*RATIOS, COUNTS[0])
    axes = {"groups.load": list(LOADS), "groups.period_ratio": ratios}
    base = rw.Scene.from_groups({"output": FULL}, ridges=RIDGES, amplitude_ratio=A)
    found = rw.sweep(base, axes, phases=256, lines=1).rms.sel(quantity="displacement")
    return ratios, np.asarray(found.values / base.finger.ridge_amplitude, np.float64)


def fingertip() -> tuple[Real, Real]:
    """Return the period over that of the ridges, and rms over their amplitude [loads, ratios]."""
    ratios = np.geomspace(*RATIOS, COUNTS[1])
    scene = rw.parse_scene({"finger": {"kind": "fingertip"}, "texture": {"amplitude": AMPLITUDE}, "output": FULL})
    axes = {"scan.load": list(FORCES), "texture.period": RIDGE * ratios}
    found = rw.sweep(scene, axes, phases=256, lines=1).rms.sel(quantity="displacement")
    return ratios, np.asarray(found.values / scene.finger.ridge_amplitude, np.float64)


def main(words: list[str]) -> None:
    """Write period_ratio.svg and period_ratio.png into the folder that `words` names, or beside this file."""
    folder = Path(words[0]) if words else HERE
    matplotlib.use("Agg")
    with matplotlib.rc_context(LOOK):
        figure = new_figure(8.6, 3.4)
        left, right = figure.subplots(1, 2, sharex=True)
        ratios, found = comb()
        for load, line, colour in zip(LOADS, found, COLOURS, strict=True):
            left.plot(ratios, line, color=colour, lw=0.8, label=f"W = {load:g}")
        law = A / np.sqrt(2.0) * np.abs(np.sinc(RIDGES / ratios))
        left.plot(ratios, law, ":", color=INK, lw=1.0, label="sinc law, full contact")
        _finish(left, "comb: 20 ridges, A = 0.2", (1e-4, 1.0))
        ratios, found = fingertip()
        for load, line, colour in zip(FORCES, found, COLOURS, strict=False):
            right.plot(ratios, line, color=colour, lw=0.8, label=f"{load:g} N")
        _finish(right, "fingertip: texture 5 um high, ridges 0.46 mm apart", (1e-4, 1.0))
        saved(figure, folder, "period_ratio")


def _finish(axes: Axes, title: str, limits: tuple[float, float]) -> None:
    axes.set(xscale="log", yscale="log", ylim=limits, title=title)
    axes.set_xlabel("period of the texture over that of the ridges, Lambda")
    axes.set_ylabel("rms displacement over ridge amplitude")
    axes.legend(frameon=False, fontsize=7.5, loc="upper right", ncols=2)


if __name__ == "__main__":
    main(sys.argv[1:])
