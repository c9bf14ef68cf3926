"""How a scene is measured along its own motion: a stroke, a recording, a path, a long surface, a simulation or a hand.

Stage   after STAGE 3, for a scene whose frames are not read from a series of constant speed and load.
Model   The scene's own motion is rendered by every method (`motion_methods`, `baseline`, `simulated`), or, if it
        is longer than LONGEST, the piece of it in which the load changes most or the finger is fastest. The frames are
        compared with those of the reference: eq. 1 solved FINEST times as often as the plan does, in cells or segments
        that are halved up to HALVINGS times, or a simulation with as many steps on a finer table or finer points.
        Its error is bounded by the change from the second finest size.
        A live voice fades above the band, where a file is cut off. Its errors are therefore compared in the band: a
        filter passes what is below PASSED of it, and nothing above the edge of a file.
        Errors are relative to the peak-to-peak of the reference. Spectra are those of the piece under a Hann window.
Source  design, section 5.
Limits  What methods share is not in their errors: the motion and the mean of z that displacement leaves out. A short
        part of the piece, such as a landing, counts in the spectra by its share of the piece. As a displacement, an
        error below LOWEST is left out.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.special import erfc

from synth.accuracy.method import Errors, Ready, clock, decibels, margin_below
from synth.arrays import Array
from synth.contact.load_balance import Contact
from synth.motion.motion import LOAD
from synth.motion.scan_motion import ScanMotion
from synth.plan.channels import ChannelPlan
from synth.plan.frame_plan import FALL, FEWEST, FramePlan, stride_of
from synth.plan.mean_choice import own_mean
from synth.plan.preparation import Preparation
from synth.response.demand import Demand
from synth.response.discretisation import fine_enough
from synth.response.reading_filter import SOLUTIONS
from synth.sampling.frame_solver import Heights
from synth.sampling.landing import LOOK_RATE, LOOKS, pieces, windows
from synth.scene.output_section import BAND
from synth.scene.scene import Scene
from synth.voice.solved_frames import SolvedFrames

LONGEST = 0.5  # s of the motion; with more, the reference of a fingertip takes longer than REFERENCE_SECONDS
LONGEST_SIMULATED = 0.2  # s of the motion of a simulation, for the same reason
FINEST = 8  # times the steps of the plan: twice those of the finest method
HALVINGS = 2  # of the segments or cells of the plan, at most
REFERENCE_SECONDS = 6.0  # predicted, of the reference; a longer one has fewer steps, or the cells of the plan
PROBES = 64  # places along the piece at which a solution is timed
PASSED, EDGE = 0.84, 0.04  # half amplitude and width of the filter of live methods, as parts of the band
RINGING = 2.0 / EDGE  # periods of the band after which the filter has settled
LOWEST = 10.0  # Hz


@dataclass(frozen=True)
class MotionCase:
    """One channel of a scene along its own motion.

    solved: the scene, solved as a file.
    channel: number of the channel.
    setup: time in which it was solved, s.
    """

    solved: Preparation
    channel: int
    setup: float

    @property
    def scene(self) -> Scene:
        """The scene."""
        return self.solved.scene

    @property
    def rate(self) -> int:
        """Frames per second."""
        return self.scene.output.sample_rate

    @property
    def planned(self) -> ChannelPlan:
        """The plan of the channel."""
        return self.solved.channels[self.channel]

    @property
    def reads_series(self) -> bool:
        """Whether a file reads the series of a constant load along the motion, as `voice.solved_frames` does."""
        return self.solved.reads_series and not self.solved.simulated

    @cached_property
    def contact(self) -> Contact:
        """The contact that is solved along the motion, in segments or columns that the tolerance requires."""
        solved, load = self.solved, self.scene.scan.load
        if not self.reads_series:
            return solved.whole  # is fine enough
        demand = Demand(max(solved.highest, 1), (self.planned.order,), solved.tolerance)
        return fine_enough(solved.whole, (load,), load, demand)[0]

    @cached_property
    def prepared(self) -> tuple[Preparation, float]:
        """The scene with the mean that displacement leaves out, and the time (s) that this mean takes."""
        began = clock()
        mean = own_mean(self.solved.steady, self.contact, self.solved.tolerance)
        return replace(self.solved, mean=self.solved.mean or mean), clock() - began

    @cached_property
    def plan(self) -> FramePlan:
        """The steps of eq. 1 along the motion: those of the plan or, where it solves none, the usual ones of a hand."""
        solved, band = self.solved, self.scene.output.band_limit
        scale = min(1.0, band / (BAND * self.rate))
        strides = self.rate / stride_of(scale)  # per second
        if solved.frames is not None and not self.reads_series:
            return solved.frames
        count = max(FEWEST, math.ceil(SOLUTIONS * band / strides))
        return FramePlan(count, stride_of(scale), (0.0,) * len(solved.orders), scale, 0.0)

    @cached_property
    def piece(self) -> tuple[int, int]:
        """First frame and number of frames of the piece that is measured."""
        total = max(1, round(self.scene.output.duration * self.rate))
        simulated = self.solved.simulated
        chunk, longest = (1, LONGEST_SIMULATED) if simulated else (self.solver().chunk, LONGEST)
        most = chunk * max(1, round(longest * self.rate / chunk))  # whole chunks repeat no solutions
        if total <= most:
            return 0, total
        about = pieces(self.scene)["load" if self.lands else "speed"] * self.rate
        first = min(max(chunk * round((about - 0.5 * most) / chunk), 0), chunk * ((total - 1) // chunk))
        return first, min(most, total - first)

    @cached_property
    def lands(self) -> bool:
        """Whether the load changes quickly somewhere, as in a landing."""
        rate = min(LOOK_RATE, LOOKS / self.scene.output.duration)
        frames = math.ceil(self.scene.output.duration * rate) + 1
        return bool(windows(ScanMotion(self.scene, rate).at(0, frames).samples[LOAD], 1.0 / rate, 0))

    def probed(self, count: int) -> tuple[Array, ...]:
        """Return some places of the piece where the finger touches, as arguments of `Contact.heights`."""
        first, frames = self.piece
        whole = ScanMotion(self.scene).at(first, frames)
        touching = np.flatnonzero(whole.samples[LOAD] > 0.0)
        some = touching[np.linspace(0, len(touching) - 1, min(count, len(touching))).astype(int)]
        path = (np.ascontiguousarray(whole.path[:, some]),) if whole.path.size else ()
        return whole.position[some] / self.scene.texture.period, whole.samples[LOAD, some], *path

    def solver(self, ratio: float = 1.0, heights: Heights | None = None) -> SolvedFrames:
        """Return the solver of frames with `ratio` times the steps of the plan.

        heights: z (m) at places (turns) and loads (N), and along a path; None for the contact of the plan.
        """
        plan = self.plan
        count = max(1, round(ratio * plan.count))
        allowed = tuple(one * ratio**-FALL for one in plan.allowed)
        wanted = replace(plan, count=count, allowed=allowed)
        return SolvedFrames(self.prepared[0], wanted, heights or self.contact.heights)

    def steps(self, ratio: float = 1.0) -> float:
        """Return the steps per second of `solver`."""
        return max(1, round(ratio * self.plan.count)) * self.rate / self.plan.stride

    def solved_values(self, reader: SolvedFrames) -> Array:
        """Return the channel (SI) at the frames of the piece."""
        first, frames = self.piece
        out = np.empty((frames, len(self.solved.channels)), np.float32)
        reader.read(first, out)
        return out[:, self.channel].astype(np.float64) * self.planned.full_scale

    def seconds_a_solution(self, heights: Heights) -> float:
        """Return the time (s) of a solution along the piece."""
        places = self.probed(PROBES)
        heights(*places)
        began = clock()
        heights(*places)
        return (clock() - began) / max(1, len(places[0]))

    def seconds(self, a_solution: float, ratio: float = 1.0) -> float:
        """Return the approximate time (s) of one reading of the piece, without that of landings."""
        reader, (first, frames) = self.solver(ratio), self.piece
        chunks = math.ceil((first + frames) / reader.chunk) - first // reader.chunk
        return chunks * reader.solutions * a_solution

    def ready(
        self, compute: Callable[[], Array], nbytes: int, setup: float | None = None, *, live: bool = False
    ) -> Ready:
        """Return a method that computes the channel (SI) at the frames of the piece. `setup`, `live`: of `Ready`."""
        kept: list[Array] = []

        def run() -> None:
            """Compute the frames and keep them."""
            kept[:] = [compute()]

        def values(_points: int) -> Array:
            """Return the frames of the last run."""
            if not kept:
                run()
            return kept[0]

        return Ready(self.piece[1], nbytes, run, values, setup, live)

    @property
    def words(self) -> str:
        """Which piece is measured, as a sentence."""
        first, frames = self.piece
        whole = first == 0 and frames == max(1, round(self.scene.output.duration * self.rate))
        seconds = f"{frames / self.rate:.3g} s"
        if whole:
            return f"The errors are those along the whole motion of {seconds}."
        why = "the load changes most" if self.lands else "the finger is fastest"
        return f"The errors are those of {seconds} of the motion from {first / self.rate:.3g} s on, in which {why}."


@dataclass(frozen=True, slots=True)
class FrameReference:
    """The frames with which methods are compared.

    values: of the channel at the frames of the piece, SI.
    error: bound on their error, relative to the peak-to-peak.
    """

    case: MotionCase
    values: Array
    error: float

    @property
    def extent(self) -> float:
        """Peak-to-peak, SI."""
        return float(np.ptp(self.values))

    @classmethod
    def between(cls, case: MotionCase, finest: Array, second: Array) -> FrameReference:
        """Return the frames `finest`, whose error is at most their change from `second`."""
        return cls(case, finest, float(np.max(np.abs(finest - second)) / np.ptp(finest)))

    def errors(self, ready: Ready) -> Errors:
        """Return the errors of a method."""
        case, error, known = self.case, ready.values(0) - self.values, self.values
        if ready.live:
            error, known = (self._in_band(one) for one in (error, known))
        order, extent = case.planned.order, self.extent
        window = np.hanning(len(error))
        lines = np.fft.rfft(error * window) / np.sum(window)
        frequencies = np.fft.rfftfreq(len(error), 1.0 / case.rate)
        sizes, strongest = 2.0 * np.abs(lines), 2.0 * np.abs(np.fft.rfft((known - np.mean(known)) * window))
        band = frequencies < case.scene.output.band_limit
        return Errors(
            max_error=float(np.max(np.abs(error))) / extent,
            rms_error=float(np.sqrt(np.mean(error**2))) / extent,
            error_m=_displaced(error, order, case.rate),
            worst_harmonic_db=decibels(float(np.max(sizes[band]) / np.max(strongest[band]) * np.sum(window))),
            threshold_margin_db=margin_below(
                sizes[1:], np.maximum(frequencies[1:], 1.0), order, case.scene.accuracy.threshold
            ),
        )

    def _in_band(self, values: Array) -> Array:
        """Return the part of `values` in the band, without the frames in which the filter has not settled."""
        band, rate = self.case.scene.output.band_limit, self.case.rate
        aside = min(math.ceil(RINGING / band * rate), len(values) // 4)
        padded = np.pad(values, aside, "edge")
        cycles = np.fft.rfftfreq(len(padded), 1.0 / rate) / band
        kept = np.fft.irfft(np.fft.rfft(padded) * 0.5 * erfc((cycles - PASSED) / EDGE), len(padded))
        return np.asarray(kept[2 * aside : len(padded) - 2 * aside])


def _displaced(error: Array, order: int, rate: int) -> float:
    """Return the largest `error` of a time derivative of `order` as a displacement, m."""
    if order == 0:
        return float(np.max(np.abs(error)))
    padded = np.pad(error, len(error) // 2)
    frequencies = np.fft.rfftfreq(len(padded), 1.0 / rate)
    lines = np.fft.rfft(padded)
    kept = frequencies >= LOWEST
    lines[kept] /= (2.0 * math.pi * frequencies[kept]) ** order
    lines[~kept] = 0.0
    return float(np.max(np.abs(np.fft.irfft(lines, len(padded)))))


def solved_reference(case: MotionCase) -> tuple[FrameReference, int]:
    """Return the reference of eq. 1 along the motion, and how many times the steps of the plan it has."""
    sizes: list[tuple[Contact, int]] = [
        (case.contact, FINEST // 4),
        (case.contact, FINEST // 2),
        (case.contact, FINEST),
    ]
    for _halving in range(HALVINGS):
        finer = sizes[-1][0].refined() or sizes[-1][0].halved()
        sizes += [] if finer is None else [(finer, FINEST)]
    while len(sizes) > 1:
        contact, ratio = sizes[-1]
        if case.seconds(case.seconds_a_solution(contact.heights), ratio) <= REFERENCE_SECONDS:
            break
        sizes.pop()
    (contact, ratio), usual = sizes[-1], sizes[-2][0] if len(sizes) > 1 else case.contact
    finest = case.solved_values(case.solver(ratio, contact.heights))
    second = case.solved_values(case.solver(ratio // 2, usual.heights))
    return FrameReference.between(case, finest, second), ratio
