"""ACCURACY: what accuracy costs in time, method by method, measured on one scene and this machine.

Stage   after STAGE 3, over a scene.
Model   Every method (`methods`, `baseline`) gives one period of the channel, and is compared with a reference: the
        series of the texture's own solver, solved and refined to REFERENCE_TOLERANCE, or as far as the bound on work
        allows. Errors are relative to the quantity's peak-to-peak, limited to its harmonics; an error as a displacement
        is its spectrum divided by (2 pi f)^k; a harmonic above half the rate is felt where it folds to. Timings are
        medians of REPEATS runs after one that is not counted, so compiling is left out; the report tells it beside
        (`start_up`).
Source  design, section 5; thresholds: `threshold`.
Limits  a stroke, or a recording, is measured as a steady scan at its largest speed and load. Methods that would take
        longer than PATIENCE to measure are left out and named; after BUDGET of the quicker ones, those that would take
        longer than HASTE.
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
from synth.errors import CannotRender, Fault, InvalidRequest, shown
from synth.perception.threshold import threshold_displacement
from synth.plan.channels import UNITS
from synth.plan.preparation import prepare
from synth.response.spectrum import Complex, Demand, solve_spectrum
from synth.scene.scene import Scene, SceneLike, scene_document, scene_from

REPEATS = 5
PATIENCE, HASTE = 6.0, 0.5  # s that a method may take to be set up, run and judged once, and after BUDGET
BUDGET = 45.0  # s of measuring
ENOUGH = 0.5  # s of a timing, after which it is not repeated
REFERENCE_TOLERANCE = 1e-8  # below the rounding of float32; looser ones would show in the errors of the best methods
SEEN_PHASES = 1 << 17  # of a period, at least, at which errors are looked for

Progress = Callable[[str, int, int], None]
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Measured:
    """What one method errs by and costs; docs/accuracy.md tells what each field means."""

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
    """The cost-against-error table of one channel of a scene.

    peak_to_peak: of the quantity, in `unit`. reference_error: a bound of that of what errors are measured against.
    threshold: name of the detection curve. chosen: the method that the plan takes; it is among `methods`. repeats: how
    many times each timing was taken at most. process_seconds: what this process took once before it could compute:
    start, imports, kernels. compile_seconds: the part of that which only a first use takes.
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
        """Return the JSON document (design, section 5); null where a number is not finite."""
        made = asdict(self)
        made["methods"] = [_finite(row) for row in made["methods"]]
        made["left_out"] = list(made["left_out"])
        return _finite(made)


def reference_of(case: Case) -> tuple[Complex, float]:
    """Return the truth: the series of the channel (SI), and a bound of its error relative to the peak-to-peak."""
    demand = Demand(case.solved.highest, (case.order,), REFERENCE_TOLERANCE)
    found = solve_spectrum(case.contact, case.load, demand)
    return case.derived(found.harmonics), found.errors[0]


def measure_accuracy(
    scene: SceneLike, *, quantity: str | None = None, progress: Progress | None = None
) -> AccuracyReport:
    """Return what every method errs by and costs for one channel of `scene`. Takes half a minute.

    scene: a Scene, a mapping, the path of a JSON file, or a name of the catalogue. quantity: that of the channel, None
    for the first. progress: told before each method its name, how many are done, and how many there are.
    Raises InvalidRequest for a quantity that the scene has no channel of, and for a scene with effects, CannotRender
    where nothing moves.
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
        unit=UNITS[case.quantity],
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
    """Return what each method of `listed` errs by and costs, or why it was left out; the quickest come first."""
    made: dict[str, Measured | LeftOutMethod] = {}
    began, told = perf_counter(), progress or (lambda *_done: None)
    for done, method in enumerate(sorted(listed, key=lambda one: one.seconds)):
        told(method.name, done, len(listed))
        if method.seconds <= (PATIENCE if perf_counter() - began < BUDGET else HASTE):
            made[method.name] = _measured(case, method, reference)
        else:
            reason = f"It would take {method.seconds:.3g} s to measure."
            made[method.name] = LeftOutMethod(method.name, method.family, reason)
    told(listed[-1].name, len(listed), len(listed))
    return [made[method.name] for method in listed]


def _not_there(case: Case) -> Iterator[LeftOutMethod]:
    """Yield the methods that this scene does not have, with the reason in words."""
    sinusoid = case.contact.geometry.profile is None
    if not sinusoid:
        reason = "Two cosines alone have antiderivatives in closed form: segments, refined, take its place."
        yield LeftOutMethod("exact solver in closed form", "exact", reason)
    if case.contact.closed(case.load) is None:
        pressed = "The load does not flatten the whole contact at every phase."
        reason = pressed if sinusoid else "Full contact is one sinusoid only where the texture is."
        yield LeftOutMethod("closed form", "closed", reason)


def require_measurable(scene: Scene) -> None:
    """Raise what `measure_accuracy` raises of `scene`, as far as that is seen without solving anything."""
    if scene.effects:
        hint = "The report compares ways to compute the contact response: leave the effects out."
        raise InvalidRequest([Fault("/effects", ", ".join(scene.effects), "{}", hint)])
    if scene.scan.speed == 0.0:
        raise CannotRender("The finger stands still (scan.speed is 0 m/s): there is nothing to measure.")


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
    """Return `scene` as a constant scan; raises CannotRender where that is silent."""
    scan = scene.scan.model_copy(update={"stroke": None, "trajectory": None})
    scene = scene.model_copy(update={"scan": scan})
    silence = prepare(scene).silence
    if silence:
        raise CannotRender(f"{silence} There is nothing to measure.")
    return scene


def _measured(case: Case, method: Method, reference: Complex) -> Measured:
    ready, setup = _timed(method.set_up)
    values = ready.period(max(SEEN_PHASES, 1 << (8 * case.solved.highest).bit_length()))
    error = values - curve_between(reference, len(values))
    a_second = _timed(ready.run)[1] * case.rate / ready.frames
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
    """Return what `work` returns, and the median of its times (s) after a first run."""
    times: list[float] = []
    made = work()
    while len(times) < REPEATS and sum(times) < ENOUGH:
        began = perf_counter()
        made = work()
        times.append(perf_counter() - began)
    return made, statistics.median(times)


def _spectral_errors(case: Case, error: Array, reference: Complex) -> tuple[float, float, float]:
    """Return the largest error as a displacement (m), that of a harmonic in the band in dB, and the margin in dB."""
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
    """Return the rows, `pareto` true where none is nearer and cheaper, set-up and `duration` seconds together."""
    pairs = [(row.max_error, row.setup_seconds + duration * row.seconds_per_second) for row in rows]
    beaten = [any(other != own and other[0] <= own[0] and other[1] <= own[1] for other in pairs) for own in pairs]
    return tuple(replace(row, pareto=not one) for row, one in zip(rows, beaten, strict=True))


def _finite(row: dict[str, Any]) -> dict[str, Any]:
    return {
        name: None if isinstance(value, float) and not math.isfinite(value) else value for name, value in row.items()
    }
