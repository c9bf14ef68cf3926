"""Missing points of a measured surface: filled from their neighbours, or cut away.

Stage   SURFACES, from files.
Model   fill    A missing point is interpolated linearly between the nearest measured points to its left and right, and
                also between those above and below. The height is the mean of both values, each weighted by 1 / distance
                between its two points. Within its measured points, a plane is therefore filled exactly. If a point has
                neither pair, it gets the height of the nearest measured point.
        crop    The largest rectangle (of a profile, the longest piece) without missing points is kept.
Limits  If more than MOST_FILLED of the points are missing, `fill` is refused: the result would be mostly invented.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from synth.kernels import kernel
from synth.surfaces.readers.surface_file import Heights, Missing, refuse_file

MOST_FILLED = 0.5
Places = tuple[slice, ...]


def filled(heights: Heights, missing: Missing, spacing: tuple[float, ...]) -> Heights:
    """Return `heights` with heights at the missing points. Raises InvalidRequest if too many are missing.

    spacing: distance between neighbouring columns, then rows, m.
    """
    share = float(np.mean(missing))
    if share > MOST_FILLED:
        refuse_file(f"{100 * share:.0f} % missing points", "at most 50 % of them", "Write missing = crop.")
    grid, gaps = np.atleast_2d(heights), np.atleast_2d(missing)
    along_x, weight_x = _between(grid, gaps, spacing[0])
    along_y, weight_y = (part.T for part in _between(grid.T, gaps.T, spacing[-1]))
    weight = weight_x + weight_y
    found = (weight > 0.0) & gaps
    made = grid.copy()
    made[found] = (along_x[found] * weight_x[found] + along_y[found] * weight_y[found]) / weight[found]
    rest = gaps & ~found
    if np.any(rest):
        from scipy.ndimage import distance_transform_edt

        nearest = distance_transform_edt(
            gaps, sampling=(spacing[-1], spacing[0]), return_distances=False, return_indices=True
        )
        made[rest] = grid[tuple(index[rest] for index in nearest)]
    return np.asarray(made.reshape(heights.shape))


def _between(grid: Heights, gaps: Missing, step: float) -> tuple[Heights, Heights]:
    """Return, at missing points, the height between the measured points to the left and right, and its weight.

    step: distance between neighbouring columns, m.
    Both are 0 where one of these points does not exist, and at measured points.
    """
    columns = grid.shape[1]
    index = np.arange(columns)
    left = np.maximum.accumulate(np.where(gaps, -1, index), axis=1)
    right = np.minimum.accumulate(np.where(gaps, columns, index)[:, ::-1], axis=1)[:, ::-1]
    both = gaps & (left >= 0) & (right < columns)
    row, column = np.nonzero(both)
    before, after = left[both], right[both]
    low, high = grid[row, before], grid[row, after]
    height, weight = np.zeros(grid.shape), np.zeros(grid.shape)
    height[both] = low + (high - low) * (column - before) / (after - before)
    weight[both] = 1.0 / (step * (after - before))
    return height, weight


def largest_whole_part(missing: Missing) -> Places:
    """Return the slices of the largest rectangle, or piece of a profile, without missing points.

    Raises InvalidRequest if every point is missing.
    """
    top, bottom, left, right = _largest_rectangle(np.atleast_2d(missing))
    if bottom - top < 1 or right - left < 1:
        refuse_file("only missing points", "a surface with heights", "Is this the right channel?")
    across = slice(int(left), int(right))
    return (across,) if missing.ndim == 1 else (slice(int(top), int(bottom)), across)


@kernel
def _largest_rectangle(missing: Any) -> Any:
    """Return top, bottom, left and right of the largest rectangle of False.

    Each row is the base of a histogram: the columns are as high as the run of False that ends in the row.
    """
    rows, columns = missing.shape
    above = np.zeros(columns + 1, np.int64)
    stack = np.zeros(columns + 1, np.int64)
    best, found = 0, (0, 0, 0, 0)
    for row in range(rows):
        depth = 0
        for column in range(columns + 1):
            if column < columns:
                above[column] = 0 if missing[row, column] else above[column] + 1
            while depth > 0 and above[stack[depth - 1]] >= above[column]:
                depth -= 1
                height = above[stack[depth]]
                left = stack[depth - 1] + 1 if depth > 0 else 0
                if height * (column - left) > best:
                    best = height * (column - left)
                    found = (row + 1 - height, row + 1, left, column)
            stack[depth] = column
            depth += 1
    return found
