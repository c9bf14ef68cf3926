"""The kind `weave`: cloth of threads that cross, over an area, such as linen, denim, burlap or sateen.

Stage   SURFACES.
Model   Warp threads run across the scan and weft threads along it. Both have n threads per period, by the weave (UP). A
        thread has height H at its crown where it is on top of a crossing, and 0 where it is under one. Its height is

            H crown(from its middle) rise(along it)

        `crown` is a raised cosine, 1 in the middle and 0 at the sides of the thread. `rise` is half a cosine from one
        crossing to the next. The surface is the higher of warp and weft, and 0 in the gaps.
Source  The forms of crown and rise are choices. Weaves: the notations are the usual ones (general knowledge).
Limits  Threads are equally wide along and across, as a part of their distance; fibres and fuzz are left out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from synth.scene.quantity import Dimension
from synth.scene.rules import Choice, Quantity
from synth.scene.section import Section
from synth.scene.texture_registry import Kind
from synth.surfaces.height_field import HeightField
from synth.surfaces.profile import Array, Bounds

Flags = np.ndarray[Any, np.dtype[np.float64]]
Pair = tuple[Array, Array]


def _up(count: int, step: int, covered: int) -> Flags:
    """Return 1 where the warp is on top and 0 elsewhere [weft, warp], of `count` threads in a period.

    step: by which a weft thread has the pattern of the weft thread before it.
    covered: number of weft threads over which a warp thread floats.
    """
    numbers = np.arange(count)
    return np.asarray((step * numbers + numbers[:, np.newaxis]) % count < covered, np.float64)


UP: Mapping[str, Flags] = {
    "plain": _up(2, 1, 1),
    "2/1 twill": _up(3, 1, 2),
    "3/1 twill": _up(4, 1, 3),
    "sateen": _up(5, 2, 1),
}
"""Of each weave. In a plain one threads go over one and under one. In a 2/1 twill the warp floats over two of three
threads, in a 3/1 twill over three of four. In a sateen the weft floats over four of five."""

NODES = 16  # of Gauss and Legendre in each smooth part of a crossing: 12 give the same 13 digits
HALVINGS = 50  # of the interval that contains a crease


@dataclass(frozen=True, eq=False)
class Weave(HeightField):
    """Cloth.

    period, across: of the pattern, along and across the scan, m.
    weave: name in UP.
    height: H, m.
    width: of a thread, as a part of the distance of threads.
    phase: rad.
    """

    period: float
    across: float
    weave: str
    height: float
    width: float
    phase: float = 0.0
    kind = "weave"

    @property
    def key(self) -> Hashable:
        """Everything that decides the heights."""
        return self.kind, self.period, self.across, self.weave, self.height, self.width, self.phase

    @property
    def threads(self) -> int:
        """Number of threads per period, along and across."""
        return len(UP[self.weave])

    def area(self, x: Array, y: Array) -> Array:
        """Return the heights (m) at every pair of `x` and `y` (m)."""
        return self._above_gaps(np.asarray(x) / self.period + self.phase / (2.0 * math.pi), y) - self._moments[0]

    def _above_gaps(self, turns: Array, y: Array) -> Array:
        """Return the heights (m) above the gaps; turns: x in periods."""
        up, at = UP[self.weave], turns * self.threads
        rows = np.asarray(y) / self.across * self.threads
        warp, weft = (np.round(one).astype(np.int64) % self.threads for one in (at, rows))
        over = self._crowns(at) * _rises(up, rows)[:, warp]
        under = self._crowns(rows)[:, np.newaxis] * _rises(1.0 - up.T, at).T[weft]
        return np.asarray(self.height * np.maximum(over, under, out=over))

    def _crowns(self, places: Array) -> Array:
        """Return the height of threads, 0 to 1, at `places` in threads."""
        return _crown(np.abs(places - np.round(places)), self.width)[0]

    @cached_property
    def _moments(self) -> tuple[float, float, float]:
        """Mean of the heights above the gaps (m), of their square (m^2), and of (dh/dx)^2, over a period."""
        up, found = UP[self.weave], np.zeros(3)
        quarters = {changes: _quarter(self.width, *changes) for changes in product((False, True), repeat=2)}
        for row, column, below, beside in product(range(self.threads), range(self.threads), (-1, 1), (-1, 1)):
            warp = up[row, column]
            changes = (
                up[(row + below) % self.threads, column] != warp,
                up[row, (column + beside) % self.threads] != warp,
            )
            mean, square, through, along = quarters[changes if warp else changes[::-1]]
            found += mean, square, through if warp else along
        found /= 4.0 * self.threads**2
        steep = self.height * self.threads / self.period
        return self.height * float(found[0]), self.height**2 * float(found[1]), steep**2 * float(found[2])

    @property
    def bounds(self) -> Bounds:
        """Exact bounds of the heights and of the slope, that of a crown. There is a crease where threads meet."""
        mean, steep = self._moments[0], self._steepest(self.period)
        return Bounds(-mean, self.height - mean, steep, math.inf if steep else 0.0)

    def _steepest(self, period: float) -> float:
        return math.pi * self.height * self.threads / (self.width * period)

    @property
    def slope_across(self) -> float:
        """Bound of |dh/dy|."""
        return self._steepest(self.across)

    @property
    def rms(self) -> tuple[float, float]:
        """Rq (m) and rms slope along x, over the area."""
        mean, square, slope = self._moments
        return math.sqrt(max(square - mean**2, 0.0)), math.sqrt(slope)


def _crown(places: Array, width: float) -> Pair:
    """Return the height of a thread, 0 to 1, and its slope, at `places` from its middle, in distances of threads."""
    turned = np.minimum(places * (2.0 * math.pi / width), math.pi)
    return 0.5 + 0.5 * np.cos(turned), -math.pi / width * np.sin(turned)


def _fall(places: Array) -> Pair:
    """Return the height of a thread along it, 1 to 0, and its slope, at `places` from where it is on top."""
    return 0.5 + 0.5 * np.cos(math.pi * places), -0.5 * math.pi * np.sin(math.pi * places)


def _last(true: Callable[[Array], Any], end: Array) -> Array:
    """Return the last places, from 0 to `end`, at which `true` holds, if it holds from 0 on; otherwise 0."""
    low, high = np.zeros_like(end), end
    for _halving in range(HALVINGS):
        middle = 0.5 * (low + high)
        holds = true(middle)
        low, high = np.where(holds, middle, low), np.where(holds, high, middle)
    return low


def _sums(of_p: Pair, of_q: Pair, weights: Array) -> Array:
    """Return the weighted sums of h, h^2, (dh/dp)^2 and (dh/dq)^2, where h is a product; given with their slopes."""
    (p, p_slope), (q, q_slope) = of_p, of_q
    parts = p * q, (p * q) ** 2, (p_slope * q) ** 2, (p * q_slope) ** 2
    return np.array([np.sum(weights * part) for part in parts])


def _quarter(width: float, falls: bool, rises: bool) -> tuple[float, ...]:
    """Return the means over a quarter of a crossing of h, h^2, (dh/dp)^2 and (dh/dq)^2.

    p is the distance from the middle of the upper thread, and q that from the crossing along it, in distances of
    threads. h is relative to the height of a thread. The lower thread is the higher one up to a crease q(p), because it
    falls with q faster than the upper one.

    width: of a thread, as a part of the distance of threads.
    falls, rises: whether the upper thread goes under the next one, and whether the lower thread goes over the next one.
    """
    half, (nodes, weights) = 0.5 * width, np.polynomial.legendre.leggauss(NODES)
    nodes, weights = 0.5 + 0.5 * nodes, 0.5 * weights
    begin = _last(lambda p: _crown(p, width)[0] >= rises * (1.0 - _fall(p)[0]), np.array([half]))
    # beyond `begin` the crease grows as a square root
    p = np.concatenate([begin * nodes, begin + (half - begin) * nodes**2, half + (0.5 - half) * nodes])
    of_p = np.concatenate([begin * weights, (half - begin) * 2.0 * nodes * weights, (0.5 - half) * weights])
    (crown, crown_slope), (fall, fall_slope) = _crown(p, width), _fall(p)
    lower, lower_slope = rises * (1.0 - fall), -rises * fall_slope

    def upper(q: Array) -> Pair:
        return _fall(q) if falls else (np.ones_like(q), np.zeros_like(q))

    crease = _last(lambda q: crown * upper(q)[0] < lower * _crown(q, width)[0], np.full_like(p, half))
    total = np.zeros(4)
    for node, weight in zip(nodes, weights, strict=True):
        near = _crown(crease * node, width)
        far = upper(crease + (0.5 - crease) * node)
        total += weight * _sums((lower, lower_slope), near, crease * of_p)
        total += weight * _sums((crown, crown_slope), far, (0.5 - crease) * of_p)
    return tuple((4.0 * total).tolist())


def _rises(up: Flags, places: Array) -> Array:
    """Return the rise of each thread, 0 to 1, at `places` along it, in crossings: [places, threads].

    up: whether it is on top of each crossing [crossings, threads].
    """
    before = np.floor(places)
    share = 1.0 - _fall(places - before)[0][:, np.newaxis]
    first = before.astype(np.int64) % len(up)
    return np.asarray((1.0 - share) * up[first] + share * up[(first + 1) % len(up)])


class WeaveFields(Section):
    """Weave and size of the threads of a cloth."""

    weave: Annotated[str | None, Choice(tuple(UP))] = Field(
        default="plain", description="weave: how the threads cross; it decides how many there are in a period."
    )
    thread_height: Annotated[float | None, Quantity(Dimension.LENGTH, 0.0, 1e-3, usual=0.7e-3)] = Field(
        default=40e-6, description="weave: height of a thread on top of a crossing above the gaps."
    )
    thread_width: Annotated[float | None, Quantity(Dimension.NONE, 0.1, 1.0)] = Field(
        default=1.0, description="weave: width of a thread, as a part of the distance of threads."
    )


def _made(values: Mapping[str, Any]) -> Weave:
    across = values["period_across"] or values["period"]
    return Weave(
        values["period"], across, values["weave"], values["thread_height"], values["thread_width"], values["phase"]
    )


KIND = Kind(
    "weave",
    WeaveFields,
    _made,
    shared=("period", "period_across"),
    defaults={"period": 1e-3},
    steep="thread_height",
    of_area=True,
)
