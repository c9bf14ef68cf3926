"""ACCURACY: what accuracy costs in time, method by method. A stub: every number in it is made up.

Stage   after STAGE 3, over a scene.
Limits  nothing is measured.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from typing import Any

from synth.channels import UNITS
from synth.errors import AskedWrong, CannotRender, Fault, shown
from synth.scene import Scene, scene_document


@dataclass(frozen=True, slots=True)
class Measured:
    """What one method errs by and costs."""

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
class LeftOut:
    """A method that was not measured, and why."""

    method: str
    family: str
    reason: str


@dataclass(frozen=True, slots=True)
class AccuracyReport:
    """The cost-against-error table of one scene."""

    scene: dict[str, Any]
    quantity: str
    unit: str
    peak_to_peak: float
    duration: float
    sample_rate: int
    threshold: str
    chosen: str
    repeats: int
    methods: tuple[Measured, ...]
    left_out: tuple[LeftOut, ...]

    def document(self) -> dict[str, Any]:
        """Return the JSON document; null where a number is not finite."""
        made = asdict(self)
        made["methods"] = [
            {
                name: None if isinstance(value, float) and not math.isfinite(value) else value
                for name, value in row.items()
            }
            for row in made["methods"]
        ]
        made["left_out"] = list(made["left_out"])
        return made


def measure_accuracy(
    scene: Scene, *, quantity: str | None = None, progress: Callable[[str, int, int], None] | None = None
) -> AccuracyReport:
    """Return a made-up report; raises AskedWrong for a quantity the scene lacks, CannotRender where nothing moves."""
    channels = [channel.quantity for channel in scene.output.channel_list]
    if quantity is not None and quantity not in channels:
        raise AskedWrong([Fault("/quantity", shown(quantity), " or ".join(channels), "Name a channel of the scene.")])
    if scene.texture.amplitude == 0.0 or scene.scan.load == 0.0:
        raise CannotRender("Nothing moves: there is no error to measure.")
    chosen = quantity or channels[0]
    rows = list(_rows(0.3 if chosen == "acceleration" else 1e-3))
    for done, row in enumerate(rows, 1):
        if progress is not None:
            progress(row.method, done, len(rows))
    return AccuracyReport(
        scene_document(scene), chosen, UNITS[chosen], 37.9 if chosen == "acceleration" else 1.9e-6,
        scene.output.duration, scene.output.sample_rate, "made-up numbers", CHOSEN, 5, _fronted(rows, 2.0),
        (LeftOut("closed form", "closed", "The contact is not full at every phase."),),
    )  # fmt: skip


CHOSEN = "response table, 512 phases, cubic, 64 cells"


def _rows(scale: float) -> Iterator[Measured]:
    for n in (25, 50, 100, 200, 400, 800, 1600, 3200, 6400):
        yield _row(f"brentq, {n} points a ridge", "baseline", 0.02 * (25 / n) ** 1.9, 0.0, 48000 * (9e-5 + 1.8e-6 * n))
    for n in (8, 16, 32, 64, 128, 256, 512):
        yield _row(f"sampled solver, {n} points a ridge", "sampled", 0.1 * (8 / n) ** 2, 0.0, 48000 * 2e-8 * 20 * n)
    for n in (1, 2, 4, 8, 16, 32):
        error = 0.2 * scale * (1 / n) ** 2.5
        yield _row(f"exact solver, oversampled {n} times", "exact", error, 0.001, 0.09 * n)
    for kind, order, ns in (("linear", 1.6, 4), ("cubic", 2.5, 6)):
        for n in (2**k for k in range(3, 17)):
            error = max(scale * (8 / n) ** order, 3e-15)
            yield _row(f"response table, {n} phases, {kind}", "table", error, 1e-4 + 2e-6 * n, 48e-6 * ns)
    yield _row(CHOSEN, "table", scale * (8 / 512) ** 2.6, 3e-3, 6e-5)
    for n in (2**k for k in range(10)):
        error = 0.0 if n == 512 else scale * n**-2.5
        yield _row(f"harmonics, {n}", "harmonics", error, 8e-3, 48000 * (3e-9 + 2e-9 * n))


def _row(method: str, family: str, error: float, setup: float, cost: float) -> Measured:
    level = 20 * math.log10(error) - 14 if error else -math.inf
    return Measured(
        method, family, error, 0.3 * error, 2e-6 * error, level, -level - 20, setup, cost, 1 / cost, 4096, False
    )  # fmt: skip


def _fronted(rows: list[Measured], duration: float) -> tuple[Measured, ...]:
    def cost(row: Measured) -> float:
        return row.setup_seconds + duration * row.seconds_per_second

    def beaten(row: Measured) -> bool:
        return any(
            (other.max_error < row.max_error and cost(other) <= cost(row))
            or (other.max_error <= row.max_error and cost(other) < cost(row))
            for other in rows
        )

    return tuple(Measured(**{**asdict(row), "pareto": not beaten(row)}) for row in rows)
