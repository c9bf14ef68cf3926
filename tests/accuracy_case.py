"""Reports of what accuracy costs as tests want them: plausible numbers of every family, without measuring anything."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

from synth.accuracy.method import LeftOutMethod
from synth.accuracy.report import AccuracyReport, Measured
from synth.scene.effects_section import unit_of
from synth.scene.scene import Scene, parse_scene, scene_document

CHOSEN = "sum of harmonics, 512 phases"
DURATION = 2.0


def report(scene: Scene | None = None, quantity: str = "acceleration") -> AccuracyReport:
    """Return a report of some sixty rows: errors fall by powers, times are those of a usual machine; two have none."""
    return AccuracyReport(
        scene=scene_document(parse_scene({"output": {"duration": DURATION}}) if scene is None else scene),
        quantity=quantity,
        unit=unit_of(quantity),
        peak_to_peak=37.9 if quantity == "acceleration" else 1.93e-6,
        duration=DURATION,
        sample_rate=48000,
        threshold="Nobody (1900)",
        measured="The errors are those over a period.",
        reference_error=1e-9,
        chosen=CHOSEN,
        repeats=7,
        process_seconds=1.25,
        compile_seconds=0.0,
        methods=_with_front(list(_rows())),
        left_out=(LeftOutMethod("closed form", "closed", "The contact is not full at every phase."),),
    )


def document(**changes: Any) -> dict[str, Any]:
    """Return the report as a program reads it from a file, with `changes`."""
    made: dict[str, Any] = json.loads(json.dumps(report().document(), allow_nan=False))
    return made | changes


def fake_measure(
    scene: Scene,
    *,
    quantity: str | None = None,
    live: bool = False,
    progress: Callable[[str, int, int], None] | None = None,
) -> AccuracyReport:
    """Stand in for `synth.accuracy.report.measure_accuracy` where any scene will do."""
    made = report(scene, quantity or scene.output.channel_list[0].quantity)
    if progress is not None:
        for done, row in enumerate(made.methods, 1):
            progress(row.method, done, len(made.methods))
    return made


def fake_drawings(_document: object) -> dict[str, bytes]:
    """Stand in for `clients.accuracy_report.figure.drawings` where any picture will do."""
    return {"accuracy.svg": b"<svg>", "accuracy.png": b"PNG"}


def _rows() -> Iterator[Measured]:
    for power, count in enumerate((1, 1, 2, 2, 4, 4, 8, 8)):
        name = f"trapezoid and brentq, {25 * 2**power} points a ridge"
        error = 0.02 * 2.0 ** (-1.9 * power)
        yield _row("baseline", f"{name}, oversampling {count}", error, 0.0, 2.2 * 2**power * count)
        yield _row("baseline", f"{name}, tabled, {512 * count} phases", error, 0.1 * 2**power * count, 3e-4)
    for power, count in enumerate((1, 2, 4, 4, 8, 16, 32)):
        name = f"sampled solver, {52 << power} segments, {count} a frame"
        yield _row("sampled", name, 0.1 * 2.0 ** (-2.0 * power), 0.0, 0.16 * 2**power)
    for size in (1, 2, 4, 8, 16, 32):
        yield _row("exact", f"exact solver, oversampling {size}", 0.06 * size**-2.5, 0.001, 0.09 * size)
    for size in (500, 2000, 8000):
        yield _row("table", f"response table, to a {size}th", 0.2 / size, 1e-4 * size, 4e-4)
    for size in (2**power for power in range(3, 17)):
        if size != 512:
            error = 0.0 if size == 65536 else 0.5 * (8 / size) ** 2.5
            yield _row("harmonics", f"sum of harmonics, {size} phases", error, 2e-6 * size, 1e-4)
    yield _row("harmonics", CHOSEN, 6e-6, 3e-3, 1e-4)
    yield _row("closed", "closed form", 0.0, 1e-5, 0.9)


def _row(family: str, method: str, error: float, setup: float, seconds: float) -> Measured:
    level = 20.0 * math.log10(error) - 14.0 if error else -math.inf
    return Measured(
        method=method,
        family=family,
        max_error=error,
        rms_error=0.3 * error,
        error_m=2e-6 * error,
        worst_harmonic_db=level,
        threshold_margin_db=-20.0 - level,
        setup_seconds=setup,
        seconds_per_second=seconds,
        times_real_time=1.0 / seconds,
        memory_bytes=8192,
        pareto=False,
    )


def _with_front(rows: list[Measured]) -> tuple[Measured, ...]:
    def pair(row: Measured) -> tuple[float, float]:
        return row.max_error, row.setup_seconds + DURATION * row.seconds_per_second

    def beaten(row: Measured) -> bool:
        error, cost = pair(row)
        return any(
            pair(other) != (error, cost) and pair(other)[0] <= error and pair(other)[1] <= cost for other in rows
        )

    return tuple(replace(row, pareto=not beaten(row)) for row in rows)
