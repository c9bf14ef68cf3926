"""By what a texture is felt, over its period and the speed: levels of each receptor class, and a map of each finger."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from clients.figure_look import BLUE, FAINT, INK, ORANGE, YELLOW, Real, new_figure
from clients.study_figures import cannot_draw

if TYPE_CHECKING:
    from xarray import Dataset

FINGER, TEXTURE, SPEED = "finger.kind", "texture", "scan.speed"
LEVELS, SHOWN = (-40.0, 90.0), 0.08  # dB; m/s, the speed at which levels are drawn
BOUNDARY = 2e-4  # m: up to here roughness follows the Pacinian power (Bensmaia & Hollins, 2003)
KINDS = {
    "nothing": "#ffffff", "vibration": BLUE, "spatial pattern": ORANGE, "vibration and spatial pattern": YELLOW,
}  # fmt: skip
STYLES = {"-": "solid", ":": "dotted", "--": "dashed", "-.": "dash-dotted"}


def check(found: Dataset) -> None:
    """Refuse a study with other axes, or without what the skin feels."""
    few = found.sizes.get(FINGER, 0) <= len(STYLES)
    many = found.sizes.get(TEXTURE, 0) > 1 and found.sizes.get(SPEED, 0) > 1
    if set(found.reason.dims) != {FINGER, TEXTURE, SPEED} or not json.loads(found.attrs["spec"])["skin"]:
        cannot_draw("duplex", f'the axes {FINGER}, {TEXTURE}, {SPEED}, and "skin": true')
    if not few or not many:
        cannot_draw("duplex", f"two textures, two speeds, and at most {len(STYLES)} fingers")


def drawn(found: Dataset) -> Figure:
    """Return the figure."""
    fingers = found[FINGER].values.tolist()
    turns = found.fundamental.isel({FINGER: 0, SPEED: 0}).values
    periods = np.asarray(found[SPEED].values[0] / turns, np.float64)
    figure = new_figure(4.6 + 3.0 * len(fingers), 3.4)
    left, *maps = figure.subplots(1, 1 + len(fingers), width_ratios=[1.4] + [1.0] * len(fingers))
    _draw_levels(left, found, periods)
    for axes, finger in zip(maps, fingers, strict=True):
        _draw_map(axes, found.sel({FINGER: finger}), periods)
        axes.set_title(f"{finger}: felt by", fontsize=8.5)
    maps[0].set_ylabel("speed (mm/s)")
    patches = [Patch(facecolor=colour, edgecolor=INK, lw=0.4, label=kind) for kind, colour in KINDS.items()]
    figure.legend(handles=patches, fontsize=7.0, frameon=False, loc="outside lower right", ncols=4)
    return figure


def felt_by(part: Dataset) -> Real:
    """Return the place in KINDS of each scene."""
    vibration = np.fmax(part.ra_level, part.pc_level) > 0.0
    return np.asarray(vibration + 2 * (part.sa1_level > 0.0), np.float64)


def _draw_levels(axes: Axes, found: Dataset, periods: Real) -> None:
    near = found.sel({SPEED: SHOWN}, method="nearest")
    names = (
        ("pc_level", BLUE, "PC, vibration"), ("ra_level", ORANGE, "RA, vibration"),
        ("sa1_level", INK, "SA1, spatial pattern"), ("sensation_level", FAINT, "motion of the whole finger"),
    )  # fmt: skip
    fingers = found[FINGER].values.tolist()
    for finger, style in zip(fingers, STYLES, strict=False):
        for name, colour, label in names:
            values = near[name].sel({FINGER: finger}).values
            values = np.where(values > LEVELS[0], values, np.nan)
            axes.plot(1e3 * periods, values, style, color=colour, lw=1.2, label=label if style == "-" else None)
    axes.axhline(0.0, color=INK, lw=0.6)
    axes.axvline(1e3 * BOUNDARY, ymax=0.85, color=INK, lw=0.6, ls="--")
    axes.text(1.05e3 * BOUNDARY, LEVELS[0] + 2.0, "0.2 mm", color=INK, fontsize=7.5)
    ends = 1e3 * float(np.min(periods)), 1e3 * float(np.max(periods))
    axes.set(
        xscale="log", xlim=ends, ylim=LEVELS, xlabel="period of the texture (mm)", ylabel="level over threshold (dB)"
    )
    drawn_as = ", ".join(f"{finger} {STYLES[style]}" for finger, style in zip(fingers, STYLES, strict=False))
    axes.set_title(f"{1e3 * float(near[SPEED]):.3g} mm/s; {drawn_as}", fontsize=8.5)
    axes.legend(fontsize=7.0, frameon=False, loc="upper left", ncols=2)


def _edges(centres: Real) -> Real:
    """Return the edges of cells around `centres`, at equal ratios."""
    inner = np.sqrt(centres[1:] * centres[:-1])
    return np.concatenate([[centres[0] ** 2 / inner[0]], inner, [centres[-1] ** 2 / inner[-1]]])


def _draw_map(axes: Axes, part: Dataset, periods: Real) -> None:
    shades = matplotlib.colors.ListedColormap(list(KINDS.values()))
    kinds = felt_by(part.transpose(SPEED, TEXTURE, ...))
    x, y = _edges(1e3 * periods), _edges(1e3 * part[SPEED].values)
    axes.pcolormesh(x, y, kinds, cmap=shades, vmin=-0.5, vmax=3.5)
    axes.axvline(1e3 * BOUNDARY, color=INK, lw=0.6, ls="--")
    axes.set(xscale="log", yscale="log", xlabel="period of the texture (mm)")
