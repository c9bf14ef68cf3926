"""A table of the elastic energy of one contact, over the height of the finger and the phase of the texture.

Stage   contact -> TABLE OF THE ENERGY -> steps
Model   I(z, theta) is the mean over L of max(h - z, 0), l = -dI/dz the part of L that touches, and E the integral of I
        from z to infinity. The elastic energy is k E.
        d = z - b(theta), where b is a smooth curve near z. The table has I, l and E at equal steps of d and of phase.
        Between two steps of d, I is the cubic through both values with both slopes, and E is its integral. Above the
        last step I is 0; below the first it continues as a straight line.
        Over the phase, I, l and E are periodic cubic splines. The values read therefore satisfy I = -dE/dz at every
        phase, and have two continuous derivatives over the phase.
        The mean of I between two heights is integrated piece by piece over the cubics, not as a difference of E.
Source  Fagiani & Barbieri (2016), eq. 1; cubic splines from samples: Unser, Aldroubi & Eden (1993), IEEE Trans.
        Signal Process. 41. The rest is derived here.
Limits  `error` bounds the largest error dI / l of the z that balances a load. It is measured at places off the grid,
        against the exact contact. It is relative to the peak-to-peak of z or, if that is larger, to the distance of z
        from the heights of the given loads.
        Where crests come into contact I is only once differentiable. The error there falls as the square of the steps
        of the phase.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from synth.arrays import Array
from synth.contact.load_balance import Contact
from synth.kernels import inlined, inner, signed_kernel
from synth.response.phases import turns_to_phase

Complex = np.ndarray[Any, np.dtype[np.complex128]]

MOST_NODES = 1 << 21  # per table, 50 MB; where more would be needed, `error` reports the remaining error
MOST_WORK = 1 << 28  # nodes measured for a table times cells of the contact's grid: a second or two
FEWEST_ROWS = 512  # phases of the first attempt: an error of 2e-4 to 1e-3 at one load
CELLS_OF_MOTION = 6.0  # steps of d per peak-to-peak of z, in the first attempt
FEWEST_CELLS, MOST_CELLS = 6, 9  # log2 of the number of steps of d, in the first attempt
BASE_PHASES = 512  # phases at which the curve b and the range of heights are found
BASE_HARMONICS = 16  # harmonics of b, faded out; more would add the kinks of z to heights that have none
PROBES, LAYERS = 512, 8  # phases off the grid, and heights per phase, at which the error is measured
MARGIN = 1.5  # times the largest error at the probes; between them it was up to 1.4 times as large
SMALLEST_MOTION = 1e-5  # of a1 + a2: if z moves less, errors are relative to this
GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
PLACE = 2.0**-53  # unit of the 53 bits of the phase below the row, in steps between rows

DEPTH, TOUCHING, ENERGY = range(3)
"""Values of a node: I (m), l times the step of d (m), E over the step of d (m)."""
BOTTOM, WIDTH, CELLS, BITS = range(4)
"""Entries of `grid`: the lowest d (m), the step of d (m), the number of steps, log2 of the number of phases."""
BASE, HIGHEST = range(2)  # rows of `curves`


class _Probes(NamedTuple):
    """Places off the grid at which the error is measured.

    phases: turns.
    heights: m.
    depth: exact I (m).
    touching: exact l, or l at the lightest load if that is larger.
    allowed: permitted error (m).
    """

    phases: Array
    heights: Array
    depth: Array
    touching: Array
    allowed: Array


@dataclass(frozen=True, slots=True)
class EnergyTable:
    """The energy of one contact, ready to be read.

    nodes: float64 [steps of d + 1, phases + 3, 3], spline coefficients over the phase; see DEPTH.
    curves: float64 [2, phases + 3], spline coefficients of b and of the highest point of h (m).
    grid: float64 [4], see BOTTOM.
    error: see Limits.
    motion: peak-to-peak of z (m), to which `error` is relative.
    """

    nodes: Array
    curves: Array
    grid: Array
    error: float
    motion: float

    @property
    def nbytes(self) -> int:
        """Size in bytes."""
        return int(self.nodes.nbytes + self.curves.nbytes)

    def read(self, turns: Array, heights: Array) -> Array:
        """Return [4, places] at `turns` and `heights` (m): I (m), l, dE/dtheta at fixed z (m^2 per turn), E (m^2)."""
        return np.asarray(read_places(self.nodes, self.curves, self.grid, turns_to_phase(turns), heights))

    def coarser(self) -> EnergyTable:
        """Return the table of every second node along both axes. Its `error` is still that of this table."""
        nodes = _values(self.nodes)[::2, ::2] * [1.0, 2.0, 0.5]
        curves = _values(self.curves)[:, ::2]
        bottom, width, cells, bits = self.grid.tolist()
        return replace(
            self,
            nodes=splines(nodes),
            curves=splines(curves),
            grid=np.array([bottom, 2.0 * width, cells / 2.0, bits - 1.0]),
        )

    @classmethod
    def of(
        cls,
        contact: Contact,
        load: float,
        lightest: float,
        heaviest: float,
        below: float = 0.0,
        above: float = 0.0,
        tolerance: float = 1e-3,
    ) -> EnergyTable:
        """Return the table that keeps `tolerance`, or the best table within the bounds on nodes and work.

        contact, load: the table is that of the contact in its shape at `load` (N).
        lightest, heaviest: loads (N) between whose heights the tolerance is kept. Outside, up to the loss of contact,
            the tolerance is relative to the distance of z from those heights.
        below, above: distances (m) from those heights that the cells also cover. They always cover the loss of
            contact, and a peak-to-peak of z below.
        """
        span = _Range.of(contact, load, min(lightest, load), max(heaviest, load), below, above)
        probes = span.probes(tolerance)
        most, work = min(MOST_NODES, MOST_WORK // contact.grid.cells), 0
        wanted = math.ceil(math.log2(CELLS_OF_MOTION * (span.top - span.bottom) / span.motion))
        rows, cells = FEWEST_ROWS, 1 << min(max(wanted, FEWEST_CELLS), MOST_CELLS)
        tables: list[EnergyTable] = []
        while not tables or (tables[-1].error > tolerance and work + rows * cells <= most):
            tables.append(span.table(rows, cells, probes, tolerance))
            work += rows * cells
            rows, cells = 2 * rows, 2 * cells
        return min(tables, key=lambda table: table.error)


@dataclass(frozen=True, slots=True)
class _Range:
    """The range that a table spans.

    indentations: at the lightest and the heaviest load (m).
    harmonics: of the curve b.
    bottom, top: lowest and highest d (m).
    below: see `EnergyTable.of` (m), with a peak-to-peak of z added.
    motion: peak-to-peak of z (m), to which errors are relative.
    """

    contact: Contact
    load: float
    indentations: tuple[float, float]
    harmonics: Complex
    bottom: float
    top: float
    below: float
    motion: float

    @classmethod
    def of(cls, contact: Contact, load: float, lightest: float, heaviest: float, below: float, above: float) -> _Range:
        """Return the range between the heights of the loads, extended by `below` and `above`; see `EnergyTable.of`."""
        solver, phases = contact.solver(load), np.arange(BASE_PHASES) / BASE_PHASES
        pressed = [contact.indentation(w) for w in (load, lightest, heaviest)]
        middle, light, heavy = (solver.solve(phases, indentation).height for indentation in pressed)
        scale = contact.geometry_at(load).height_scale
        harmonics = np.fft.rfft(middle)[:BASE_HARMONICS] / BASE_PHASES
        harmonics *= np.cos(0.5 * np.pi * np.arange(BASE_HARMONICS) / BASE_HARMONICS) ** 2
        base = np.fft.irfft(harmonics, BASE_PHASES) * BASE_PHASES
        highest = solver.solve(phases, 0.0).height
        motion = max(*(float(np.ptp(heights)) for heights in (middle, light, heavy)), SMALLEST_MOTION * scale)
        below += motion
        top, bottom = float(np.max(highest - base)), float(np.min(heavy - base)) - below
        # everything of a flat finger touches below the lowest h, so the line below the bottom is exact there
        if contact.of_one_line and contact.dome == 0.0:
            bottom = max(bottom, contact.geometry_at(load).extent[0] - float(np.max(base)) - 0.01 * (top - bottom))
        bottom = min(bottom, top - motion)
        top = max(top, min(top + above, float(np.max(light - base)) + above)) + 0.01 * (top - bottom)
        return cls(contact, load, (pressed[1], pressed[2]), harmonics, bottom, top, below, motion)

    def probes(self, tolerance: float) -> _Probes:
        """Return the probes: LAYERS heights, from the highest point down, at each of PROBES phases off every grid."""
        turns = np.sort(np.arange(1, PROBES + 1) * GOLDEN % 1.0)
        solver = self.contact.solver(self.load)
        light, heavy = (solver.solve(turns, indentation) for indentation in self.indentations)
        highest = solver.solve(turns, 0.0).height
        part = (np.arange(LAYERS * PROBES) * GOLDEN % 1.0).reshape(LAYERS, PROBES)
        part = (np.arange(LAYERS)[:, None] + part) / LAYERS
        least = highest - light.height
        depths = least * ((highest - heavy.height + self.below) / least) ** part
        heights = (highest - depths).ravel()
        spread = np.tile(turns, LAYERS)
        depth, touching = self.contact.measure(spread, heights, self.load)
        outside = np.maximum(heights - np.tile(light.height, LAYERS), np.tile(heavy.height, LAYERS) - heights)
        allowed = tolerance * np.maximum(self.motion, outside)
        return _Probes(spread, heights, depth, np.maximum(touching, np.tile(light.touching, LAYERS)), allowed)

    def table(self, rows: int, cells: int, probes: _Probes, tolerance: float) -> EnergyTable:
        """Return the table of `rows` phases and `cells` steps of d, exact at its nodes, with its error at `probes`."""
        turns, edges = np.arange(rows) / rows, np.linspace(self.bottom, self.top, cells + 1)
        base = np.fft.irfft(self.harmonics, rows) * rows
        heights = (base[:, None] + edges).ravel()
        measured = self.contact.measure(np.repeat(turns, len(edges)), heights, self.load)
        depth, touching = (part.reshape(rows, len(edges)).T for part in measured)
        depth[-1], touching[-1] = 0.0, 0.0  # the top is above all heights, except any between the phases of its search
        width = edges[1] - edges[0]
        energy = np.zeros_like(depth)
        pieces = 0.5 * (depth[:-1] + depth[1:]) + width / 12.0 * np.diff(touching, axis=0)
        energy[:-1] = np.cumsum(pieces[::-1], axis=0)[::-1]
        highest = self.contact.solver(self.load).solve(turns, 0.0).height
        nodes = splines(np.stack([depth, width * touching, energy], axis=-1))
        grid = np.array([self.bottom, width, cells, math.log2(rows)])
        table = EnergyTable(nodes, splines(np.stack([base, highest])), grid, 0.0, self.motion)
        wrong = np.abs(table.read(probes.phases, probes.heights)[0] - probes.depth) / probes.touching
        return replace(table, error=MARGIN * tolerance * float(np.max(wrong / probes.allowed)))


def splines(values: Array) -> Array:
    """Return the coefficients of periodic cubic splines through `values` along the second axis, which grows by three.

    A value is (c[j - 1] + 4 c[j] + c[j + 1]) / 6, and c[j - 1] is stored at index j.
    """
    count = values.shape[1]
    gain = (2.0 + np.cos(2.0 * np.pi * np.arange(count // 2 + 1) / count)) / 3.0
    lines = np.fft.rfft(np.moveaxis(values, 1, -1)) / gain
    found = np.moveaxis(np.fft.irfft(lines, count), -1, 1)
    return np.ascontiguousarray(np.concatenate([found[:, -1:], found, found[:, :2]], axis=1))


def _values(coefficients: Array) -> Array:
    """Return the values from their spline coefficients along the second axis: the inverse of `splines`."""
    return np.asarray((coefficients[:, :-3] + 4.0 * coefficients[:, 1:-2] + coefficients[:, 2:-1]) / 6.0)


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
