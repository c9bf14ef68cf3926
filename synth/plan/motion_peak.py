"""Find the largest value of each quantity along a scan's own motion. It determines an automatic full scale.

Stage   2, used by `prepare` for strokes and recordings.
Model   The response is solved along the motion (`frame_solver`) as the file is, or for a voice with deadlines
        OVERSAMPLING times per frame of the lowest rate that contains the band. If that would take longer than PATIENCE,
        only the chunks with the largest estimated values are solved, and a warning tells it. The estimates of z and its
        two time derivatives are

            Y_0,  Y_1 |f| + Y_0 |w'| / w,  Y_2 f^2 + Y_1 (|f'| + 2 |f w'| / w) + Y_0 (|w''| / w + (w' / w)^2)

        Y_k is the largest k-th derivative over the phase of the steady response at the load w, and f = u / lambda2.
Source  The chain rule. The size of the terms with w' and w'' is a guess.
Limits  With OVERSAMPLING solutions per frame, the folded error is about 1 % of the peak, but 18 % at light loads and up
        to 30 % in quick lifts. The peaks are those of the response, without any simulation of effects. A voice with
        deadlines may play longer than the output lasts: its peaks are those of the whole recording with its lift, or of
        a period of a stroke.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping
from dataclasses import dataclass

import numpy as np

from synth.arrays import Array
from synth.contact.load_balance import Contact
from synth.motion.motion import LOAD, LOAD_BEND, LOAD_RATE, SPEED, SPEED_RATE
from synth.motion.moved_skin import mover_of
from synth.motion.scan_motion import LIFT_TIME, ScanMotion
from synth.plan.frame_plan import CURVE_READ, FRAME_SETUP, FramePlan, solution_nanoseconds, stride_of
from synth.plan.request import Request
from synth.response.demand import Demand, curves, points_for
from synth.response.mean_approach import Mean
from synth.response.phases import phase_step
from synth.response.series_curve import SeriesCurve
from synth.response.spectrum import solve_spectrum
from synth.response_cache import PARTS
from synth.sampling.frame_solver import MARGIN, WITH_MEAN, FrameSolver, Heights
from synth.scene.output_section import BAND
from synth.scene.scene import Scene

OVERSAMPLING = 4  # solutions per frame: the band is 0.40 of the rate, so only lines above 9 times the band fold into it
TOLERANCE = 1e-2  # tolerance of the series for the estimates
PATIENCE = 4.0  # s of predicted work, which delays the opening of a recording; with less, louder parts may be missed
OF_COLUMNS = 0.4  # part of its predicted time that a solution on columns takes (8 to 10 ns a node, 32 predicted)
LIVE = 0.5  # part of PATIENCE for a voice with deadlines, whose first sound somebody waits for
KEPT = 32 << 20  # bytes: the frames of a file that were all solved are kept for the voice that renders them
FEW_PERIODS = 5  # texture periods: a shorter stroke may not pass its loudest place
QUICK_TURN = 0.02  # s: a shorter turn of a stroke may be louder than its cruise
LOUD_LOADS = 7  # number of loads, from the smallest to the largest, at which Y_k is solved
LOOKS = 1 << 20  # largest number of moments at which a long motion is estimated: 2^24 moments take 10 s
TOGETHER, MOST_FRAMES = 1 << 16, 1 << 22  # frames of a constant scan read at once and in all: 87 s at 48 kHz, 0.05 s
NEAR_MARGIN = 140  # frames on each side of a part that is solved alone: the ringing of the filter is below 1e-4 there
LOOK_RATE = 4000  # Hz, rate of those moments: a step of the load takes at least 1 ms


def peaks_along(
    contact: Contact,
    asked: Request,
    mean: Mean,
    orders: tuple[int, ...],
    series: Contact | None = None,
    read: Heights | None = None,
    plan: FramePlan | None = None,
) -> tuple[Array, str]:
    """Return the largest magnitude of the time derivative of each of `orders`, SI, float64 [orders], and a warning.

    The warning is "" if no louder part may have been missed.

    mean: mean of z over a period, as for `FrameSolver`.
    series: contact whose series gives the estimates, where it is not `contact`.
    read: z (m) at places (turns) and loads (N), where the frames are read from a series, not solved.
    plan: of the file; None for a voice with deadlines.
    """
    scene, whole, rate = asked.scene, asked.live, asked.scene.output.sample_rate
    count = OVERSAMPLING if plan is None else plan.count
    part = 1.0 if contact.of_one_line or contact.geometry.over_area else OF_COLUMNS
    solution = 1e-9 * ((part * solution_nanoseconds(contact) if read is None else CURVE_READ) + FRAME_SETUP)
    length, warning = _rendered(scene, whole), ""
    landings = {} if plan is None else plan.landings(asked.orders)
    finer = 1 if plan is None else plan.finer
    frames, patience = max(1, round(length * rate)), PATIENCE * (LIVE if whole else 1.0)
    search = _Search(read or contact.heights, scene, mean, orders, frames, whole, landings, finer)
    solver = search.solver(count)
    chunks, most = search.chunks(solver), max(1, math.floor(patience / (solver.solutions * solution)))
    if len(chunks) <= most:
        found, peaks = search.searched(solver, chunks, keep=plan is not None and 8 * len(orders) * frames <= KEPT)
        if found is not None and plan is not None:
            PARTS.get(frames_key(asked, contact, plan), lambda: found)
        return peaks, ""
    # short parts with short margins: more of them are looked at in the same time
    solver = search.solver(count, longest=0, margin=NEAR_MARGIN)
    chunks, most = search.chunks(solver), max(1, math.floor(patience / (solver.solutions * solution)))
    if len(chunks) > most:
        warning = (
            f"The full scale follows the {most} parts of {solver.chunk / rate:.3g} s of the scan that are likely to be "
            f"the loudest, of {len(chunks)}. A louder one may have been missed."
        )
        chunks = _loud_chunks(series or contact, scene, orders, length, solver.chunk / rate, most, whole=whole)
    return search.searched(solver, chunks)[1], warning


def searched_orders(asked: Request) -> tuple[int, ...]:
    """Return the orders whose peaks along the motion are searched: those of the channels, and the displacement."""
    approach = any(one.quantity == "approach" for one in asked.scene.output.channel_list)
    return tuple(sorted({0, *asked.orders, *({WITH_MEAN} if approach else ())}))


def frames_key(asked: Request, contact: Contact, plan: FramePlan) -> Hashable:
    """Return the key in PARTS of all frames of a file, SI [`searched_orders`, frames], which the search has solved."""
    return "frames", asked.scene, contact.key, plan.steps


@dataclass(frozen=True, slots=True)
class _Search:
    """The frames in which the largest values are searched; the arguments are those of `FrameSolver`.

    frames: their number.
    """

    heights: Heights
    scene: Scene
    mean: Mean
    orders: tuple[int, ...]
    frames: int
    whole: bool
    landings: Mapping[int, float]
    finer: int

    def solver(self, count: int, longest: int | None = None, margin: int = MARGIN) -> FrameSolver:
        """Return a solver with `count` solutions per stride."""
        rate = self.scene.output.sample_rate
        scale = min(1.0, self.scene.output.band_limit / (BAND * rate))
        return FrameSolver(
            self.heights, self.scene, self.mean, rate, count=count, scale=scale, stride=stride_of(scale),
            longest=self.frames if longest is None else longest, margin=margin,
            whole=self.whole, landings=self.landings, finer=self.finer,
        )  # fmt: skip

    def chunks(self, solver: FrameSolver) -> list[int]:
        """Return the numbers of all chunks of `solver`."""
        return list(range(math.ceil(self.frames / solver.chunk)))

    def searched(self, solver: FrameSolver, chunks: list[int], *, keep: bool = False) -> tuple[Array | None, Array]:
        """Return the frames of some chunks, SI [orders, frames], if they are to be kept, and the largest magnitudes.

        Those of a file are under its fades.
        """
        kept, peaks = [], np.zeros(len(self.orders))
        for chunk in chunks:
            first, found = chunk * solver.chunk, solver.solved(chunk, self.orders)
            values = np.abs(found[:, : self.frames - first])
            if not self.whole:
                values *= fades(self.scene, first, values.shape[1])
            peaks = np.maximum(peaks, np.max(values, axis=1))
            kept += [found] * keep
        return np.concatenate(kept, axis=1) if kept else None, peaks


def steady_peak(reader: SeriesCurve, level: float, scene: Scene) -> float:
    """Return the largest magnitude (SI) at the frames of a constant scan, at most the first MOST_FRAMES.

    level: added to the values of `reader`.
    """
    frames = max(1, round(scene.output.duration * scene.output.sample_rate))
    step = phase_step(scene.scan.speed, scene.texture.period, scene.output.sample_rate)
    out, peak = np.empty((min(frames, TOGETHER), 1), np.float32), 0.0
    for first in range(0, min(frames, MOST_FRAMES), TOGETHER):
        part = out[: frames - first]
        reader.read(first * step % 2**64, step, 1.0, part, 0)
        faded = np.abs(part + level) * fades(scene, first, len(part))[:, np.newaxis]
        peak = max(peak, float(np.max(faded)))
    return peak


def fades(scene: Scene, first: int, frames: int) -> Array:
    """Return the gains [frames] of the fades of a file from frame `first` on: raised cosines over `output.fade`."""
    rate = scene.output.sample_rate
    total, fade = round(scene.output.duration * rate), round(scene.output.fade * rate)
    if not fade:
        return np.ones(frames)
    n = np.arange(first, first + frames)
    near = np.minimum(n + 0.5, total - n - 0.5) / fade
    return np.asarray(0.5 - 0.5 * np.cos(math.pi * np.clip(near, 0.0, 1.0)))


def _rendered(scene: Scene, whole: bool) -> float:
    """Return the time (s) after which the output ends, or, of a voice with deadlines, the motion ends or repeats."""
    if not whole:
        return scene.output.duration
    if scene.scan.stroke is not None:
        return scene.scan.stroke.period
    recorded = scene.scan.trajectory is not None
    return ScanMotion(scene, whole=True).duration + LIFT_TIME if recorded else scene.output.duration


def differs_from_cruise(scene: Scene) -> bool:
    """Return whether the largest values of a scan may differ from those at its own speed and load."""
    stroke = scene.scan.stroke
    if not scene.scan.along_x or mover_of(scene) is not None:
        return True
    if stroke is None:
        return scene.scan.trajectory is not None
    return stroke.length < FEW_PERIODS * scene.texture.period or stroke.turn_time < QUICK_TURN


def _loud_chunks(
    contact: Contact, scene: Scene, orders: tuple[int, ...], length: float, chunk: float, most: int, *, whole: bool
) -> list[int]:
    """Return the numbers of the chunks that are likely to be the loudest.

    length: duration of the motion, s.
    chunk: duration of a chunk, s.
    most: largest number of chunks, for all orders together.
    whole: without the fades of a file.
    """
    look_rate = max(1, math.floor(min(LOOK_RATE, LOOKS / length)))
    looks = max(1, math.floor(length * look_rate))
    moments = np.arange(looks) / look_rate
    numbers, fades = (moments / chunk).astype(int), np.ones(looks)
    if not whole and scene.output.fade:
        fades = np.clip(np.minimum(moments, length - moments) / scene.output.fade, 0.0, 1.0)
    ranked = []
    for values in _likely(contact, scene, orders, ScanMotion(scene, look_rate, whole=True).at(0, looks).samples):
        loudest = np.zeros(numbers[-1] + 1)
        np.maximum.at(loudest, numbers, values * fades)
        ranked.append(np.argsort(loudest)[::-1].tolist())
    wanted: dict[int, None] = dict.fromkeys(one for place in zip(*ranked, strict=True) for one in place)
    return sorted(list(wanted)[: max(most, len(orders))])


def _likely(contact: Contact, scene: Scene, orders: tuple[int, ...], samples: Array) -> list[Array]:
    """Return the estimated size of each of `orders` at the moments of `samples` (rows of a Motion)."""
    lift, period = scene.scan.lift_load, contact.geometry.texture_period
    load, touching = np.maximum(samples[LOAD], lift), samples[LOAD] > 0.0
    known = np.geomspace(load.min(), load.max(), LOUD_LOADS) if np.ptp(load) else load[:1]
    fastest = max(float(np.max(np.abs(samples[SPEED]))) / period, 1e-9)
    highest = int(min(max(scene.output.band_limit / fastest, 1.0), 64.0))
    series = [solve_spectrum(contact, float(one), Demand(highest, (0,), TOLERANCE), highest) for one in known]
    sizes = [
        np.interp(load, known, [np.max(np.abs(curves(one.harmonics, k, points_for(highest)))) for one in series])
        for k in range(3)
    ]
    f, f1 = np.abs(samples[SPEED]) / period, np.abs(samples[SPEED_RATE]) / period
    w1, w2 = np.abs(samples[LOAD_RATE]) / load, np.abs(samples[LOAD_BEND]) / load
    likely = (
        sizes[0],
        sizes[1] * f + sizes[0] * w1,
        sizes[2] * f**2 + sizes[1] * (f1 + 2.0 * f * w1) + sizes[0] * (w2 + w1**2),
    )
    mean = np.interp(load, known, [abs(float(one.harmonics[0].real)) for one in series])
    return [touching * (likely[0] + mean if order == WITH_MEAN else likely[order]) for order in orders]
