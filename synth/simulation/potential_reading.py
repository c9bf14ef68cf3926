"""Reading a table of the energy of a contact: weights of a phase, cells of a height, and means over a path.

Model   `potential`: at a phase, four rows are summed with the weights of the cubic spline; then I is one cubic in t =
        (d - origin) scale in each cell of d, and E of a cell is E(origin) - (integral of I).
        The mean of I between two heights is the divided difference of E, without its cancellation: within a cell I is
        written about where the path begins, I = j0 + j1 u + j2 u^2 + j3 u^3, and its mean is j0 + j1 u / 2 + j2 u^2 / 3
        + j3 u^3 / 4; over several cells the parts, all of one sign, are added up.
Source  derived here.
Limits  exact for the table, to round-off.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from synth.contact.exact import Array
from synth.contact.kernels import inlined, kernel

PLACE = 2.0**-53  # the 53 bits of the phase below the row, as a fraction of the step between rows


class TableArrays(NamedTuple):
    """A table as compiled loops read it; cells run from -infinity (a line) to +infinity (nothing).

    pieces: [cells, rows + 3, 4] coefficients of I. energies: [cells, rows + 3], E at the origin of each cell.
    curves: [2, rows + 3], b and the highest point of h. bounds: [cells + 1] of the cells (m). origins (m) and scales
    (1/m): of t, [cells]. index: the cell at equal steps from the lowest to the highest bound.
    """

    pieces: Array
    energies: Array
    curves: Array
    bounds: Array
    origins: Array
    scales: Array
    index: np.ndarray[Any, np.dtype[np.uint16]]


@inlined
def row_of(table, phase):
    """Return the row at or before `phase`, the place after it in steps of a row, and the number of rows."""
    rows = table.curves.shape[1] - 3
    bits = np.uint64(0)
    while (1 << bits) < rows:
        bits += np.uint64(1)
    row = np.int64(phase >> (np.uint64(64) - bits))
    return row, np.float64(np.int64((phase << bits) >> np.uint64(11))) * PLACE, np.float64(rows)


@inlined
def weights_of(t):
    """Return the weights of four rows."""
    s = 1.0 - t
    first, last = s * s * s * (1.0 / 6.0), t * t * t * (1.0 / 6.0)
    second = 2.0 / 3.0 + t * t * (0.5 * t - 1.0)
    return first, second, 1.0 - first - second - last, last


@inlined
def slopes_of(t, rows):
    """Return the derivatives of the weights of four rows, a turn."""
    s = 1.0 - t
    first, second, last = -0.5 * s * s * rows, t * (1.5 * t - 2.0) * rows, 0.5 * t * t * rows
    return first, second, -first - second - last, last


@inlined
def curve_at(curves, which, row, weights):
    """Return one of the curves."""
    first, second, third, last = weights
    line = curves[which]
    return first * line[row] + second * line[row + 1] + third * line[row + 2] + last * line[row + 3]


@inlined
def blended(pieces, cell, row, weights):
    """Return the four coefficients of I in a cell."""
    first, second, third, last = weights
    a, b, c, d = pieces[cell, row], pieces[cell, row + 1], pieces[cell, row + 2], pieces[cell, row + 3]
    return (
        first * a[0] + second * b[0] + third * c[0] + last * d[0],
        first * a[1] + second * b[1] + third * c[1] + last * d[1],
        first * a[2] + second * b[2] + third * c[2] + last * d[2],
        first * a[3] + second * b[3] + third * c[3] + last * d[3],
    )


@kernel
def cell_of(table, d, cell):
    """Return the cell in which `d` (m) lies; `cell` is a first guess."""
    bounds = table.bounds
    if bounds[cell] <= d < bounds[cell + 1]:
        return cell
    last = len(bounds) - 2
    low, high = bounds[1], bounds[last]
    if d < low:
        return 0
    if not d < high:
        return last
    places = len(table.index)
    cell = np.int64(table.index[min(int((d - low) / (high - low) * places), places - 1)])
    while d < bounds[cell]:
        cell -= 1
    while d >= bounds[cell + 1]:
        cell += 1
    return cell


@kernel
def piece_at(table, row, weights, cell, d):
    """Return I about `d` (m) in a cell: j0 to j3, in powers of (distance from d) times the scale of the cell."""
    i0, i1, i2, i3 = blended(table.pieces, cell, row, weights)
    t = (d - table.origins[cell]) * table.scales[cell]
    return i0 + t * (i1 + t * (i2 + t * i3)), i1 + t * (2.0 * i2 + 3.0 * t * i3), i2 + 3.0 * t * i3, i3


@kernel
def path_across(table, row, weights, cell, d, s):
    """Return the mean of I from `d` to d + s, its derivative over s, and the cell reached; any number of cells."""
    bounds = table.bounds
    up = 1 if s > 0.0 else 0
    step = 1 if s > 0.0 else -1
    begin, total = 0.0, 0.0
    while True:
        edge = bounds[cell + up] - d
        inside = s <= edge if s > 0.0 else s >= edge
        end = s if inside else edge
        j0, j1, j2, j3 = piece_at(table, row, weights, cell, d + begin)
        u = (end - begin) * table.scales[cell]
        total += (end - begin) * (j0 + u * (0.5 * j1 + u * (j2 / 3.0 + u * (0.25 * j3))))
        if inside:
            mean = total / s
            return mean, (j0 + u * (j1 + u * (j2 + u * j3)) - mean) / s, cell
        begin = edge
        cell += step


@kernel
def energy_slope(table, row, weights, slopes, base_slope, cell, d):
    """Return I (m), l and dE/dtheta (m^2 a turn) at a fixed z, and dI/dtheta there."""
    scale = table.scales[cell]
    t = (d - table.origins[cell]) * scale
    i0, i1, i2, i3 = blended(table.pieces, cell, row, weights)
    depth = i0 + t * (i1 + t * (i2 + t * i3))
    touching = -scale * (i1 + t * (2.0 * i2 + 3.0 * t * i3))
    i0, i1, i2, i3 = blended(table.pieces, cell, row, slopes)
    drift = i0 + t * (i1 + t * (i2 + t * i3))
    energy = curve_at(table.energies, cell, row, slopes)
    energy -= t * (i0 + t * (0.5 * i1 + t * (i2 / 3.0 + t * (0.25 * i3)))) / scale
    return depth, touching, energy + depth * base_slope, drift + touching * base_slope


@kernel
def read_heights(table, phases, heights):
    """Return [5, places]: I (m), l, dE/dtheta at a fixed z (m^2 a turn), dI/dtheta at a fixed z, E (m^2)."""
    found = np.empty((5, len(phases)))
    cell = 0
    for i in range(len(phases)):
        row, t, rows = row_of(table, phases[i])
        weights, slopes = weights_of(t), slopes_of(t, rows)
        d = heights[i] - curve_at(table.curves, 0, row, weights)
        cell = cell_of(table, d, cell)
        base_slope = curve_at(table.curves, 0, row, slopes)
        depth, touching, energy, drift = energy_slope(table, row, weights, slopes, base_slope, cell, d)
        found[0, i], found[1, i], found[2, i], found[3, i] = depth, touching, energy, drift
        j0, j1, j2, j3 = blended(table.pieces, cell, row, weights)
        u = (d - table.origins[cell]) * table.scales[cell]
        area = u * (j0 + u * (0.5 * j1 + u * (j2 / 3.0 + u * (0.25 * j3)))) / table.scales[cell]
        found[4, i] = curve_at(table.energies, cell, row, weights) - area
    return found
