"""The mean of z that the displacement of a file leaves out: at how many loads and places it is solved.

Stage   2, used by `own_motion`.
Model   The mean is a spline over the load, of means over places. From every second load, and over every second place,
        it changes the frames: both changes are told. Where they exceed the tolerance's share, the spline is made to a
        finer tolerance, or over twice as many places. Where the motion is then solved in smaller cells, what these
        change of the mean is added to it, solved at its loads and PLACES_OF_CELLS places.
Limits  No more than WORK. Where a contact is gained or lost, the second derivative of the mean jumps, and the spline
        errs within an interval of loads of it: the faster the load passes there, the less of it is in the band.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from synth.arrays import Array
from synth.plan.channels import APPROACH, SteadyScan
from synth.plan.direct_plan import AREA_MEAN_TOLERANCE, MEAN_TOLERANCE
from synth.plan.direct_plan import MEANS as AREA_MEANS
from synth.plan.direct_plan import PLACES as FEWEST_PLACES
from synth.plan.frame_plan import solution_nanoseconds
from synth.response.mean_approach import FEWEST_MEANS, MOST_PLACES, SolvedMean, heights_of_mean, mean_of
from synth.scene.scene import Scene

MEAN_SHARE = 50.0  # times the tolerance: the mean over an area to begin with, whose error is then a twentieth of it
ON_A_LINE = 30.0  # the same on a line
PLACES_SHARE, SHARE = 0.1, 0.2  # of the tolerance: for the level of the mean, and for its changes along the motion
ROUNDS = 12  # most times that the mean is solved
BEGINS = 1e-4  # least tolerance of the mean to begin with, where the motion judges it
FINEST, FINER = 1e-2, 0.5  # least and largest factor on the tolerance of the spline in a round
GROWTH = 0.4  # the number of loads grows with that factor to this power: 0.25 of a smooth mean, 0.5 near kinks
WORK = 1.0  # predicted s for the mean
PLACES_OF_CELLS = 64  # at which the change of the mean by the cells is solved

Judge = Callable[[SolvedMean], Array]
"""Returns the errors of each order (SI) along a motion, by the loads and by the places of a mean [2, orders]."""


@dataclass(frozen=True, slots=True)
class MeanChoice:
    """How the mean is solved.

    contact: the contact.
    across: whether the mean is that over both periods of an area.
    loads: between which it is known, N.
    load, lift: as of `mean_of`.
    tolerance: as of `mean_of`.
    fewest: least number of loads.
    places: number of places.
    """

    contact: Any
    across: bool
    loads: tuple[float, float]
    load: float
    lift: float
    tolerance: float
    fewest: int
    places: int

    @classmethod
    def of(cls, asked: SteadyScan, contact: Any, tolerance: float) -> Self:
        """Return the first choice for the mean of a request; tolerance: of the scene."""
        load, over = pressed(asked.scene), contact.geometry.over_area
        across = asked.over_area and over
        fewest, wanted = FEWEST_MEANS, ON_A_LINE * tolerance
        if over:
            fewest, wanted = AREA_MEANS, min(max(MEAN_SHARE * tolerance, MEAN_TOLERANCE), AREA_MEAN_TOLERANCE)
        found = cls(contact, across, asked.loads, load, asked.scene.scan.lift_load, wanted, fewest, FEWEST_PLACES)
        if asked.live:
            return found
        if over:
            larger = _larger_cells(contact, load, PLACES_SHARE * tolerance, across=across)
            found = replace(found, contact=larger)
        return found.with_enough_places(PLACES_SHARE * tolerance) if 0 in asked.orders else found

    def with_enough_places(self, error: float) -> Self:
        """Return the choice with as many places as keep `error` of the mean, relative to the peak-to-peak of z."""
        heights = heights_of_mean(self.contact, across=self.across)
        few, places = heights(np.arange(self.places) / self.places, self.load), self.places
        while places < MOST_PLACES:
            many = heights(np.arange(2 * places) / (2 * places), self.load)
            if abs(float(np.mean(many) - np.mean(few))) <= error * float(np.ptp(many)):
                break
            places, few = 2 * places, many
        return replace(self, places=places)

    def solved(self) -> SolvedMean:
        """Return the mean."""
        heights = heights_of_mean(self.contact, across=self.across)
        return mean_of(heights, self.loads, self.load, self.tolerance, self.places, self.fewest, self.lift)

    def in_cells(self, mean: SolvedMean, contact: Any) -> SolvedMean:
        """Return `mean`, as `solved` by this choice, as it is in the cells of `contact`.

        What the cells change is small, so that fewer places show it.
        """
        places = np.arange(PLACES_OF_CELLS) / PLACES_OF_CELLS
        before, after = (heights_of_mean(one, across=self.across) for one in (self.contact, contact))
        loads = (mean.roots**3).tolist()
        changes = np.array([after(places, load) - before(places, load) for load in loads])
        return mean.plus(np.mean(changes, axis=1), np.mean(changes[:, ::2], axis=1))

    def closer(self, mean: SolvedMean, judge: Judge, allowed: Array) -> tuple[Self, SolvedMean]:
        """Return the choice and the mean whose errors are `allowed` (SI) [orders], or as near as WORK permits.

        mean: as `solved` by this choice.
        """
        choice = self
        for _round in range(ROUNDS):
            by_loads, by_places = np.max(judge(mean) / allowed, axis=1).tolist()
            work = 1e-9 * len(mean.roots) * choice.places * solution_nanoseconds(choice.contact) / WORK
            factor = max(0.5 / max(by_loads, 1e-9), FINEST, work ** (1.0 / GROWTH))
            if by_places > max(by_loads, 1.0) and choice.places < MOST_PLACES and 2.0 * work < 1.0:
                choice = replace(choice, places=2 * choice.places)
            elif by_loads > 1.0 and factor < FINER:
                choice = replace(choice, tolerance=factor * choice.tolerance)
            else:
                break
            mean = choice.solved()
        return choice, mean


def own_mean(asked: SteadyScan, contact: Any, tolerance: float) -> SolvedMean:
    """Return the mean of z that the displacement of the request leaves out; `tolerance` is that of the scene.

    Of a file that reads the series of one load, it is that of the series.
    """
    if asked.reads_series and not asked.live:
        return SolvedMean(np.cbrt([pressed(asked.scene)]), asked.spectrum.harmonics[:1].real)
    return MeanChoice.of(asked, contact, tolerance).solved()


def _larger_cells(contact: Any, load: float, error: float, *, across: bool) -> Any:
    """Return `contact` in larger cells where its mean of z at `load` (N) changes by no more than `error` in them.

    error: relative to the peak-to-peak of z.
    across: as of `MeanChoice`.
    """
    larger = contact.doubled()
    if larger is None:
        return contact
    places = np.arange(FEWEST_PLACES) / FEWEST_PLACES
    many, few = (heights_of_mean(one, across=across)(places, load) for one in (contact, larger))
    return larger if abs(float(np.mean(few) - np.mean(many))) <= error * float(np.ptp(many)) else contact


def has_approach(scene: Scene) -> bool:
    """Return whether a channel is z itself, which is not 0 where the finger does not move."""
    return any(channel.quantity == APPROACH for channel in scene.output.channel_list)


def pressed(scene: Scene) -> float:
    """Return the load (N) at which the response of `scene` is solved: for a finger that pulls, the lift load."""
    return scene.scan.load if scene.scan.load > 0.0 else scene.scan.lift_load
