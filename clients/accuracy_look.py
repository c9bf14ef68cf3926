"""How the figure of what accuracy costs looks: fonts, colours and markers, and where on it a method stands."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from matplotlib.axes import Axes

from clients.accuracy_series import Document, Row, cost_of

SMALL, SMALLEST = 8.0, 7.6  # points, of words
INK, FAINT, FRONT = "#1d2733", "#6b7682", "#c3cad2"
LOOK: Any = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans", "Verdana"],
    "font.size": 9.0,
    "axes.linewidth": 0.6,
    "axes.edgecolor": INK,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.minor.visible": False,
    "ytick.minor.visible": False,
    "svg.fonttype": "none",
    "svg.hashsalt": "ridgewave",
    "figure.facecolor": "white",
    "figure.dpi": 72,
}


@dataclass(frozen=True, slots=True)
class Style:
    """How a family is drawn; colours after Okabe & Ito, told apart in grey by their markers."""

    colour: str
    marker: str
    size: float = 4.2


STYLES = {
    "baseline": Style("#b8480a", "s", 3.9),
    "sampled": Style("#d18f00", "D", 3.7),
    "exact": Style("#0072b2", "o", 4.4),
    "table": Style("#00785a", "^", 4.6),
    "harmonics": Style("#b35a8f", "v", 4.6),
    "closed": Style("#111111", "*", 8.0),
}
OTHER = Style("#555555", "X")


def style_of(family: str) -> Style:
    """Return the style of a family, known or not."""
    return STYLES.get(family, OTHER)


def place_of(axes: Axes, document: Document, row: Row) -> tuple[float, float]:
    """Return where a method stands; one without error a little above the lower edge."""
    return cost_of(document, row), row["max_error"] or 1.5 * axes.get_ylim()[0]
