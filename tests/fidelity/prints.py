"""Prints of the finger other than the default: `python -m tests.fidelity prints` and `... steps`.

Model   A print is a set of the fields of a fingertip and a seed. For each set, a row of `prints` counts the seeds whose
        line at u / lambda2 is the strongest, or within 6 dB of it, at each of 40 periods. The rows of `steps` tell how
        the rms acceleration changes in steps of 5 % of the period: for single prints of the default set, and for the
        mean square of all of them.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from tests.fidelity.measures import STEPPED, Section, decibels, period_accelerations, weakest_fundamental

SETS: tuple[Section, ...] = (
    {},
    {"pattern": "whorl"},
    {"pattern": "whorl", "spacing_spread": 0.5},
    {"spacing_spread": 0.5, "direction_spread": 0.5, "height_spread": 0.5},
)
SEEDS = 20
ENDS = 0.1e-3, 0.2e-3, 0.5e-3, 1e-3, 2e-3, 5e-3  # m: ranges of the period
SMOOTH = 3.0  # dB


def table() -> Iterator[str]:
    """Yield one row per set."""
    yield "| print | seeds within 6 dB | worst |"
    yield "| --- | --- | --- |"
    for fields in SETS:
        yield row(fields)


def row(fields: Section) -> str:
    """Return the row of one set."""
    weakest = np.array([weakest_fundamental({"kind": "fingertip", **fields, "seed": seed}) for seed in range(SEEDS)])
    name = ", ".join(f"`{field}` {value}" for field, value in fields.items()) or "the defaults"
    return f"| {name} | {np.sum(weakest >= -6.0)} of {SEEDS} | {weakest.min():.0f} dB |"


def steps() -> Iterator[str]:
    """Yield one row per range of the period."""
    found = np.array([period_accelerations({"kind": "fingertip", "seed": seed}) for seed in range(SEEDS)])
    single = np.abs(np.diff(decibels(found), axis=1))
    mean = np.abs(np.diff(decibels(np.sqrt(np.mean(found**2, axis=0)))))
    yield "| period, mm | steps of one print below 3 dB | largest of one print | largest of the mean of 20 prints |"
    yield "| --- | --- | --- | --- |"
    for low, high in pairwise(ENDS):
        there = (STEPPED[:-1] >= 0.999 * low) & (STEPPED[:-1] < 0.999 * high)
        share, largest = 100.0 * np.mean(single[:, there] < SMOOTH), single[:, there].max()
        name = f"{1e3 * low:g} to {1e3 * high:g}"
        yield f"| {name} | {share:.0f} % | {largest:.1f} dB | {mean[there].max():.1f} dB |"
