"""Integrals of the pressure field at any phase and z: over the slopes of the texture, and of powers of the pressure.

Model   y = h - z. Over the length L: S = mean of max(y, 0) h_t'(x) with h_t(x) = a2 cos(2 pi (x - p) / lambda2 + phi);
        T = mean of h_t' where y > 0, so that dS/dz = -T; N_g = mean of max(y, 0)^g, with dN_g/dz = -g N_(g-1). N_1
        is the mean indentation, N_0 the touching part of the length. A dome of 1 / R takes (x - L/2)^2 / (2 R) off h.
        Cells are those of `exact_solver`; `intervals` finds what touches of each. S, T, N_0 and N_1 are closed forms
        over a cell that touches all over, and Gauss-Legendre over an interval. For N_g an interval is halved until each
        piece holds at most one root of y, at its end, and no other root, real or complex, comes near: then Gauss-Jacobi
        takes the power of that root into its weight, y^(g-1) once a node serving N_g and N_(g-1) both.
Source  Fagiani & Barbieri (2016), eqs 1-2. Golub & Welsch (1969) for the nodes. The rest is derived here.
Limits  S and N_1 err by 1e-13 of (a1 + a2) times the touching length at most; for g of 0.5 to 1.5 N_g errs by 1e-12 of
        itself and N_(g-1) by 1e-10, beside what rounding z to 1e-16 makes of them (150 random scenes, against rules of
        twice the nodes; tests/synth/contact/test_pressure.py holds them to an oracle).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import roots_jacobi, roots_legendre

from synth.arrays import Array
from synth.contact.exact_solver import Grid, bounds_of_cell
from synth.contact.geometry import Geometry
from synth.contact.intervals import (
    LEFT,
    LEFT_EDGE,
    MOST_INTERVALS,
    RIGHT,
    RIGHT_EDGE,
    touching_intervals,
)
from synth.contact.patches import profile, sine_series
from synth.kernels import inlined, kernel

SLOPE_NODES = 6  # exact to 2e-17 for products of two waves of 1/16 period a cell; 5 would leave 7e-14
FEW_NODES, SOME_NODES, MANY_NODES = 5, 6, 9  # of a power, whose nearest root lies FAR, AWAY or NEAR
SOME_FROM, MANY_FROM, ROOTED_FROM = 5, 11, 20  # where they begin among the nodes, and those that begin at a root
FAR, AWAY, NEAR = 5.0, 3.2, 2.0  # half lengths of a piece: Gauss on n nodes then errs by 9.9^-2n, 6.2^-2n and 3.7^-2n
DEEPEST = 2.0**-30  # of an interval: pieces are not cut smaller; what they hold is below 1e-13 of a patch
LEVEL = 1e-15  # of a1 + a2: pieces of less height are rounding, and are not cut
WIDENED = 1.3  # bounds of the third derivative hold for |t| <= 1; off the axis, up to |t| = 3, cosh(0.6) more


@dataclass(frozen=True, slots=True)
class SlopeSums:
    """S (m), T, N_1 (m) and N_0, one of each a phase."""

    slope: Array
    rise: Array
    depth: Array
    touching: Array


@dataclass(frozen=True, slots=True)
class PowerSums:
    """N_g (m^g) and N_(g-1) (m^(g-1)), one of each a phase."""

    power: Array
    below: Array


@dataclass(frozen=True, slots=True)
class PressureField:
    """The cells of one contact; heights relative to a1 + a2.

    tables: float64 [8, cells]: finger height and slope, texture height and slope at phase 0 and the same a quarter
    period on, and what the dome takes off at the centre and as a slope. Slopes are per half cell. k1, k2: half a cell
    in radians, squared, of finger and texture. bow: what the dome takes off at the ends of a cell by its curvature.
    """

    tables: Array
    k1: float
    k2: float
    bow: float
    height_scale: float
    length: float

    @classmethod
    def of_geometry(cls, geometry: Geometry, dome: float = 0.0) -> PressureField:
        """Return the field of `geometry` with a dome of 1 / R (1/m); at least one surface must have a height."""
        grid, length = Grid.of_geometry(geometry), geometry.contact_length
        cells, bend = grid.cells, dome / grid.height_scale
        half = 0.5 * length / cells
        place = half * (2.0 * np.arange(cells) + (1.0 - cells))
        tables = np.vstack([grid.tables, 0.5 * bend * place**2, bend * half * place])
        return cls(tables, grid.k1, grid.k2, 0.5 * bend * half * half, grid.height_scale, length)

    @property
    def cells(self) -> int:
        """Cells that a phase is summed over."""
        return int(self.tables.shape[1])

    def slopes(self, phases: Array, heights: Array) -> SlopeSums:
        """Return S, T, N_1 and N_0 at each phase (turns) and z (m)."""
        sums = np.empty((4, len(phases)))
        coefficients = self.k1, self.k2, self.bow
        moments, nodes = _whole_cell(self.k1, self.k2), np.stack(roots_legendre(SLOPE_NODES))
        sum_slopes(self.tables, coefficients, phases, heights / self.height_scale, moments, nodes, sums)
        scale = self.height_scale
        slope, rise = scale / self.length * scale * sums[0], scale / self.length * sums[1]
        return SlopeSums(slope, rise, 0.5 * scale / self.cells * sums[2], 0.5 / self.cells * sums[3])

    def powers(self, phases: Array, heights: Array, exponent: float) -> PowerSums:
        """Return N_g and N_(g-1) for g = `exponent` (above 0), at each phase (turns) and z (m)."""
        below = exponent - 1.0
        sums = np.empty((2, len(phases)))
        smooth = below in (0.0, 1.0)  # y^g is no harder to integrate than y
        coefficients = self.k1, self.k2, self.bow
        relative = heights / self.height_scale
        sum_powers(self.tables, coefficients, phases, relative, below, smooth, _power_nodes(exponent), sums)
        sums *= 0.5 / self.cells
        return PowerSums(self.height_scale**exponent * sums[1], self.height_scale**below * sums[0])


def _power_nodes(exponent: float) -> Array:
    """Return places and weights, float64 [2, nodes]: for roots that lie far, away and near, and from a root on."""
    place, weight = roots_jacobi(MANY_NODES, 0.0, exponent - 1.0)
    rules = [roots_legendre(count) for count in (FEW_NODES, SOME_NODES, MANY_NODES)]
    rules.append((0.5 * (1.0 + place), weight / 2.0**exponent))
    return np.hstack([np.stack(rule) for rule in rules])


def _whole_cell(k1: float, k2: float) -> tuple[float, ...]:
    """Return the integrals over t of c1 c2, c2 c2, c2, t^2 c2, s1 s2, s2 s2, t s2 and c1, with c = cos(k t) and s =
    sin(k t) / k.
    """
    t, weight = roots_legendre(2 * SLOPE_NODES)
    (c1, s1), (c2, s2) = ((np.cos(k * t), t * np.sinc(k * t / math.pi)) for k in (math.sqrt(k1), math.sqrt(k2)))
    products = (c1 * c2, c2 * c2, c2, t * t * c2, s1 * s2, s2 * s2, t * s2, c1)
    return tuple(float(np.sum(weight * product)) for product in products)


@kernel
def fill_field(tables, k1, k2, bow, turn, work):
    """Write upper and lower bound of h, texture height and texture slope of every cell to `work`, at phase `turn`."""
    angle = 2.0 * math.pi * (turn - math.floor(turn))
    cosine, sine = math.cos(angle), math.sin(angle)
    for i in range(tables.shape[1]):
        height = tables[2, i] * cosine + tables[4, i] * sine
        slope = tables[3, i] * cosine + tables[5, i] * sine
        centre = height + tables[0, i] - tables[6, i]
        bend = 0.52 * (k1 * abs(tables[0, i]) + k2 * abs(height)) + 0.2 * (k1 * abs(tables[1, i]) + k2 * abs(slope))
        reach = abs(slope + tables[1, i] - tables[7, i]) + bend + abs(bow)
        work[0, i] = centre + reach
        work[1, i] = centre - reach
        work[2, i] = height
        work[3, i] = slope


@inlined
def intervals_of_cell(cell, whole, stack, found):
    """Write the touching intervals of a cell and return how many, and a bound of the third derivative of h; `whole`:
    the cell is known to touch all over.
    """
    u1, v1, k1, u2, v2, k2, (_offset, _lean, bow) = cell
    bound2, bound3 = bounds_of_cell(u1, v1, k1, u2, v2, k2)
    count = 1
    if whole:
        found[LEFT, 0], found[RIGHT, 0], found[LEFT_EDGE, 0], found[RIGHT_EDGE, 0] = -1.0, 1.0, 0.0, 0.0
    else:
        count = touching_intervals(cell, bound2 + 2.0 * abs(bow), bound3, stack, found)
    return count, bound3


@inlined
def depth_and_rise(cell, t):
    """Return y and the slope of the texture at `t` of the cell."""
    u1, v1, k1, u2, v2, k2, (offset, lean, bow) = cell
    s1, c1 = sine_series(k1, t)
    s2, c2 = sine_series(k2, t)
    y = u1 - u1 * k1 * c1 + v1 * s1 + u2 - u2 * k2 * c2 + v2 * s2 - offset - t * (lean + bow * t)
    return y, v2 - k2 * (u2 * s2 + v2 * c2)


@kernel
def sum_slopes(tables, coefficients, phases, heights, moments, nodes, sums):
    """Write the integrals over t of y h_t', h_t', y and 1 where y > 0, summed over the cells, to `sums` [4, phases]."""
    k1, k2, bow = coefficients
    c1c2, c2c2, c2, ttc2, s1s2, s2s2, ts2, c1 = moments
    cells = tables.shape[1]
    work, stack, found = np.empty((4, cells)), np.empty((2, 64)), np.empty((4, MOST_INTERVALS))
    for i in range(len(phases)):
        fill_field(tables, k1, k2, bow, phases[i], work)
        z = heights[i]
        slope, rise, depth, touching = 0.0, 0.0, 0.0, 0.0
        for j in range(cells):
            if work[0, j] <= z:
                continue
            u1, v1, u2, v2 = tables[0, j], tables[1, j], work[2, j], work[3, j]
            offset, lean = z + tables[6, j], tables[7, j]
            if work[1, j] >= z:
                slope += v2 * (u1 * c1c2 + u2 * c2c2 - offset * c2 - bow * ttc2)
                slope -= k2 * u2 * (v1 * s1s2 + v2 * s2s2 - lean * ts2)
                rise += v2 * c2
                depth += u1 * c1 + u2 * c2 - 2.0 * offset - bow * (2.0 / 3.0)
                touching += 2.0
                continue
            cell = (u1, v1, k1, u2, v2, k2, (offset, lean, bow))
            count, _bound3 = intervals_of_cell(cell, False, stack, found)
            for n in range(count):
                half = 0.5 * (found[RIGHT, n] - found[LEFT, n])
                middle = 0.5 * (found[RIGHT, n] + found[LEFT, n])
                for m in range(nodes.shape[1]):
                    y, steep = depth_and_rise(cell, middle + half * nodes[0, m])
                    weight = half * nodes[1, m]
                    slope += weight * y * steep
                    rise += weight * steep
                    depth += weight * y
                touching += 2.0 * half
        sums[0, i], sums[1, i], sums[2, i], sums[3, i] = slope, rise, depth, touching


@kernel
def sum_powers(tables, coefficients, phases, heights, below, smooth, nodes, sums):
    """Write the integrals over t of y^`below` and y^(`below` + 1) where y > 0, summed over the cells, to `sums`
    [2, phases].

    smooth: y^below needs no care at the roots. nodes: see `_power_nodes`.
    """
    k1, k2, bow = coefficients
    cells = tables.shape[1]
    work, stack, found = np.empty((4, cells)), np.empty((4, 64)), np.empty((4, MOST_INTERVALS))
    for i in range(len(phases)):
        fill_field(tables, k1, k2, bow, phases[i], work)
        z = heights[i]
        lower, upper = 0.0, 0.0
        for j in range(cells):
            if work[0, j] <= z:
                continue
            level = (z + tables[6, j], tables[7, j], bow)
            cell = (tables[0, j], tables[1, j], k1, work[2, j], work[3, j], k2, level)
            count, bound3 = intervals_of_cell(cell, work[1, j] >= z, stack, found)
            for n in range(count):
                edges = int(found[LEFT_EDGE, n]) + 2 * int(found[RIGHT_EDGE, n])
                ends = (found[LEFT, n], found[RIGHT, n])
                a, b = power_of_interval(cell, WIDENED * bound3, ends, edges, below, smooth, nodes, stack)
                lower += a
                upper += b
        sums[0, i], sums[1, i] = lower, upper


@inlined
def power_sum(cell, nodes, first, last, begin, step, below):
    """Return the sums of w y^below and w y^(below + 1) over nodes `first` to `last`, at begin + step x.

    The weights of nodes from a root on hold the power `below` of x, by which y is divided first.
    """
    lower, upper = 0.0, 0.0
    for m in range(first, last):
        place, part = nodes[0, m], nodes[1, m]
        y = max(depth_and_rise(cell, begin + step * place)[0], 1e-300)
        if below != 0.0:
            part *= math.exp(below * math.log(y / place if first == ROOTED_FROM else y))
        lower += part
        upper += part * y
    return abs(step) * lower, abs(step) * upper


@inlined
def falls_within(slope, curvature, bound3, reach):
    """Return a bound of how much y changes on the complex disc of radius `reach` round where its slope was taken."""
    return reach * (abs(slope) + reach * (0.5 * abs(curvature) + reach * bound3 / 6.0))


@kernel
def power_of_interval(cell, bound3, ends, edges, below, smooth, nodes, stack):
    """Return the integrals of y^below and y^(below + 1) over an interval where y > 0.

    edges: 1 where y vanishes at its left end, 2 at its right, 3 at both, 0 at none. bound3: of the third derivative, on
    the complex discs round the pieces too. nodes: see `_power_nodes`.
    """
    lower, upper = 0.0, 0.0
    smallest = DEEPEST * (ends[1] - ends[0])
    stack[0, 0], stack[1, 0], stack[2, 0] = ends[0], ends[1], edges
    depth = 1
    while depth > 0:
        depth -= 1
        low, high, kind = stack[0, depth], stack[1, depth], int(stack[2, depth])
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        clear = smooth or half <= smallest
        a, b = 0.0, 0.0
        if clear or kind == 0:
            y, slope, curvature, _area = profile(cell, middle)
            if smooth or falls_within(slope, curvature, bound3, FAR * half) <= y:
                clear = True
                a, b = power_sum(cell, nodes, 0, SOME_FROM, middle, half, below)
            elif falls_within(slope, curvature, bound3, AWAY * half) <= y:
                clear = True
                a, b = power_sum(cell, nodes, SOME_FROM, MANY_FROM, middle, half, below)
            else:
                fall = falls_within(slope, curvature, bound3, NEAR * half)
                clear = clear or fall <= y or y + fall <= LEVEL
                if clear:
                    a, b = power_sum(cell, nodes, MANY_FROM, ROOTED_FROM, middle, half, below)
        elif kind < 3:
            edge = low if kind == 1 else high
            _y, slope, curvature, _area = profile(cell, edge)
            reach = (1.0 + NEAR) * half
            clear = reach * (0.5 * abs(curvature) + bound3 * reach / 6.0) <= abs(slope)
            if clear:
                step = 2.0 * half if kind == 1 else -2.0 * half
                a, b = power_sum(cell, nodes, ROOTED_FROM, nodes.shape[1], edge, step, below)
        if clear:
            lower += a
            upper += b
            continue
        stack[0, depth], stack[1, depth], stack[2, depth] = low, middle, kind & 1
        stack[0, depth + 1], stack[1, depth + 1], stack[2, depth + 1] = middle, high, kind & 2
        depth += 2
    return lower, upper
