"""The figure of `ridgewave compare`: Welch spectra with their confidence, and the lines of the model. Extra `plots`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from synth.errors import CannotRender
from synth.scene.effects_section import unit_of

INK, MEASURED, MODEL = "#1d2733", "#1f6f8b", "#b5482a"
WIDTH, HEIGHT = 7.0, 2.6  # inches, of a recording


def draw(comparisons: Sequence[Any], path: Path) -> None:
    """Write the figure to `path` (.svg, .png or .pdf). Raises CannotRender without the extra `plots`, OSError."""
    try:
        from matplotlib.figure import Figure
    except ModuleNotFoundError:
        raise CannotRender("The figure needs matplotlib: pip install 'ridgewave[plots]'.") from None
    figure = Figure(figsize=(WIDTH, HEIGHT * len(comparisons)), layout="constrained")
    rows = figure.subplots(len(comparisons), 1, squeeze=False)[:, 0]
    for axes, one in zip(rows, comparisons, strict=True):
        _spectrum(axes, one)
    figure.savefig(path, dpi=200)


def _spectrum(axes: Any, one: Any) -> None:
    spectrum, gain = one.spectrum, 10.0 ** ((one.gain or 0.0) / 20.0)
    per_bin = np.sqrt(2.0 * spectrum.density * spectrum.bin * 1.5) * gain  # amplitude of a line in a Hann window
    low, high = spectrum.interval()
    band = per_bin * low**0.5, per_bin * high**0.5
    axes.fill_between(spectrum.hertz, *band, color=MEASURED, alpha=0.25, lw=0, label="95 % confidence")
    axes.plot(spectrum.hertz, per_bin, color=MEASURED, lw=0.8, label="measured")
    model = [(line.measured.frequency, line.model) for line in one.lines if line.model > 0.0]
    if model:
        axes.plot(*zip(*model, strict=True), "o", ms=3.5, mfc="none", color=MODEL, label="lines of the model")
    found = [(line.measured.frequency, line.measured.amplitude * gain) for line in one.lines if line.measured.found]
    if found:
        axes.plot(*zip(*found, strict=True), "x", ms=4.0, color=INK, label="lines found")
    name = f"{one.quantity.replace('_', ' ')} ({unit_of(one.quantity).replace('^2', '$^2$')})"
    top = one.lines[-1].measured.frequency * 1.1
    axes.set(yscale="log", xlim=(0.0, top), xlabel="frequency (Hz)", ylabel=f"amplitude of lines, {name}")
    axes.set_title(one.name, fontsize=9)
    axes.legend(fontsize=7, frameon=False)
