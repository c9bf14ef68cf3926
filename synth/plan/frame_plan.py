"""How a file whose speed or load varies is solved: at which steps of time, with which error, in what time.

Stage   2, used by `preparation`; `solved_frames` renders it.
Model   What folds at n solutions a period is what folds into a steady series of n phases: the loads of the scan are
        probed for how many phases their series take to hold the tolerance, and the fastest speed then gives the
        solutions a second, of which a landing takes some at least. Where the load stays, the series itself is read,
        which is cheap; else every solution is one of eq. 1.
Source  design, sections 4 (`"exact"`) and 8; constants: seen with 18 recordings of 0.1 to 1 N, one machine.
Limits  predicted costs, not measured ones: the same scene always takes the same way.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from synth.contact.load_balance import Contact
from synth.motion.scan_motion import ScanMotion
from synth.plan.frame_solver import MARGIN
from synth.response.spectrum import Demand, Spectrum, solve_spectrum
from synth.scene.scene import Scene

PROBED_LOADS = 5  # of the recording: how many phases a period they take
FEWEST_PHASES = 16  # a period, where every probed load is in full contact
FALL = 2.5  # the power of the phases by which the error falls: kinks of order 3/2
# Of displacement, velocity and acceleration: what folded at SEEN solutions a frame of recordings that land in full
# contact, at 8 to 48 kHz, relative to the peak-to-peak. A landing passes contacts that no recorded load has.
SEEN, FOLDED = 4, (2.5e-4, 8e-4, 3e-3)
FOLDED_SHARE = 0.3  # of the tolerance
EXACT_CELL = 8.0  # ns that the solver takes a phase and cell, on one core with AVX-512; elsewhere PATIENCE is longer
FRAME_SETUP = 60.0  # ns a solution for everything but the solver: motion, transforms
CURVE_READ = 80.0  # ns a solution where a series is read
MOST_TOGETHER = 1 << 23  # solutions of the smallest chunk, which is as long as its margins: 800 MB of working memory
PATIENCE = 300.0  # s of predicted work of a recording: beyond it the response table is read, with its error


@dataclass(frozen=True, slots=True)
class FramePlan:
    """How frames are solved.

    count, stride: so many solutions in so many frames. errors: of each order of the demand, relative to its
    peak-to-peak. scale: of the filter's frequencies, as a part of those of the whole band. work: predicted seconds of
    a processor for a second of the motion.
    """

    count: int
    stride: int
    errors: tuple[float, ...]
    scale: float
    work: float


def plan_frames(contact: Contact, scene: Scene, demand: Demand, tolerance: float, scale: float) -> FramePlan | None:
    """Return how the moving scan of `scene` is solved, or None where that would take too much time or memory.

    demand: what a series must hold; tolerance: the whole of which it is a share; scale: the band that is kept, as a
    part of the rate's own.
    """
    motion = ScanMotion(scene)
    low, high = (max(load, scene.scan.lift_load) for load in motion.recorded_loads())
    varies = motion.load_range()[0] != motion.load_range()[1]
    probed = np.geomspace(low, high, PROBED_LOADS) if high > low else [low]
    series = [solve_spectrum(contact, float(load), demand) for load in probed]
    phases = max(FEWEST_PHASES, *(_phases_for(one, demand.tolerance) for one in series))
    errors = tuple(
        max(one.errors[place] * (one.phases / phases) ** FALL for one in series) for place in range(len(demand.orders))
    )
    stride = 1 << math.floor(math.log2(1.0 / scale))
    rate = scene.output.sample_rate / stride
    fastest = motion.fastest() / scene.texture.period  # periods a second
    if not varies:  # the series that is read ends with the harmonics of the demand: nothing folds
        count = math.ceil((demand.highest * fastest + scene.output.band_limit) / rate)
        errors = series[0].errors
    else:
        count = max(_solutions_for_landing(demand.orders, tolerance), math.ceil(phases * fastest / rate))
        folded = (FOLDED[order] * (SEEN / count) ** FALL for order in demand.orders)
        errors = tuple(one + other for one, other in zip(errors, folded, strict=True))
    if 4.0 * MARGIN / (scale * stride) * count > MOST_TOGETHER:
        return None
    solution = EXACT_CELL * contact.cells if varies else CURVE_READ
    work = 1e-9 * count * rate * (solution + FRAME_SETUP)
    if varies and work * (motion.duration - motion.start) > PATIENCE:
        return None
    return FramePlan(count, stride, errors, scale, work)


def _solutions_for_landing(orders: tuple[int, ...], tolerance: float) -> int:
    """Return how many solutions a frame hold the tolerance where the load changes quickly."""
    most = max(FOLDED[order] for order in orders) / (FOLDED_SHARE * tolerance)
    return math.ceil(SEEN * float(most ** (1.0 / FALL)))


def _phases_for(series: Spectrum, tolerance: float) -> float:
    """Return how many phases hold the tolerance: fewer than the series took, since those were doubled until it did."""
    spared = (max(series.errors) / tolerance) ** (1.0 / FALL)
    return float(series.phases * min(max(spared, 0.5), 1.0))
