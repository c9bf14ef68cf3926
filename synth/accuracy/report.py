"""ACCURACY: what accuracy costs in time, method by method, measured on one scene and this machine.

Stage   after STAGE 3, over a scene.
Model   Every method (`methods`, `baseline_methods`) gives one period of the channel, and is compared with a reference:
        the exact solver at REFERENCE times as many phases as any table has, or as many as the bound on work allows.
        Errors are relative to the quantity's peak-to-peak, limited to its harmonics; an error as a displacement is its
        spectrum divided by (2 pi f)^k; a harmonic above half the rate is felt where it folds to. Timings are medians of
        REPEATS runs after one that is not counted, so compiling is left out; the report tells it beside (`start_up`).
Source  design, section 5; thresholds: `threshold`.
Limits  a stroke, or a recording, is measured as a steady scan at its largest speed and load. Methods that would take
        longer than PATIENCE to measure, or, after BUDGET of measuring, than HASTE, are left out and named, and so are
        sizes of the baseline that would show nothing new (`ladders`).
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from time import perf_counter
from typing import Any

import numpy as np

from synth.accuracy.baseline_methods import baseline_methods
from synth.accuracy.costing import explain
from synth.accuracy.ladders import Ladders
from synth.accuracy.methods import TABLE_PHASES, Case, Method, case_of, chosen_method, methods_of
from synth.arrays import Array
from synth.contact.geometry import Geometry
from synth.errors import AskedWrong, CannotRender, Fault, shown
from synth.perception.threshold import threshold_displacement
from synth.plan.channels import UNITS
from synth.plan.preparation import prepare
from synth.response.spectrum import MOST_WORK, curves
from synth.scene.scene import Scene, scene_document
from synth.scene.source import SceneLike, scene_from

REPEATS = 5
PATIENCE, HASTE = 6.0, 0.5  # s that measuring one method may take, and after BUDGET
BUDGET = 60.0  # s of measuring
REFERENCE = 8  # times the phases of the largest table: the error of the reference is then 200 times smaller
SEEN_PHASES = 1 << 17  # of a period, at least, at which errors are looked for
PROBES = 8  # phases solved to guess how long a method takes

Progress = Callable[[str, int, int], None]


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

    def seconds_for(self, duration: float) -> float:
        """Return the seconds that `duration` seconds of sound take, set-up included."""
        return self.setup_seconds + duration * self.seconds_per_second


@dataclass(frozen=True, slots=True)
class LeftOut:
    """A method that was not measured, and why."""

    method: str
    family: str
    reason: str


@dataclass(frozen=True, slots=True)
class AccuracyReport:
    """The cost-against-error table of one channel of a scene.

    peak_to_peak: of the quantity, in `unit`. reference_error: of what errors are measured against, relative to it.
    threshold: name of the detection curve. chosen: the method that the plan takes; it is among `methods`. repeats: how
    many times each timing was taken. process_seconds: what this process took once before it could compute: start,
    imports, kernels. compile_seconds: the part of that which only a first use takes.
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
    left_out: tuple[LeftOut, ...]

    def document(self) -> dict[str, Any]:
        """Return the JSON document (design, section 5); null where a number is not finite."""
        made = asdict(self)
        made["methods"] = [_finite(row) for row in made["methods"]]
        made["left_out"] = list(made["left_out"])
        return _finite(made)


@dataclass(frozen=True, slots=True)
class Reference:
    """The truth: values (SI) at the phases (i + 1/2) / points of a period, and how far off it may be."""

    curve: Array
    strongest: float
    error: float


def measure_accuracy(
    scene: SceneLike, *, quantity: str | None = None, progress: Progress | None = None
) -> AccuracyReport:
    """Return what every method errs by and costs for one channel of `scene`. Takes half a minute.

    scene: a Scene, a mapping, the path of a JSON file, or a name of the catalogue. quantity: that of the channel, None
    for the first. progress: told before each method its name, how many are done, and how many there are.
    Raises AskedWrong for a quantity that the scene has no channel of, and for a scene with effects, CannotRender where
    nothing moves.
    """
    scene = scene_from(scene)
    require_measurable(scene)
    channel = _channel_of(scene, quantity)
    cost = explain(scene).cost
    assert cost is not None
    case = case_of(_steady(scene), channel)
    reference = _reference_of(case)
    chosen = chosen_method(case, channel)
    others = (method for method in methods_of(case) if method.name != chosen.name)
    listed = [*baseline_methods(case), *others, chosen]
    rows, left_out = _measured_all(case, listed, chosen, reference, progress)
    planned = scene.output.channel_list[channel]
    duration = scene.output.duration
    return AccuracyReport(
        scene=scene_document(scene),
        quantity=planned.quantity,
        unit=UNITS[planned.quantity],
        peak_to_peak=case.extent,
        duration=duration,
        sample_rate=case.rate,
        threshold=scene.accuracy.threshold,
        reference_error=reference.error,
        chosen=chosen.name,
        repeats=REPEATS,
        process_seconds=cost.process_seconds,
        compile_seconds=cost.compile_seconds,
        methods=_with_front(rows, duration),
        left_out=tuple(left_out),
    )


def _measured_all(
    case: Case, listed: Sequence[Method], chosen: Method, reference: Reference, progress: Progress | None
) -> tuple[list[Measured], list[LeftOut]]:
    """Return what each method of `listed` errs by and costs, and why others were left out."""
    rows: list[Measured] = []
    left_out: list[LeftOut] = []
    ladders = Ladders(case.solved.tolerance)
    began = perf_counter()
    for done, method in enumerate(listed):
        if progress is not None:
            progress(method.name, done, len(listed))
        rung = method.rung
        if rung is not None and ladders.skips(rung.ladder, rung.points, rung.below):
            continue
        patience = PATIENCE if perf_counter() - began < BUDGET else HASTE
        found = _measured(case, method, reference, math.inf if method is chosen else patience)
        if isinstance(found, Measured):
            rows.append(found)
        else:
            left_out.append(found)
        if rung is None:
            continue
        if isinstance(found, LeftOut):
            ladders.end(rung.ladder, found.reason)
        elif reason := ladders.take(rung.ladder, rung.points, found.max_error):
            left_out.append(LeftOut(f"{rung.ladder}, more points", method.family, reason))
    if progress is not None:
        progress(chosen.name, len(listed), len(listed))
    return rows, left_out


def require_measurable(scene: Scene) -> None:
    """Raise what `measure_accuracy` raises of `scene`, as far as that is seen without solving anything."""
    if scene.effects:
        hint = "The report compares ways to compute the contact response: leave the effects out."
        raise AskedWrong([Fault("/effects", ", ".join(scene.effects), "{}", hint)])
    if Geometry.of_scene(scene).profile is not None:
        raise CannotRender(
            f"The report's methods are written for a sinusoid, and the texture is of kind {scene.texture.kind}. "
            "Its plan (explain) tells its error and its cost."
        )
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
    raise AskedWrong([Fault("/quantity", shown(quantity), allowed, "Name a quantity of output.channels.")])


def _steady(scene: Scene) -> Scene:
    """Return `scene` as a constant scan; raises CannotRender where that is silent."""
    if scene.scan.stroke is not None or scene.scan.trajectory is not None:
        update = {"stroke": None, "trajectory": None, "speed": scene.scan.speed, "load": scene.scan.load}
        scene = scene.model_copy(update={"scan": scene.scan.model_copy(update=update)})
    silence = prepare(scene).silence
    if silence:
        raise CannotRender(f"{silence} There is nothing to measure.")
    return scene


def _reference_of(case: Case) -> Reference:
    most = 1 << int(math.log2(MOST_WORK / case.contact.grid.cells))
    phases = max(min(REFERENCE * TABLE_PHASES[-1], most), 1 << (4 * case.solved.highest).bit_length())
    heights = case.heights(phases)
    series, half = case.series(heights), case.series(heights[::2])
    points = _points(case)
    turned = np.exp(1j * math.pi * np.arange(len(series)) / points)
    curve = curves(series * turned, 0, points)
    change = float(np.max(np.abs(curves((series - half) * turned, 0, points))))
    return Reference(curve, 2.0 * float(np.max(np.abs(series))), change / case.extent / 2.0**2.5)


def _points(case: Case) -> int:
    return max(SEEN_PHASES, 1 << (8 * case.solved.highest).bit_length())


def _measured(case: Case, method: Method, reference: Reference, patience: float) -> Measured | LeftOut:
    longest = method.seconds
    if longest is None or longest <= patience:
        ready = method.set_up()
        longest = _expected_seconds(method, case, ready) if longest is None else longest
    if longest > patience:
        return LeftOut(method.name, method.family, f"It would take {longest:.3g} s to measure.")
    setups, runs = [], []
    for _ in range(REPEATS):
        if ready.setup is not None:
            setups.append(ready.setup)
            continue
        began = perf_counter()
        ready = method.set_up()
        setups.append(perf_counter() - began)
    error = ready.period(len(reference.curve)) - reference.curve
    ready.run()
    for _ in range(REPEATS):
        began = perf_counter()
        ready.run()
        runs.append(perf_counter() - began)
    a_second = statistics.median(runs) * case.rate / ready.frames
    largest = float(np.max(np.abs(error)))
    displacement, worst, margin = _spectral_errors(case, error, reference)
    return Measured(
        method=method.name,
        family=method.family,
        max_error=largest / case.extent,
        rms_error=float(np.sqrt(np.mean(error**2))) / case.extent,
        error_m=displacement,
        worst_harmonic_db=worst,
        threshold_margin_db=margin,
        setup_seconds=statistics.median(setups),
        seconds_per_second=a_second,
        times_real_time=1.0 / a_second,
        memory_bytes=ready.nbytes,
        pareto=False,
    )


def _expected_seconds(method: Method, case: Case, ready: Any) -> float:
    """Return about how long a method takes to measure, from a few of its phases."""
    contact = getattr(ready, "contact", case.contact)
    probes = np.arange(PROBES) / PROBES
    contact.approach(probes, case.scene.scan.load)
    began = perf_counter()
    contact.approach(probes, case.scene.scan.load)
    a_phase = (perf_counter() - began) / PROBES
    frames = ready.frames * max(1.0, method.phases / case.period_frames) if method.family in ("exact", "sampled") else 0
    setups = method.phases * (REPEATS + 1) if method.family in ("table", "harmonics") else method.phases
    return float(a_phase * (setups + (REPEATS + 1) * frames))


def _spectral_errors(case: Case, error: Array, reference: Reference) -> tuple[float, float, float]:
    """Return the largest error as a displacement (m), that of a harmonic in the band in dB, and the margin in dB."""
    lines = np.fft.rfft(error) / len(error)
    n = np.arange(1, len(lines))
    sizes = 2.0 * np.abs(lines[1:])
    fundamental = abs(case.solved.turns)
    per_turn = (2.0 * math.pi * fundamental * n) ** case.order
    displaced = np.concatenate([[0.0], lines[1:] / per_turn])
    largest = float(np.max(np.abs(np.fft.irfft(displaced, len(error)) * len(error))))
    in_band = sizes[: case.solved.highest]
    worst = _decibels(float(np.max(in_band)) / reference.strongest)
    folded = np.abs(n * fundamental - np.rint(n * fundamental / case.rate) * case.rate)
    folded = np.maximum(folded, 1.0)
    felt = threshold_displacement(folded, case.scene.accuracy.threshold) * (2.0 * math.pi * folded) ** case.order
    return largest, worst, -_decibels(float(np.max(sizes / felt)))


def _decibels(ratio: float) -> float:
    return 20.0 * math.log10(ratio) if ratio > 0.0 else -math.inf


def _with_front(rows: Iterable[Measured], duration: float) -> tuple[Measured, ...]:
    """Return the rows, `pareto` true where none is nearer and cheaper, set-up and `duration` seconds together."""
    listed = list(rows)
    return tuple(
        replace(
            row,
            pareto=not any(
                other.max_error <= row.max_error
                and other.seconds_for(duration) <= row.seconds_for(duration)
                and (other.max_error, other.seconds_for(duration)) != (row.max_error, row.seconds_for(duration))
                for other in listed
            ),
        )
        for row in listed
    )


def _finite(row: dict[str, Any]) -> dict[str, Any]:
    return {
        name: None if isinstance(value, float) and not math.isfinite(value) else value for name, value in row.items()
    }
