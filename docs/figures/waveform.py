"""Draws a rendered waveform with its spectrum: waveform.svg and waveform.png, for README.md.

    python -m docs.figures.waveform [FOLDER]

The scene is that of the README's first command, rendered as displacement and as acceleration at full
band. Needs the extra `plots`.
The same versions draw the same bytes.
"""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from clients.figure_look import BLUE, FAINT, INK, LOOK, RED, Real, new_figure, saved
from synth import open_voice, parse_scene
from synth.scene.scene import Scene

HERE = Path(__file__).resolve().parent
SCENE = HERE.parent / "examples" / "paper-finger.json"
OUTPUT = {
    "channels": [{"quantity": "displacement"}, {"quantity": "acceleration"}],
    "duration": 2.0,
    "bandwidth": "full",
}
PERIODS = 3  # of the texture, drawn
FELT_HZ = 1000.0  # what a fingertip feels ends about here (docs/examples/README.md, back-and-forth.json)
LOWEST_HZ, HIGHEST_HZ = 60.0, 24000.0
NAMED = (1, 3, 8)  # harmonics that carry their number
RANGE_DB = 90.0  # of a spectrum, below its strongest line


@dataclass(frozen=True, slots=True)
class Row:
    """How a quantity is drawn: its channel, factor from SI to `unit`, names and colour."""

    channel: int
    factor: float
    name: str
    unit: str
    colour: str


ROWS = (
    Row(0, 1e6, "displacement", "µm", BLUE),
    Row(1, 1.0, "acceleration", "m/s²", RED),
)


def main(folder: Path = HERE) -> None:
    """Write waveform.svg and waveform.png into `folder`."""
    scene = parse_scene(json.loads(SCENE.read_text("utf-8")) | {"output": OUTPUT})
    with matplotlib.rc_context(LOOK):
        saved(draw(scene, rendered(scene)), folder, "waveform")


def rendered(scene: Scene) -> Real:
    """Return the whole render in SI units, float64 [frames, channels]."""
    voice = open_voice(scene)
    frames = round(scene.output.duration * voice.sample_rate)
    return np.asarray(voice.render(frames) * np.array(voice.full_scale), dtype=np.float64)


def draw(scene: Scene, sound: Real) -> Figure:
    """Return the figure: a row for each quantity, its waveform and its spectrum."""
    figure = new_figure(7.4, 4.3)
    panels = figure.subplots(2, 2, sharex="col", width_ratios=(1.0, 1.25))
    for row, (waveform, spectrum) in zip(ROWS, panels, strict=True):
        draw_waveform(waveform, row, scene, sound[:, row.channel] * row.factor)
        draw_spectrum(spectrum, row, scene, sound[:, row.channel] * row.factor)
    figure.align_ylabels()
    panels[0, 1].annotate(
        "not felt, above 1 kHz", (0.98, 0.97), xycoords="axes fraction", color=INK, fontsize=7.5, ha="right", va="top"
    )
    panels[0, 0].set_title(words(scene), loc="left", fontsize=8.5, color=INK)
    panels[0, 1].set_title(f"harmonics n of u/λ₂ = {fundamental(scene):g} Hz", loc="left", fontsize=8.5, color=INK)
    panels[1, 0].set_xlabel("time (ms)")
    panels[1, 1].set_xlabel("frequency (kHz)")
    return figure


def words(scene: Scene) -> str:
    """Return what was rendered, in a line."""
    texture, scan = scene.texture, scene.scan
    return f"λ₂ = {1e3 * texture.period:g} mm, u = {1e3 * scan.speed:g} mm/s, w = {scan.load:g} N"


def fundamental(scene: Scene) -> float:
    """Return texture periods a second."""
    return scene.scan.speed / scene.texture.period


def draw_waveform(axes: Axes, row: Row, scene: Scene, values: Real) -> None:
    """Draw the first periods, with a mark where each begins."""
    rate, period = scene.output.sample_rate, 1.0 / fundamental(scene)
    shown = round(PERIODS * period * rate) + 1
    for begin in range(PERIODS + 1):
        axes.axvline(1e3 * begin * period, color=FAINT, linewidth=0.5, alpha=0.5, zorder=0)
    axes.axhline(0.0, color=FAINT, linewidth=0.5, zorder=0)
    axes.plot(1e3 * np.arange(shown) / rate, values[:shown], color=row.colour, linewidth=1.1)
    axes.set_xlim(0.0, 1e3 * PERIODS * period)
    axes.set_ylabel(f"{row.name} ({row.unit})")
    axes.margins(y=0.12)


def draw_spectrum(axes: Axes, row: Row, scene: Scene, values: Real) -> None:
    """Draw the amplitude of each harmonic; what lies beyond the sense of touch is shaded."""
    frequencies, levels = harmonics(scene, values)
    bottom = levels.max() - RANGE_DB
    shown = levels > bottom
    axes.axvspan(FELT_HZ, HIGHEST_HZ, color=FAINT, alpha=0.12, linewidth=0.0, zorder=0)
    axes.vlines(frequencies[shown], bottom, levels[shown], color=row.colour, linewidth=0.5, alpha=0.45)
    axes.plot(frequencies[shown], levels[shown], "o", color=row.colour, markersize=1.9, markeredgewidth=0.0)
    axes.set_xscale("log")
    axes.set_xlim(LOWEST_HZ, HIGHEST_HZ)
    axes.set_xticks([100.0, 1000.0, 10000.0])
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _place: f"{1e-3 * value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_ylim(bottom, levels.max() + 14.0)
    axes.set_ylabel(f"amplitude (dB re 1 {row.unit})")
    for number in NAMED:
        place = (frequencies[number - 1], levels[number - 1])
        axes.annotate(f"n = {number}", place, (0, 4), textcoords="offset points", color=INK, fontsize=7, ha="center")


def harmonics(scene: Scene, values: Real) -> tuple[Real, Real]:
    """Return frequency (Hz) and level (dB of the peak amplitude) of each harmonic, from a whole number of periods."""
    rate, first = scene.output.sample_rate, fundamental(scene)
    periods = len(values) * first / rate
    assert abs(periods - round(periods)) < 1e-9, "the spectrum is taken over whole periods"
    amplitudes: Real = 2.0 / len(values) * np.abs(np.fft.rfft(values))[:: round(periods)]
    numbers: Real = np.arange(1.0, len(amplitudes))
    levels: Real = 20.0 * np.log10(np.maximum(amplitudes[1:], 1e-30))
    return numbers * first, levels


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE)
