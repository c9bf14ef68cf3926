"""What the plan assumes of the methods it chooses between, beside what they take on this machine.

`synth.plan.method_choice` predicts times from constants, so that the same scene takes the same methods everywhere. Each
line is a
measured time over the assumed one: far from 1, another choice would be cheaper here.
"""

from __future__ import annotations

import statistics
from collections.abc import Callable

import numpy as np

from synth.contact.balance import Contact
from synth.contact.geometry import Geometry
from synth.contact.sampled import SampledGrid
from synth.contact.stiffness import Stiffness
from synth.plan import method_choice as choice
from synth.response.phase_cells import CUBIC, LINEAR, fitted_table, polynomials
from synth.response.steady import SteadyHarmonics, SteadyReader, SteadyTable
from synth.scene.scene import parse_scene
from tests.bench.timing import Figure, figure, repeated

PHASES = 1024
FRAMES = 1 << 14
HARMONICS = 32


def figures(quick: bool) -> list[Figure]:
    """Return the lines of the methods; on one core."""
    repeats = 3 if quick else 51
    return [*solvers(repeats), *readers(repeats), *set_ups(repeats)]


def ratio(name: str, work: Callable[[], object], repeats: int, assumed: float, what: str) -> Figure:
    """Return the line of `work`, which is assumed to take `assumed` nanoseconds."""
    times = repeated(work, repeats)
    took = 1e9 * statistics.median(times)
    how = f"{what}: {took / 1e3:.3g} us against {assumed / 1e3:.3g}, median of {repeats}"
    return figure(name, times, "x assumed", None, how, scale=1e9 / assumed)


def solvers(repeats: int) -> list[Figure]:
    """Return the lines of a phase of the exact and of the sampled solver."""
    scene = parse_scene({"output": {"bandwidth": "full"}})
    geometry, stiffness = Geometry.of_scene(scene), Stiffness.of_scene(scene)
    contact, pressed = Contact.of(geometry, stiffness), stiffness.indentation(scene.scan.load)
    sampled, phases = SampledGrid.of_geometry(geometry, 64), np.arange(PHASES) / PHASES
    exact_time = PHASES * contact.grid.cells * choice.EXACT_CELL
    sampled_time = PHASES * sampled.cells * choice.SAMPLED_PIECE
    return [
        ratio("choice: exact solver", lambda: contact.grid.solve(phases, pressed), repeats, exact_time, "1024 phases"),
        ratio("choice: sampled solver", lambda: sampled.solve(phases, pressed), repeats, sampled_time, "1024 phases"),
    ]


def readers(repeats: int) -> list[Figure]:
    """Return the lines of a block of each reader."""
    curve = kink(HARMONICS)
    out = np.empty((FRAMES, 1), np.float32)
    step = int(2**64 / 480.3)

    def line(name: str, reader: SteadyReader, a_frame: float) -> Figure:
        return ratio(name, lambda: reader.read(0, step, 1.0, out, 0), repeats, FRAMES * a_frame, "16384 frames")

    summed = choice.HARMONICS_FRAME + HARMONICS * choice.HARMONIC_FRAME
    return [
        line("choice: cubic table", SteadyTable(polynomials(curve, CUBIC, 1024)), choice.CUBIC_FRAME),
        line("choice: linear table", SteadyTable(polynomials(curve, LINEAR, 1024)), choice.LINEAR_FRAME),
        line("choice: sum of 32 harmonics", SteadyHarmonics(curve), summed),
    ]


def set_ups(repeats: int) -> list[Figure]:
    """Return the lines of building a table."""
    lines = []
    for count, tolerance in ((16, 1e-3), (191, 1e-4)):
        curve = kink(count)
        cells = len(fitted_table(curve, CUBIC, (0,), tolerance).coefficients)
        assumed = choice.TABLE_SETUP + cells * choice.CELL_SETUP
        build = ratio(
            f"choice: table of {cells} cells",
            lambda curve=curve, tolerance=tolerance: fitted_table(curve, CUBIC, (0,), tolerance),  # type: ignore[misc]
            repeats, assumed, f"{count} harmonics",
        )  # fmt: skip
        lines.append(build)
    return lines


def kink(count: int) -> np.ndarray:
    """Return a series that falls as that of a kink of order 3/2."""
    n = np.arange(1, count + 1)
    return np.concatenate([[0.0], n**-2.5 * np.exp(1j * n**2)])
