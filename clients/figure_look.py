"""How figures look, and how they are written: the same bytes from the same versions. Needs the extra `plots`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

LOOK: Any = {
    "font.family": "DejaVu Sans",
    "font.size": 8.5,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "svg.hashsalt": "ridgewave",
    "figure.facecolor": "white",
}
INK, FAINT = "#1d2733", "#8a94a0"
BLUE, RED, GREEN = "#1f6f8b", "#b5482a", "#5d8a3a"
ORANGE, YELLOW = "#d55e00", "#e3b505"  # with BLUE and INK told apart by the colour-blind
WITHOUT_DATE = {
    ".svg": {"Date": None, "Creator": None},
    ".png": {"Software": None},
    ".pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}
"""Endings of a figure, and the metadata that would differ from one time to the next."""

Real = npt.NDArray[np.float64]


def shade(number: int, count: int) -> Any:
    """Return the colour of one of `count` lines in order, from dark to light."""
    return matplotlib.colormaps["viridis"](0.8 * number / max(1, count - 1))


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure of `width` and `height` inches."""
    return Figure(figsize=(width, height), layout=ConstrainedLayoutEngine(w_pad=0.09, h_pad=0.06))


def saved(figure: Figure, folder: Path, name: str) -> None:
    """Write NAME.svg and NAME.png into `folder`, without dates."""
    for ending in (".svg", ".png"):
        save(figure, folder / f"{name}{ending}")


def save(figure: Figure, path: Path) -> None:
    """Write `figure` to `path` (an ending of WITHOUT_DATE), without dates. Raises OSError."""
    with matplotlib.rc_context(LOOK):
        figure.savefig(path, dpi=200, metadata=WITHOUT_DATE[path.suffix.lower()])
