"""The methods to compute a steady scan, with one interface, for the comparison in a report of accuracy.

Stage   no stage. These are the methods of the plan, in several sizes. `baseline` has the method that one would write
        from the paper.
Model   A method is set up for a case. It then gives the channel over a period, and computes frames as a render does.
        Solved frames (families exact and sampled): frames have the same folding as a series with as many phases per
        period, rounded to a whole number. Their error is computed from that series.
        Harmonics: a period is solved at several phases and its series is read, as in the plan of a constant scan.
        Table: a response table is made to given errors and read along the scan, as by a live voice.
        The exact solver is that of the texture. For two cosines it is in closed form. Otherwise it uses segments,
        refined until their error is REFINED of the scene's tolerance. The sampled solver uses a polyline with a given
        number of segments, for any texture. The columns of a fingertip have several distances.
Source  design, section 5; Fagiani & Barbieri (2016), eq. 1, for all methods.
Limits  Steady scans only. Components of a table above the band, where its mip levels fade out up to 1.4 times the band,
        are not counted.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np

from synth.accuracy.method import Method, Ready, clock
from synth.arrays import Array, Block
from synth.contact.load_balance import Contact
from synth.contact.profile_solver import SegmentGrid
from synth.motion.motion import LOAD, SPEED, Motion
from synth.plan.preparation import Preparation
from synth.plan.prepare import prepare
from synth.plan.scene_table import bounds_for, table_of_scene
from synth.plan.stretch import stretch_of
from synth.response.demand import Complex, Demand, curves, harmonics_of
from synth.response.discretisation import fine_enough
from synth.response.mean_approach import heights_of_mean, mean_of
from synth.response.phases import phase_step
from synth.response.series_curve import SeriesCurve
from synth.response.table_making import TableBounds
from synth.response.table_reader import TableReader
from synth.response_cache import ResponseCache
from synth.sampling.frame_solver import FrameSolver
from synth.scene.output_section import BAND
from synth.scene.scene import Scene
from synth.voice.table_reading import HandReader, TableChannels

DISTANCES = (4.0, 2.0, 1.0, 0.5, 0.25)  # of the columns of a fingertip, and of all its other numbers, to the usual ones
OVERSAMPLINGS = (1, 2, 4, 8, 16, 32)
SAMPLED_SIZES = 7  # numbers of segments that are measured, each twice the previous one
SERIES_PHASES = tuple(2**power for power in range(3, 17))
TABLE_SIZES = (0.25, 1.0, 4.0)  # accuracy relative to a live voice's table; a table of size 16 would take half a minute
TABLE_SECONDS = 0.5  # approximate time to make a table for a live voice
REFINED = 0.1  # of the tolerance; a larger solver error would add to the errors of the methods that use the solver
TIMED_FRAMES = 1 << 14  # frames of a timed reader
PROBES = 16  # phases from which the time per phase is measured
MOST_PLACES = 1 << 16  # largest number of different phases of a period at which the table is compared

Solve = Callable[[Array], Array]
"""Returns z (m) at phases (turns)."""


@dataclass(frozen=True, slots=True)
class Case:
    """One channel of a steady scan, as given to every method.

    scene: the scene.
    solved: the solved scene.
    contact: contact with a grid that is fine enough for the exact solver.
    quantity: quantity of the channel.
    order: order of its time derivative.
    extent: peak-to-peak, SI.
    """

    scene: Scene
    solved: Preparation
    contact: Contact
    quantity: str
    order: int
    extent: float

    @property
    def rate(self) -> int:
        """Frames per second."""
        return self.scene.output.sample_rate

    @property
    def load(self) -> float:
        """The load of the scan, N."""
        return self.scene.scan.load

    @property
    def period_frames(self) -> float:
        """Frames per texture period."""
        return self.rate / abs(self.solved.turns)

    def heights(self, phases: Array) -> Array:
        """Return z (m) at `phases` (turns)."""
        return self.contact.approach(phases, self.load)[0]

    def series(self, solve: Solve, phases: int) -> Complex:
        """Return the series (SI) of the channel from z at `phases` equal steps of a period, up to the band limit."""
        heights = solve(np.arange(phases) / phases)
        return self.derived(harmonics_of(heights, min(phases // 2, self.solved.highest)))

    def derived(self, series: Complex) -> Complex:
        """Return the series (SI) of the channel from that of z (m), without the mean."""
        return self.solved.steady.series(self.order, series)

    def solved_period(self, solve: Solve, count: int) -> tuple[Callable[[int], Array], int]:
        """Return the function `Ready.values` for frames with `count` solutions each, and the phases per period."""
        phases = max(8, round(self.period_frames * count))

        def period(points: int) -> Array:
            """Return the channel, rounded like float32 samples near full scale."""
            values = curve_between(self.series(solve, phases), points)
            return (values / self.extent).astype(np.float32).astype(float) * self.extent

        return period, phases


def case_of(solved: Preparation, channel: int) -> Case:
    """Return the case of channel number `channel` of a constant scan that is not silent."""
    assert solved.contact is not None
    scene, plan = solved.scene, solved.channels[channel]
    demand = Demand(solved.highest, (plan.order,), REFINED * solved.tolerance)
    contact, _left = fine_enough(solved.contact, (scene.scan.load,), scene.scan.load, demand)
    return Case(scene, solved, contact, plan.quantity, plan.order, plan.extent)


def methods_of(case: Case) -> Iterator[Method]:
    """Yield every method of ridgewave for `case`, from the slowest family to the fastest."""
    if case.contact.of_one_line:
        yield from _sampled(case)
    elif not case.contact.geometry.over_area:
        yield from _columns(case)
    exact = case.contact.grid
    name = f"segments solver, {exact.segments} a period" if isinstance(exact, SegmentGrid) else exact.name
    for count in OVERSAMPLINGS:
        yield _framed(case, f"{name}, oversampling {count}", "exact", count)
    for size in TABLE_SIZES if short_enough(case.scene) else ():
        yield _table(case, size)
    a_phase = seconds_a_phase(case.heights)
    for phases in SERIES_PHASES:
        yield _series(case, phases, phases * a_phase)
    if case.contact.closed(case.load) is not None:
        yield _closed(case)


def chosen_method(case: Case, channel: int) -> Method:
    """Return the method that the plan of the case uses."""
    spectrum, reader = case.solved.spectrum, case.solved.channels[channel].reader
    assert spectrum is not None and reader is not None
    if spectrum.closed:
        return _closed(case)

    def set_up() -> Ready:
        made = prepare(case.scene, ResponseCache()).channels[channel].reader
        assert made is not None
        return read_by(case, made)

    return Method(f"sum of harmonics, {spectrum.phases} phases", "harmonics", set_up)


def curve_between(series: Complex, points: int) -> Array:
    """Return the values of `series` at the phases (i + 1/2) / points of a period."""
    return curves(series * np.exp(1j * math.pi * np.arange(len(series)) / points), 0, points)


def read_by(case: Case, curve: SeriesCurve, setup: float | None = None) -> Ready:
    """Return the reader of a constant scan, ready to run. `setup` is that of `Ready`."""
    gain = 1.0 / case.extent

    def period(points: int) -> Array:
        """Return the channel (SI) at the phases (i + 1/2) / points of a period, as `curve` reads it."""
        out, step = np.empty((points, 1), np.float32), 2**64 // points
        curve.read(step // 2, step, gain, out, 0)
        return out[:, 0].astype(float) * case.extent

    out = np.empty((TIMED_FRAMES, 1), np.float32)
    step = phase_step(case.scene.scan.speed, case.scene.texture.period, case.rate)
    return Ready(TIMED_FRAMES, curve.nbytes, lambda: curve.read(0, step, gain, out, 0), period, setup)


def seconds_a_phase(solve: Solve) -> float:
    """Return the approximate time (s) of one solution."""
    phases = np.arange(PROBES) / PROBES
    solve(phases)
    began = clock()
    solve(phases)
    return (clock() - began) / PROBES


def _framed(case: Case, name: str, family: str, count: int) -> Method:
    """Return the method that solves the contact of `case` `count` times per frame."""
    scale = min(1.0, case.scene.output.band_limit / (BAND * case.rate))
    period, phases = case.solved_period(case.heights, count)

    def set_up() -> Ready:
        mean = mean_of(heights_of_mean(case.contact), (case.load, case.load), case.load, case.solved.tolerance)
        solver = FrameSolver(case.contact.heights, case.scene, mean, case.rate, count=count, scale=scale)
        held = case.contact.grid.nbytes + solver.memory_bytes
        return Ready(solver.chunk, held, lambda: solver.solved(0, (case.order,)), period)

    return Method(name, family, set_up, seconds_a_phase(case.heights) * (phases + 2 * 4096 * count / scale))


def _sampled(case: Case) -> Iterator[Method]:
    """Yield the solver on polylines of several sizes.

    Folding is proportional to solutions^-2.5, and the error of the polyline to segments^-2.
    """
    geometry = case.contact.geometry.as_profile()
    least = SegmentGrid.of_geometry(replace(geometry, segments=1)).segments
    for power in range(SAMPLED_SIZES):
        segments, count = least << power, OVERSAMPLINGS[min(round(0.8 * power), len(OVERSAMPLINGS) - 1)]
        coarse = replace(case, contact=case.contact.on(replace(geometry, segments=segments)))
        yield _framed(coarse, f"sampled solver, {segments} segments, {count} a frame", "sampled", count)


def _columns(case: Case) -> Iterator[Method]:
    """Yield the series of a fingertip with several distances of its columns, at as many phases as the plan has."""
    assert case.solved.spectrum is not None
    from synth.contact.finger_columns import COLUMNS

    phases = case.solved.spectrum.phases
    for distance in DISTANCES:
        coarse = replace(case, contact=replace(case.contact, coarser=distance))  # type: ignore[call-arg]
        method = _series(coarse, phases, phases * seconds_a_phase(coarse.heights))
        name = f"surface of the fingertip, {round(COLUMNS / distance)} columns a ridge"
        yield replace(method, name=name, family="sampled")


def _series(case: Case, phases: int, seconds: float) -> Method:
    def set_up() -> Ready:
        return read_by(case, SeriesCurve(case.series(case.heights, phases)))

    return Method(f"sum of harmonics, {phases} phases", "harmonics", set_up, seconds)


def _closed(case: Case) -> Method:
    def set_up() -> Ready:
        found = case.contact.closed(case.load)
        assert found is not None
        return read_by(case, SeriesCurve(case.derived(np.array([0.0, found.first]))))

    return Method("closed form", "closed", set_up)


def short_enough(scene: Scene) -> bool:
    """Return whether the period of the texture is short enough for a response table."""
    return stretch_of(scene, 1, 0) is None


def table_bounds(scene: Scene, size: float) -> TableBounds:
    """Return the limits of a response table that is `size` times as accurate as that of a live voice."""
    bounds = bounds_for(scene)
    z, velocity, acceleration = bounds.targets
    if size > 1.0:
        bounds = replace(bounds, nbytes=round(size * bounds.nbytes), work=size * bounds.work)
    return replace(bounds, targets=(z / size, velocity / size, acceleration / size))


def _table(case: Case, size: float) -> Method:
    """Return a response table that is `size` times as accurate as that of a live voice."""
    bounds = table_bounds(case.scene, size)
    name = f"response table, to a {1.0 / bounds.targets[0]:.0f}th"

    def set_up() -> Ready:
        table = table_of_scene(case.scene, bounds)
        return _live(case, TableReader.of(table, case.quantity, case.rate, 1.0 / case.extent))

    return Method(name, "table", set_up, TABLE_SECONDS * max(size, 1.0))


def _live(case: Case, reader: TableReader) -> Ready:
    """Return the method that reads a table along the scan block by block, as a live voice does."""
    texture = case.scene.texture.period
    whole = Fraction(case.solved.turns / case.rate).limit_denominator(MOST_PLACES)
    places, lap = whole.denominator, whole.numerator  # `places` frames pass `lap` periods, to 1e-10

    def hand_along(speed: float, frames: int) -> tuple[HandReader, Motion, Block]:
        """Return a reader, a motion of `frames` frames at `speed` (m/s), and a block for its samples."""
        samples = np.zeros((5, frames))
        samples[SPEED], samples[LOAD] = speed, case.load
        hand = HandReader(TableChannels((reader,)), texture, case.rate)
        return hand, Motion(samples, np.empty(0)), np.empty((frames, 1), np.float32)

    def period(points: int) -> Array:
        """Return the channel (SI) at `places` equal phases of a period; `points` is not used."""
        hand, motion, out = hand_along(lap / places * case.rate * texture, places)
        hand.phase = 2**63 // places
        hand.read(motion, out)
        values = np.empty(places)
        values[(np.arange(places) - hand.delay) * lap % places] = out[:, 0]
        lines = np.fft.rfft(values) * case.extent
        lines[0] = lines[case.solved.highest + 1 :] = 0.0
        return np.fft.irfft(lines, places)

    hand, steady, out = hand_along(case.scene.scan.speed, TIMED_FRAMES)
    return Ready(TIMED_FRAMES, reader.table.memory_bytes, lambda: hand.read(steady, out), period)
