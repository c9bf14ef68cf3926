"""The response solved along a scan, at equal steps of time: no table. At which steps, with which error, in what time.

Stage   2, used by `preparation`; `solved_frames` renders it, and `motion_peak` looks for its largest values.
Model   y = g(w) (z(p / lambda2, w) - mean of z over a period at w) is solved at equal steps of time: many in a frame,
        or, where the band is narrow, some in several frames. The band limit, the derivatives and the step to the frame
        rate are one product in the frequency domain: (2 pi i f)^k / 2 erfc((f - CUT rate) / (WIDTH rate)), chunk by
        chunk, with margins on both sides that are longer than the filter rings. The mean over a period is a spline
        over w^(1/3), in which it is smooth.
        What folds at n solutions a period is what folds into a steady series of n phases: the loads of the scan are
        probed for how many phases their series take to hold the tolerance, and the fastest speed then gives the
        solutions a second, of which a landing takes some at least. Where the load stays, the series itself is read,
        which is cheap; else every solution is one of eq. 1.
Source  design, sections 4 (`"exact"`) and 8; eq. 1 (Fagiani & Barbieri, 2016) is solved by `contact.exact_solver`;
        constants: seen with 18 recordings of 0.1 to 1 N, one machine.
Limits  up to 0.40 of the rate the filter is 1 to 1e-9, above 0.49 below 1e-9 (in parts of the bandwidth where that is
        narrower). A solution costs a few microseconds. Costs are predicted, not measured: the same scene always takes
        the same way.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from synth.arrays import Array
from synth.contact.load_balance import Contact
from synth.motion.motion import LOAD
from synth.motion.scan_motion import ScanMotion
from synth.response.mean_approach import Mean
from synth.response.spectrum import Demand, solve_spectrum
from synth.scene.scene import Scene

Heights = Callable[[Array, Array], Array]

WITH_MEAN = -1  # the order that stands for z itself: the approach, where 0 is displacement, z about its mean
CUT, WIDTH = 0.445, 0.0105  # of the rate: half amplitude, and how steeply; 0.045 beside the cut 1e-9 is left
MARGIN = 192  # frames beside a chunk, at the full band: the filter rings by less than 1e-15 there
CHUNK = 4096  # frames of a chunk, where the filter does not ring for long
TOGETHER = 1 << 21  # solutions of a chunk and its margins at most: 200 MB of working memory; more where margins need it
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
    # fewer hold the tolerance than the series took, since those were doubled until it did
    spared = [min(max((max(one.errors) / demand.tolerance) ** (1.0 / FALL), 0.5), 1.0) for one in series]
    phases = max(FEWEST_PHASES, *(one.phases * part for one, part in zip(series, spared, strict=True)))
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
        landing = max(FOLDED[order] for order in demand.orders) / (FOLDED_SHARE * tolerance)
        count = max(math.ceil(SEEN * landing ** (1.0 / FALL)), math.ceil(phases * fastest / rate))
        folded = (FOLDED[order] * (SEEN / count) ** FALL for order in demand.orders)
        errors = tuple(one + other for one, other in zip(errors, folded, strict=True))
    if 4.0 * MARGIN / (scale * stride) * count > MOST_TOGETHER:
        return None
    solution = EXACT_CELL * contact.grid.cells if varies else CURVE_READ
    work = 1e-9 * count * rate * (solution + FRAME_SETUP)
    if varies and work * (motion.duration - motion.start) > PATIENCE:
        return None
    return FramePlan(count, stride, errors, scale, work)


class FrameSolver:
    """Solves chunks of frames of a scan; any chunk, in any order.

    heights: z (m) at each place (turns) and load (N, above 0). mean: of z over a period (m), over the cube root of the
    load (N^(1/3)). rate: frames a second. count, stride: so many solutions in so many frames. scale: of the filter's
    frequencies, as a part of those of the whole band. chunk: frames that are solved together.
    """

    def __init__(
        self, heights: Heights, scene: Scene, mean: Mean, rate: int, *, count: int, scale: float, stride: int = 1
    ) -> None:
        self._heights, self._scan, self._period = heights, scene.scan, scene.texture.period
        self._rate, self._count, self._stride, self._scale = rate, count, stride, scale
        self._motion, self._frames = ScanMotion(scene, rate * count / stride), ScanMotion(scene, rate)
        self._margin = _multiple(math.ceil(MARGIN / scale), stride)
        room = TOGETHER * stride // count - 2 * self._margin
        self.chunk = _multiple(max(2 * self._margin, min(room, max(CHUNK, 4 * self._margin))), stride)
        self._mean = mean

    @property
    def memory_bytes(self) -> int:
        """Bytes of the working memory of a chunk."""
        return 8 * 12 * self.solutions

    @property
    def solutions(self) -> int:
        """Solutions that a chunk takes."""
        return (self.chunk + 2 * self._margin) // self._stride * self._count

    def solved(self, number: int, orders: tuple[int, ...]) -> Array:
        """Return a chunk: float64 [orders, chunk], the time derivative of each of `orders` (0: m) at its frames.

        The order WITH_MEAN is z itself, with its mean.
        """
        frames, own = self.chunk + 2 * self._margin, slice(self._margin, self._margin + self.chunk)
        first = (number * self.chunk - self._margin) // self._stride * self._count
        motion = self._motion.at(first, self.solutions)
        value, mean = self._gated(motion.position / self._period, motion.samples[LOAD])
        touching = self._frames.at(number * self.chunk, self.chunk).samples[LOAD] > 0.0
        return np.array([
            self._limited(value + mean if order == WITH_MEAN else value, frames, max(order, 0))[own] * touching
            for order in orders
        ])  # fmt: skip

    def _gated(self, theta: Array, loads: Array) -> tuple[Array, Array]:
        """Return y, and the mean (m) that it is about, at each phase (turns) and load (N)."""
        value, means = np.zeros_like(loads), np.zeros_like(loads)
        touching = np.flatnonzero(loads > 0.0)
        if len(touching):
            some = loads[touching]
            height = self._heights(theta[touching], some)
            s = np.minimum(some / self._scan.lift_load, 1.0)
            faded, mean = s**3 * (10.0 + s * (6.0 * s - 15.0)), self._mean(np.cbrt(some))
            value[touching], means[touching] = faded * (height - mean), faded * mean
        return value, means

    def _limited(self, value: Array, frames: int, order: int) -> Array:
        """Return the derivative of `order` of `value`, band-limited, at the frames.

        A straight line from end to end is taken out first and put back: without it the ends would not meet.
        """
        from scipy.special import erfc

        rise = (value[-1] - value[0]) / (len(value) - 1)
        spectrum = np.fft.rfft(value - (value[0] + rise * np.arange(len(value)))) * (frames / len(value))
        spectrum = spectrum[: frames // 2 + 1]
        cycles = np.arange(len(spectrum)) / frames
        gain = 0.5 * erfc((cycles - CUT * self._scale) / (WIDTH * self._scale))
        spectrum *= gain * (2j * math.pi * self._rate * cycles) ** order
        found = np.fft.irfft(spectrum, frames)
        rise *= self._count / self._stride  # a frame
        if order == 0:
            found += value[0] + rise * np.arange(frames)
        elif order == 1:
            found += rise * self._rate
        return np.asarray(found)


def _multiple(least: int, stride: int) -> int:
    """Return the smallest multiple of `stride` from `least` on."""
    return -(-least // stride) * stride
