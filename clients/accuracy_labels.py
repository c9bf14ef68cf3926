"""Puts words beside points of a figure so that none lies on another: greedy, by the least of what a place would cover.

Model: each label tries places round its point, near ones first; a place costs what it would cover (words already
    placed most, then points, then lines) and how far it is. What finds no free place is dropped, unless it must stay.
Limits: one after another, so an early label may take the only place of a later one: put the important ones first.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import RendererAgg
from matplotlib.transforms import Bbox

Points = npt.NDArray[np.float64]

REACHES = (4.5, 8.0, 13.0, 20.0, 29.0, 40.0, 54.0, 72.0, 95.0, 125.0)  # points between a label and its place
Direction = tuple[float, float]
UP_OR_DOWN: tuple[Direction, ...] = ((0, 1), (0, -1))  # for words along a line across
ASIDE: tuple[Direction, ...] = ((1, 0), (-1, 0))  # for words along a line up
CORNERS: tuple[Direction, ...] = ((1, 1), (1, -1), (-1, 1), (-1, -1))
SLID: tuple[Direction, ...] = ((0.5, 1), (0.5, -1), (-0.5, 1), (-0.5, -1))
DIRECTIONS = (*ASIDE, *CORNERS, *UP_OR_DOWN, *SLID)
WORDS, POINT, LINE, FAR = 1000.0, 150.0, 2.5, 0.5  # costs: of covered words, a point, a bit of line, a point of way
CROSSED = 200.0  # cost of words that a thin line would cross
DROPPED = 35.0  # cost at which a label that need not stay is left out: it would cover a point
STEP = 2.0  # points between the bits of a line
FAINT = 8  # of the bits of a faint line, one counts
LEADER = 13.0  # points: a label further away gets a thin line to its place
MARKER = 4.2  # points round a point that words stay off
ROOM = 1.2  # points round a label that stay free


@dataclass(frozen=True, slots=True)
class Label:
    """Words for the point (x, y) of the axes' data.

    keep: shown even where it covers other words. close: at the nearest reach only, in one of `directions`.
    """

    text: str
    x: float
    y: float
    colour: str
    size: float
    bold: bool = False
    keep: bool = False
    close: bool = False
    directions: tuple[Direction, ...] = DIRECTIONS


class Placing:
    """Labels of one figure: what is taken, in points of the page."""

    def __init__(
        self,
        axes: Axes,
        points: Sequence[tuple[float, float]],
        lines: Iterable[Points],
        faint: Iterable[Points],
    ) -> None:
        """Labels keep off `points` (data), less so off `lines` (arrays [n, 2] of data), and least off `faint` ones."""
        assert axes.figure.dpi == 72, "a pixel is a point"
        self._axes = axes
        self._renderer = RendererAgg(10, 10, 72)  # type: ignore[no-untyped-call]
        self._points = self._on_page(np.asarray(points, dtype=np.float64).reshape(-1, 2))
        bits = [self._bits(line) for line in lines] + [self._bits(line)[::FAINT] for line in faint]
        self._lines = np.concatenate([np.zeros((0, 2)), *bits])
        self._taken: list[Bbox] = []
        self._room = axes.get_window_extent(self._renderer)

    def take(self, box: Bbox) -> None:
        """Keep labels off `box`, in points of the page."""
        self._taken.append(box)

    def put(self, *labels: Label) -> bool:
        """Place the one of `labels` that covers least where it does; return whether one was placed."""
        best: tuple[float, Label, Points, Bbox] | None = None
        for label, centre, box, price in itertools.chain.from_iterable(map(self._choices, labels)):
            if best is None or price < best[0]:
                whole = price + self._price_of_way(centre, box)
                if best is None or whole < best[0]:
                    best = whole, label, centre, box
        if best is None or (best[0] >= DROPPED and not best[1].keep):
            return False
        _, label, centre, box = best
        self.take(box)
        way = _way(centre, box)
        if leader := len(way) * STEP > LEADER:
            self._lines = np.concatenate([self._lines, way])
        self._draw(label, centre, box, leader=leader)
        return True

    def _choices(self, label: Label) -> Iterator[tuple[Label, Points, Bbox, float]]:
        """Yield the places of a label within the axes, with their prices but for the way."""
        centre = self._on_page(np.array([[label.x, label.y]]))[0]
        width, height = self._extent(label)
        for reach, (turn, direction) in itertools.product(
            REACHES[: 1 if label.close else None], enumerate(label.directions)
        ):
            box = _beside(centre, direction, reach, width, height)
            if self._inside(box):
                yield label, centre, box, FAR * reach + 0.01 * turn + self._price(box)

    def _draw(self, label: Label, centre: Points, box: Bbox, *, leader: bool) -> None:
        nearest = np.clip(centre, (box.x0, box.y0), (box.x1, box.y1))
        line = {
            "arrowstyle": "-",
            "linewidth": 0.5,
            "color": label.colour,
            "shrinkA": 0.0,
            "shrinkB": 2.5,
            "relpos": ((nearest[0] - box.x0) / box.width, (nearest[1] - box.y0) / box.height),
        }
        self._axes.annotate(
            label.text,
            (label.x, label.y),
            (0.5 * (box.x0 + box.x1) - centre[0], 0.5 * (box.y0 + box.y1) - centre[1]),
            textcoords="offset points",
            ha="center",
            va="center",
            fontsize=label.size,
            fontweight="bold" if label.bold else "normal",
            color=label.colour,
            arrowprops=line if leader else None,
            zorder=6,
        )

    def _extent(self, label: Label) -> tuple[float, float]:
        probe = self._axes.text(
            0, 0, label.text, fontsize=label.size, fontweight="bold" if label.bold else "normal", transform=None
        )
        box = probe.get_window_extent(self._renderer)
        probe.remove()
        return box.width + 2 * ROOM, box.height + 2 * ROOM

    def _price(self, box: Bbox) -> float:
        covered = WORDS * sum(box.overlaps(other) for other in self._taken)
        return covered + POINT * _within(box.padded(MARKER), self._points) + LINE * _within(box, self._lines)

    def _price_of_way(self, centre: Points, box: Bbox) -> float:
        """Return what the thin line from a place to its label crosses."""
        way = _way(centre, box)
        if len(way) * STEP <= LEADER:
            return 0.0
        steps = way[round(5.0 / STEP) :, np.newaxis]
        met = np.count_nonzero((np.abs(steps - self._lines) < STEP).all(axis=2))
        return LINE * met + CROSSED * sum(_within(other, way) > 1 for other in self._taken)

    def _inside(self, box: Bbox) -> bool:
        room = self._room
        return bool(box.x0 > room.x0 and box.x1 < room.x1 and box.y0 > room.y0 and box.y1 < room.y1)

    def _bits(self, line: Points) -> Points:
        return _dotted(self._on_page(np.asarray(line, dtype=np.float64)))

    def _on_page(self, data: Points) -> Points:
        return np.asarray(self._axes.transData.transform(data), dtype=np.float64)


def _beside(centre: Points, direction: Direction, reach: float, width: float, height: float) -> Bbox:
    """Return the box of that size whose side or corner toward `centre` is `reach` away from it."""
    x = centre[0] + direction[0] * (reach + 0.5 * width)
    y = centre[1] + direction[1] * (reach + 0.5 * height)
    return Bbox.from_bounds(x - 0.5 * width, y - 0.5 * height, width, height)


def _way(centre: Points, box: Bbox) -> Points:
    """Return points from `centre` to the nearest of a box, about STEP apart."""
    nearest = np.clip(centre, (box.x0, box.y0), (box.x1, box.y1))
    return _dotted(np.stack([centre, nearest]))


def _dotted(line: Points) -> Points:
    """Return points along a line, about STEP apart."""
    parts = [line[:1]]
    for begin, end in itertools.pairwise(line):
        count = max(1, int(np.hypot(*(end - begin)) / STEP))
        parts.append(begin + (end - begin) * np.linspace(0.0, 1.0, count + 1)[1:, np.newaxis])
    return np.concatenate(parts)


def _within(box: Bbox, points: Points) -> int:
    inside = (points > (box.x0, box.y0)) & (points < (box.x1, box.y1))
    return int(np.count_nonzero(inside.all(axis=1)))
