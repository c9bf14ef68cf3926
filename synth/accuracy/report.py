"""ACCURACY: the error and the time of every method, measured on one scene and this machine.

Stage   after STAGE 3, for a scene.
Model   Every method (`methods`, `baseline`) gives one period of the channel. It is compared with a reference: the
        series of the texture's own solver, refined to REFERENCE_TOLERANCE or to the solver's limit on work.
        Errors are relative to the peak-to-peak of the quantity, as the sum of its harmonics in the band. To convert an
        error to a displacement, its spectrum is divided by (2 pi f)^k. A harmonic above half the rate is compared with
        the threshold at the frequency to which it folds.
        Timings are medians of up to REPEATS runs after one run that is not timed, so compilation is not included. The
        report states it separately (`process_seconds`, `compile_seconds`).
Source  design, section 5; thresholds: `threshold`.
Limits  A stroke or a recording is measured as a steady scan at its largest speed and load. Methods that would take
        longer than PATIENCE to measure are left out and listed. After BUDGET seconds of measuring the limit is HASTE.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from time import perf_counter
from typing import Any, TypeVar

import numpy as np

from synth.accuracy.baseline import baseline_methods
from synth.accuracy.costing import explain
from synth.accuracy.methods import Case, Method, case_of, chosen_method, curve_between, methods_of
from synth.arrays import Array
from synth.errors import Fault, InvalidRequest, shown
from synth.perception.threshold import threshold_displacement
from synth.plan.preparation import prepare
from synth.response.spectrum import Complex, Demand, curves, points_for, solve_spectrum
from synth.scene.effects_section import unit_of
from synth.scene.line_scan import along_x
from synth.scene.scene import Scene, SceneLike, scene_document, scene_from
from synth.surfaces.height_field import HeightField

REPEATS = 5
PATIENCE, HASTE = 6.0, 0.5  # s, longest time to set up, run and judge a method, before and after BUDGET
BUDGET = 45.0  # s of measuring
ENOUGH = 0.5  # s of timing, after which no further run is timed
CLOCK_STEP = 1e-9  # s: a time that the clock shows as none counts as this
REFERENCE_TOLERANCE = 1e-8  # below the rounding of float32; a larger one would add to the errors of the best methods
COLUMN_PHASES = 16  # phases per point at which the error of the reference's columns is judged
SEEN_PHASES = 1 << 17  # smallest number of phases of a period at which errors are computed

Progress = Callable[[str, int, int], None]
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Measured:
    """The error and the cost of one method. docs/accuracy.md describes the fields."""

    method: str
    family: str
    max_error: float
    rms_error: float
    error_m: float
    worst_harmonic_db: float
    threshold_margin_db: float
    setup_seconds: float
    seconds_per_second: float
    times_real_time: float
    memory_bytes: int
    pareto: bool


@dataclass(frozen=True, slots=True)
class LeftOutMethod:
    """A method that was not measured, and why."""

    method: str
    family: str
    reason: str


@dataclass(frozen=True, slots=True)
class AccuracyReport:
    """The table of error and cost for one channel of a scene.

    scene: complete document of the scene.
    quantity: quantity of the channel.
    unit: its SI unit.
    peak_to_peak: peak-to-peak of the quantity, in `unit`.
    duration: duration of the scene's output, s.
    sample_rate: frames per second.
    threshold: name of the detection threshold.
    reference_error: bound on the error of the reference, relative to the peak-to-peak.
    chosen: name of the method that the plan uses; it is one of `methods`.
    repeats: largest number of runs per timing.
    process_seconds: time that this process needed once before it could compute: start, imports and kernels, s.
    compile_seconds: the part of process_seconds that compiled kernels; it is 0 if all were on disk, s.
    methods: the measured methods.
    left_out: the methods that were not measured.
    """

    scene: dict[str, Any]
    quantity: str
    unit: str
    peak_to_peak: float
    duration: float
    sample_rate: int
    threshold: str
    reference_error: float
    chosen: str
    repeats: int
    process_seconds: float
    compile_seconds: float
    methods: tuple[Measured, ...]
    left_out: tuple[LeftOutMethod, ...]

    def document(self) -> dict[str, Any]:
        """Return the JSON document (design, section 5). A number that is not finite is null."""
        made = asdict(self)
        made["methods"] = [_finite(row) for row in made["methods"]]
        made["left_out"] = list(made["left_out"])
        return _finite(made)


def reference_of(case: Case) -> tuple[Complex, float]:
    """Return the reference series of the channel (SI), and a bound on its error, relative to the peak-to-peak."""
    demand = Demand(case.solved.highest, (case.order,), REFERENCE_TOLERANCE)
    found = solve_spectrum(case.contact, case.load, demand)
    return case.derived(found.harmonics), found.errors[0] + _of_columns(case)


def _of_columns(case: Case) -> float:
    """Return the error of cells or columns that cannot be halved, by the change from those twice as large."""
    larger = case.contact.doubled()
    if larger is None or case.contact.refined() is not None:
        return 0.0
    points = points_for(case.solved.highest)
    cases = replace(case, contact=larger), case
    before, after = (one.series(one.heights, COLUMN_PHASES * points) for one in cases)
    return float(np.max(np.abs(curves(after - before, 0, points)))) / case.extent


def measure_accuracy(
    scene: SceneLike, *, quantity: str | None = None, progress: Progress | None = None
) -> AccuracyReport:
    """Return the error and the cost of every method, for one channel of `scene`. Takes half a minute.

    scene: a Scene, a mapping, the path of a JSON file, or a name of the catalogue.
    quantity: quantity of the channel; None for the first channel.
    progress: called before each method with its name, the number of methods done, and the number of all methods.
    Raises InvalidRequest if the scene has no channel with that quantity, has effects, or does not move.
    """
    scene = scene_from(scene)
    require_measurable(scene)
    channel = _channel_of(scene, quantity)
    cost = explain(scene).cost
    assert cost is not None
    case = case_of(_steady(scene), channel)
    (reference, bound), chosen = reference_of(case), chosen_method(case, channel)
    others = (method for method in methods_of(case) if method.name != chosen.name)
    made = _measured_all(case, [*baseline_methods(case), *others, chosen], reference, progress)
    rows = [one for one in made if isinstance(one, Measured)]
    left_out = [one for one in made if isinstance(one, LeftOutMethod)]
    duration = scene.output.duration
    return AccuracyReport(
        scene=scene_document(scene),
        quantity=case.quantity,
        unit=unit_of(case.quantity),
        peak_to_peak=case.extent,
        duration=duration,
        sample_rate=case.rate,
        threshold=scene.accuracy.threshold,
        reference_error=bound,
        chosen=chosen.name,
        repeats=REPEATS,
        process_seconds=cost.process_seconds,
        compile_seconds=cost.compile_seconds,
        methods=_with_front(rows, duration),
        left_out=(*left_out, *_not_there(case)),
    )


def _measured_all(
    case: Case, listed: Sequence[Method], reference: Complex, progress: Progress | None
) -> list[Measured | LeftOutMethod]:
    """Return the result of each method of `listed`, or why it was left out. The fastest are measured first."""
    made: dict[str, Measured | LeftOutMethod] = {}
    began, report_progress = perf_counter(), progress or (lambda *_done: None)
    for done, method in enumerate(sorted(listed, key=lambda one: one.seconds)):
        report_progress(method.name, done, len(listed))
        if method.seconds <= (PATIENCE if perf_counter() - began < BUDGET else HASTE):
            made[method.name] = _measured(case, method, reference)
        else:
            reason = f"It would take {method.seconds:.3g} s to measure."
            made[method.name] = LeftOutMethod(method.name, method.family, reason)
    report_progress(listed[-1].name, len(listed), len(listed))
    return [made[method.name] for method in listed]


def _not_there(case: Case) -> Iterator[LeftOutMethod]:
    """Yield the methods that do not apply to this scene, with the reason."""
    if isinstance(case.contact.geometry.profile, HeightField):
        reason = "It solves a texture along a line, and this texture varies across it."
        for name, family in (("trapezoid and brentq", "baseline"), ("sampled solver", "sampled")):
            yield LeftOutMethod(name, family, reason)
    sinusoid = case.contact.geometry.profile is None
    if not sinusoid:
        reason = "Only two cosines have antiderivatives in closed form. Refined segments replace them."
        yield LeftOutMethod("exact solver in closed form", "exact", reason)
    if case.contact.closed(case.load) is None:
        pressed = "The load does not flatten the whole contact at every phase."
        reason = pressed if sinusoid else "Full contact gives one sinusoid only if the texture is a sinusoid."
        yield LeftOutMethod("closed form", "closed", reason)


def require_measurable(scene: Scene) -> None:
    """Raise those errors of `measure_accuracy` that do not require a solution of the scene."""
    if scene.effects:
        hint = "The report compares methods that compute the contact response. Leave the effects out."
        raise InvalidRequest([Fault("/effects", ", ".join(scene.effects), "{}", hint)])
    if scene.scan.speed == 0.0:
        hint = "Where the finger does not move, there is nothing to measure."
        raise InvalidRequest([Fault("/scan/speed", "0 m/s", "a speed above or below 0 m/s", hint)])


def _channel_of(scene: Scene, quantity: str | None) -> int:
    """Return the index of the first channel of `quantity`."""
    names = [channel.quantity for channel in scene.output.channel_list]
    if quantity is None:
        return 0
    if quantity in names:
        return names.index(quantity)
    allowed = ", ".join(dict.fromkeys(names))
    raise InvalidRequest([Fault("/quantity", shown(quantity), allowed, "Name a quantity of output.channels.")])


def _steady(scene: Scene) -> Scene:
    """Return `scene` with a constant scan. Raises InvalidRequest if that is silent."""
    speed = along_x(scene).scan.speed
    scan = scene.scan.model_copy(update={"speed": speed, "stroke": None, "trajectory": None, "heading": 0.0})
    scene = scene.model_copy(update={"scan": scan})
    silence = prepare(scene).silence
    if silence:
        raise InvalidRequest(
            [Fault("", "a silent scene", "a scene that moves", f"{silence} There is nothing to measure.")]
        )
    return scene


def _measured(case: Case, method: Method, reference: Complex) -> Measured:
    ready, setup = _timed(method.set_up)
    values = ready.period(max(SEEN_PHASES, 1 << (8 * case.solved.highest).bit_length()))
    error = values - curve_between(reference, len(values))
    a_second = max(_timed(ready.run)[1], CLOCK_STEP) * case.rate / ready.frames
    displacement, worst, margin = _spectral_errors(case, error, reference)
    return Measured(
        method=method.name,
        family=method.family,
        max_error=float(np.max(np.abs(error))) / case.extent,
        rms_error=float(np.sqrt(np.mean(error**2))) / case.extent,
        error_m=displacement,
        worst_harmonic_db=worst,
        threshold_margin_db=margin,
        setup_seconds=setup if ready.setup is None else ready.setup,
        seconds_per_second=a_second,
        times_real_time=1.0 / a_second,
        memory_bytes=ready.nbytes,
        pareto=False,
    )


def _timed(work: Callable[[], T]) -> tuple[T, float]:
    """Return the result of `work`, and the median of its times (s) after a first run."""
    times: list[float] = []
    made = work()
    while len(times) < REPEATS and sum(times) < ENOUGH:
        began = perf_counter()
        made = work()
        times.append(perf_counter() - began)
    return made, statistics.median(times)


def _spectral_errors(case: Case, error: Array, reference: Complex) -> tuple[float, float, float]:
    """Return three figures of an error.

    - its largest value as a displacement, m
    - its largest harmonic in the band, relative to the strongest harmonic of the reference, dB
    - its margin below the detection threshold, dB
    """
    lines = np.fft.rfft(error) / len(error)
    n = np.arange(1, len(lines))
    sizes = 2.0 * np.abs(lines[1:])
    fundamental = abs(case.solved.turns)
    per_turn = (2.0 * math.pi * fundamental * n) ** case.order
    displaced = np.concatenate([[0.0], lines[1:] / per_turn])
    largest = float(np.max(np.abs(np.fft.irfft(displaced, len(error)) * len(error))))
    in_band = sizes[: case.solved.highest]
    strongest = 2.0 * float(np.max(np.abs(reference)))
    worst = _decibels(float(np.max(in_band)) / strongest)
    folded = np.abs(n * fundamental - np.rint(n * fundamental / case.rate) * case.rate)
    folded = np.maximum(folded, 1.0)
    felt = threshold_displacement(folded, case.scene.accuracy.threshold) * (2.0 * math.pi * folded) ** case.order
    return largest, worst, -_decibels(float(np.max(sizes / felt)))


def _decibels(ratio: float) -> float:
    return 20.0 * math.log10(ratio) if ratio > 0.0 else -math.inf


def _with_front(rows: Sequence[Measured], duration: float) -> tuple[Measured, ...]:
    """Return the rows with `pareto` true for those on the Pareto front.

    The cost is the set-up time plus the time for `duration` seconds.
    """
    pairs = [(row.max_error, row.setup_seconds + duration * row.seconds_per_second) for row in rows]
    beaten = [any(other != own and other[0] <= own[0] and other[1] <= own[1] for other in pairs) for own in pairs]
    return tuple(replace(row, pareto=not one) for row, one in zip(rows, beaten, strict=True))


def _finite(row: dict[str, Any]) -> dict[str, Any]:
    return {
        name: None if isinstance(value, float) and not math.isfinite(value) else value for name, value in row.items()
    }
