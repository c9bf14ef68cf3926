"""The methods to compute a scene along its own motion: steps, series, segments, cells, tables and direct solutions.

Stage   no stage. These are the methods of the plan, in several sizes, on the frames of a `motion.MotionCase`.
Model   Steps: eq. 1 is solved at equal steps of the motion, RATIOS times as many as the plan takes.
        Series: the load is constant, so a series is read at the steps of the plan, of SERIES_RATIOS times its phases.
        Segments and cells: z is solved at the steps of the plan, on polylines or in cells of several sizes.
        Table: a response table of several sizes is read along the motion, as a live voice reads it.
        Direct: a live voice solves eq. 1 RATIOS times as often as usual, in the cells that it can afford.
Source  design, section 5; Fagiani & Barbieri (2016), eq. 1, for all methods.
Limits  The set-up does not include the geometry of the contact. That of a file is the mean of z and, for the plan's
        choice, the preparation of the whole scene.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from synth.accuracy.method import LeftOutMethod, Method, Ready
from synth.accuracy.methods import TABLE_SECONDS, TABLE_SIZES, seconds_a_phase, short_enough, table_bounds
from synth.accuracy.motion import MotionCase
from synth.arrays import Array
from synth.contact.finger_columns import COLUMNS
from synth.contact.load_balance import Contact
from synth.contact.profile_solver import SegmentGrid
from synth.plan.frame_plan import FRAME_SETUP
from synth.plan.scene_table import table_of_scene
from synth.response.demand import harmonics_of
from synth.response.series_curve import SeriesCurve
from synth.response.table_reader import TableReader
from synth.sampling.frame_solver import Heights
from synth.voice.table_reading import ChannelReader, ScanReader, TableChannels

RATIOS = (0.25, 0.5, 1.0, 2.0, 4.0)  # of the plan's steps or solutions
SERIES_RATIOS = (1.0 / 256.0, 1.0 / 64.0, 1.0 / 16.0, 0.25, 1.0)  # of its phases
SEGMENT_SIZES = 5  # numbers of segments that are measured, each twice the previous one
CELLS = (8.0, 4.0, 2.0, 1.0)  # of the cells of the plan
TWICE = 2.0  # runs of a slow method: one that is not timed, one that is


def file_methods(case: MotionCase, finest: int) -> Iterator[Method]:
    """Yield the methods of a file; finest: how many times the steps of the plan the reference has."""
    a_solution = case.seconds_a_solution(case.contact.heights)
    for ratio in RATIOS:
        if ratio < finest:
            yield _steps(case, ratio, a_solution)
    if case.reads_series:
        yield from _series(case)
    yield from _segments(case)
    yield from _cells(case)
    if table_is_possible(case):
        yield from table_methods(case)


def chosen_name(case: MotionCase) -> str:
    """Return the name of the method by which a file of `case` is rendered."""
    if case.solved.frames is None:
        return table_name(case, 1.0)
    return _series_name(case, 1.0) if case.reads_series else _steps_name(case, 1.0)


def missing_methods(case: MotionCase) -> Iterator[LeftOutMethod]:
    """Yield the methods that do not apply, with the reason."""
    if not case.reads_series and not case.solved.simulated:
        reason = "The load changes." if case.solved.load_varies else "The surface is too long or an area."
        yield LeftOutMethod("series", "harmonics", f"A series belongs to one load on one line. {reason}")
    if not table_is_possible(case):
        reason = "A table covers one line of a surface whose period is short enough."
        yield LeftOutMethod("response table", "table", reason)


def table_is_possible(case: MotionCase) -> bool:
    """Return whether a response table covers the motion."""
    return short_enough(case.scene) and not case.solved.over_area


def _steps_name(case: MotionCase, ratio: float) -> str:
    return f"solved along the motion, {case.steps(ratio):.0f} steps a second"


def _steps(case: MotionCase, ratio: float, a_solution: float) -> Method:
    chosen = ratio == 1.0 and case.solved.frames is not None and not case.reads_series
    made = partial(_solved, case, case.contact.heights, case.contact.grid.nbytes, ratio, 0.0, chosen=chosen)
    seconds = TWICE * case.seconds(a_solution + 1e-9 * FRAME_SETUP, ratio)
    return Method(_steps_name(case, ratio), "steps", made, seconds)


def _solved(
    case: MotionCase, heights: Heights, nbytes: int, ratio: float, setup: float, *, chosen: bool = False
) -> Ready:
    """Return z solved along the motion, ready to run. setup: s, besides the mean of z."""
    mean = case.prepared[1]

    def compute() -> Array:
        """Return the frames of the piece."""
        return case.solved_values(case.solver(ratio, heights))

    held = nbytes + case.solver(ratio, heights).memory_bytes
    return case.ready(compute, held, case.setup if chosen else mean + setup)


def _phases(case: MotionCase, ratio: float) -> int:
    assert case.solved.spectrum is not None
    return max(1, round(ratio * case.solved.spectrum.phases))


def _series_name(case: MotionCase, ratio: float) -> str:
    return f"series read along the motion, {_phases(case, ratio)} phases"


def _series(case: MotionCase) -> Iterator[Method]:
    """Yield series of several numbers of phases, each read at the steps of the plan."""
    solved, load = case.solved, case.scene.scan.load
    a_phase = seconds_a_phase(lambda phases: case.contact.approach(phases, load)[0])
    for ratio in SERIES_RATIOS:
        phases = _phases(case, ratio)

        def set_up(phases: int = phases, *, chosen: bool = ratio == 1.0) -> Ready:
            """Return the series, ready to be read."""
            assert solved.spectrum is not None
            curve = SeriesCurve(solved.spectrum.harmonics) if chosen else _series_of(case, case.contact, phases)
            return _read(case, curve.heights, curve.nbytes, phases * a_phase, chosen=chosen)

        yield Method(_series_name(case, ratio), "harmonics", set_up, phases * a_phase)


def _series_of(case: MotionCase, contact: Contact, phases: int) -> SeriesCurve:
    """Return the series of some phases of a contact, with no more harmonics than the plan has steps for."""
    assert case.solved.spectrum is not None
    z = contact.approach(np.arange(phases) / phases, case.scene.scan.load)[0]
    return SeriesCurve(harmonics_of(z, min(phases // 2, case.solved.spectrum.highest)))


def _read(case: MotionCase, heights: Heights, nbytes: int, setup: float, *, chosen: bool) -> Ready:
    """Return a series, ready to be read at the steps that the plan takes for it."""
    plan = case.solved.frames
    count = case.plan.count if plan is None else plan.count
    return _solved(case, heights, nbytes, count / case.plan.count, setup, chosen=chosen)


def _segments(case: MotionCase) -> Iterator[Method]:
    """Yield polylines of several sizes, solved at the steps of the plan."""
    if not case.contact.of_one_line or not case.contact.of_one_shape:
        return
    geometry = case.contact.geometry.as_profile()
    least = SegmentGrid.of_geometry(replace(geometry, segments=1)).segments
    for power in range(SEGMENT_SIZES):
        segments = least << power
        contact = case.contact.on(replace(geometry, segments=segments))
        yield _resized(case, contact, f"sampled solver, {segments} segments", "sampled")


def _cells(case: MotionCase) -> Iterator[Method]:
    """Yield cells or columns of several sizes, solved at the steps of the plan."""
    if case.contact.of_one_line:
        return
    contact: Any = case.contact
    for times in CELLS[:-1]:
        larger = replace(contact, coarser=times * contact.coarser)
        if case.contact.geometry.over_area:
            yield _resized(case, larger, f"cells, {100.0 * larger.coarser:.0f} % of the usual size", "cells")
        else:
            name = f"surface of the fingertip, {round(COLUMNS / larger.coarser)} columns a ridge"
            yield _resized(case, larger, name, "sampled")


def _resized(case: MotionCase, contact: Contact, name: str, family: str) -> Method:
    """Return `contact`, solved at the steps of the plan, or read as a series if the plan reads one."""
    a_solution = case.seconds_a_solution(contact.heights) + 1e-9 * FRAME_SETUP
    if not case.reads_series:
        made = partial(_solved, case, contact.heights, contact.grid.nbytes, 1.0, 0.0)
        return Method(name, family, made, TWICE * case.seconds(a_solution))

    def set_up() -> Ready:
        """Return the series, ready to be read."""
        phases = _phases(case, 1.0)
        curve = _series_of(case, contact, phases)
        return _read(case, curve.heights, curve.nbytes, phases * a_solution, chosen=False)

    return Method(name, family, set_up, _phases(case, 1.0) * a_solution)


def table_name(case: MotionCase, size: float) -> str:
    """Return the name of a table `size` times as accurate as that of a live voice."""
    return f"response table, to a {1.0 / table_bounds(case.scene, size).targets[0]:.0f}th"


def table_methods(case: MotionCase) -> Iterator[Method]:
    """Yield response tables of several sizes, read along the motion."""
    for size in TABLE_SIZES:
        name = table_name(case, size)

        def set_up(size: float = size) -> Ready:
            """Return the table, ready to be read."""
            table = table_of_scene(case.scene, table_bounds(case.scene, size))
            reader = TableReader.of(table, case.planned.quantity, case.rate, 1.0 / case.planned.full_scale)
            return read_live(case, TableChannels((reader,)), table.memory_bytes)

        yield Method(name, "table", set_up, TABLE_SECONDS * max(size, 1.0))


def read_live(case: MotionCase, reader: ChannelReader, nbytes: int, setup: float | None = None) -> Ready:
    """Return a reader of one channel of a live voice, ready to run along the motion. `setup` is that of `Ready`."""
    first, frames = case.piece

    def compute() -> Array:
        """Return the frames of the piece."""
        out = np.empty((frames, 1), np.float32)
        ScanReader(reader, case.scene).read(first, out)
        return out[:, 0].astype(np.float64) * case.planned.full_scale

    return case.ready(compute, nbytes, setup, live=True)
