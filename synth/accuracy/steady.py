"""How a constant scan is measured: over one period, against the series of the texture's own solver.

Stage   after STAGE 3, for a scene whose frames are read from a series.
Model   Every method (`methods`, `baseline`) gives one period of the channel. It is compared with a reference: the
        series of the texture's own solver, refined to REFERENCE_TOLERANCE or to the solver's limit on work.
        Errors are relative to the peak-to-peak of the quantity, as the sum of its harmonics in the band. A harmonic
        above half the rate is compared with the threshold at the frequency to which it folds.
Source  design, section 5.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from synth.accuracy.baseline import baseline_methods
from synth.accuracy.method import Errors, LeftOutMethod, Ready, Subject, decibels, margin_below
from synth.accuracy.methods import Case, case_of, chosen_method, curve_between, methods_of, short_enough
from synth.arrays import Array
from synth.plan.preparation import Preparation
from synth.response.demand import Complex, Demand, curves, points_for
from synth.response.spectrum import solve_spectrum

REFERENCE_TOLERANCE = 1e-8  # below the rounding of float32; a larger one would add to the errors of the best methods
COLUMN_PHASES = 16  # phases per point at which the error of the reference's columns is judged
SEEN_PHASES = 1 << 17  # smallest number of phases of a period at which errors are computed
MEASURED = "The errors are those over a period of the texture, at the speed and the load of the scan."


def steady_subject(solved: Preparation, channel: int) -> Subject:
    """Return how channel number `channel` of a constant scan that is not silent is measured."""
    case = case_of(solved, channel)
    (reference, bound), chosen = reference_of(case), chosen_method(case, channel)
    others = (method for method in methods_of(case) if method.name != chosen.name)

    def errors(ready: Ready) -> Errors:
        """Return the errors of a period."""
        values = ready.values(max(SEEN_PHASES, 1 << (8 * case.solved.highest).bit_length()))
        return _errors(case, values - curve_between(reference, len(values)), reference)

    return Subject(
        quantity=case.quantity,
        extent=case.extent,
        measured=MEASURED,
        reference_error=bound,
        chosen=chosen.name,
        methods=(*baseline_methods(case), *others, chosen),
        left_out=tuple(_not_there(case)),
        errors=errors,
    )


def reference_of(case: Case) -> tuple[Complex, float]:
    """Return the reference series of the channel (SI), and a bound on its error, relative to the peak-to-peak."""
    demand = Demand(case.solved.highest, (case.order,), REFERENCE_TOLERANCE)
    found = solve_spectrum(case.contact, case.load, demand)
    return case.derived(found.harmonics), found.errors[0] + _of_columns(case)


def _of_columns(case: Case) -> float:
    """Return the error of cells or columns that no series refines, by the change from those twice as large."""
    larger = case.contact.doubled()
    if larger is None or case.contact.refines:
        return 0.0
    points = points_for(case.solved.highest)
    cases = replace(case, contact=larger), case
    before, after = (one.series(one.heights, COLUMN_PHASES * points) for one in cases)
    return float(np.max(np.abs(curves(after - before, 0, points)))) / case.extent


def _not_there(case: Case) -> Iterator[LeftOutMethod]:
    """Yield the methods that do not apply to this scene, with the reason."""
    if case.contact.geometry.over_area:
        reason = "It solves a texture along a line, and this texture varies across it."
        for name, family in (("trapezoid and brentq", "baseline"), ("sampled solver", "sampled")):
            yield LeftOutMethod(name, family, reason)
    sinusoid = case.contact.geometry.profile is None
    if not sinusoid:
        reason = "Only two cosines have antiderivatives in closed form. Refined segments replace them."
        yield LeftOutMethod("exact solver in closed form", "exact", reason)
    if not short_enough(case.scene):
        yield LeftOutMethod("response table", "table", "The period of the surface is too long for a table.")
    if case.contact.closed(case.load) is None:
        pressed = "The load does not flatten the whole contact at every phase."
        reason = pressed if sinusoid else "Full contact gives one sinusoid only if the texture is a sinusoid."
        yield LeftOutMethod("closed form", "closed", reason)


def _errors(case: Case, error: Array, reference: Complex) -> Errors:
    """Return the figures of an error at equal steps of a period."""
    lines = np.fft.rfft(error) / len(error)
    n = np.arange(1, len(lines))
    sizes = 2.0 * np.abs(lines[1:])
    fundamental = abs(case.solved.turns)
    displaced = np.concatenate([[0.0], lines[1:] / (2.0 * math.pi * fundamental * n) ** case.order])
    folded = np.abs(n * fundamental - np.rint(n * fundamental / case.rate) * case.rate)
    return Errors(
        max_error=float(np.max(np.abs(error))) / case.extent,
        rms_error=float(np.sqrt(np.mean(error**2))) / case.extent,
        error_m=float(np.max(np.abs(np.fft.irfft(displaced, len(error)) * len(error)))),
        worst_harmonic_db=decibels(
            float(np.max(sizes[: case.solved.highest])) / (2.0 * float(np.max(np.abs(reference))))
        ),
        threshold_margin_db=margin_below(sizes, np.maximum(folded, 1.0), case.order, case.scene.accuracy.threshold),
    )
