"""The mean of z over a texture period as a function of the load. Displacement is z minus this mean.

Model   A cubic spline over the cube root of the load, over which the mean is smooth except for kinks. Intervals are
        halved where the spline misses the mean halfway.
Limits  The error halfway between the loads, after the lift gate, is within MEAN_ERROR of the tolerance, from no load to
        the heaviest.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from synth.arrays import Array
from synth.contact.load_balance import Contact
from synth.response.lift_gate import gates
from synth.surfaces.height_field import HeightField

if TYPE_CHECKING:
    from synth.contact.area_path import AreaContact

Mean = Callable[[Array], Array]
"""The mean of z over a period (m) as a function of w^(1/3) (N^(1/3))."""
Heights = Callable[[Array, float], Array]
"""z (m) at each of some phases (turns) and at one load (N)."""

FEWEST_MEANS, MOST_MEANS = 33, 2049  # loads at which the mean is solved
MEAN_PHASES = 512  # phases per load, of a period that is solved as a series
MEAN_ERROR = 1e-3  # largest error, relative to the tolerance times the peak-to-peak of z
GOLDEN, NO_LOAD = 0.618033988749895, 1e-9  # turns across per place along; N, a load that the solver treats as none
NARROWEST = 1e-4  # of the largest root: no narrower interval is halved; at the lightest loads an area is never smooth
SPLINE_GAIN = 8.0  # least factor by which the error falls when an interval is halved; 16 in the limit


def mean_curve(
    contact: Contact,
    loads: tuple[float, float],
    load: float,
    tolerance: float,
    places: int = MEAN_PHASES,
    fewest: int = FEWEST_MEANS,
    lift: float = 0.0,
) -> Mean:
    """Return the mean of z over a period (m) as a function of w^(1/3), from no load to the heavier of `loads` (N).

    load: N; `tolerance` is relative to the peak-to-peak of z at this load.
    places: number of places of a period over which z is averaged.
    fewest: least number of loads at which it is solved, before intervals are halved.
    lift: load (N) below which the lift gate fades the output, and so the error of the mean; 0: at no load.
    """

    def heights(phases: Array, w: float) -> Array:
        return contact.heights(phases, np.full(len(phases), w)) if w > 0.0 else contact.approach(phases, 0.0)[0]

    lightest = loads[0] if loads[0] == loads[1] else 0.0
    return mean_of(heights, (lightest, loads[1]), load, tolerance, places, fewest, lift)


def mean_over_area(
    contact: AreaContact,
    loads: tuple[float, float],
    load: float,
    tolerance: float,
    places: int = MEAN_PHASES,
    fewest: int = FEWEST_MEANS,
    lift: float = 0.0,
) -> Mean:
    """Return the mean of z over both periods of a height field, at the direction of the line of `contact`.

    The arguments are those of `mean_curve`. The places across follow from those along by the golden ratio.
    """
    texture = contact.geometry.profile
    assert isinstance(texture, HeightField)
    across = texture.across

    def heights(phases: Array, w: float) -> Array:
        path = np.empty((2, len(phases)))
        path[0], path[1] = GOLDEN * np.arange(len(phases)) % 1.0 * across, contact.line.direction
        return contact.heights(phases, np.full(len(phases), max(w, NO_LOAD)), path)

    return mean_of(
        heights, (loads[0] if loads[0] == loads[1] else 0.0, loads[1]), load, tolerance, places, fewest, lift
    )


def mean_of(
    heights: Heights,
    loads: tuple[float, float],
    load: float,
    tolerance: float,
    places: int = MEAN_PHASES,
    fewest: int = FEWEST_MEANS,
    lift: float = 0.0,
) -> Mean:
    """Return the mean of `heights` as `mean_curve` does, between two loads (N). Below these it is constant."""
    from scipy.interpolate import CubicSpline

    theta = np.arange(places) / places

    def means(roots: Array) -> Array:
        return np.array([np.mean(heights(theta, float(root) ** 3)) for root in roots])

    lightest, heaviest = loads
    if lightest == heaviest:
        return partial(np.full_like, fill_value=means(np.cbrt([heaviest]))[0])
    least, most = np.cbrt(lightest), np.cbrt(max(heaviest, 1e-12))
    roots = np.linspace(least, most, fewest)
    values, halved = means(roots), np.arange(fewest - 1)
    allowed = MEAN_ERROR * tolerance * float(np.ptp(heights(theta, load))) + 1e-14 * float(np.max(np.abs(values)))
    while len(halved) and len(roots) < MOST_MEANS:
        between = 0.5 * (roots[halved] + roots[halved + 1])
        more = means(between)
        heard = gates(between**3, lift) if lift else 1.0
        missed = heard * np.abs(CubicSpline(roots, values)(between) - more)
        roots, values = np.insert(roots, halved + 1, between), np.insert(values, halved + 1, more)
        wide = between - roots[halved + np.arange(len(halved))] > NARROWEST * most
        halves = (halved + np.arange(len(halved)))[wide & (missed > SPLINE_GAIN * allowed)]
        halved = np.sort(np.concatenate([halves, halves + 1]))
    return MeanSpline(roots, values)


class MeanSpline:
    """The mean of z as a cubic spline.

    roots: w^(1/3) of the loads, N^(1/3), rising; below the first the mean is constant.
    values: the mean of z at them, m.
    """

    def __init__(self, roots: Array, values: Array) -> None:
        from scipy.interpolate import CubicSpline

        self.roots, self.values = roots, values
        self._spline = CubicSpline(roots, values)

    def __call__(self, wanted: Array) -> Array:
        """Return the mean of z (m) at `wanted` w^(1/3) (N^(1/3))."""
        return np.asarray(self._spline(np.maximum(wanted, self.roots[0])))
