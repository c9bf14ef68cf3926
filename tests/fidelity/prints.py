"""Prints of the finger other than the default: `python -m tests.fidelity prints`.

Model   A print is a set of the fields of a fingertip and a seed. For each set, a row counts the seeds whose
        line at u / lambda2 is the strongest, or within 6 dB of it, at each of 40 periods. It also gives the largest
        change of the acceleration in steps of 5 % of the period, as the median of STEP_SEEDS seeds.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tests.fidelity.measures import Section, largest_step, weakest_fundamental

SETS: tuple[Section, ...] = (
    {},
    {"pattern": "whorl"},
    {"pattern": "whorl", "spacing_spread": 0.5},
    {"spacing_spread": 0.5, "direction_spread": 0.5, "height_spread": 0.5},
)
SEEDS, STEP_SEEDS = 20, 8


def table() -> Iterator[str]:
    """Yield one row per set."""
    yield "| print | seeds within 6 dB | worst | steps of the period, median of 8 seeds |"
    yield "| --- | --- | --- | --- |"
    for fields in SETS:
        yield row(fields)


def row(fields: Section) -> str:
    """Return the row of one set."""
    fingers = [{"kind": "fingertip", **fields, "seed": seed} for seed in range(SEEDS)]
    weakest = np.array([weakest_fundamental(finger) for finger in fingers])
    step = np.median([largest_step(finger, "period") for finger in fingers[:STEP_SEEDS]])
    name = ", ".join(f"`{field}` {value}" for field, value in fields.items()) or "the defaults"
    return f"| {name} | {np.sum(weakest >= -6.0)} of {SEEDS} | {weakest.min():.0f} dB | {step:.1f} dB |"
