"""The exact solver, per phase, compared with a straightforward implementation of the model."""

from __future__ import annotations

import statistics

import numpy as np

from synth.accuracy.baseline import Trapezoid
from synth.contact.geometry import Geometry
from synth.contact.load_balance import Contact
from synth.contact.stiffness import Stiffness
from synth.scene.scene import parse_scene
from tests.bench.timing import Figure, figure, repeated

PHASES = 4096  # of a period, in order, as for a response
BASELINE_PHASES = 16
BASELINES = (100.0, 6000.0)  # points per ridge: errors of about 1e-3 and 1e-6 of the motion, from the design
AGAINST_BASELINE = 1.0  # 1/1000: the exact solver is a thousand times faster than a baseline with an error of 1e-6


def figures(quick: bool) -> list[Figure]:
    """Return the lines of the solver, on one core."""
    scene = parse_scene({"output": {"bandwidth": "full"}})
    contact = Contact(Geometry.of_scene(scene), Stiffness.of_scene(scene))
    indentation = contact.stiffness.indentation(scene.scan.load)
    phases = np.arange(PHASES) / PHASES
    repeats = 3 if quick else 25
    exact = repeated(lambda: contact.grid.solve(phases, indentation), repeats)
    how = f"{PHASES} phases of a period, median of {repeats}"
    lines = [figure("exact solver, default scene", exact, "us/phase", 5.0, how, scale=1e6 / PHASES)]
    for points in BASELINES[:1] if quick else BASELINES:
        lines.append(baseline(contact, scene.scan.load, points, lines[0].value, 1 if quick else 5))
    return lines


def baseline(contact: Contact, load: float, points: float, exact: float, repeats: int) -> Figure:
    """Return the `exact` us per phase in thousandths of the baseline's time, and the error of the baseline."""
    rule = Trapezoid(contact, load, points)
    phases = (np.arange(BASELINE_PHASES) + 0.5) / BASELINE_PHASES
    targets = np.full(len(phases), contact.indentation(load))
    height, _slope = contact.approach(phases, load)
    extent = np.ptp(contact.approach(np.arange(512) / 512, load)[0])
    error = float(np.max(np.abs(rule.solved(phases, targets) - height)) / extent)
    took = repeated(lambda: rule.solved(phases, targets), repeats)
    a_phase = 1e6 * statistics.median(took) / BASELINE_PHASES
    how = f"brentq, {points:g} points per ridge, error {error:.1e}, {a_phase:.4g} us per phase, median of {repeats}"
    parts = [exact / (1e6 * one / BASELINE_PHASES) for one in took]
    limit = AGAINST_BASELINE if points == BASELINES[-1] else None
    return figure("exact solver, of a baseline's time", parts, "1/1000", limit, how, scale=1e3)
