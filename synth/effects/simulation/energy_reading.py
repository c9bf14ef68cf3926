"""Read a table of the elastic energy: the kernels that the steps of a simulation call.

Stage   table of the energy -> READING -> steps
Model   Over the height, I is a cubic between two nodes, from its values and slopes there. Above the last node it is 0,
        below the first a straight line. Over the phase, the values of a node are cubic splines. See `energy_table`.
Source  As of `energy_table`.
Limits  The reading is exact for the table.
"""

from __future__ import annotations

import math

import numpy as np

from synth.kernels import inlined, inner, signed_kernel

PLACE = 2.0**-53  # unit of the 53 bits of the phase below the row, in steps between rows

DEPTH, TOUCHING, ENERGY = range(3)
"""Values of a node: I (m), l times the step of d (m), E over the step of d (m)."""
BOTTOM, WIDTH, CELLS, BITS = range(4)
"""Entries of `grid`: the lowest d (m), the step of d (m), the number of steps, log2 of the number of phases."""
BASE, HIGHEST = range(2)  # rows of `curves`


@inner
def row_of(grid, phase):
    """Return the row at or before `phase`, and the distance from it in steps between rows."""
    bits = np.uint64(grid[BITS])
    row = np.int64(phase >> (np.uint64(64) - bits))
    return row, np.float64(np.int64((phase << bits) >> np.uint64(11))) * PLACE


@inner
def weights_of(t):
    """Return the spline weights of four rows; t: distance from the second of them, in steps between rows."""
    s = 1.0 - t
    first, last = s * s * s * (1.0 / 6.0), t * t * t * (1.0 / 6.0)
    second = 2.0 / 3.0 + t * t * (0.5 * t - 1.0)
    return first, second, 1.0 - first - second - last, last


@inner
def slopes_of(t, rows):
    """Return the derivatives of the spline weights of four rows, per turn."""
    s = 1.0 - t
    first, second, last = -0.5 * s * s * rows, t * (1.5 * t - 2.0) * rows, 0.5 * t * t * rows
    return first, second, -first - second - last, last


@inlined
def curve_at(curves, curve, row, weights):
    """Return b or the highest point of h (m); with slopes as weights, its derivative (m per turn)."""
    return (
        weights[0] * curves[curve, row] + weights[1] * curves[curve, row + 1]
        + weights[2] * curves[curve, row + 2] + weights[3] * curves[curve, row + 3]
    )  # fmt: skip


@inlined
def node_at(nodes, node, row, weights, what):
    """Return DEPTH, TOUCHING or ENERGY of a node."""
    return (
        weights[0] * nodes[node, row, what] + weights[1] * nodes[node, row + 1, what]
        + weights[2] * nodes[node, row + 2, what] + weights[3] * nodes[node, row + 3, what]
    )  # fmt: skip


@inlined
def piece_of(nodes, row, weights, cell):
    """Return the coefficients of I in a cell, a cubic in steps of d from the start of the cell.

    cell: -1 is the straight line below the table; above the last cell I is 0.
    """
    cells = len(nodes) - 1
    if cell >= cells:
        return 0.0, 0.0, 0.0, 0.0
    node = max(cell, 0)
    depth, start = node_at(nodes, node, row, weights, DEPTH), -node_at(nodes, node, row, weights, TOUCHING)
    if cell < 0:
        return depth, start, 0.0, 0.0
    rise = node_at(nodes, node + 1, row, weights, DEPTH) - depth
    end = -node_at(nodes, node + 1, row, weights, TOUCHING)
    return depth, start, 3.0 * rise - 2.0 * start - end, start + end - 2.0 * rise


@inlined
def cell_at(nodes, place):
    """Return the cell that contains `place` (steps of d from the bottom), and the start of that cell."""
    cell = min(max(math.floor(place), -1.0), float(len(nodes) - 1))
    return int(cell), max(cell, 0.0)


@inlined
def piece_at(nodes, row, weights, place):
    """Return the cell that contains `place`, its start, and the coefficients of I in it (`piece_of`)."""
    cell, begin = cell_at(nodes, place)
    c0, c1, c2, c3 = piece_of(nodes, row, weights, cell)
    return cell, begin, c0, c1, c2, c3


@inlined
def depth_in(piece, place):
    """Return I (m) and its derivative per step of d, at `place` in a piece from `piece_at`."""
    _cell, begin, c0, c1, c2, c3 = piece
    t = place - begin
    return c0 + t * (c1 + t * (c2 + t * c3)), c1 + t * (2.0 * c2 + t * 3.0 * c3)


@inlined
def depth_near(nodes, row, weights, piece, place):
    """Return I (m) and its derivative per step of d at `place`, which is probably in `piece`."""
    if cell_at(nodes, place)[0] == piece[0]:
        return depth_in(piece, place)
    return depth_in(piece_at(nodes, row, weights, place), place)


@inlined
def mean_depth(nodes, row, weights, piece, place, move):
    """Return the mean of I (m) from `place` to `place` + `move` (steps of d), and its derivative over `move`.

    piece: the piece at `place`.
    """
    cell, begin, c0, c1, c2, c3 = piece
    end, done, total = place + move, place, 0.0
    while True:
        if move > 0.0:
            edge = np.inf if cell >= len(nodes) - 1 else cell + 1.0
            stop = min(end, edge)
        else:
            stop = max(end, begin if cell >= 0 else -np.inf)
        a, b = done - begin, stop - begin
        mean = c0 + c1 * (a + b) / 2.0 + c2 * (a * a + a * b + b * b) / 3.0 + c3 * (a + b) * (a * a + b * b) / 4.0
        if stop == end and done == place:
            return mean, c1 / 2.0 + c2 * (a + 2.0 * b) / 3.0 + c3 * (a * a + 2.0 * a * b + 3.0 * b * b) / 4.0
        total += (stop - done) * mean
        if stop == end:
            mean = total / move
            return mean, (c0 + b * (c1 + b * (c2 + b * c3)) - mean) / move
        done = stop
        cell += 1 if move > 0.0 else -1
        begin = max(float(cell), 0.0)
        c0, c1, c2, c3 = piece_of(nodes, row, weights, cell)


@inner
def energy_at(nodes, row, weights, place):
    """Return E over the step of d (m); with slopes as weights, its derivative over phase at fixed d (m per turn)."""
    cell, begin = cell_at(nodes, place)
    if cell >= len(nodes) - 1:
        return 0.0
    c0, c1, c2, c3 = piece_of(nodes, row, weights, cell)
    t = place - begin
    rest = node_at(nodes, max(cell, 0), row, weights, ENERGY)
    return rest - t * (c0 + t * (c1 / 2.0 + t * (c2 / 3.0 + t * c3 / 4.0)))


@inner
def drift_at(nodes, curves, grid, row, t, place):
    """Return I (m), its derivative per step of d, and dE/dtheta at fixed z (m^2 per turn), at `place`."""
    slopes = slopes_of(t, 2.0 ** grid[BITS])
    depth, slope = depth_in(piece_at(nodes, row, weights_of(t), place), place)
    drift = grid[WIDTH] * energy_at(nodes, row, slopes, place) + depth * curve_at(curves, BASE, row, slopes)
    return depth, slope, drift


@signed_kernel("f8[:,::1](f8[:,:,::1], f8[:,::1], f8[::1], u8[::1], f8[::1])")
def read_places(nodes, curves, grid, phases, heights):
    """Return [4, places]: see `EnergyTable.read`."""
    found = np.empty((4, len(phases)))
    for i in range(len(phases)):
        row, t = row_of(grid, phases[i])
        weights = weights_of(t)
        place = (heights[i] - curve_at(curves, BASE, row, weights) - grid[BOTTOM]) / grid[WIDTH]
        found[0, i], slope, found[2, i] = drift_at(nodes, curves, grid, row, t, place)
        found[1, i] = -slope / grid[WIDTH]
        found[3, i] = grid[WIDTH] * energy_at(nodes, row, weights, place)
    return found
