"""Draws how a hand on the network is followed, and prints the tables of docs/live-motion.md: following.svg and .png.

    python -m docs.figures.following [FOLDER]

Hands, networks and ways are those of `following_measures`. Needs the extra `plots`. The same versions draw the
same bytes.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from clients.figure_look import BLUE, FAINT, GREEN, INK, LOOK, RED, Real, new_figure, saved
from docs.figures.following_measures import (
    LENGTH,
    LOADED,
    RATE,
    REST,
    STEADY,
    STROKE_TIME,
    TROUBLES,
    WAYS,
    Figures,
    Network,
    arrivals,
    chosen,
    clean,
    figures,
    followed,
    load_figures,
    press,
    pressed,
    silence_after_lift,
    steady,
    strokes,
)
from synth.motion.motion import LOAD

HERE = Path(__file__).resolve().parent
HZ = 125.0  # of the updates that are drawn: an old mouse, a headset at half of its own rate
SEED = 3
RATES = (30, 60, 90, 125, 250, 500, 1000)
COMPARED = (30, 60, 125, 1000)
DECAYS = (100, 150, 200, 300, 400)
SHOWN = {
    "low pass of the held position": FAINT,
    "line by arrival, no clock": RED,
    "line without delay": GREEN,
    "chosen: line 10 ms late": BLUE,
}

HEAD = (
    "lag (ms)", "error about it (µm rms)", "sidebands (dB)", "ripple of the speed (%)", "past a stop (µm)",
    "past a turn (µm)", "largest step of the acceleration (m/s²)", "still after (ms)",
)  # fmt: skip


def main(folder: Path = HERE) -> None:
    """Write following.svg and following.png into `folder`, and print the tables."""
    with matplotlib.rc_context(LOOK):
        saved(draw(), folder, "following")
    for line in tables():
        print(line)


# -- tables


def tables() -> Iterator[str]:
    """Yield the tables of the page as Markdown, line by line."""
    yield from headed("way", *HEAD)
    for name, way in WAYS.items():
        yield row(f"{name}", figures(way, Network(HZ)))
    yield from headed("way, at the rate", *HEAD)
    for hz in COMPARED:
        for name in ("low pass of the held position", "line without delay", "line 20 ms late"):
            yield row(f"{name}, {hz} Hz", figures(WAYS[name], Network(hz)))
    yield from headed("updates", *HEAD)
    for hz in RATES:
        yield row(f"{hz} Hz", figures(chosen, Network(hz)))
    for hz in RATES[:4]:
        yield row(f"{hz} Hz, a clean network", figures(chosen, clean(hz)))
    yield from headed("trouble, at 125 Hz", *HEAD)
    for name, network in TROUBLES.items():
        yield row(name, figures(chosen, network(HZ)))
    yield from headed("decay of the load (1/s)", "lag (ms)", "error about it (mN rms)", "rate beyond (N/s rms)")
    for hz in (30, 125):
        for decay in DECAYS:
            lag, error, ripple = load_figures(hz, decay)
            yield f"| {decay}, {hz} Hz | {1e3 * lag:.1f} | {1e3 * error:.1f} | {ripple:.2f} |"
    light, none = silence_after_lift()
    yield f"\nA sudden lift of {LOADED:g} N: below 1 mN after {1e3 * light:.0f} ms, no load after {1e3 * none:.0f} ms."


def headed(*names: str) -> Iterator[str]:
    """Yield the head of a table."""
    yield f"\n| {' | '.join(names)} |"
    yield f"| --- |{' ---: |' * (len(names) - 1)}"


def row(name: str, found: Figures) -> str:
    """Return one line of a table."""
    cells = (
        f"{1e3 * found.lag:.1f}", f"{1e6 * found.error:.0f}", f"{found.rough:.1f}", f"{100 * found.ripple:.1f}",
        f"{1e6 * max(found.stop, 0.0):.0f}", f"{1e6 * max(found.turn, 0.0):.0f}", f"{found.step:.2f}",
        f"{1e3 * found.still:.0f}",
    )  # fmt: skip
    return f"| {name} | {' | '.join(cells)} |"


# -- figure


def draw() -> Figure:
    """Return speed of a steady hand, a turn, and a touch and lift, each as it is and as it is followed."""
    figure = new_figure(7.4, 5.2)
    grid = figure.add_gridspec(2, 2, width_ratios=(1.35, 1.0))
    _speeds(figure.add_subplot(grid[0, :]))
    _turn(figure.add_subplot(grid[1, 0]))
    _touch(figure.add_subplot(grid[1, 1]))
    return figure


def _speeds(axes: Axes) -> None:
    applied = arrivals(steady, pressed, Network(HZ), 3.0, SEED)
    t = 1e3 * np.arange(3 * RATE) / RATE - 1500.0
    for name, colour in SHOWN.items():
        axes.plot(t[::16], 1e3 * WAYS[name](applied, 3 * RATE)[1][::16], color=colour, linewidth=1.1, label=name)
    axes.axhline(1e3 * STEADY, color=INK, linewidth=0.6, linestyle=(0, (4, 3)))
    _titled(axes, f"a steady hand, {1e3 * STEADY:g} mm/s; {HZ:g} Hz of late, lost and rounded updates", "speed (mm/s)")
    axes.set_xlim(0.0, 400.0)
    axes.set_ylim(0.0, 160.0)
    axes.legend(frameon=False, fontsize=7.5, ncols=4, loc="upper center", labelcolor=INK, columnspacing=1.2)


def _turn(axes: Axes) -> None:
    seconds, begin = 2.0, 2.0 * (STROKE_TIME + REST)
    applied = arrivals(strokes, pressed, Network(HZ), seconds, SEED)
    t = np.arange(round(seconds * RATE)) / RATE
    for name, colour in SHOWN.items():
        if name != "line by arrival, no clock":
            x = WAYS[name](applied, len(t))[0]
            axes.plot(1e3 * (t - begin)[::16], 1e3 * x[::16], color=colour, linewidth=1.1)
    axes.plot(1e3 * (t - begin)[::16], 1e3 * strokes(t[::16]), color=INK, linewidth=0.7, linestyle=(0, (4, 3)))
    _titled(axes, "the end of a stroke (dashed: the hand)", "position (mm)")
    axes.set_xlim(250.0, 500.0)
    axes.set_ylim(1e3 * LENGTH - 8.0, 1e3 * LENGTH + 1.6)


def _touch(axes: Axes) -> None:
    for hz, colour in ((30.0, RED), (HZ, BLUE)):
        load: Real = followed(arrivals(steady, press, Network(hz), 2.0, SEED), 2 * RATE)[0][LOAD]
        t = 1e3 * np.arange(2 * RATE) / RATE - 1000.0
        axes.plot(t[::16], load[::16], color=colour, linewidth=1.1, label=f"{hz:g} Hz")
    axes.plot(t[::16], press(1e-3 * t[::16] + 1.0), color=INK, linewidth=0.7, linestyle=(0, (4, 3)))
    _titled(axes, "a touch and a lift (dashed: the hand)", "load (N)")
    axes.set_xlim(-50.0, 800.0)
    axes.legend(frameon=False, fontsize=7.5, labelcolor=INK)


def _titled(axes: Axes, title: str, up: str) -> None:
    axes.set_title(title, loc="left", fontsize=8.5, color=INK)
    axes.set_xlabel("time (ms)")
    axes.set_ylabel(up)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE)
