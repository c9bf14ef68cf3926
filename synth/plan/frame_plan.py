"""Plan how the frames of a scan are solved: the number of steps, their error and their cost.

Stage   2, used by `prepare`. `sampling.frame_solver` solves the frames.
Model   If the load is constant, the series is read, which is cheap. If the load varies, or if the period of the surface
        is too long for a series, every solution is one of eq. 1.
        Where the load varies, `own_motion` finds how many solutions the tolerance requires. On a long surface the
        folded error of n solutions per period is that of the steady series of its stretch at n phases. The solutions
        per second are this number times the largest speed in periods per second.
Source  design, section 4. The constants were measured with 18 recordings of 0.1 to 1 N, on one machine.
Limits  A solution costs a few microseconds. Costs are predicted, not measured, so that the same scene is always solved
        by the same method.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from synth.arrays import Array
from synth.contact.load_balance import Contact
from synth.motion.scan_motion import ScanMotion
from synth.plan.request import Request
from synth.response.demand import Demand, curves, points_for
from synth.response.spectrum import Spectrum
from synth.sampling.frame_solver import MARGIN, MOST_TOGETHER
from synth.scene.scene import Scene

if TYPE_CHECKING:
    from synth.contact.area_forces import ForceOverArea


FEWEST_PHASES = 16  # per period of a long surface
FALL = 2.5  # the error falls with the number of phases to this power: kinks of order 3/2
FEWEST = 4  # solutions per stride, where the load varies: `landing` has a short filter then
FEWEST_OVER_AREA = 2  # where a solution takes up to a millisecond
EXACT_CELL = 8.0  # ns per phase and cell of the solver, on one core with AVX-512; slower machines exceed PATIENCE
OVER_AREA = 8.0  # factor on EXACT_CELL for a height field, at 1.8 N; about 5 at 0.3 N
FRAME_SETUP = 60.0  # ns per solution outside the solver: motion, transforms
CURVE_READ = 80.0  # ns per solution that is read from a series
PATIENCE = 300.0  # s of predicted work for a recording; above it there are fewer solutions, or the table is read
STILL_SOLVED = 0.02  # largest error with fewer than the tolerance requires: that of a table is similar


@dataclass(frozen=True, slots=True)
class FramePlan:
    """How frames are solved.

    count: number of solutions per `stride` frames.
    stride: number of frames.
    errors: error of each order of the demand, relative to its peak-to-peak.
    extents: these peak-to-peaks along pieces of the motion (SI); empty: those at the scan's own speed and load.
    scale: the kept band, as a part of the whole band.
    work: predicted processor time per second of the motion, s, without landings.
    allowed: largest error of each order (SI) that a landing leaves; empty: the load does not vary.
    finer: largest number of solutions in a landing for each usual one.
    """

    count: int
    stride: int
    errors: tuple[float, ...]
    scale: float
    work: float
    allowed: tuple[float, ...] = ()
    finer: int = 1
    extents: tuple[float, ...] = ()

    def landings(self, orders: tuple[int, ...]) -> dict[int, float]:
        """Return the largest error (SI) that a landing leaves, by order; orders: of the request."""
        return dict(zip(orders, self.allowed, strict=False))

    @property
    def steps(self) -> tuple[Any, ...]:
        """What decides the frames."""
        return self.count, self.stride, self.scale, self.allowed, self.finer

    def with_errors(self, more: Array) -> FramePlan:
        """Return the plan with `more` added to its errors [orders]."""
        return replace(self, errors=tuple((np.array(self.errors) + more).tolist()))


def plan_frames(asked: Request, contact: Contact, demand: Demand, series: Spectrum, scale: float) -> FramePlan | None:
    """Return how a moving scan is solved, or None if that would take too much time or memory.

    Where the load varies, or along a path, the plan has the fewest solutions and no error: `own_motion` finds both.

    contact: the contact; on a long surface, that of its stretch.
    demand, series: harmonics, orders and tolerance, and the series that meets them at the scan's own load.
    scale: the kept band, as a part of the whole band.
    """
    scene = asked.scene
    if asked.load_varies or asked.over_area:
        fewest = FEWEST_OVER_AREA if contact.geometry.over_area else FEWEST
        return counted(scene, scale, fewest, (0.0,) * len(demand.orders), solution_nanoseconds(contact))
    errors = tuple(_error(series, place, demand) for place in range(len(demand.orders)))
    rate = scene.output.sample_rate / stride_of(scale)
    fastest = ScanMotion(scene).fastest() / contact.geometry.texture_period  # periods per second
    if asked.reads_series:  # none of its harmonics folds
        count = math.ceil((series.highest * fastest + scene.output.band_limit) / rate)
        return counted(scene, scale, count, errors, CURVE_READ)
    # The number of phases was doubled until the series reached the tolerance, so fewer phases are enough.
    spared = min(max((max(series.errors) / demand.tolerance) ** (1.0 / FALL), 0.5), 1.0)
    phases = max(FEWEST_PHASES, series.phases * spared)
    errors = tuple(one * (series.phases / phases) ** FALL for one in errors)
    count = max(1, math.ceil(phases * fastest / rate))
    return counted(scene, scale, count, errors, solution_nanoseconds(contact))


def _error(series: Spectrum, place: int, demand: Demand) -> float:
    """Return the error of one of the orders, relative to its peak-to-peak; one of a still finger is as of `still`."""
    order = demand.orders[place]
    extent = float(np.ptp(curves(series.harmonics[: demand.highest + 1], order, points_for(demand.highest))))
    least = demand.still * (2.0 * math.pi) ** order
    return series.errors[place] * (extent / least if extent < least else 1.0)


def counted(
    scene: Scene,
    scale: float,
    count: int,
    errors: tuple[float, ...],
    solution: float,
) -> FramePlan | None:
    """Return a plan of `count` solutions per stride, or None if time or memory do not allow it; see `plan_frames`.

    errors: of the time derivatives, without a landing.
    solution: time of a solution without transforms, ns.
    """
    motion, stride = ScanMotion(scene), stride_of(scale)
    varies = motion.load_range()[0] != motion.load_range()[1]
    each = 1e-9 * scene.output.sample_rate / stride * (solution + FRAME_SETUP)
    most = MOST_TOGETHER * scale * stride / (4.0 * MARGIN)
    if varies:
        most = min(most, PATIENCE / (each * scene.output.duration))
    return None if count > most else FramePlan(count, stride, errors, scale, count * each)


def solution_nanoseconds(contact: Contact | ForceOverArea) -> float:
    """Return the predicted processor time of a solution of `contact`, or of a force, ns."""
    over = OVER_AREA if contact.geometry.over_area else 1.0
    return EXACT_CELL * over * contact.grid.cells


def stride_of(scale: float) -> int:
    """Return the frames of a plan whose kept band is `scale` of the whole band."""
    return 1 << math.floor(math.log2(1.0 / scale))
