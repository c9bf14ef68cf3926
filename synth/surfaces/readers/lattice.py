"""Coordinates in columns: x and height, or x, y and height, as heights at equal distances.

Stage   SURFACES, from files.
Model   The places of the coordinates are whole numbers, and their spacing is the slope of the straight line through
        them. Three lattices are tried: one whose points are all there, one whose step is the median of the steps, and
        one whose step is the smallest. A place without a point is a missing point.
Limits  A coordinate may deviate from its place by WITHIN of a step, or by the resolution with which it is printed. A
        profile with unequal steps keeps its positions, and an import has to resample it. Scattered points of an area
        are refused: resampling them would invent heights. At least a quarter of the places must have a point.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from synth.surfaces.readers.surface_file import (
    LARGEST_NUMBER,
    Heights,
    SurfaceFile,
    check_numbers,
    check_shape,
    finite_heights,
    refuse_file,
)

WITHIN = 0.01  # of a step: permitted deviation of a coordinate from its place
MOST_ROUNDED = 0.05  # of a step: 0.12, 0.25, 0.38 are equal steps that were rounded; 3, 7, 10 are unequal
SAME = 1e-3  # of the greatest step: coordinates that are closer differ by rounding only
SCATTERED, FEWEST_SCATTERED = 0.5, 32  # part of points with an x, and a y, of their own; least number of them
TO_A_GRID = (
    "Resample scattered points to a grid first. Name the columns in a first line if they are not x, y and height. "
    "A grid of three columns can be saved as NPY."
)
FULLEST_GAPS = 4  # largest number of places per point; with more, the lattice is a large empty area with a few points
CERTAIN = 8  # so many gaps at regular distances are no missing points, but steps that were rounded
DIGITS_OF = 2000  # coordinates whose digits tell the resolution of all


class Lattice(NamedTuple):
    """at: place of each coordinate. count: number of places. spacing: between them. off: greatest deviation."""

    at: np.ndarray[Any, Any]
    count: int  # type: ignore[assignment]  # of NamedTuple's own method
    spacing: float
    off: float


def profile_of_pairs(values: np.ndarray[Any, Any], layout: str, unit: str | None) -> SurfaceFile:
    """Return the heights of two columns, x and height, in the order of x."""
    _check_one(values[:, 0])
    values, notes = _without_repeats(values)
    lattice = _lattice(values[:, 0], "x")
    if isinstance(lattice, Lattice) and lattice.count <= FULLEST_GAPS * len(values):
        heights, missing = _placed(values[:, 1], lattice.at, lattice.count)
        x = np.min(values[:, 0]) + lattice.spacing * np.arange(lattice.count)
        x[lattice.at] = values[:, 0]
        spacing = (lattice.spacing,)
        return SurfaceFile("text", layout, heights, missing, unit, spacing, notes=notes, measured_x=x)
    order = np.argsort(values[:, 0], kind="stable")
    heights, missing = finite_heights(values[order, 1])
    positions = values[order, 0]
    if np.any(np.diff(positions) <= 0.0):
        at = float(positions[1:][np.diff(positions) <= 0.0][0])
        refuse_file(f"2 points at one place, x = {at:g}", "one height at each place", "Remove the others.")
    return SurfaceFile("text", layout, heights, missing, unit, notes=notes, positions=positions)


def _check_one(x: np.ndarray[Any, Any]) -> None:
    """Refuse profiles that stand one below the other: x falls back to its beginning each time."""
    if not np.all(np.abs(x) < LARGEST_NUMBER):
        return  # `_lattice` refuses these
    steps = np.diff(x) * (1.0 if x[-1] > x[0] else -1.0)
    back = int(np.count_nonzero(steps < 0.0))
    far_back = int(np.count_nonzero(steps < -0.5 * float(np.ptp(x))))
    if 0 < back == far_back < len(x) // 3:
        refuse_file(f"{back + 1} profiles, one below the other", "one profile", "Keep the lines of one of them.")


def surface_of_triples(values: np.ndarray[Any, Any], layout: str, unit: str | None) -> SurfaceFile:
    """Return the heights of three columns, x, y and height. Raises InvalidRequest if x and y are no lattice."""
    if len(np.unique(values[:, 1])) == 1:
        found = profile_of_pairs(values[:, [0, 2]], f"{layout}, all on one line", unit)
        return found
    apart = min(len(np.unique(values[:, axis])) for axis in range(2))
    if apart > SCATTERED * len(values) > FEWEST_SCATTERED:
        refuse_file(f"{len(values)} points that are scattered", "points on a regular lattice", TO_A_GRID)
    column, columns, along_x = _places(values[:, 0], "x")
    row, rows, along_y = _places(values[:, 1], "y")
    if rows * columns > FULLEST_GAPS * len(values):
        refuse_file(
            f"{len(values)} points on {rows} x {columns} places",
            "points on a regular lattice",
            TO_A_GRID,
        )
    check_shape((rows, columns))
    heights, missing = _placed(values[:, 2], row * columns + column, rows * columns)
    shape = rows, columns
    return SurfaceFile("text", layout, heights.reshape(shape), missing.reshape(shape), unit, (along_x, along_y))


def _without_repeats(values: np.ndarray[Any, Any]) -> tuple[np.ndarray[Any, Any], tuple[str, ...]]:
    """Return the points without those that are there twice, and a note if there were any."""
    kept = np.unique(values, axis=0) if len(np.unique(values[:, 0])) < len(values) else values
    repeated = len(values) - len(kept)
    return kept, (f"{repeated} points that are in the file twice were read once",) if repeated else ()


def _places(coordinates: np.ndarray[Any, Any], name: str) -> tuple[np.ndarray[Any, Any], int, float]:
    """Return the place of each coordinate on an axis of equal steps, the number of places, and the step."""
    found = _lattice(coordinates, name)
    if isinstance(found, float):
        allowed = f"equal steps of {name}, within 1 %"
        refuse_file(f"steps of {name} that differ by {100 * found:.0f} %", allowed, "Resample to equal steps first.")
    return found.at, found.count, found.spacing


def _lattice(coordinates: np.ndarray[Any, Any], name: str) -> Lattice | float:
    """Return the lattice of the coordinates, or, if their steps are not equal, by how much they differ."""
    if not np.all(np.isfinite(coordinates)):
        refuse_file(f"{name} that is not a number", f"{name} at every point", "Correct the column.")
    check_numbers(coordinates, f"a value of {name}")
    levels, inverse = np.unique(coordinates, return_inverse=True)
    if len(levels) < 2:
        refuse_file(f"one value of {name} only", f"two or more values of {name}", "Are these three columns of a grid?")
    steps = np.diff(levels)
    begins = np.concatenate([[True], steps > SAME * np.max(steps)])
    levels, inverse = levels[begins], (np.cumsum(begins) - 1)[inverse]
    found = _of_levels(levels)
    return found if isinstance(found, float) else found._replace(at=found.at[inverse])


def _of_levels(levels: np.ndarray[Any, Any]) -> Lattice | float:
    """Return the lattice of increasing coordinates, or by how much their steps differ."""
    steps = np.diff(levels)
    resolution = _resolution(levels)
    whole = _fitted(levels, np.arange(len(levels)))
    tried = [_fitted(levels, places) for step in (np.median(steps), np.min(steps)) for places in _by_step(levels, step)]
    if whole.off <= WITHIN:
        return whole
    fitting = [one for one in tried if one.off <= WITHIN and one.count > len(levels)]
    gaps = min((one.count - len(levels) for one in fitting), default=CERTAIN)
    is_rounded = whole.off <= _rounding(resolution, whole)
    if is_rounded and gaps >= CERTAIN:
        return whole
    if fitting:
        check_shape((max(2, fitting[0].count),))
        return fitting[0]
    if is_rounded:
        return whole
    return float(min(one.off for one in (whole, *tried)))


def _by_step(levels: np.ndarray[Any, Any], step: float) -> list[np.ndarray[Any, Any]]:
    """Return the places of the coordinates if neighbours are whole numbers of `step` apart, counted in two ways."""
    summed = np.concatenate([[0.0], np.cumsum(np.maximum(1.0, np.rint(np.diff(levels) / step)))])
    return [summed, np.rint((levels - levels[0]) / step)]


def _fitted(levels: np.ndarray[Any, Any], at: np.ndarray[Any, Any]) -> Lattice:
    """Return the lattice of coordinates at the places `at`: the line of least squares, then moved to its middle."""
    about = at - np.mean(at)
    spacing = float(np.dot(about, levels) / np.dot(about, about))
    if not spacing > 0.0 or np.any(np.diff(at) < 1.0):
        return Lattice(at, 0, 1.0, math.inf)
    errors = levels - spacing * at
    off = float(np.max(errors) - np.min(errors)) / 2.0 / spacing
    return Lattice(at.astype(np.int64), int(at[-1]) + 1, spacing, off)


def _rounding(resolution: float, lattice: Lattice) -> float:
    """Return the deviation from its place, in steps, that rounding alone can give a coordinate."""
    return min(
        MOST_ROUNDED, 0.75 * resolution / lattice.spacing
    )  # half a digit, and what the line of least squares adds


def _resolution(values: np.ndarray[Any, Any]) -> float:
    """Return the distance between neighbouring numbers as they are printed: the last decimal, or the last digit."""
    sample = values[:: max(1, len(values) // DIGITS_OF)]
    decimals = digits = 0
    for text in (np.format_float_scientific(value, trim="-") for value in sample):
        mantissa, exponent = text.split("e")
        written = len(mantissa.lstrip("-").replace(".", ""))
        digits = max(digits, written)
        decimals = max(decimals, written - 1 - int(exponent))
    largest = float(np.max(np.abs(values)))
    return max(10.0**-decimals, 10.0 ** (math.floor(math.log10(largest)) - digits + 1))


def _placed(values: np.ndarray[Any, Any], at: np.ndarray[Any, Any], count: int) -> tuple[Heights, Any]:
    """Return the heights [count] and which are missing. Raises InvalidRequest if two points have the same place."""
    times = np.bincount(at, minlength=count)
    if np.max(times) > 1:
        refuse_file(f"{np.max(times)} points at one place", "one height at each place", "Remove the others.")
    placed = np.full(count, np.nan)
    placed[at] = values
    return finite_heights(placed)
