"""Whether a recording is solved at its frames or from rows of load, and how.

Stage   2, used by `preparation`; `solved_frames` renders it.
Model   What folds at n solutions a period is what folds into a steady series of n phases: the recording's loads are
        probed for how many phases their series take to hold the tolerance, and the fastest speed then gives the
        solutions a frame, of which a landing takes some at least. That is compared with the rows that the recorded
        loads would take, and taken where it is cheaper, or where rows would not hold the tolerance.
Source  design, sections 4 (`"exact"`) and 8; constants of the rows: seen with 18 recordings of 0.1 to 1 N, one machine.
Limits  predicted costs, not measured ones: the same scene always takes the same way.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from synth.contact.balance import Contact
from synth.motion.motion import LIFT_TIME, ScanMotion
from synth.plan.frame_solver import MARGIN
from synth.plan.method_choice import EXACT_CELL
from synth.response.spectrum import Demand, Spectrum, solve_spectrum
from synth.scene.scene import Scene

NARROWEST = 0.02  # of the band: narrower bandwidths ring for seconds, and their rows are cheap
PROBED_LOADS = 5  # of the recording: how many phases a period they take
FEWEST_PHASES = 16  # a period, where every probed load is in full contact
FALL = 2.5  # the power of the phases by which the error falls: kinks of order 3/2
# Of displacement, velocity and acceleration: what folded at SEEN solutions a frame of recordings that land in full
# contact, at 8 to 48 kHz, relative to the peak-to-peak. A landing passes contacts that no recorded load has.
SEEN, FOLDED = 4, (2.5e-4, 8e-4, 3e-3)
FOLDED_SHARE = 0.3  # of the tolerance
FRAME_SETUP = 60.0  # ns a solution for everything but the solver: motion, transforms
MOST_TOGETHER = 1 << 23  # solutions of the smallest chunk, which is as long as its margins: 800 MB of working memory
PATIENCE = 300.0  # s of predicted work: beyond it rows are taken, with what they leave of the tolerance

# Of displacement, velocity and acceleration:
ROWS_HOLD = (1e-5, 3e-4, 3e-2)  # the tightest tolerance that rows were seen to hold wherever patches are born
ROWS_AN_OCTAVE = (20.0, 75.0, 125.0)  # at a tolerance of 1e-2
ROWS_GROW = (0.36, 0.2, 0.2)  # the power of 1e-2 / tolerance by which they become more
LIFTING_ROWS = 80  # from no load to the lightest recorded load
SHAPED_ROWS = 8  # times as many rows where the shape of the contact follows the load: its ends pass ridges
ROW_SETUP = 2e6  # ns a row for everything but the solver: errors between rows, tables


@dataclass(frozen=True, slots=True)
class FramePlan:
    """How frames are solved.

    oversampling: solutions a frame. errors: of each order of the demand, relative to its peak-to-peak. scale: of the
    filter's frequencies, as a part of those of the whole band. seconds: predicted, for the whole recording.
    """

    oversampling: int
    errors: tuple[float, ...]
    scale: float
    seconds: float


def plan_frames(contact: Contact, scene: Scene, demand: Demand, tolerance: float, scale: float) -> FramePlan | None:
    """Return how the recording of `scene` is solved at its frames, or None where rows are to be taken.

    demand: what a series must hold; tolerance: the whole of which it is a share; scale: the band that is kept, as a
    part of the rate's own.
    """
    if scale < NARROWEST:
        return None
    motion = ScanMotion(scene)
    low, high = (max(load, scene.scan.lift_load) for load in motion.recorded_loads())
    series = [solve_spectrum(contact, float(load), demand) for load in np.geomspace(low, high, PROBED_LOADS)]
    phases = max(FEWEST_PHASES, *(_phases_for(one, demand.tolerance) for one in series))
    errors = tuple(
        max(one.errors[place] * (one.phases / phases) ** FALL for one in series) for place in range(len(demand.orders))
    )
    rate = scene.output.sample_rate
    oversampling = max(
        _solutions_for_landing(demand.orders, tolerance),
        math.ceil(phases * motion.fastest() / (scene.texture.period * rate)),
    )
    folded = (FOLDED[order] * (SEEN / oversampling) ** FALL for order in demand.orders)
    errors = tuple(one + other for one, other in zip(errors, folded, strict=True))
    if 4.0 * MARGIN / scale * oversampling > MOST_TOGETHER:
        return None
    solutions = oversampling * rate * (motion.duration - motion.start + 2.0 * LIFT_TIME)
    cell = EXACT_CELL * contact.frame_cells
    seconds = 1e-9 * solutions * (cell + FRAME_SETUP)
    rows = LIFTING_ROWS + math.log2(high / low) * _rows_an_octave(demand.orders, tolerance)
    with_rows = 1e-9 * rows * (phases * EXACT_CELL * contact.cells + ROW_SETUP)
    if not contact.of_one_shape:
        with_rows *= SHAPED_ROWS
    holds = all(tolerance >= ROWS_HOLD[order] for order in demand.orders)
    if seconds > PATIENCE or (holds and seconds > with_rows):
        return None
    return FramePlan(oversampling, errors, scale, seconds)


def _solutions_for_landing(orders: tuple[int, ...], tolerance: float) -> int:
    """Return how many solutions a frame hold the tolerance where the load changes quickly."""
    most = max(FOLDED[order] for order in orders) / (FOLDED_SHARE * tolerance)
    return math.ceil(SEEN * float(most ** (1.0 / FALL)))


def _phases_for(series: Spectrum, tolerance: float) -> float:
    """Return how many phases hold the tolerance: fewer than the series took, since those were doubled until it did."""
    spared = (max(series.errors) / tolerance) ** (1.0 / FALL)
    return float(series.phases * min(max(spared, 0.5), 1.0))


def _rows_an_octave(orders: tuple[int, ...], tolerance: float) -> float:
    return float(max(ROWS_AN_OCTAVE[order] * (1e-2 / tolerance) ** ROWS_GROW[order] for order in orders))
