"""Reading a table of the energy of a contact: weights of a phase, cells of a height, and means over a path.

Model   `potential`: at a phase, four rows are summed with the weights of the cubic spline; then I is one cubic in t =
        (d - origin) scale in each cell of d, and E of a cell is E(origin) - (integral of I).
        The mean of I between two heights is the divided difference of E, without its cancellation: within a cell I is
        written about where the path begins, I = j0 + j1 u + j2 u^2 + j3 u^3, and its mean is j0 + j1 u / 2 + j2 u^2 / 3
        + j3 u^3 / 4; over several cells the parts, all of one sign, are added up.
Source  derived here.
Limits  exact for the pool, layout, to round-off.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from synth.arrays import Array
from synth.kernels import inlined, inner, signed_kernel

Layout = np.ndarray[Any, np.dtype[np.int64]]

PLACE = 2.0**-53  # the 53 bits of the phase below the row, as a fraction of the step between rows


STRIDE, BITS, ENERGIES, CURVES, BOUNDS, ORIGINS, SCALES, LAST = range(8)
"""Of the layout of a pool, whose cells run from -infinity (a line) to +infinity (nothing). At 0 stand the coefficients
of I, [cells, stride, 4], stride = rows + 3. Then begin: energies [cells, stride], E at the origin of each cell; curves
[2, stride], b and the highest point of h; bounds [cells + 1] of the cells (m); origins (m) and scales (1/m) of t,
[cells]. last: the last cell. bits: log2 of the rows."""


def pool_of(pieces: Array, energies: Array, curves: Array, bounds: Array) -> tuple[Array, Layout]:
    """Return the pool of a table and its layout."""
    cells, stride = energies.shape
    origins = np.concatenate([bounds[1:2], bounds[1:-1]])
    widths = np.diff(bounds[1:-1])
    parts = [pieces, energies, curves, bounds, origins, 1.0 / np.concatenate([widths[:1], widths, widths[-1:]])]
    starts = np.cumsum([part.size for part in parts])[:-1]
    layout = np.array([stride, (stride - 4).bit_length(), *starts, cells - 1], dtype=np.int64)
    return np.concatenate([part.ravel() for part in parts]), layout


@inner
def row_of(layout, phase):
    """Return the row at or before `phase`, and the place after it in steps of a row."""
    bits = np.uint64(layout[BITS])
    row = np.int64(phase >> (np.uint64(64) - bits))
    return row, np.float64(np.int64((phase << bits) >> np.uint64(11))) * PLACE


@inner
def weights_of(t):
    """Return the weights of four rows."""
    s = 1.0 - t
    first, last = s * s * s * (1.0 / 6.0), t * t * t * (1.0 / 6.0)
    second = 2.0 / 3.0 + t * t * (0.5 * t - 1.0)
    return first, second, 1.0 - first - second - last, last


@inner
def slopes_of(t, rows):
    """Return the derivatives of the weights of four rows, a turn."""
    s = 1.0 - t
    first, second, last = -0.5 * s * s * rows, t * (1.5 * t - 2.0) * rows, 0.5 * t * t * rows
    return first, second, -first - second - last, last


@inner
def line_at(pool, at, weights):
    """Return what four rows of one number give."""
    first, second, third, last = weights
    return first * pool[at] + second * pool[at + 1] + third * pool[at + 2] + last * pool[at + 3]


@inner
def base_at(pool, layout, row, weights):
    """Return b (m), or with slopes its derivative (m a turn)."""
    return line_at(pool, layout[CURVES] + row, weights)


@inner
def highest_at(pool, layout, row, weights):
    """Return the highest point of h (m)."""
    return line_at(pool, layout[CURVES] + layout[STRIDE] + row, weights)


@inner
def blended(pool, layout, cell, row, weights):
    """Return the four coefficients of I in a cell."""
    first, second, third, last = weights
    at = 4 * (cell * layout[STRIDE] + row)
    return (
        first * pool[at] + second * pool[at + 4] + third * pool[at + 8] + last * pool[at + 12],
        first * pool[at + 1] + second * pool[at + 5] + third * pool[at + 9] + last * pool[at + 13],
        first * pool[at + 2] + second * pool[at + 6] + third * pool[at + 10] + last * pool[at + 14],
        first * pool[at + 3] + second * pool[at + 7] + third * pool[at + 11] + last * pool[at + 15],
    )


@inner
def found_cell(pool, at, last, d):
    """Return the cell in which `d` (m) lies; bounds begin at pool[at]."""
    low, high = 0, last
    while low < high:
        middle = (low + high + 1) // 2
        if d >= pool[at + middle]:
            low = middle
        else:
            high = middle - 1
    return low


@inner
def cell_of(pool, layout, d, cell):
    """Return the cell in which `d` (m) lies; `cell` is a first guess."""
    at = layout[BOUNDS] + cell
    inside = pool[at] <= d < pool[at + 1]
    return cell if inside else found_cell(pool, layout[BOUNDS], layout[LAST], d)


@inner
def piece_at(pool, layout, row, weights, cell, d):
    """Return I about `d` (m) in a cell: j0 to j3, in powers of (distance from d) times the scale of the cell."""
    i0, i1, i2, i3 = blended(pool, layout, cell, row, weights)
    t = (d - pool[layout[ORIGINS] + cell]) * pool[layout[SCALES] + cell]
    return i0 + t * (i1 + t * (i2 + t * i3)), i1 + t * (2.0 * i2 + 3.0 * t * i3), i2 + 3.0 * t * i3, i3


@inner
def path_across(pool, layout, row, weights, cell, d, s):
    """Return the mean of I from `d` to d + s, its derivative over s, and the cell reached; any number of cells."""
    up = 1 if s > 0.0 else 0
    step = 1 if s > 0.0 else -1
    begin, total = 0.0, 0.0
    while True:
        edge = pool[layout[BOUNDS] + cell + up] - d
        inside = s <= edge if s > 0.0 else s >= edge
        end = s if inside else edge
        j0, j1, j2, j3 = piece_at(pool, layout, row, weights, cell, d + begin)
        u = (end - begin) * pool[layout[SCALES] + cell]
        total += (end - begin) * (j0 + u * (0.5 * j1 + u * (j2 / 3.0 + u * (0.25 * j3))))
        if inside:
            mean = total / s
            return mean, (j0 + u * (j1 + u * (j2 + u * j3)) - mean) / s, cell
        begin = edge
        cell += step


@inlined
def path_from(pool, layout, row, weights, d, cell):
    """Return I about `d` (m), where paths begin: cell, d, j0 to j3, scale, and the ends of the cell from d (m)."""
    cell = cell_of(pool, layout, d, cell)
    j0, j1, j2, j3 = piece_at(pool, layout, row, weights, cell, d)
    low, high = pool[layout[BOUNDS] + cell] - d, pool[layout[BOUNDS] + cell + 1] - d
    return cell, d, j0, j1, j2, j3, pool[layout[SCALES] + cell], low, high


@inner
def beyond(pool, layout, row, weights, cell, d, rest, s):
    """Return what `along` does, where the path leaves the cell in which it begins."""
    if rest:
        cell = cell_of(pool, layout, d + s, cell)
        j0, j1, _j2, _j3 = piece_at(pool, layout, row, weights, cell, d + s)
        return j0, j1 * pool[layout[SCALES] + cell], np.inf
    mean, slope, _cell = path_across(pool, layout, row, weights, cell, d, s)
    return mean, slope, np.inf


@inlined
def along(pool, layout, row, weights, path, rest, s):
    """Return the mean of I over `s` (m) from where `path` begins, its derivative, and half its second derivative.

    rest: I at its end instead.
    """
    cell, d, j0, j1, j2, j3, scale, low, high = path
    if not low <= s <= high:
        return beyond(pool, layout, row, weights, cell, d, rest, s)
    u, parts = s * scale, (1.0, 1.0, 1.0) if rest else (1.0 / 2.0, 1.0 / 3.0, 1.0 / 4.0)
    j1, j2, j3 = parts[0] * j1, parts[1] * j2, parts[2] * j3
    slope, bend = scale * (j1 + u * (2.0 * j2 + 3.0 * u * j3)), scale * scale * (j2 + 3.0 * u * j3)
    return j0 + u * (j1 + u * (j2 + u * j3)), slope, bend


@inner
def energy_slope(pool, layout, row, weights, slopes, base_slope, cell, d):
    """Return I (m), l and dE/dtheta (m^2 a turn) at a fixed z."""
    scale = pool[layout[SCALES] + cell]
    t = (d - pool[layout[ORIGINS] + cell]) * scale
    i0, i1, i2, i3 = blended(pool, layout, cell, row, weights)
    depth = i0 + t * (i1 + t * (i2 + t * i3))
    touching = -scale * (i1 + t * (2.0 * i2 + 3.0 * t * i3))
    i0, i1, i2, i3 = blended(pool, layout, cell, row, slopes)
    energy = line_at(pool, layout[ENERGIES] + cell * layout[STRIDE] + row, slopes)
    energy -= t * (i0 + t * (0.5 * i1 + t * (i2 / 3.0 + t * (0.25 * i3)))) / scale
    return depth, touching, energy + depth * base_slope


@signed_kernel("f8[:,::1](f8[::1], i8[::1], u8[::1], f8[::1])")
def read_heights(pool, layout, phases, heights):
    """Return [4, places]: I (m), l, dE/dtheta at a fixed z (m^2 a turn), E (m^2)."""
    found = np.empty((4, len(phases)))
    cell = 0
    for i in range(len(phases)):
        row, t = row_of(layout, phases[i])
        weights, slopes = weights_of(t), slopes_of(t, float(layout[STRIDE] - 3))
        d = heights[i] - base_at(pool, layout, row, weights)
        cell = cell_of(pool, layout, d, cell)
        base_slope = base_at(pool, layout, row, slopes)
        found[0, i], found[1, i], found[2, i] = energy_slope(pool, layout, row, weights, slopes, base_slope, cell, d)
        j0, j1, j2, j3 = blended(pool, layout, cell, row, weights)
        u = (d - pool[layout[ORIGINS] + cell]) * pool[layout[SCALES] + cell]
        area = u * (j0 + u * (0.5 * j1 + u * (j2 / 3.0 + u * (0.25 * j3)))) / pool[layout[SCALES] + cell]
        found[3, i] = line_at(pool, layout[ENERGIES] + cell * layout[STRIDE] + row, weights) - area
    return found
