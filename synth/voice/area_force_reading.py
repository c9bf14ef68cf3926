"""Reads the horizontal forces of a finger over an area along its motion: solved for a file, or live along a motion.

Stage   3 (VOICE), used by `tangential_force` where the finger moves over an area, or on a line of one.
Model   A file solves the force at equal steps, as it solves z (`frame_solver`); the number of steps is chosen for the
        force (`force_frames`). A voice with deadlines, and a file whose frames would take too long, solve it along the
        motion (`direct_reader`), with the filters of the displacement, so that z and the forces have one delay.
        The error is that of a swing: what folds, twice the change from cells twice as large, and that of the filter.
Source  design, sections 4 and 8.
Limits  The swing is short, and along one line of the area.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from synth.arrays import Array, Block
from synth.contact.area_forces import ForceOverArea
from synth.motion.scan_motion import ScanMotion
from synth.plan.contact_choice import BEGINS, SECONDS, SHORT, UNSEEN, cells_along_path
from synth.plan.direct_plan import PATH_SLOPE
from synth.plan.frame_plan import FramePlan, counted, solution_nanoseconds, stride_of
from synth.plan.mean_choice import pressed
from synth.plan.motion_peak import KEPT
from synth.plan.preparation import Preparation
from synth.plan.request import HAND_SPEEDS, Request
from synth.plan.scene_table import band_of, bounds_for
from synth.plan.swing import MORE_FOLDS, Swing, changed_by, folded_errors, relative, turning_errors
from synth.response.demand import Complex, curves, harmonics_of, points_for
from synth.response.reading_filter import SOLUTIONS, ReadingFilter, band_filter
from synth.response_cache import PARTS
from synth.sampling.direct_reader import DirectReader
from synth.sampling.frame_solver import Chunks, FrameSolver, Solve
from synth.scene.output_section import BAND
from synth.voice.table_reading import HandReader, ScanReader

FOLDED_SHARE = 0.3  # part of the tolerance for the folded error
CELLS_SHARE = 0.1  # of the error of the cells: folded errors need not be smaller than this part
MOST_SOLUTIONS = 4e5  # per second: 40 s of processor time for each of sound
READ_AS = "displacement"  # the filters of a force: it is read as it is, without a derivative


@dataclass(frozen=True, slots=True)
class MovingForce:
    """One force of a moving finger over an area.

    force: the source.
    frames: how a file is solved; None: it is solved live along the motion.
    series: harmonics of a swing of the finger, without the mean, N.
    mean: of the swing, N.
    error: relative to the peak-to-peak of the swing.
    work: measured processor time of a second of sound, of a force that is solved live, s.
    """

    force: ForceOverArea
    frames: FramePlan | None
    series: Complex
    mean: float
    error: float
    work: float = 0.0

    @classmethod
    def of(cls, solved: Preparation, force: ForceOverArea) -> MovingForce:
        """Return how `force` is read along the motion of a prepared scene."""
        scene, load, band = solved.scene, pressed(solved.scene), solved.scene.output.band_limit
        usual = HAND_SPEEDS[1] if solved.by_hand else 0.0
        fastest = max(ScanMotion(scene, whole=solved.live).fastest(), usual)
        slope = PATH_SLOPE if solved.over_area else 0.0
        swing = Swing(SOLUTIONS * band, band, fastest, slope, SECONDS)
        short = Swing(SOLUTIONS * band, band, fastest, slope, SHORT)
        frames = None
        if solved.live or solved.over_area or solved.load_varies:  # its cells are those of z
            cells = UNSEEN * changed_by(force.doubled(), force, short, load, BEGINS)
        else:
            force, cells = cells_along_path(solved, force, solved.tolerance, (0,))
        if not solved.live:
            scale = min(1.0, band / (BAND * scene.output.sample_rate))
            frames = force_frames(solved, force, float(cells[0]), solved.tolerance, scale)
        work = 0.0
        if frames is not None:
            error = frames.errors[0]
        else:
            (folded, seconds), chosen = folded_errors(force, short, (load, load)), _filter(solved)
            error = float(folded[0] + cells[0]) + chosen.error
            work = seconds * scene.output.sample_rate / chosen.stride
        if (scene.scan.turns or (solved.by_hand and solved.over_area)) and not force.contact.of_any_direction:
            larger = force.doubled()  # whose error is as large or larger, and takes a quarter of the time
            error += float(turning_errors(larger, larger, short, load)[0])
        values = swing.heights(force, load, 0.5)
        series = harmonics_of(values, max(1, math.ceil(band * swing.seconds) - 1))
        mean, series[0] = float(series[0].real), 0.0
        return cls(force, frames, series, mean, error, work)


def force_frames(
    asked: Request, force: ForceOverArea, cells: float, tolerance: float, scale: float
) -> FramePlan | None:
    """Return how a force of a file is solved, by the folded error of a swing, or None as `plan_frames`.

    cells: error of the force by its cells.
    """
    scene, frames = asked.scene, asked.scene.output.sample_rate / stride_of(scale)
    load, fastest = max(scene.scan.load, scene.scan.lift_load), ScanMotion(scene).fastest()
    band = scene.output.band_limit
    count = max(1, math.ceil(SOLUTIONS * band / frames))
    allowed, slope = max(FOLDED_SHARE * tolerance, CELLS_SHARE * cells), PATH_SLOPE if asked.over_area else 0.0
    while True:
        swing = Swing(count * frames, band, fastest, slope, SECONDS)
        z = swing.heights(force, load, 0.5)
        fine = swing.curves(z)
        change = np.max(np.abs(fine[:, ::2] - swing.curves(z[::2])), axis=1)
        folded = float(MORE_FOLDS * relative(change, np.ptp(fine, axis=1))[0])
        if folded <= allowed or count * frames > MOST_SOLUTIONS:
            break
        count *= 2
    return counted(scene, scale, count, (folded + cells,), solution_nanoseconds(force))


def of_cells(force: ForceOverArea, load: float, highest: int) -> float:
    """Return the error of a force on a line by its cells, relative to its peak-to-peak: the change from larger ones.

    highest: number of harmonics that count.
    """
    points = points_for(highest)
    pair = (one.approach(np.arange(points) / points, load)[0] for one in (force.doubled(), force))
    before, after = (curves(harmonics_of(one, highest), 0, points) for one in pair)
    extent = float(np.ptp(after))
    return float(np.max(np.abs(after - before))) / extent if extent > 0.0 else 0.0


def _filter(solved: Preparation) -> ReadingFilter:
    """Return the filter of a force that is solved along a motion, with the delay of the channels of z."""
    scene, direct = solved.scene, solved.direct
    band, finer = (band_of(scene), 1.0) if direct is None else (direct.band, direct.finer)
    return band_filter(READ_AS, scene.output.sample_rate, band, finer)


def reader_of(solved: Preparation, forces: tuple[MovingForce, ...]) -> SolvedForces | ScanReader | HandReader:
    """Return what reads `forces` along the motion of a prepared scene."""
    if all(one.frames is not None for one in forces):
        return SolvedForces(solved, forces)
    channels, scene = DirectForces.of(solved, forces), solved.scene
    if solved.by_hand:
        return HandReader(channels, scene.texture.period, scene.output.sample_rate)
    return ScanReader(channels, scene)


class SolvedForces:
    """Renders the forces of a file, in any order of its frames. Only the last chunk of each is kept."""

    def __init__(self, solved: Preparation, forces: tuple[MovingForce, ...]) -> None:
        self._columns = [Chunks(*_solved_chunks(solved, one)) for one in forces]

    def read(self, first: int, out: Block) -> None:
        """Write the frames from `first` on to `out`, float32 [frames, forces], N."""
        for column, chunks in enumerate(self._columns):
            chunks.read(first, out[:, column])


def _solved_chunks(solved: Preparation, moving: MovingForce) -> tuple[Solve, int]:
    """Return what solves a chunk of the frames of one force (N), and the length of a chunk."""
    plan = moving.frames
    assert plan is not None
    solver = FrameSolver(
        moving.force.heights, solved.scene, np.zeros_like, solved.scene.output.sample_rate,
        count=plan.count, stride=plan.stride, scale=plan.scale,
    )  # fmt: skip
    kept = KEPT // (8 * solver.chunk)  # the search for the full scale and the voice solve the same chunks

    def solve(number: int) -> Array:
        return np.asarray(solver.solved(number, (0,))[0])

    def found(number: int) -> Array:
        key = "force frames", solved.scene, moving.force.key, plan.steps, number
        return PARTS.get(key, partial(solve, number)) if number < kept else solve(number)

    return found, solver.chunk


@dataclass(frozen=True, slots=True)
class DirectForces:
    """The readers of forces that are solved along a motion; see `table_reading.ChannelReader`."""

    readers: tuple[DirectReader, ...]

    @classmethod
    def of(cls, solved: Preparation, forces: tuple[MovingForce, ...]) -> DirectForces:
        """Return the readers of `forces`."""
        scene, direct = solved.scene, solved.direct
        on_path = solved.over_area
        heaviest = bounds_for(scene).heaviest if direct is None else direct.heaviest
        return cls(
            tuple(
                DirectReader(
                    contact=one.force,
                    line=(-scene.scan.y, scene.scan.direction) if on_path else None,
                    mean=np.zeros_like,
                    period=scene.texture.period,
                    lift_load=scene.scan.lift_load,
                    heaviest=heaviest,
                    rate=scene.output.sample_rate,
                    filters=(_filter(solved),),
                    gains=(1.0,),
                    with_mean=(False,),
                )
                for one in forces
            )
        )

    @property
    def delay(self) -> int:
        """See `ChannelReader`."""
        return self.readers[0].delay

    @property
    def cycle(self) -> int:
        """See `ChannelReader`."""
        return self.readers[0].cycle

    def start(self) -> list[Any]:
        """See `ChannelReader`."""
        return [reader.start() for reader in self.readers]

    def read(self, state: list[Any], motion: Array, position: Array, path: Array, phase: int, out: Block) -> int:
        """See `ChannelReader`."""
        after, one = phase, np.empty((len(out), 1), np.float32)
        for number, reader in enumerate(self.readers):
            after = reader.read(state[number], motion, position, path, phase, one)
            out[:, number] = one[:, 0]
        return after
