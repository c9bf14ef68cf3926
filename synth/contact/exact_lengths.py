"""z at many places whose contacts are of many lengths: each laid out and solved by itself, in one compiled loop.

Model   the cells of `exact_solver.Grid` over x0 <= x <= x0 + L, x0 = (L0 - L) / 2, ridges and texture staying where
        they are.
Source  `exact_solver`, whose kernel solves each place.
Limits  angles are those of x from the end of the nominal length, to 1e-16 of themselves: 1e-11 of a turn after 1e5
        periods. Laying out costs some five times what solving does.
"""

from __future__ import annotations

import math

import numpy as np

from synth.arrays import Array
from synth.contact.exact_solver import CELLS_PER_PERIOD, solve_phases
from synth.contact.geometry import Geometry
from synth.kernels import kernel

LAYING_OUT = 6  # cells of the solver that a cell laid out and solved costs


def heights_over(geometry: Geometry, phases: Array, lengths: Array, indentations: Array) -> Array:
    """Return z (m) at each of `phases` (turns), with lengths (m) about the middle of `geometry`, and w / k (m)."""
    scale = geometry.height_scale
    b1, b2 = geometry.ridge_amplitude / scale, geometry.texture_amplitude / scale
    shortest = min(geometry.ridge_period if b1 > 0.0 else math.inf, geometry.texture_period if b2 > 0.0 else math.inf)
    waves = np.array([b1, 2.0 * math.pi / geometry.ridge_period, geometry.ridge_phase,
                      b2, 2.0 * math.pi / geometry.texture_period, geometry.texture_phase])  # fmt: skip
    heights = np.empty(len(phases))
    density = CELLS_PER_PERIOD / shortest
    solve_lengths(waves, geometry.contact_length, density, phases, lengths, indentations / scale, heights)
    return heights * scale


@kernel
def solve_lengths(waves, nominal, density, phases, lengths, targets, heights):
    """Write z / (a1 + a2) at each phase, length and w / k / (a1 + a2).

    waves: of finger and texture, relative amplitude, radians a metre, phase. density: cells a metre.
    """
    room = max(4, math.ceil(density * np.max(lengths)))
    buffer = np.empty(6 * room)
    touching, iterations, guess = np.empty(1), np.empty(1, dtype=np.int64), np.empty(0)
    for i in range(len(phases)):
        cells = max(4, math.ceil(density * lengths[i]))
        half = 0.5 * lengths[i] / cells
        tables = buffer[: 6 * cells].reshape((6, cells))
        begin = 0.5 * (nominal - lengths[i])
        for j in range(cells):
            x = begin + (2 * j + 1) * half
            ridge, texture = waves[1] * x + waves[2], waves[4] * x + waves[5]
            cosine, sine = math.cos(texture), math.sin(texture)
            tables[0, j], tables[1, j] = -waves[0] * math.cos(ridge), waves[0] * waves[1] * half * math.sin(ridge)
            tables[2, j], tables[3, j] = waves[3] * cosine, -waves[3] * waves[4] * half * sine
            tables[4, j], tables[5, j] = waves[3] * sine, waves[3] * waves[4] * half * cosine
        k1 = (waves[1] * half) ** 2 if waves[0] > 0.0 else 0.0
        k2 = (waves[4] * half) ** 2 if waves[3] > 0.0 else 0.0
        here = slice(i, i + 1)
        solve_phases(tables, k1, k2, phases[here], targets[here], guess, heights[here], touching, iterations)
        guess = heights[here]
