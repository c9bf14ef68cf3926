"""How the figures of docs/ look, and how they are written: SVG and PNG, the same bytes from the same versions."""

from __future__ import annotations

from pathlib import Path
from typing import Any

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

Real = npt.NDArray[np.float64]


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure of `width` and `height` inches."""
    return Figure(figsize=(width, height), layout=ConstrainedLayoutEngine(w_pad=0.09, h_pad=0.06))


def saved(figure: Figure, folder: Path, name: str) -> None:
    """Write NAME.svg and NAME.png into `folder`, without dates."""
    figure.savefig(folder / f"{name}.svg", metadata={"Date": None, "Creator": None})
    figure.savefig(folder / f"{name}.png", dpi=200, metadata={"Software": None})
