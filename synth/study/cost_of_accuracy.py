"""What the accuracy of a study costs, and what it changes: some of its scenes with fewer and more phases.

Stage   STUDY.
Model   At most SCENES scenes, evenly over the study, are solved with FEWEST phases, then four times as many, up to
        MOST. Each is set beside the solution with the most phases: rms of displacement and acceleration, level over
        threshold, and whether the whole finger is felt. The time is that of the whole study in one process.
"""

from __future__ import annotations

from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.errors import CannotRender
from synth.study.chunks import chunk_of_some, solved
from synth.study.spec import StudySpec

SCENES, FEWEST, TIMES, STEPS = 48, 16, 4, 5
SHOWN = {"displacement": 0, "acceleration": 2}
"""Quantities of a row, and their places."""


def accuracy_rows(spec: StudySpec) -> list[dict[str, Any]]:
    """Return a row for each number of phases, the smallest first; pairs are median and largest.

    seconds: of the whole study. displacement, acceleration: `told`, the error relative to the peak-to-peak, and
    `rms_db`, the distance of the rms from that of the last row. level_db: that of the level over threshold.
    verdicts: part of the scenes that are felt here and not in the last row, or the reverse.
    Raises CannotRender where none of the scenes can be solved.
    """
    numbers = np.unique(np.linspace(0, spec.count - 1, SCENES).astype(int)).tolist()
    chunk = replace(chunk_of_some(spec, numbers), phases=FEWEST, lines=1, skin=False)
    solved(chunk)  # kernels and fingers are prepared
    found, rows = [], list[dict[str, Any]]()
    for count in (FEWEST * TIMES**n for n in range(STEPS)):
        started = perf_counter()
        found.append(solved(replace(chunk, phases=count)))
        rows.append({"phases": count, "seconds": (perf_counter() - started) * spec.count / len(numbers)})
    best = found[-1]
    if not np.isfinite(best["rms"]).any():
        raise CannotRender(f"None of the scenes can be solved: {best['reason'][0]}")
    for row, one in zip(rows, found, strict=True):
        for name, place in SHOWN.items():
            apart = _decibels(one["rms"][:, place], best["rms"][:, place])
            row[name] = {"told": _pair(one["error"][:, place]), "rms_db": apart}
        row["level_db"] = _pair(np.abs(one["sensation_level"] - best["sensation_level"]))
        row["verdicts"] = float(np.mean((one["sensation_level"] > 0.0) != (best["sensation_level"] > 0.0)))
    return rows


def _decibels(values: Array, best: Array) -> list[float]:
    moving = (values > 0.0) & (best > 0.0)
    return _pair(20.0 * np.abs(np.log10(values[moving] / best[moving])))


def _pair(values: Array) -> list[float]:
    """Return the median and the largest of the numbers that are known."""
    known = values[np.isfinite(values)]
    return [float(np.median(known)), float(np.max(known))] if len(known) else [0.0, 0.0]
