"""The ways to compute a steady scan, behind one interface: what a report of accuracy sets side by side.

Stage   beside the plan, which takes the same solvers and readers where they are the cheapest (`choice`). What one would
        write from the paper is in `baseline_methods`.
Model   A method, set up for a case, gives the channel's values over a period, and runs a number of frames as it would
        in use. Direct methods solve every frame, oversampled (`solved_frames`): what folds into their period is what
        folds into a series of as many phases as they solve in a period, the nearest whole number. Tables and sums of
        harmonics solve phases once, with the exact solver, and read them (`contact.steady`).
Source  design, section 5; Fagiani & Barbieri (2016), eq. 1, for all of them.
Limits  steady scans.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from synth.arrays import Array
from synth.contact.balance import Contact
from synth.contact.full_contact import full_contact
from synth.contact.phase_solver import PhaseSolver
from synth.contact.sampled import SampledGrid
from synth.plan.channels import ChannelPlan
from synth.plan.frame_plan import FramePlan
from synth.plan.preparation import Preparation, band_limit, prepare
from synth.response.evaluation import gate
from synth.response.phase_cells import CUBIC, LINEAR, polynomials
from synth.response.phases import phase_step
from synth.response.spectrum import Complex, curves, harmonics_of
from synth.response.steady import SteadyHarmonics, SteadyReader, SteadyTable
from synth.scene.output_section import BAND
from synth.scene.scene import Scene
from synth.voice.solved_frames import SolvedFrames

SAMPLED_POINTS = (8, 16, 32, 64, 128, 256, 512)  # a ridge
OVERSAMPLINGS = (1, 2, 4, 8, 16, 32)
TABLE_PHASES = tuple(2**power for power in range(3, 17))
HARMONIC_COUNTS = tuple(2**power for power in range(10))
PHASES_A_HARMONIC = 16  # solved for a sum of harmonics: what folds is then far below what is cut off
TIMED_FRAMES = 1 << 14  # of a reader


@dataclass(frozen=True, slots=True)
class Case:
    """One channel of a steady scan, as every method finds it. extent: peak-to-peak of the quantity (SI)."""

    scene: Scene
    solved: Preparation
    contact: Contact
    order: int
    extent: float

    @property
    def rate(self) -> int:
        """Frames a second."""
        return self.scene.output.sample_rate

    @property
    def period_frames(self) -> float:
        """Frames in a period of the texture."""
        return self.rate / abs(self.solved.turns)

    @property
    def lifted(self) -> float:
        """What the gate of a lifting finger leaves."""
        scan = self.scene.scan
        return float(gate(scan.load, scan.lift_load)[0]) if scan.load < scan.lift_load else 1.0

    def series(self, heights: Array, highest: int | None = None) -> Complex:
        """Return the series (SI) of the channel from z (m) at equal steps of a period, cut at `highest` or the band."""
        wanted = self.solved.highest if highest is None else min(highest, self.solved.highest)
        found = harmonics_of(heights, wanted)
        n = np.arange(len(found))
        found *= self.lifted * (2j * math.pi * n * self.solved.turns) ** self.order
        found[0] = 0.0
        return found

    def heights(self, phases: int, contact: Contact | None = None) -> Array:
        """Return z (m) at `phases` equal steps of a period."""
        return (contact or self.contact).approach(np.arange(phases) / phases, self.scene.scan.load)[0]

    def solved_by(self, grid: PhaseSolver) -> Contact:
        """Return the contact of this case with another solver."""
        return Contact.of(self.contact.geometry, self.contact.stiffness, grid)


class Ready(Protocol):
    """A method that is set up."""

    @property
    def frames(self) -> int:
        """Frames that `run` computes."""

    @property
    def nbytes(self) -> int:
        """Bytes that it holds."""

    @property
    def setup(self) -> float | None:
        """Seconds of set-up where they were found otherwise than by setting up; None where they are to be timed."""

    def period(self, points: int) -> Array:
        """Return the channel (SI) at the phases (i + 1/2) / points of a period."""

    def run(self) -> None:
        """Compute `frames` frames."""


@dataclass(frozen=True, slots=True)
class Rung:
    """A size of a method: the ladder that it belongs to, its points, and the ladder with fewer solutions, or ""."""

    ladder: str
    points: int
    below: str


@dataclass(frozen=True, slots=True)
class Method:
    """A way to compute a case.

    phases: solutions that setting up and `period` take, for a guess of the time. seconds: that guess, where it is made
    otherwise. rung: its place among methods that only differ in their number of points.
    """

    name: str
    family: str
    phases: float
    set_up: Callable[[], Ready]
    seconds: float | None = None
    rung: Rung | None = None


@dataclass(frozen=True, slots=True)
class Read:
    """A reader in use."""

    reader: SteadyReader
    case: Case
    frames: int = TIMED_FRAMES
    setup: float | None = None

    @property
    def nbytes(self) -> int:
        """See `Ready`."""
        return self.reader.nbytes

    def period(self, points: int) -> Array:
        """See `Ready`: what the float32 samples are, near full scale."""
        out = np.empty((points, 1), np.float32)
        step = 2**64 // points
        self.reader.read(step // 2, step, 1.0 / self.case.extent, out, 0)
        return out[:, 0].astype(float) * self.case.extent

    def run(self) -> None:
        """See `Ready`."""
        out = np.empty((self.frames, 1), np.float32)
        step = phase_step(self.case.scene.scan.speed, self.case.scene.texture.period, self.case.rate)
        self.reader.read(0, step, 1.0 / self.case.extent, out, 0)


@dataclass(frozen=True, slots=True)
class Framed:
    """Frames that are solved."""

    case: Case
    contact: Contact
    phases: int
    renderer: SolvedFrames

    setup = None

    @property
    def frames(self) -> int:
        """See `Ready`."""
        return self.renderer.chunk

    @property
    def nbytes(self) -> int:
        """See `Ready`."""
        return self.contact.grid.nbytes + self.renderer.memory_bytes

    def period(self, points: int) -> Array:
        """See `Ready`."""
        series = self.case.series(self.case.heights(self.phases, self.contact))
        shifted = series * np.exp(1j * math.pi * np.arange(len(series)) / points)
        return (curves(shifted, 0, points) / self.case.extent).astype(np.float32).astype(float) * self.case.extent

    def run(self) -> None:
        """See `Ready`."""
        self.renderer.forget()
        self.renderer.read(0, np.empty((self.frames, 1), np.float32))


def case_of(scene: Scene, channel: int) -> Case:
    """Return the case of a steady `scene` that is not silent; channel: its index."""
    solved = prepare(scene)
    assert solved.contact is not None
    plan = solved.channels[channel]
    return Case(scene, solved, solved.contact, plan.order, plan.extent)


def methods_of(case: Case) -> Iterator[Method]:
    """Yield every method of ridgewave's own for `case`, from the slowest family to the fastest."""
    geometry = case.contact.geometry
    for points in SAMPLED_POINTS:
        count = _sampled_oversampling(points)
        name = f"sampled solver, {points} points a ridge, oversampling {count}"
        yield _framed(case, name, SampledGrid.of_geometry, points, count)
    for count in OVERSAMPLINGS:
        yield _framed(case, f"exact solver, oversampling {count}", None, 0, count)
    for degree, kind in ((LINEAR, "linear"), (CUBIC, "cubic")):
        for phases in TABLE_PHASES:
            yield _table(case, f"response table, {phases} phases, {kind}", phases, degree)
    highest = case.solved.highest
    for count in sorted({*(count for count in HARMONIC_COUNTS if count < highest), min(highest, 512)}):
        yield _harmonics(case, count)
    if full_contact(geometry, case.contact.stiffness, case.scene.scan.load) is not None:
        yield _closed(case)


def chosen_method(case: Case, channel: int) -> Method:
    """Return what the plan of the case takes."""
    spectrum, plan = case.solved.spectrum, case.solved.channels[channel]
    assert spectrum is not None and plan.reader is not None
    if spectrum.closed:
        return _closed(case)
    by = "" if spectrum.solver == case.contact.grid.name else f", {spectrum.solver}"
    if isinstance(plan.reader, SteadyTable):
        cells, width = plan.reader.coefficients.shape
        kind = "cubic" if width == CUBIC + 1 else "linear"
        name, family = f"response table, {spectrum.phases} phases, {kind}, {cells} cells{by}", "table"
    else:
        assert isinstance(plan.reader, SteadyHarmonics)
        count = len(plan.reader.series) - 1
        name, family = f"sum of harmonics, {count} harmonics, {spectrum.phases} phases{by}", "harmonics"

    def set_up() -> Ready:
        made = prepare(case.scene).channels[channel].reader
        assert made is not None
        return Read(made, case)

    return Method(name, family, spectrum.phases, set_up)


def _sampled_oversampling(points: int) -> int:
    """Return solutions a frame for so many points: what folds falls as their power 2.5, the error as the square."""
    return OVERSAMPLINGS[min(len(OVERSAMPLINGS) - 1, round(0.8 * math.log2(points / SAMPLED_POINTS[0])))]


def _framed(case: Case, name: str, grid: Callable[..., PhaseSolver] | None, points: int, count: int) -> Method:
    phases = max(8, round(case.period_frames * count))
    family = "exact" if grid is None else "sampled"

    def set_up() -> Ready:
        contact = case.contact if grid is None else case.solved_by(grid(case.contact.geometry, points))
        plain = ChannelPlan("", case.order, case.extent, 0.0, case.extent, None)
        solved = replace(case.solved, contact=contact, channels=(plain,))
        scale = min(1.0, band_limit(case.scene) / (BAND * case.rate))
        renderer = SolvedFrames(solved, FramePlan(count, 1, (), scale, 0.0), contact.heights)
        return Framed(case, contact, phases, renderer)

    return Method(name, family, phases, set_up)


def _table(case: Case, name: str, phases: int, degree: int) -> Method:
    def set_up() -> Ready:
        series = case.series(case.heights(phases), phases // 2)
        return Read(SteadyTable(polynomials(series, degree, phases)), case)

    return Method(name, "table", phases, set_up)


def _harmonics(case: Case, count: int) -> Method:
    phases = 1 << max(5, (PHASES_A_HARMONIC * count - 1).bit_length())

    def set_up() -> Ready:
        return Read(SteadyHarmonics(case.series(case.heights(phases), count)), case)

    return Method(f"sum of harmonics, {count} harmonic{'s' if count > 1 else ''}", "harmonics", phases, set_up)


def _closed(case: Case) -> Method:
    def set_up() -> Ready:
        found = full_contact(case.contact.geometry, case.contact.stiffness, case.scene.scan.load)
        assert found is not None
        turned = 2j * math.pi * case.solved.turns
        return Read(SteadyHarmonics(np.array([0.0, case.lifted * found.first * turned**case.order])), case)

    return Method("closed form", "closed", 0.0, set_up)
