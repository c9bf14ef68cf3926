"""The roots of the trapezoid rule of `baseline`, found fast, so that a report can measure what the rule errs by.

Model   The trapezoid of max(h - z, 0) is convex, falls, and is straight between the heights of its points, so Newton's
        method ends at its root to round-off. `brentq` ends at the same root; a test holds them together.
Source  Fagiani & Barbieri (2016), eqs 1-2; Michelot (1986).
Limits  for errors only: the report takes the time of the baseline from `brentq`.
"""

from __future__ import annotations

import math

import numpy as np

from synth.arrays import Array
from synth.contact.baseline import BrentqGrid
from synth.kernels import kernel, summing

MOST_STEPS = 100  # never reached in the suite; it bounds the time of a phase
SETTLED = 1e-15  # of a1 + a2: a Newton step this small is rounding


def trapezoid_heights(grid: BrentqGrid, phases: Array, indentation: float) -> Array:
    """Return z (m) at `phases` (turns), the root that `grid.solve` finds. indentation: w / k (m)."""
    geometry = grid.geometry
    angle = 2.0 * np.pi * grid.places / geometry.texture_period + geometry.texture_phase
    texture = geometry.texture_amplitude
    tables = np.stack([grid.finger, texture * np.cos(angle), texture * np.sin(angle)]) / geometry.height_scale
    heights = np.empty(len(phases))
    solve_trapezoid(tables, phases, indentation / geometry.height_scale, heights)
    return heights * geometry.height_scale


@kernel
def solve_trapezoid(tables, phases, target, heights):
    """Write the root z / (a1 + a2) at each phase."""
    points = tables.shape[1]
    profile = np.empty(points)
    for i in range(len(phases)):
        turn = 2.0 * math.pi * (phases[i] - math.floor(phases[i]))
        cosine, sine = math.cos(turn), math.sin(turn)
        lowest = math.inf
        for j in range(points):
            profile[j] = tables[0, j] + (cosine * tables[1, j] + sine * tables[2, j])
            lowest = min(lowest, profile[j])
        z = heights[i - 1] if i > 0 else lowest - target
        for _ in range(MOST_STEPS):
            area, part = trapezoid_above(profile, z)
            if part <= 0.0:
                z = lowest - target
                continue
            step = (area - target) / part
            z += step
            if abs(step) <= SETTLED:
                break
        heights[i] = z


@summing
def trapezoid_above(profile, z):
    """Return the trapezoid of max(h - z, 0) over L, divided by L, and minus its derivative."""
    area, part = 0.0, 0.0
    for j in range(len(profile)):
        area += max(profile[j] - z, 0.0)
        part += 1.0 if profile[j] > z else 0.0
    for j in (0, len(profile) - 1):
        area -= 0.5 * max(profile[j] - z, 0.0)
        part -= 0.5 if profile[j] > z else 0.0
    return area / (len(profile) - 1), part / (len(profile) - 1)
