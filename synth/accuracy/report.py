"""ACCURACY: the error and the time of every method, measured on one scene and this machine.

Stage   after STAGE 3, for a scene.
Model   A constant scan is measured over a period (`steady`). Any other scene is measured along its own motion, or along
        the most demanding piece of it (`motion`). Timings are medians of up to REPEATS runs after one run that is not
        timed, so compilation is not included. The report states it separately (`process_seconds`, `compile_seconds`).
Source  design, section 5.
Limits  Methods that would take longer than PATIENCE to measure are left out and listed. After BUDGET seconds of
        measuring the limit is HASTE.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from time import perf_counter
from typing import Any, TypeVar

from synth.accuracy.baseline import baseline_along, without_baseline
from synth.accuracy.hand import chosen_of, hand_methods, rubbed
from synth.accuracy.method import LeftOutMethod, Method, Subject, clock
from synth.accuracy.motion import FrameReference, MotionCase, solved_reference
from synth.accuracy.motion_methods import chosen_name, file_methods, missing_methods
from synth.accuracy.simulated import Simulated, simulated_methods, simulated_reference, step_name, without_methods
from synth.accuracy.steady import steady_subject
from synth.errors import Fault, InvalidRequest, shown
from synth.plan.preparation import Preparation
from synth.plan.prepare import prepare
from synth.plan.process_start import compile_seconds, kernel_seconds, process_seconds
from synth.plan.usual_hand import prepare_hand
from synth.response_cache import ResponseCache
from synth.scene.effects_section import unit_of
from synth.scene.scene import Scene, SceneLike, scene_document, scene_from

REPEATS = 5
PATIENCE, HASTE = 6.0, 0.5  # s, longest time to set up, run and judge a method, before and after BUDGET
BUDGET, LATE = 45.0, 3.0  # s of measuring; elapsed seconds that count as one, on a busy machine
ENOUGH = 0.5  # s of timing, after which no further run is timed
CLOCK_STEP = 1e-9  # s: a time that the clock shows as none counts as this

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
class AccuracyReport:
    """The table of error and cost for one channel of a scene.

    scene: complete document of the scene.
    quantity: quantity of the channel.
    unit: its SI unit.
    peak_to_peak: peak-to-peak of the quantity, in `unit`.
    duration: duration of the scene's output, s.
    sample_rate: frames per second.
    threshold: name of the detection threshold.
    measured: what the errors are those of, as a sentence.
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
    measured: str
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


def measure_accuracy(
    scene: SceneLike, *, quantity: str | None = None, live: bool = False, progress: Progress | None = None
) -> AccuracyReport:
    """Return the error and the cost of every method, for one channel of `scene`. Takes up to a minute.

    scene: a Scene, a mapping, the path of a JSON file, or a name of the catalogue.
    quantity: quantity of the channel; None for the first channel.
    live: measure what a live voice reads or solves behind a hand, in place of the methods of a file.
    progress: called before each method with its name, the number of methods done, and the number of all methods.
    Raises InvalidRequest if the scene has no channel with that quantity, or does not move.
    """
    scene = scene_from(scene)
    require_measurable(scene)
    channel = _channel_of(scene, quantity)
    solved, setup = _prepared(rubbed(scene) if live else scene)
    if live and not solved.simulated:
        scales = tuple(one.full_scale for one in solved.all_channels)
        hand, setup = _timed_once(lambda: prepare_hand(scene, scales, ResponseCache()))
        subject = live_subject(solved, channel, hand, setup)
    elif not solved.moving and not solved.simulated:
        subject = steady_subject(solved, channel)
    else:
        subject = moving_subject(solved, channel, setup)
    made = _measured_all(subject, scene.output.sample_rate, progress)
    rows = [one for one in made if isinstance(one, Measured)]
    left_out = [one for one in made if isinstance(one, LeftOutMethod)]
    duration = scene.output.duration
    return AccuracyReport(
        scene=scene_document(scene),
        quantity=subject.quantity,
        unit=unit_of(subject.quantity),
        peak_to_peak=subject.extent,
        duration=duration,
        sample_rate=scene.output.sample_rate,
        threshold=scene.accuracy.threshold,
        measured=subject.measured,
        reference_error=subject.reference_error,
        chosen=subject.chosen,
        repeats=REPEATS,
        process_seconds=process_seconds(),
        compile_seconds=compile_seconds(),
        methods=_with_front(rows, duration),
        left_out=(*left_out, *subject.left_out),
    )


def _prepared(scene: Scene) -> tuple[Preparation, float]:
    """Return `scene` solved as a file, and the time (s) of it. Raises InvalidRequest if it is silent."""
    solved, seconds = _timed_once(lambda: prepare(scene, ResponseCache()))
    if solved.silence:
        hint = f"{solved.silence} There is nothing to measure."
        raise InvalidRequest([Fault("", "a silent scene", "a scene that moves", hint)])
    return solved, seconds


def _measured_all(subject: Subject, rate: int, progress: Progress | None) -> list[Measured | LeftOutMethod]:
    """Return the result of each method of `subject`, or why it was left out.

    The plan's choice is measured first, however long it takes, and then the fastest.
    """
    made: dict[str, Measured | LeftOutMethod] = {}
    began, elapsed, listed = clock(), perf_counter(), subject.methods
    report_progress = progress or (lambda *_done: None)
    first = [one for one in listed if one.name == subject.chosen]
    others = sorted((one for one in listed if one.name != subject.chosen), key=lambda one: one.seconds)
    for done, method in enumerate((*first, *others)):
        report_progress(method.name, done, len(listed))
        spent = max(clock() - began, (perf_counter() - elapsed) / LATE)
        if method.name == subject.chosen or method.seconds <= (PATIENCE if spent < BUDGET else HASTE):
            made[method.name] = _measured(subject, method, rate)
        else:
            reason = f"It would take {method.seconds:.3g} s to measure."
            made[method.name] = LeftOutMethod(method.name, method.family, reason)
    report_progress(listed[-1].name, len(listed), len(listed))
    return [made[method.name] for method in listed]


def require_measurable(scene: Scene) -> None:
    """Raise the error of `measure_accuracy` that does not require a solution of the scene."""
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


def _measured(subject: Subject, method: Method, rate: int) -> Measured:
    ready, setup = _timed(method.set_up)
    a_second = max(_timed(ready.run)[1], CLOCK_STEP) * rate / ready.frames
    return Measured(
        method=method.name,
        family=method.family,
        **asdict(subject.errors(ready)),
        setup_seconds=setup if ready.setup is None else ready.setup,
        seconds_per_second=a_second,
        times_real_time=1.0 / a_second,
        memory_bytes=ready.nbytes,
        pareto=False,
    )


def _timed_once(work: Callable[[], T]) -> tuple[T, float]:
    """Return the result of `work`, and its time (s) without that of loading kernels, by their part of the time."""
    began, elapsed, kernels = clock(), perf_counter(), kernel_seconds()
    made = work()
    part = (kernel_seconds() - kernels) / max(perf_counter() - elapsed, CLOCK_STEP)
    return made, max(CLOCK_STEP, (clock() - began) * (1.0 - min(part, 1.0)))


def _timed(work: Callable[[], T]) -> tuple[T, float]:
    """Return the result of `work`, and the median of its times (s) after a first run."""
    times: list[float] = []
    made = work()
    while len(times) < REPEATS and sum(times) < ENOUGH:
        began = clock()
        made = work()
        times.append(clock() - began)
    return made, statistics.median(times)


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


def moving_subject(solved: Preparation, channel: int, setup: float) -> Subject:
    """Return how channel number `channel` of a scene is measured along its own motion.

    solved: the scene, solved as a file in `setup` (s).
    """
    case = MotionCase(solved, channel, setup)
    if solved.simulated:
        scene = Simulated.of(case)
        reference, finest, usual = simulated_reference(scene)
        methods = list(simulated_methods(scene, finest, usual))
        return _subject(case, reference, methods, step_name(scene, 1.0), list(without_methods(scene)))
    reference, finest = solved_reference(case)
    methods = [*baseline_along(case), *file_methods(case, finest)]
    return _subject(case, reference, methods, chosen_name(case), [*without_baseline(case), *missing_methods(case)])


def live_subject(solved: Preparation, channel: int, hand: Preparation, setup: float) -> Subject:
    """Return how channel number `channel` of a live voice is measured.

    solved: the motion of the hand, solved as a file.
    hand: the scene prepared for a hand, which took `setup` (s).
    """
    case = MotionCase(solved, channel, 0.0)
    reference, _finest = solved_reference(case)
    methods = [*baseline_along(case), *hand_methods(case, hand, setup)]
    return _subject(case, reference, methods, chosen_of(case, hand), list(without_baseline(case)), "A live voice. ")


def _subject(
    case: MotionCase,
    reference: FrameReference,
    methods: Sequence[Method],
    chosen: str,
    left_out: Sequence[LeftOutMethod],
    before: str = "",
) -> Subject:
    return Subject(
        quantity=case.planned.quantity,
        extent=reference.extent,
        measured=before + case.words,
        reference_error=reference.error,
        chosen=chosen,
        methods=tuple(methods),
        left_out=tuple(left_out),
        errors=reference.errors,
    )
