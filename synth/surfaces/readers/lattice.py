"""Coordinates in columns: x and height, or x, y and height, as heights at equal distances.

Stage   SURFACES, from files.
Model   The smallest step between two coordinates is the spacing, if every other step is a multiple of it. Each point
        has its place on the lattice. A place without a point is a missing point.
Limits  A coordinate may deviate from its place by WITHIN of a step. Scattered points are refused: resampling them would
        invent heights. At least a quarter of the places must have a point.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from synth.surfaces.readers.surface_file import (
    Heights,
    SurfaceFile,
    check_numbers,
    check_shape,
    finite_heights,
    refuse_file,
)

WITHIN = 0.01  # of a step: printed coordinates are rounded
SAME = 1e-3  # of the greatest step: coordinates that are closer differ by rounding only
FULLEST_GAPS = 4  # largest number of places per point; with more, the lattice is a large empty area with a few points


def profile_of_pairs(values: np.ndarray[Any, Any], layout: str, unit: str | None) -> SurfaceFile:
    """Return the heights of two columns, x and height. Raises InvalidRequest if the steps of x are not equal."""
    at, count, spacing = _places(values[:, 0], "x")
    heights, missing = _placed(values[:, 1], at, count)
    return SurfaceFile("text", layout, heights, missing, unit, (spacing,))


def surface_of_triples(values: np.ndarray[Any, Any], layout: str, unit: str | None) -> SurfaceFile:
    """Return the heights of three columns, x, y and height. Raises InvalidRequest if x and y are no lattice."""
    column, columns, along_x = _places(values[:, 0], "x")
    if np.all(values[:, 1] == values[0, 1]):
        heights, missing = _placed(values[:, 2], column, columns)
        return SurfaceFile("text", f"{layout}, all on one line", heights, missing, unit, (along_x,))
    row, rows, along_y = _places(values[:, 1], "y")
    check_shape((rows, columns))
    if rows * columns > FULLEST_GAPS * len(values):
        refuse_file(
            f"{len(values)} points on {rows} x {columns} places",
            "points on a regular lattice",
            "Resample scattered points to a grid first. A grid of three columns can be saved as NPY.",
        )
    heights, missing = _placed(values[:, 2], row * columns + column, rows * columns)
    shape = rows, columns
    return SurfaceFile("text", layout, heights.reshape(shape), missing.reshape(shape), unit, (along_x, along_y))


def _places(coordinates: np.ndarray[Any, Any], name: str) -> tuple[np.ndarray[Any, Any], int, float]:
    """Return the place of each coordinate on an axis of equal steps, the number of places, and the step."""
    hint = "Resample to equal steps first."
    if not np.all(np.isfinite(coordinates)):
        refuse_file(f"{name} that is not a number", f"{name} at every point", "Correct the column.")
    check_numbers(coordinates, f"a value of {name}")
    levels = np.unique(coordinates)
    if len(levels) < 2:
        refuse_file(f"one value of {name} only", f"two or more values of {name}", "Are these three columns of a grid?")
    steps = np.diff(levels)
    step = float(np.min(steps[steps > SAME * np.max(steps)]))
    length = float(levels[-1] - levels[0])
    intervals = max(1, round(length / step))
    check_shape((max(2, intervals + 1),))
    step = length / intervals
    exact = (coordinates - levels[0]) / step
    at = np.rint(exact)
    off = float(np.max(np.abs(exact - at)))
    if off > WITHIN:
        refuse_file(f"steps of {name} that differ by {100 * off:.0f} %", f"equal steps of {name}, within 1 %", hint)
    return at.astype(np.int64), intervals + 1, step


def _placed(values: np.ndarray[Any, Any], at: np.ndarray[Any, Any], count: int) -> tuple[Heights, Any]:
    """Return the heights [count] and which are missing. Raises InvalidRequest if two points have the same place."""
    times = np.bincount(at, minlength=count)
    if np.max(times) > 1:
        refuse_file(f"{np.max(times)} points at one place", "one height at each place", "Remove the others.")
    placed = np.full(count, np.nan)
    placed[at] = values
    return finite_heights(placed)
