"""Draws by what a texture is felt, over its period and the speed: duplex.svg and duplex.png, for docs/study.md.

    python -m docs.figures.duplex [FOLDER]

A fingertip and a comb at 0.5 N on sinusoids from 20 um to 10 mm, whose amplitude is a twentieth of the period, 20 um at
most. Left: levels over the threshold of each receptor class at 80 mm/s. Right: by what the comb feels each period at
each speed. Needs the extra `plots`. The same versions draw the same bytes.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from docs.figures.look import BLUE, FAINT, GREEN, INK, LOOK, RED, new_figure, saved
from synth.scene.scene import parse_scene
from synth.study.skin_outcome import skin_felt

HERE = Path(__file__).resolve().parent
PERIODS, SPEEDS = np.geomspace(2e-5, 1e-2, 33), np.geomspace(1e-2, 0.16, 7)  # m, m/s
LEVELS, SPEED, LOAD = (-40.0, 90.0), 0.08, 0.5  # dB; m/s; N
BOUNDARY = 2e-4  # m: up to here roughness follows the Pacinian power (Bensmaia & Hollins, 2003)
COLOURS = {
    "nothing": "#ffffff", "vibration": BLUE, "spatial pattern": GREEN, "vibration and spatial pattern": "#c9a227",
}  # fmt: skip


def scene_of(finger: str, period: float, speed: float) -> dict[str, Any]:
    """Return one of the scenes."""
    texture = {"period": float(period), "amplitude": min(float(period) / 20.0, 20e-6)}
    return {"finger": {"kind": finger}, "texture": texture, "scan": {"speed": float(speed), "load": LOAD}}


def levels(finger: str) -> dict[str, list[float]]:
    """Return the level of each receptor class, and of the whole finger, at each period (dB); -inf: nothing moves."""
    found: dict[str, list[float]] = {}
    for period in PERIODS:
        felt = skin_felt(parse_scene(scene_of(finger, period, SPEED)))
        told = {one["receptor"]: one["level"] for one in felt["receptors"]} | {"whole": felt["whole_finger_level"]}
        for name, level in told.items():
            found.setdefault(name, []).append(-np.inf if level is None else level)
    return found


def felt_by() -> list[list[str]]:
    """Return by what a comb feels each period, speed by speed."""
    return [
        [skin_felt(parse_scene(scene_of("comb", period, speed)))["felt_by"] for period in PERIODS] for speed in SPEEDS
    ]


def main(words: list[str]) -> None:
    """Write duplex.svg and duplex.png into the folder that `words` names, or beside this file."""
    folder = Path(words[0]) if words else HERE
    matplotlib.use("Agg")
    with matplotlib.rc_context(LOOK):
        figure = new_figure(8.6, 3.4)
        left, right = figure.subplots(1, 2, width_ratios=(1.15, 1.0))
        _draw_levels(left)
        _draw_map(figure, right)
        saved(figure, folder, "duplex")


def _draw_levels(axes: Axes) -> None:
    names = (("PC", BLUE, "PC, vibration"), ("RA", RED, "RA, vibration"), ("SA1", GREEN, "SA1, spatial pattern"))
    for finger, style in (("fingertip", "-"), ("comb", ":")):
        found = levels(finger)
        for name, colour, label in (*names, ("whole", FAINT, "motion of the whole finger")):
            values = np.where(np.array(found[name]) > LEVELS[0], found[name], np.nan)
            axes.plot(1e3 * PERIODS, values, style, color=colour, lw=1.2, label=label if style == "-" else None)
    axes.axhline(0.0, color=INK, lw=0.6)
    axes.axvline(1e3 * BOUNDARY, color=INK, lw=0.6, ls="--")
    axes.text(1.05e3 * BOUNDARY, LEVELS[0] + 2.0, "0.2 mm", color=INK, fontsize=7.5)
    axes.set(xscale="log", ylim=LEVELS, xlabel="period of the texture (mm)", ylabel="level over threshold (dB)")
    axes.set_title("80 mm/s, 0.5 N; fingertip drawn out, comb dotted", fontsize=8.5)
    axes.legend(fontsize=7.0, frameon=False, loc="upper left", ncols=2)


def _draw_map(figure: Figure, axes: Axes) -> None:
    kinds = list(COLOURS)
    numbers = np.array([[kinds.index(one) for one in row] for row in felt_by()])
    shades = matplotlib.colors.ListedColormap(list(COLOURS.values()))
    axes.pcolormesh(1e3 * PERIODS, 1e3 * SPEEDS, numbers, cmap=shades, vmin=-0.5, vmax=3.5, shading="nearest")
    axes.axvline(1e3 * BOUNDARY, color=INK, lw=0.6, ls="--")
    axes.set(xscale="log", yscale="log", xlabel="period of the texture (mm)", ylabel="speed (mm/s)")
    axes.set_title("a comb feels it by", fontsize=8.5)
    patches = [Patch(facecolor=colour, edgecolor=INK, lw=0.4, label=kind) for kind, colour in COLOURS.items()]
    figure.legend(handles=patches, fontsize=7.0, frameon=False, loc="outside lower right", ncols=4)


if __name__ == "__main__":
    main(sys.argv[1:])
