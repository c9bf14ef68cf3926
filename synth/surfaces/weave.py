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
from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from functools import cached_property
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

PLACES = 128  # per thread, over which the mean and the rms values are summed; their error is at most 1e-3


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
        from_middle = np.minimum(np.abs(places - np.round(places)) * (2.0 / self.width), 1.0)
        return np.asarray(0.5 + 0.5 * np.cos(math.pi * from_middle))

    @cached_property
    def _moments(self) -> tuple[float, float, float]:
        """Mean of the heights above the gaps (m), of their square (m^2), and of (dh/dx)^2, over a period."""
        count = self.threads * PLACES
        turns = np.asarray((np.arange(count) + 0.5) / count)
        heights = self._above_gaps(turns, turns * self.across)
        slopes = np.diff(heights, axis=1, append=heights[:, :1]) / (self.period / count)
        return float(np.mean(heights)), float(np.mean(heights**2)), float(np.mean(slopes**2))

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


def _rises(up: Flags, places: Array) -> Array:
    """Return the rise of each thread, 0 to 1, at `places` along it, in crossings: [places, threads].

    up: whether it is on top of each crossing [crossings, threads].
    """
    before = np.floor(places)
    share = (0.5 - 0.5 * np.cos(math.pi * (places - before)))[:, np.newaxis]
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
