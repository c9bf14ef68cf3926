"""The approach z at any phase of the texture, to round-off.

Model   z solves the load balance F(z) = mean over [0, L] of max(h - z, 0) = w / k, with h of eq. 2. F is convex and
        falling: F' = -(touching part of L), F'' = sum of 1 / |h'| over the edges of the touching patches. Newton's
        method with the second-order term solves for z. It starts from below or from the preceding phases, and a
        bracket guards each step. All values are relative to a1 + a2 and to L.
        The contact length is divided into cells of at most 1/16 of the shortest period. A cell touches over its whole
        width where the bounds on its h lie above z, and nowhere where they lie below. `patches` measures the others.
Source  Fagiani & Barbieri (2016), eq. 1. This use of Newton's method is Michelot's projection on the simplex (1986).
Limits  |error of z| < 2e-13 (a1 + a2), measured by tests/synth/contact/test_exact_solver.py. For w / k below 1e-18
        (a1 + a2), about 1e-12 N, z is the highest point of h and nothing touches: the error is 2e-9 at most.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.contact.geometry import Geometry
from synth.contact.patches import profile, touching_part
from synth.kernels import inlined, inner, kernel

CELLS_PER_PERIOD = 16  # the series in `patches` are exact to round-off up to pi / 16; fewer cells lose digits
SMALLEST_INDENTATION = 1e-18  # of a1 + a2: below it z is the highest point, with an error of 2e-9 at most
MOST_ITERATIONS = 60  # never reached in the tests; limits the time per phase


@dataclass(frozen=True, slots=True)
class Approaches:
    """The solved contact at a number of phases.

    height: z, m, per phase.
    touching: part of L that touches, per phase.
    iterations: of Newton's method, per phase.
    """

    height: Array
    touching: Array
    iterations: np.ndarray[Any, np.dtype[np.int64]]


@dataclass(frozen=True, slots=True)
class Grid:
    """The cells of one contact: coefficients that are computed once and read by the kernel.

    tables: float64 [6, cells]. The rows are finger height u1, finger slope v1, texture height and slope at phase 0, and
        texture height and slope a quarter period on. Slopes are per half cell.
    k1, k2: square of half a cell in radians, of finger and texture.
    texture: a2, relative to a1 + a2.
    height_scale: a1 + a2, m.
    """

    tables: Array
    k1: float
    k2: float
    texture: float
    height_scale: float

    name = "exact solver"

    @property
    def cells(self) -> int:
        """Number of cells per phase: the work per phase."""
        return int(self.tables.shape[1])

    @property
    def nbytes(self) -> int:
        """Memory of the grid in bytes."""
        return int(self.tables.nbytes)

    def solve(self, phases: Array, indentation: float | Array, guess: Array | None = None) -> Approaches:
        """Return the approach at each of `phases` (turns of the texture period, theta = p / lambda2).

        indentation: w / k, m, at least 0; one for all phases, or one per phase.
        guess: z, m, per phase; None: start from the preceding phases.
        """
        count, scale = len(phases), self.height_scale
        height, touching, iterations = np.empty(count), np.empty(count), np.zeros(count, dtype=np.int64)
        begin = np.empty(0) if guess is None else guess / scale
        targets = np.atleast_1d(np.asarray(indentation, dtype=float)) / scale
        solve_phases(self.tables, self.k1, self.k2, phases, targets, begin, height, touching, iterations)
        return Approaches(height * scale, touching, iterations)

    def measure(self, phases: Array, heights: Array) -> tuple[Array, Array]:
        """Return the mean of max(h - z, 0) (m) and the touching part of L, to round-off, in the shape of `heights`.

        phases: turns.
        heights: z (m) at each phase, [phases] or [phases, levels]. Many levels at one phase take less time than one
            level at each of many phases.
        """
        levels = np.ascontiguousarray(heights.reshape(len(phases), -1)) / self.height_scale
        depth, touching = np.empty(levels.shape), np.empty(levels.shape)
        measure_phases(self.tables, self.k1, self.k2, phases, levels, depth, touching)
        return depth.reshape(heights.shape) * self.height_scale, touching.reshape(heights.shape)

    @classmethod
    def of_geometry(cls, geometry: Geometry) -> Grid:
        """Return the grid of `geometry`; at least one surface must have a height."""
        scale = geometry.height_scale
        b1, b2 = geometry.ridge_amplitude / scale, geometry.texture_amplitude / scale
        shortest = min(
            geometry.ridge_period if b1 > 0.0 else math.inf, geometry.texture_period if b2 > 0.0 else math.inf
        )
        cells = max(4, math.ceil(CELLS_PER_PERIOD * geometry.contact_length / shortest))
        half1 = math.pi * geometry.ridges / cells
        half2 = math.pi * geometry.texture_periods / cells
        angle1 = angles_of_centres(geometry.ridges, cells) + geometry.ridge_phase
        angle2 = angles_of_centres(geometry.texture_periods, cells) + geometry.texture_phase
        tables = np.stack(
            [
                -b1 * np.cos(angle1),
                b1 * half1 * np.sin(angle1),
                b2 * np.cos(angle2),
                -b2 * half2 * np.sin(angle2),
                b2 * np.sin(angle2),
                b2 * half2 * np.cos(angle2),
            ]
        )
        return cls(tables, half1 * half1 if b1 else 0.0, half2 * half2 if b2 else 0.0, b2, scale)


def angles_of_centres(periods: float, cells: int) -> Array:
    """Return the angle (rad) at the centre of each of `cells` equal parts of `periods` periods.

    Whole turns are subtracted as integers: in floating point their rounding would be 1e-11 of a turn after 1e5 periods.
    """
    whole = math.floor(periods)
    odd = 2 * np.arange(cells, dtype=np.int64) + 1
    turns = (whole % (2 * cells) * odd % (2 * cells) + (periods - whole) * odd) / (2 * cells)
    return np.asarray(2.0 * math.pi * (turns % 1.0))


@inlined
def first_guess(guess, height, i, otherwise):
    """Return the starting value of Newton's method at phase `i`: the guess, or a cubic through the preceding phases."""
    if len(guess) > 0:
        return guess[i]
    if i >= 4:
        return 4.0 * (height[i - 1] + height[i - 3]) - 6.0 * height[i - 2] - height[i - 4]
    return height[i - 1] if i >= 1 else otherwise


@kernel
def solve_phases(tables, k1, k2, phases, targets, guess, height, touching, iterations):
    """Write z / (a1 + a2), the touching part of L and the number of iterations at each phase.

    tables: those of `Grid`, here and in the kernels below.
    targets: w / k / (a1 + a2), one per phase, or one for all.
    """
    work = np.empty((5, tables.shape[1]))
    scratch = np.empty((2, 64))
    lowest = 0.0
    for i in range(len(phases)):
        target = targets[i] if len(targets) > 1 else targets[0]
        turn = phases[i] - math.floor(phases[i])
        mean = fill_cells(tables, k1, k2, math.cos(2.0 * math.pi * turn), math.sin(2.0 * math.pi * turn), work)
        lowest = mean - target
        begin = first_guess(guess, height, i, lowest)
        if target < SMALLEST_INDENTATION:
            z, part, iterations[i] = highest_point(tables, k1, k2, work), 0.0, 1
        else:
            z, part, iterations[i] = newton(work, tables, k1, k2, target, max(begin, lowest), lowest, scratch)
        height[i] = z
        touching[i] = part


@inner
def highest_point(tables, k1, k2, work):
    """Return the largest h over the contact length; work: as filled by `fill_cells`."""
    top = -2.0
    for i in range(tables.shape[1]):
        top = max(top, work[1, i])
    for i in range(tables.shape[1]):
        if work[0, i] <= top:
            continue
        cell = (tables[0, i], tables[1, i], k1, work[3, i], work[4, i], k2, 0.0)
        best, high = -1.0, profile(cell, -1.0)[0]
        for j in range(1, 17):
            y = profile(cell, -1.0 + 0.125 * j)[0]
            if y > high:
                best, high = -1.0 + 0.125 * j, y
        t = best
        for _ in range(6):
            _y, slope, curvature, _area = profile(cell, t)
            if curvature < 0.0:
                t = min(max(t - slope / curvature, max(best - 0.125, -1.0)), min(best + 0.125, 1.0))
        top = max(top, high, profile(cell, t)[0])
    return top


@kernel
def measure_phases(tables, k1, k2, phases, heights, depth, touching):
    """Write F(z) / (a1 + a2) and the touching part of L at each phase and each of its z / (a1 + a2)."""
    work = np.empty((5, tables.shape[1]))
    scratch = np.empty((2, 64))
    for i in range(len(phases)):
        turn = phases[i] - math.floor(phases[i])
        fill_cells(tables, k1, k2, math.cos(2.0 * math.pi * turn), math.sin(2.0 * math.pi * turn), work)
        for j in range(heights.shape[1]):
            depth[i, j], touching[i, j], _bend = contact_sum(work, tables, k1, k2, heights[i, j], scratch)


@inner
def fill_cells(tables, k1, k2, cosine, sine, work):
    """Write height bounds, mean height, and the texture's height and slope of every cell; return the mean of h over L.

    work: the rows are upper bound of h, lower bound of h, mean of h, texture height, texture slope.
    """
    cells = tables.shape[1]
    mean1 = 1.0 + k1 * (-1.0 / 6.0 + k1 * (1.0 / 120.0 + k1 * (-1.0 / 5040.0 + k1 * (1.0 / 362880.0))))
    mean2 = 1.0 + k2 * (-1.0 / 6.0 + k2 * (1.0 / 120.0 + k2 * (-1.0 / 5040.0 + k2 * (1.0 / 362880.0))))
    for i in range(cells):
        height = tables[2, i] * cosine + tables[4, i] * sine
        slope = tables[3, i] * cosine + tables[5, i] * sine
        centre = height + tables[0, i]
        bend = 0.52 * (k1 * abs(tables[0, i]) + k2 * abs(height)) + 0.2 * (k1 * abs(tables[1, i]) + k2 * abs(slope))
        reach = abs(slope + tables[1, i]) + bend
        work[0, i] = centre + reach
        work[1, i] = centre - reach
        work[2, i] = mean1 * tables[0, i] + mean2 * height
        work[3, i] = height
        work[4, i] = slope
    total = 0.0
    for i in range(cells):
        total += work[2, i]
    return total / cells


@inlined
def bounds_of_cell(u1, v1, k1, u2, v2, k2):
    """Return bounds of the second and third derivative of h over a cell.

    With h1'' = -k1 h1 and h2'' = -k2 h2, h'' = -k1 h - (k2 - k1) h2. Where two surfaces of nearly equal period cancel,
    h is far flatter than either. These bounds reflect that. With cruder bounds such a cell is halved again and again.
    """
    apart, slope = abs(k2 - k1), abs(v1 + v2)
    bound2 = k1 * (abs(u1) + abs(v1)) + k2 * (abs(u2) + abs(v2))
    bound2 = min(bound2, 1.03 * (k1 * (abs(u1 + u2) + slope) + apart * (abs(u2) + abs(v2))))
    bound3 = k1 * (abs(v1) + k1 * abs(u1)) + k2 * (abs(v2) + k2 * abs(u2))
    return bound2, min(bound3, k1 * (slope + bound2) + apart * (abs(v2) + k2 * abs(u2)))


@inner
def contact_sum(work, tables, k1, k2, z, scratch):
    """Return F(z), the touching part of L, and F''(z), all relative to L and a1 + a2."""
    cells = tables.shape[1]
    full = 0.0
    touching = 0
    area = 0.0
    length = 0.0
    edges = 0.0
    for i in range(cells):
        if work[0, i] <= z:
            continue
        if work[1, i] >= z:
            full += work[2, i] - z
            touching += 1
            continue
        u1, v1, u2, v2 = tables[0, i], tables[1, i], work[3, i], work[4, i]
        bound2, bound3 = bounds_of_cell(u1, v1, k1, u2, v2, k2)
        cell = (u1, v1, k1, u2, v2, k2, z)
        part, width, edge = touching_part(cell, bound2, bound3, scratch)
        area += part
        length += width
        edges += edge
    half = 0.5 / cells
    return full / cells + area * half, touching / cells + length * half, edges * half


@inner
def newton(work, tables, k1, k2, target, z, lowest, scratch):
    """Return z, the touching part of L at z, and the number of iterations; requires F(`lowest`) >= target."""
    highest = 2.0
    part = 0.0
    for iteration in range(1, MOST_ITERATIONS + 1):
        total, part, bend = contact_sum(work, tables, k1, k2, z, scratch)
        excess = total - target
        if excess >= 0.0:
            lowest = max(lowest, z)
        else:
            highest = min(highest, z)
        if part <= 0.0:
            z = 0.5 * (lowest + highest)
            continue
        step = excess / part
        crowding = bend / part
        curved = step * (1.0 + min(max(0.5 * crowding * step, -0.5), 0.5))
        if (crowding * curved) ** 2 * abs(curved) <= 1e-17 or abs(curved) <= 2e-16:
            return z + curved, max(part - bend * curved, 0.0), iteration
        z = z + (curved if abs(crowding * step) < 0.5 else step)
        if not lowest <= z <= highest:
            z = 0.5 * (lowest + highest) if highest < 2.0 else lowest
        if highest - lowest <= 4e-16:
            return z, part, iteration
    return z, part, MOST_ITERATIONS
