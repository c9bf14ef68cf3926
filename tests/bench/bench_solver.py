"""The exact solver, a phase; and what the obvious way to write the model takes instead."""

from __future__ import annotations

import numpy as np

from synth.contact.geometry import Geometry
from synth.contact.spectrum import Contact
from synth.contact.stiffness import Stiffness
from synth.scene import Scene, parse_scene
from tests.bench.timing import Figure, figure, repeated
from tests.reference.sampled_baseline import sampled_approach
from tests.reference.stiffness_oracle import Touch, stiffness

PHASES = 4096  # of a period, in order, as a response takes them
BASELINE_PHASES = 16
BASELINES = (100.0, 6000.0)  # points a ridge: about 1e-3 and 1e-6 of the motion off, says the design


def figures(quick: bool) -> list[Figure]:
    """Return the lines of the solver; on one core."""
    scene = parse_scene({})
    contact = Contact.of(Geometry.of_scene(scene), Stiffness.of_scene(scene))
    indentation = contact.stiffness.indentation(scene.scan.load)
    phases = np.arange(PHASES) / PHASES
    repeats = 3 if quick else 25
    exact = repeated(lambda: contact.grid.solve(phases, indentation), repeats)
    how = f"{PHASES} phases of a period, median of {repeats}"
    lines = [figure("exact solver, default scene", exact, "us/phase", 5.0, how, scale=1e6 / PHASES)]
    for points in BASELINES[:1] if quick else BASELINES:
        lines.append(baseline(scene, contact, points, lines[0].value, 1 if quick else 5))
    return lines


def baseline(scene: Scene, contact: Contact, points: float, exact: float, repeats: int) -> Figure:
    """Return how many times longer the sampled baseline takes than the `exact` us a phase, and how far off it is."""
    touch = Touch()  # the same scene, as the oracles take it
    groups, tall = stiffness(touch), touch.ridge_amplitude + touch.texture_amplitude
    phases = (np.arange(BASELINE_PHASES) + 0.5) / BASELINE_PHASES

    def sampled() -> list[float]:
        return [
            tall
            * sampled_approach(
                groups.tau, groups.period_ratio, touch.texture_amplitude / tall, groups.indentation_load, phase,
                touch.phase, points, touch.ridge_amplitude / tall,
            )
            for phase in phases
        ]  # fmt: skip

    height, _slope = contact.approach(phases, scene.scan.load)
    extent = np.ptp(contact.approach(np.arange(512) / 512, scene.scan.load)[0])
    error = float(np.max(np.abs(sampled() - height)) / extent)
    took = repeated(sampled, repeats)
    how = f"brentq, {points:g} points a ridge, off by {error:.1e} of the motion, median of {repeats}"
    return figure("sampled baseline", took, "x exact", None, how, scale=1e6 / BASELINE_PHASES / exact)
