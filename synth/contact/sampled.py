"""The approach z from a sampled profile: cheaper than the exact solver where the tolerance is loose.

Model   h of eq. 2 is sampled at equal steps and joined by straight lines. F(z), the mean of max(h - z, 0) of that
        polygon over L, is exact: of a piece from height p to q, with A = max(p - z, 0) and B = max(q - z, 0), the part
        s = min(1, (A + B) / |p - q|) lies above z, and holds the area s (A + B) / 2. F is convex and falls, F' is minus
        the part of L above z, and Newton's method from the neighbouring phases takes two to three steps.
Source  Fagiani & Barbieri (2016), eqs 1-2.
Limits  between two points a cosine bulges from its chord by (2 pi / n)^2 / 8 of its amplitude, n points a period; what
        is left of that in z is measured by who takes this solver (`choice`). Loads below w / k = 1e-12 (a1 + a2)
        are lost between two points.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from synth.arrays import Array
from synth.contact.exact import Approaches, angles_of_centres
from synth.contact.geometry import Geometry
from synth.kernels import kernel, summing

FEWEST_PIECES = 8  # in the contact, however short it is
SETTLED = 1e-13  # of a1 + a2 + |z|: a Newton step this small ends it; far smaller ones are rounding
MOST_STEPS = 60  # never reached in the suite; it bounds the time of a phase


@dataclass(frozen=True, slots=True)
class SampledGrid:
    """The points of one contact.

    tables: float64 [3, points], relative to a1 + a2: finger height, and texture height at phase 0 and a quarter period
    on. points_per_ridge: as asked for.
    """

    tables: Array
    height_scale: float
    points_per_ridge: float

    family = "sampled"

    @classmethod
    def of_geometry(cls, geometry: Geometry, points_per_ridge: float) -> SampledGrid:
        """Return the grid of `geometry`; at least one surface must have a height."""
        scale = geometry.height_scale
        pieces = max(FEWEST_PIECES, math.ceil(points_per_ridge * geometry.ridges))
        angle1 = angles_of_points(geometry.ridges, pieces) + geometry.ridge_phase
        angle2 = angles_of_points(geometry.texture_periods, pieces) + geometry.texture_phase
        b1, b2 = geometry.ridge_amplitude / scale, geometry.texture_amplitude / scale
        tables = np.stack([-b1 * np.cos(angle1), b2 * np.cos(angle2), b2 * np.sin(angle2)])
        return cls(tables, scale, points_per_ridge)

    @property
    def name(self) -> str:
        """What a report calls it."""
        return f"sampled, {self.points_per_ridge:g} points a ridge"

    @property
    def cells(self) -> int:
        """Pieces that a phase is solved on: the work of a phase."""
        return int(self.tables.shape[1]) - 1

    @property
    def nbytes(self) -> int:
        """Bytes that the grid holds."""
        return int(self.tables.nbytes)

    def solve(self, phases: Array, indentation: float | Array, guess: Array | None = None) -> Approaches:
        """See `PhaseSolver`; begins from the phases before."""
        count = len(phases)
        height, touching, iterations = np.empty(count), np.empty(count), np.zeros(count, dtype=np.int64)
        targets = np.atleast_1d(np.asarray(indentation, dtype=float)) / self.height_scale
        solve_sampled(self.tables, phases, targets, height, touching, iterations)
        return Approaches(height * self.height_scale, touching, iterations)


def angles_of_points(periods: float, pieces: int) -> Array:
    """Return the angle (rad) at the ends of `pieces` equal parts of `periods` periods: float64 [pieces + 1]."""
    ends = angles_of_centres(periods, pieces) + math.pi * periods / pieces
    return np.concatenate([[0.0], ends])


@kernel
def solve_sampled(tables, phases, targets, height, touching, iterations):
    """Write z / (a1 + a2), the part of L that touches, and the number of iterations at each phase."""
    points = tables.shape[1]
    profile = np.empty(points)
    steepness = np.empty(points - 1)
    for i in range(len(phases)):
        target = targets[i] if len(targets) > 1 else targets[0]
        turn = 2.0 * math.pi * (phases[i] - math.floor(phases[i]))
        mean, top = sample_profile(tables, math.cos(turn), math.sin(turn), profile, steepness)
        if i >= 4:
            z = 4.0 * (height[i - 1] + height[i - 3]) - 6.0 * height[i - 2] - height[i - 4]
        elif i >= 1:
            z = height[i - 1]
        else:
            z = mean - target
        z = max(z, mean - target)
        if z >= top:
            z = mean - target
        part, step = 1.0, 1.0
        low, high = mean - target, top
        for count in range(1, MOST_STEPS + 1):
            area, part = area_above(profile, steepness, z)
            iterations[i] = count
            if area >= target:
                low = z
            else:
                high = z
            if part <= 0.0:
                z = 0.5 * (low + high)
                continue
            step = (area - target) / part
            if not low <= z + step <= high:
                step = 0.5 * (low + high) - z
            z += step
            if min(abs(step), high - low) <= SETTLED * (1.0 + abs(z)):
                break
        height[i] = z
        touching[i] = part


@summing
def sample_profile(tables, cosine, sine, profile, steepness):
    """Write the heights at the points and 1 / |rise| of each piece; return mean and largest height."""
    for j in range(tables.shape[1]):
        profile[j] = tables[0, j] + (cosine * tables[1, j] + sine * tables[2, j])
    return measure_pieces(profile, steepness)


@summing
def measure_pieces(profile, steepness):
    """Write 1 / |rise| of each piece between the heights `profile`; return mean and largest height."""
    pieces = len(steepness)
    ahead = profile[1:]
    for j in range(pieces):
        steepness[j] = 1.0 / max(abs(ahead[j] - profile[j]), 1e-30)
    top = profile[0]
    for j in range(pieces):
        top = max(top, ahead[j])
    total = 0.0
    for j in range(pieces):
        total += profile[j] + ahead[j]
    return 0.5 * total / pieces, top


@summing
def area_above(profile, steepness, z):
    """Return the mean over L of max(h - z, 0) of the polygon, and the part of L where it is above z."""
    ahead = profile[1:]
    area, length = 0.0, 0.0
    for j in range(len(steepness)):
        both = max(profile[j] - z, 0.0) + max(ahead[j] - z, 0.0)
        part = min(1.0, both * steepness[j])
        area += part * both
        length += part
    return 0.5 * area / len(steepness), length / len(steepness)
