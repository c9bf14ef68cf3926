"""The peaks of each quantity along a scan's own motion, and the mean of z that displacement leaves out.

Stage   2, used by `prepare`.
Model   Pieces of a file along a path, or of a recording whose load varies, are solved with twice the planned steps. The
        change when every second is left out is the folded error. While it exceeds its share of the tolerance, there are
        more steps. The change by segments, columns or cells twice as large is added. While the change by cells exceeds
        its share, they are halved, up to MOST_WORK. The mean of z is judged along the motion, too (`mean_choice`).
        Of a file that reads a series, the change by the upper half of its harmonics is added.
        Where the peaks along the motion are not those of the steady scan, `motion_peak` finds them. On a long surface
        the peaks of displacement and approach are those at PLACES places.
Source  design, section 4.
Limits  What is worse outside of the pieces is missed, and so is a peak between two of the places. A peak below FLOOR of
        the surfaces, at the end of the band, is the rounding of a finger at rest, and counts as none.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.contact.load_balance import Contact
from synth.effects.effect import Kind
from synth.motion.scan_motion import ScanMotion
from synth.plan.channels import SteadyScan
from synth.plan.contact_choice import MOST_WORK, SECONDS
from synth.plan.direct_plan import PATH_SLOPE
from synth.plan.effect_choice import asked as asked_effects
from synth.plan.frame_plan import FALL, PATIENCE, STILL_SOLVED, FramePlan, solution_nanoseconds
from synth.plan.mean_choice import BEGINS, SHARE, MeanChoice, has_approach, own_mean, pressed
from synth.plan.motion_peak import NEAR_MARGIN, differs_from_cruise, peaks_along, searched_orders
from synth.plan.request import harmonics_in_band
from synth.plan.swing import Swing, turning_changes
from synth.response.discretisation import DISCRETE_SHARE
from synth.response.mean_approach import Mean, SolvedMean
from synth.response.reading_filter import SOLUTIONS
from synth.response.series_curve import SeriesCurve
from synth.response.series_error import FLOOR
from synth.sampling.frame_solver import FrameSolver, Heights
from synth.sampling.landing import MOST_FINER, pieces
from synth.scene.scene import Scene

FOLD_SHARE, LANDING_SHARE = 0.4, 0.15  # of the tolerance: for the folded error of pieces, and for what landings leave
ROUNDS = 8  # most increases of the number of steps
OVER_CHANGE = 2.0  # error over the change by twice as many steps: up to 1.34 in a piece (`landing`), more beside it
MOST_CHUNKS = 32  # of a motion along which the mean is judged, besides those of its pieces
PLACES = 512  # places of a long surface at which the peaks of displacement and approach are computed


def own_motion(
    asked: SteadyScan, series: Contact, contact: Contact, tolerance: float, frames: FramePlan | None
) -> tuple[Any, SolvedMean | None, FramePlan | None, dict[int, float], str]:
    """Return the contact, the mean of z, the plan of the frames, the peak of each order, and a warning or "".

    If the scan's own speed and load determine the peaks, the mean is None and only a long surface has peaks.

    series: contact of one period of the series; `contact` is on the whole surface, and is returned in the cells that
        the own motion requires.
    frames: how a file is solved, without its landings.
    """
    scene, listed = asked.scene, asked.scene.output.channel_list
    approach, long = has_approach(scene), asked.stretch is not None
    probed = np.arange(PLACES) / PLACES
    peaks = asked.peaks_over(contact.heights(probed, np.full(PLACES, pressed(scene)))) if long else {}
    still = bool(asked.silence(peaks)) or not harmonics_in_band(scene, 1)
    # in the turns more harmonics are in the band; a file is as loud as its own frames
    differs = still or not asked.live or differs_from_cruise(scene)
    if asked.by_hand or not asked.moving or not (approach or long or differs):
        return contact, None, frames, peaks, ""
    left = min(frames.errors, default=0.0) if frames and not still else 0.0  # by cells: the mean need not be nearer
    in_pieces = asked.over_area or (scene.scan.trajectory is not None and asked.load_varies)
    if frames is not None and in_pieces:
        choice = MeanChoice.of(asked, contact, max(tolerance, left, BEGINS))
        contact, mean, frames = with_pieces(asked, frames, contact, choice, tolerance)
    else:
        mean = own_mean(asked, contact, max(tolerance, left))
        if frames is not None and asked.reads_series and not asked.live:
            frames = frames.with_errors(_beyond_series(asked, frames))
    if all(channel.full_scale for channel in listed) or not (approach or differs):
        return contact, mean, frames, peaks, ""
    known = searched_orders(asked)
    read = SeriesCurve(asked.spectrum.harmonics).heights if asked.reads_series and not asked.live else None
    found, warning = peaks_along(contact, asked, mean, known, series, read, frames)
    height, band = contact.geometry.height_scale, 2.0 * math.pi * scene.output.band_limit
    rounding = [FLOOR * height * band ** max(order, 0) for order in known]
    peaks = {order: peak * (peak > least) for order, peak, least in zip(known, found.tolist(), rounding, strict=True)}
    if frames is not None and not in_pieces:
        frames = _beside_own_peaks(asked, frames, peaks)
    return contact, mean, frames, peaks, warning


def _beside_own_peaks(steady: SteadyScan, frames: FramePlan, peaks: Mapping[int, float]) -> FramePlan:
    """Return `frames` with errors relative to the own motion where the steady motion is still, as `planned` has it."""
    errors = []
    for order, error in zip(steady.orders, frames.errors, strict=True):
        least = steady.least(order)
        still, most = steady.extent(order) <= least, max(2.0 * peaks[order], least)
        errors.append(error * least / most if still and most > 0.0 else error)
    return replace(frames, errors=tuple(errors))


class _Pieces:
    """The pieces of a motion on which its plan is judged.

    steady, plan: of `with_pieces`.
    mean: mean of z over a period, as for `FrameSolver`.
    """

    def __init__(self, steady: SteadyScan, plan: FramePlan, mean: SolvedMean) -> None:
        self._steady, self._plan, self.mean = steady, plan, mean
        self._places = pieces(steady.scene).values()
        self.finer = min(MOST_FINER, math.floor(self.room(plan)))

    def room(self, plan: FramePlan) -> float:
        """Return how many times the solutions of `plan` may be taken, 2 at least."""
        return max(2.0, PATIENCE / (plan.work * self._steady.scene.output.duration))

    def solved(self, contact: Any, count: int, landing: Array) -> tuple[Array, Array, Array]:
        """Return the frames of the pieces, their folded errors, and the errors that are left of their landings, SI."""
        orders, rate = self._steady.orders, self._steady.scene.output.sample_rate
        solver = FrameSolver(
            contact.heights, self._steady.scene, self.mean, rate, count=2 * count, stride=self._plan.stride,
            scale=self._plan.scale, longest=0, margin=NEAR_MARGIN,
            landings=dict(zip(orders, landing.tolist(), strict=True)), finer=self.finer,
        )  # fmt: skip
        numbers = sorted({math.floor(place * rate / solver.chunk) for place in self._places})
        frames, folded, left = zip(*(solver.folded(number, orders) for number in numbers), strict=True)
        return np.concatenate(frames, axis=1), np.max(folded, axis=0), np.max(left, axis=0)

    def of_mean(self, mean: SolvedMean) -> Array:
        """Return the errors of each order (SI) along the motion by the loads and by the places of a mean [2, orders].

        They are the changes from fewer. Along a long motion, parts of it are judged.
        """
        found = []
        for other in mean.coarser():

            def change(roots: Array, other: Mean = other) -> Array:
                return other(roots) - mean(roots)

            found.append(_largest(self._steady, self._plan, _none, change, self._places))
        return np.array(found)

    def changes(self, before: Array, frames: Array) -> Array:
        """Return the largest changes (SI) of the frames; that of the mean counts where the approach is asked."""
        change = frames - before
        if not has_approach(self._steady.scene):
            change -= np.mean(change, axis=1, keepdims=True)
        return np.asarray(np.max(np.abs(change), axis=1))


def _largest(
    steady: SteadyScan, plan: FramePlan, heights: Heights, mean: Mean, places: Collection[float] = ()
) -> Array:
    """Return the largest magnitude (SI) of each order along a motion, of which parts are looked at if it is long.

    heights, mean: as of `FrameSolver`.
    places: times (s) that are among these parts.
    """
    scene, rate = steady.scene, steady.scene.output.sample_rate
    solver = FrameSolver(heights, scene, mean, rate, count=plan.count, stride=plan.stride, scale=plan.scale)
    last = max(0, math.ceil(scene.output.duration * rate / solver.chunk) - 1)
    numbers = {round(one) for one in np.linspace(0, last, min(last + 1, MOST_CHUNKS))}
    numbers |= {math.floor(place * rate / solver.chunk) for place in places}
    frames = np.concatenate([solver.solved(number, steady.orders) for number in sorted(numbers)], axis=1)
    return np.asarray(np.max(np.abs(frames), axis=1))


def _beyond_series(steady: SteadyScan, plan: FramePlan) -> Array:
    """Return the error of each order by the harmonics that a series has not, which a slow finger has in the band.

    It is the change by the upper half of those that it has, relative to the peak-to-peak at the scan's own speed.
    """
    upper = steady.spectrum.harmonics.copy()
    upper[: (len(upper) + 1) // 2] = 0.0
    extents = [max(steady.extent(order), steady.least(order)) for order in steady.orders]
    return _largest(steady, plan, SeriesCurve(upper).heights, np.zeros_like) / extents


def _none(phases: Array, _loads: Array, _path: Array | None = None) -> Array:
    """Return 0 for z at each place."""
    return np.zeros(len(phases))


def with_pieces(
    steady: SteadyScan, plan: FramePlan, contact: Any, choice: MeanChoice, tolerance: float
) -> tuple[Any, SolvedMean, FramePlan | None]:
    """Return the contact in the cells, the mean, and the plan with its error, that pieces of the motion require.

    The plan is None where a table errs less in that time.

    steady: a file along a path, or a recording whose load varies, at its own speed and load.
    contact: on the whole surface.
    plan: with the fewest solutions, and no error yet.
    choice: of the mean of z over a period, to begin with.
    """
    scene, orders, count, mean = steady.scene, steady.orders, plan.count, choice.solved()
    parts = _Pieces(steady, plan, mean)
    extents = np.array([steady.extent(order) for order in orders])
    least = np.array([steady.least(order) for order in orders])
    moved = np.ptp(parts.solved(contact, count, np.full(len(orders), np.inf))[0], axis=1)
    own = np.maximum(moved, np.where(extents <= least, least, extents))
    if not own.all():
        return contact, mean, plan
    choice, mean = choice.closer(mean, parts.of_mean, SHARE * tolerance * own)
    parts.mean = mean
    usual, landing = contact, LANDING_SHARE * tolerance * own
    frames, changed, left = parts.solved(contact, count, landing)
    if (larger := contact.doubled()) is not None:
        moved = parts.changes(parts.solved(larger, count, landing)[0], frames)
        while np.max(moved / own) > DISCRETE_SHARE * tolerance and (smaller := _smaller(contact, scene, plan)):
            longer = solution_nanoseconds(smaller) / solution_nanoseconds(contact)
            contact, before, plan = smaller, frames, replace(plan, work=longer * plan.work)
            frames, changed, left = parts.solved(contact, count, landing)
            moved = parts.changes(before, frames)
        plan = plan.with_errors(moved / own)  # in the pieces half of it is left, or less
        if contact is not usual and 0 in orders:  # a displacement keeps what the mean errs
            mean = choice.in_cells(mean, contact)
    plan = plan.with_errors((_turning(contact, steady) + np.sum(parts.of_mean(mean), axis=0)) / own)
    allowed = FOLD_SHARE * np.maximum(tolerance, plan.errors) * own  # cells and columns may leave more
    for _round in range(ROUNDS):
        excess = float(np.max(OVER_CHANGE * changed / allowed))
        if excess <= 1.0 or 2 * count > parts.room(plan) * plan.count:
            break
        count = math.ceil(count * min(max(excess ** (1.0 / FALL), 1.2), 4.0))
        _frames, changed, left = parts.solved(contact, count, landing)
    plan = plan.with_errors((np.maximum(left, landing) + OVER_CHANGE * changed) / own)
    if excess > 1.0 and max(plan.errors) > STILL_SOLVED:
        return contact, mean, None
    plan = replace(plan, count=count, work=plan.work * count / plan.count, finer=parts.finer)
    return contact, mean, replace(plan, allowed=tuple(landing.tolist()), extents=tuple(own.tolist()))


def _smaller(contact: Any, scene: Scene, plan: FramePlan) -> Any:
    """Return `contact` in cells half as large; None on a line, for a simulation, and where they would be too many."""
    if not contact.geometry.over_area or any(asked_effects(scene, Kind.BALANCE)):
        return None
    smaller = contact.halved()
    if smaller is None or smaller.grid.cells > MOST_WORK:
        return None
    longer = solution_nanoseconds(smaller) / solution_nanoseconds(contact)
    return smaller if longer * plan.work * scene.output.duration <= PATIENCE else None


def _turning(contact: Any, steady: SteadyScan) -> Array:
    """Return the error (SI) of each order of a finger that turns, from a swing between two directions of its cells."""
    scene, band = steady.scene, steady.scene.output.band_limit
    if not scene.scan.turns or contact.of_any_direction:
        return np.zeros(len(steady.orders))
    swing = Swing(SOLUTIONS * band, band, ScanMotion(scene).fastest(), PATH_SLOPE, SECONDS)
    return turning_changes(contact, contact, swing, pressed(scene))[0][list(steady.orders)]
