"""The ways to compute a steady scan, behind one interface: what a report of accuracy sets side by side.

Stage   beside the plan, of whose methods these are the sizes; what one would write from the paper is in `baseline`.
Model   A method, set up for a case, gives the channel's values over a period, and runs frames as it would in use.
        Frames that are solved (exact, sampled): what folds into their period is what folds into a series of as many
        phases as they solve in a period, the nearest whole number.
        Harmonics: a period is solved at some phases, and its series read, as the plan of a constant scan does.
        Table: the response table, made to errors of a size, and read along the scan as a live voice does.
        The exact solver is that of the texture: in closed form of two cosines, else segments, refined until they err by
        REFINED of the scene's tolerance. The sampled solver is a polyline of so many segments, whatever the texture.
Source  design, section 5; Fagiani & Barbieri (2016), eq. 1, for all of them.
Limits  steady scans. Of a table, what sounds above the band is not counted: its levels fade out to 1.4 times it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from time import perf_counter

import numpy as np

from synth.arrays import Array, Block
from synth.contact.load_balance import Contact
from synth.contact.profile_solver import SegmentGrid
from synth.motion.motion import LOAD, SPEED, Motion
from synth.plan.frame_solver import FrameSolver
from synth.plan.preparation import Preparation, prepare
from synth.plan.scene_table import bounds_for, table_of_scene
from synth.response.mean_approach import mean_curve
from synth.response.phases import phase_step
from synth.response.response_cache import ResponseCache
from synth.response.series_curve import SeriesCurve
from synth.response.spectrum import Complex, Demand, curves, fine_enough, harmonics_of
from synth.response.table_reader import TableReader
from synth.scene.output_section import BAND
from synth.scene.scene import Scene
from synth.voice.table_reading import HandReader

OVERSAMPLINGS = (1, 2, 4, 8, 16, 32)
SAMPLED_SIZES = 7  # numbers of segments, each twice the last
SERIES_PHASES = tuple(2**power for power in range(3, 17))
TABLE_SIZES = (0.25, 1.0, 4.0)  # times as well as a live voice's table; 16 times the best takes half a minute
TABLE_SECONDS = 0.5  # that a table of a live voice takes, about
REFINED = 0.1  # of the tolerance: more would show in the errors of what is read from the solver
TIMED_FRAMES = 1 << 14  # of a reader
PROBES = 16  # phases of which the time of one is taken
MOST_PLACES = 1 << 16  # of a period at which frames of a voice stand

Solve = Callable[[Array], Array]
"""z (m) at phases (turns)."""


@dataclass(frozen=True, slots=True)
class Case:
    """One channel of a steady scan, as every method finds it.

    contact: as finely divided as the exact solver needs. order: of the time derivative. extent: peak-to-peak (SI).
    """

    scene: Scene
    solved: Preparation
    contact: Contact
    quantity: str
    order: int
    extent: float

    @property
    def rate(self) -> int:
        """Frames a second."""
        return self.scene.output.sample_rate

    @property
    def load(self) -> float:
        """N, of the scan."""
        return self.scene.scan.load

    @property
    def period_frames(self) -> float:
        """Frames in a period of the texture."""
        return self.rate / abs(self.solved.turns)

    def heights(self, phases: Array) -> Array:
        """Return z (m) at `phases` (turns)."""
        return self.contact.approach(phases, self.load)[0]

    def series(self, solve: Solve, phases: int) -> Complex:
        """Return the series (SI) of the channel from z at so many equal steps of a period, cut at the band."""
        heights = solve(np.arange(phases) / phases)
        return self.derived(harmonics_of(heights, min(phases // 2, self.solved.highest)))

    def derived(self, series: Complex) -> Complex:
        """Return the series (SI) of the channel from that of z (m), its mean left out."""
        return self.solved.steady.series(self.order, series)

    def solved_period(self, solve: Solve, count: int) -> tuple[Callable[[int], Array], int]:
        """Return `Ready.period` of frames that are solved `count` times each, and the phases of a period."""
        phases = max(8, round(self.period_frames * count))

        def period(points: int) -> Array:
            """Return the channel as float32 samples near full scale are."""
            values = curve_between(self.series(solve, phases), points)
            return (values / self.extent).astype(np.float32).astype(float) * self.extent

        return period, phases


@dataclass(frozen=True, slots=True)
class Ready:
    """A method that is set up.

    frames: that `run` computes. nbytes: that it holds. period: gives the channel (SI) at the phases (i + 1/2) / points
    of a period for about as many points as it is asked for. setup: seconds of set-up where they were found otherwise
    than by setting up.
    """

    frames: int
    nbytes: int
    run: Callable[[], object]
    period: Callable[[int], Array]
    setup: float | None = None


@dataclass(frozen=True, slots=True)
class Method:
    """A way to compute a case. seconds: about what setting it up, running it and finding its error take."""

    name: str
    family: str
    set_up: Callable[[], Ready]
    seconds: float = 0.0


def case_of(scene: Scene, channel: int) -> Case:
    """Return the case of a steady `scene` that is not silent; channel: its index."""
    solved = prepare(scene)
    assert solved.contact is not None
    plan = solved.channels[channel]
    demand = Demand(solved.highest, (plan.order,), REFINED * solved.tolerance)
    contact = fine_enough(solved.contact, (scene.scan.load,), scene.scan.load, demand)
    return Case(scene, solved, contact, plan.quantity, plan.order, plan.extent)


def methods_of(case: Case) -> Iterator[Method]:
    """Yield every method of ridgewave's own for `case`, from the slowest family to the fastest."""
    yield from _sampled(case)
    exact = case.contact.grid
    name = f"segments solver, {exact.segments} a period" if isinstance(exact, SegmentGrid) else exact.name
    for count in OVERSAMPLINGS:
        yield _framed(case, f"{name}, oversampling {count}", "exact", count)
    for size in TABLE_SIZES:
        yield _table(case, size)
    a_phase = seconds_a_phase(case.heights)
    for phases in SERIES_PHASES:
        yield _series(case, phases, phases * a_phase)
    if case.contact.closed(case.load) is not None:
        yield _closed(case)


def chosen_method(case: Case, channel: int) -> Method:
    """Return what the plan of the case takes."""
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
    """Return the reader of a constant scan, ready; setup: as of `Ready`."""
    gain = 1.0 / case.extent

    def period(points: int) -> Array:
        out, step = np.empty((points, 1), np.float32), 2**64 // points
        curve.read(step // 2, step, gain, out, 0)
        return out[:, 0].astype(float) * case.extent

    out = np.empty((TIMED_FRAMES, 1), np.float32)
    step = phase_step(case.scene.scan.speed, case.scene.texture.period, case.rate)
    return Ready(TIMED_FRAMES, curve.nbytes, lambda: curve.read(0, step, gain, out, 0), period, setup)


def seconds_a_phase(solve: Solve) -> float:
    """Return about how long a solution takes."""
    phases = np.arange(PROBES) / PROBES
    solve(phases)
    began = perf_counter()
    solve(phases)
    return (perf_counter() - began) / PROBES


def _framed(case: Case, name: str, family: str, count: int) -> Method:
    """Return frames that the contact of `case` is solved for, `count` times each."""
    scale = min(1.0, case.scene.output.band_limit / (BAND * case.rate))
    period, phases = case.solved_period(case.heights, count)

    def set_up() -> Ready:
        mean = mean_curve(case.contact, (case.load, case.load), case.load, case.solved.tolerance)
        solver = FrameSolver(case.contact.heights, case.scene, mean, case.rate, count=count, scale=scale)
        held = case.contact.grid.nbytes + solver.memory_bytes
        return Ready(solver.chunk, held, lambda: solver.solved(0, (case.order,)), period)

    return Method(name, family, set_up, seconds_a_phase(case.heights) * (phases + 2 * 4096 * count / scale))


def _sampled(case: Case) -> Iterator[Method]:
    """Yield the solver on a polyline: what folds falls as the power 2.5 of the solutions, its error as the square."""
    geometry = case.contact.geometry.as_profile()
    least = SegmentGrid.of_geometry(replace(geometry, segments=1)).segments
    for power in range(SAMPLED_SIZES):
        segments, count = least << power, OVERSAMPLINGS[min(round(0.8 * power), len(OVERSAMPLINGS) - 1)]
        coarse = replace(case, contact=case.contact.on(replace(geometry, segments=segments)))
        yield _framed(coarse, f"sampled solver, {segments} segments, {count} a frame", "sampled", count)


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


def _table(case: Case, size: float) -> Method:
    """Return the response table, `size` times as well as that of a live voice."""
    bounds = bounds_for(case.scene)
    z, velocity, acceleration = bounds.targets
    targets = z / size, velocity / size, acceleration / size
    if size > 1.0:
        bounds = replace(bounds, nbytes=round(size * bounds.nbytes), work=size * bounds.work)
    name = f"response table, to a {1.0 / targets[0]:.0f}th"

    def set_up() -> Ready:
        table = table_of_scene(case.scene, replace(bounds, targets=targets))
        return _live(case, TableReader.of(table, case.quantity, case.rate, 1.0 / case.extent))

    return Method(name, "table", set_up, TABLE_SECONDS * max(size, 1.0))


def _live(case: Case, reader: TableReader) -> Ready:
    """Return the reading of a table along the scan, block by block, as a live voice reads it."""
    texture = case.scene.texture.period
    whole = Fraction(case.solved.turns / case.rate).limit_denominator(MOST_PLACES)
    places, lap = whole.denominator, whole.numerator  # so many frames in so many periods, to 1e-10 of them

    def hand_along(speed: float, frames: int) -> tuple[HandReader, Motion, Block]:
        samples = np.zeros((5, frames))
        samples[SPEED], samples[LOAD] = speed, case.load
        hand = HandReader((reader,), texture, case.rate)
        return hand, Motion(samples, np.empty(0)), np.empty((frames, 1), np.float32)

    def period(points: int) -> Array:
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
