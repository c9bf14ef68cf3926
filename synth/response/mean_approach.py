"""The mean of z over a texture period as a function of the load. Displacement is z minus this mean.

Model   A cubic spline over the cube root of the load, over which the mean is smooth except for kinks. Intervals are
        halved where the spline misses the mean halfway. It has a piece below the lift load and one above it.
Limits  The error halfway between the loads, after the lift gate, is within MEAN_ERROR of the tolerance, from no load to
        the heaviest.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.response.lift_gate import gates

Mean = Callable[[Array], Array]
"""The mean of z over a period (m) as a function of w^(1/3) (N^(1/3))."""
Heights = Callable[[Array, float], Array]
"""z (m) at each of some phases (turns) and at one load (N)."""

FEWEST_MEANS, MOST_MEANS = 33, 2049  # loads at which the mean is solved
MEAN_PHASES = 512  # phases per load, of a period that is solved as a series
MEAN_ERROR = 1e-3  # largest error, relative to the tolerance times the peak-to-peak of z
GOLDEN, NO_LOAD = 0.618033988749895, 1e-9  # turns across per place along; N, a load that the solver treats as none
NARROWEST = 1e-4  # of the largest root: no narrower interval is halved; at the lightest loads an area is never smooth
MOST_PLACES = 4096  # of a period over an area, at which z is averaged
SPLINE_GAIN = 8.0  # least factor by which the error falls when an interval is halved; 16 in the limit


def heights_of_mean(contact: Any, *, across: bool = False) -> Heights:
    """Return z at places of a period on the line of `contact`.

    across: at places along and across both periods of a height field, at the direction of the line. The places across
        follow from those along by the golden ratio.
    """

    def on_line(phases: Array, w: float) -> Array:
        found = contact.heights(phases, np.full(len(phases), w)) if w > 0.0 else contact.approach(phases, 0.0)[0]
        return np.asarray(found)

    def over_both(phases: Array, w: float) -> Array:
        path = np.empty((2, len(phases)))
        path[0] = GOLDEN * np.arange(len(phases)) % 1.0 * contact.geometry.profile.across
        path[1] = contact.line.direction
        return np.asarray(contact.heights(phases, np.full(len(phases), max(w, NO_LOAD)), path))

    return over_both if across else on_line


def mean_of(
    heights: Heights,
    loads: tuple[float, float],
    load: float,
    tolerance: float,
    places: int = MEAN_PHASES,
    fewest: int = FEWEST_MEANS,
    lift: float = 0.0,
) -> SolvedMean:
    """Return the mean of `heights` over a period (m) as a function of w^(1/3), between two `loads` (N).

    Below these loads it is constant.

    load: N; `tolerance` is relative to the peak-to-peak of z at this load.
    places: number of places of a period over which z is averaged.
    fewest: least number of loads at which it is solved, before intervals are halved.
    lift: load (N) below which the lift gate fades the output, and so the error of the mean; 0: at no load.
    """
    theta = np.arange(places) / places

    def means(roots: Array) -> Array:
        solved = [heights(theta, float(root) ** 3) for root in roots]
        return np.array([[np.mean(one), np.mean(one[::2])] for one in solved])

    lightest, heaviest = loads
    if lightest == heaviest:
        root = np.cbrt([heaviest])
        return SolvedMean(root, *means(root).T)
    least, most = np.cbrt(lightest), np.cbrt(max(heaviest, 1e-12))
    extent = MEAN_ERROR * tolerance * float(np.ptp(heights(theta, load)))
    kink = float(np.cbrt(lift))
    if not least < kink < most:
        roots, values = _solved(means, (least, most), extent, fewest, lift)
        return SolvedMean(roots, *values.T)
    below, above = (_solved(means, pair, extent, fewest, lift) for pair in ((least, kink), (kink, most)))
    roots, values = (np.concatenate([low, high[1:]]) for low, high in zip(below, above, strict=True))
    return SolvedMean(roots, *values.T, kink=kink)


def _solved(
    means: Callable[[Array], Array], ends: tuple[float, float], error: float, fewest: int, lift: float
) -> tuple[Array, Array]:
    """Return roots between two, and `means` there, whose spline keeps `error` (m), the largest after the lift gate."""
    from scipy.interpolate import CubicSpline

    roots = np.linspace(*ends, fewest)
    values, halved = means(roots), np.arange(fewest - 1)
    allowed = error + 1e-14 * float(np.max(np.abs(values)))
    while len(halved) and len(roots) < MOST_MEANS:
        between = 0.5 * (roots[halved] + roots[halved + 1])
        more = means(between)
        heard = gates(between**3, lift) if lift else 1.0
        missed = heard * np.abs(CubicSpline(roots, values[:, 0])(between) - more[:, 0])
        roots, values = np.insert(roots, halved + 1, between), np.insert(values, halved + 1, more, axis=0)
        wide = between - roots[halved + np.arange(len(halved))] > NARROWEST * ends[1]
        halves = (halved + np.arange(len(halved)))[wide & (missed > SPLINE_GAIN * allowed)]
        halved = np.sort(np.concatenate([halves, halves + 1]))
    return roots, values


class SolvedMean:
    """The mean of z as a cubic spline over the loads at which it was solved; at one load it is constant.

    roots: w^(1/3) of the loads, N^(1/3), rising; below the first the mean is constant.
    values: the mean of z at them, m.
    sparse: the same over every second place; None: not known.
    kink: one of the roots, at which a contact that grows has a kink: that of the lift load. 0: there is none.
    """

    def __init__(self, roots: Array, values: Array, sparse: Array | None = None, *, kink: float = 0.0) -> None:
        from scipy.interpolate import CubicSpline

        self.roots, self.values, self._sparse, self._kink = roots, values, sparse, kink
        at = int(np.searchsorted(roots, kink)) if kink else 0
        self._pieces = (slice(0, at + 1), slice(at, None)) if at else (slice(None),)
        self._splines = [CubicSpline(roots[one], values[one]) for one in self._pieces if len(roots) > 1]

    def __call__(self, wanted: Array) -> Array:
        """Return the mean of z (m) at `wanted` w^(1/3) (N^(1/3))."""
        if not self._splines:
            return np.full_like(wanted, self.values[0])
        found, low = self._splines[-1](np.maximum(wanted, self.roots[0])), wanted < self._kink
        if np.any(low):
            found[low] = self._splines[0](np.maximum(wanted[low], self.roots[0]))
        return np.asarray(found)

    def plus(self, change: Array, sparse: Array) -> SolvedMean:
        """Return this mean plus a `change` (m) at each of its loads; sparse: the same over every second place."""
        assert self._sparse is not None
        return SolvedMean(self.roots, self.values + change, self._sparse + sparse, kink=self._kink)

    def coarser(self) -> tuple[SolvedMean, SolvedMean]:
        """Return the mean from every second load, and that over every second place; the changes tell its errors."""
        assert self._sparse is not None
        numbers = [np.arange(len(self.roots))[one] for one in self._pieces]
        some = np.unique(np.concatenate([np.append(one[::2], one[-1]) for one in numbers]))
        few = SolvedMean(self.roots[some], self.values[some], kink=self._kink)
        return few, SolvedMean(self.roots, self._sparse, kink=self._kink)
