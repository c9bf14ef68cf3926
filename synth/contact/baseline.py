"""The approach z as one would write it from the paper: a trapezoid rule and SciPy's `brentq`, a phase at a time.

Model   integral over [0, L] of max(h - z, 0) dx = w L / k of eq. 1 on equally spaced points, a root of a function of z.
Source  Fagiani & Barbieri (2016), eqs 1-5.
Limits  for the report of what accuracy costs, and for nothing else: on the default scene about 0.2 ms a
        phase at 100 points a ridge, off by 2e-3 of the motion, and 20 ms at 6000, off by 4e-7 (tests/bench).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from synth.arrays import Array
from synth.contact.exact import Approaches
from synth.contact.geometry import Geometry


@dataclass(frozen=True, slots=True)
class BrentqGrid:
    """Points on the contact of one geometry: x and the finger's heights (m)."""

    geometry: Geometry
    places: Array
    finger: Array
    points_per_ridge: float

    family = "baseline"

    @classmethod
    def of_geometry(cls, geometry: Geometry, points_per_ridge: float) -> BrentqGrid:
        """Return the grid of `geometry`."""
        points = max(8, math.ceil(points_per_ridge * geometry.ridges)) + 1
        x = np.linspace(0.0, geometry.contact_length, points)
        finger = -geometry.ridge_amplitude * np.cos(2.0 * np.pi * x / geometry.ridge_period + geometry.ridge_phase)
        return cls(geometry, x, finger, points_per_ridge)

    @property
    def name(self) -> str:
        """What a report calls it."""
        return f"brentq, {self.points_per_ridge:g} points a ridge"

    @property
    def cells(self) -> int:
        """Pieces that a phase is solved on."""
        return len(self.places) - 1

    @property
    def nbytes(self) -> int:
        """Bytes that the grid holds."""
        return int(self.places.nbytes + self.finger.nbytes)

    def solve(self, phases: Array, indentation: float | Array, guess: Array | None = None) -> Approaches:
        """See `PhaseSolver`; begins afresh."""
        targets = np.broadcast_to(indentation, len(phases))
        solved = [self._solved(float(phase), float(target)) for phase, target in zip(phases, targets, strict=True)]
        height, touching, iterations = (np.array(column) for column in zip(*solved, strict=True))
        return Approaches(height, touching, iterations.astype(np.int64))

    def _solved(self, phase: float, target: float) -> tuple[float, float, int]:
        from scipy.optimize import brentq

        geometry, length = self.geometry, self.geometry.contact_length
        angle = 2.0 * np.pi * (self.places / geometry.texture_period - phase) + geometry.texture_phase
        height = geometry.texture_amplitude * np.cos(angle) + self.finger

        def excess(z: float) -> float:
            return float(np.trapezoid(np.maximum(height - z, 0.0), self.places)) / length - target

        lowest = float(height.min()) - target - 1e-6 * geometry.height_scale
        resolution = 4.0 * np.finfo(float).eps
        z, found = brentq(
            excess, lowest, float(height.max()), xtol=1e-15 * geometry.height_scale, rtol=resolution, full_output=True
        )
        return z, float(np.mean(height > z)), found.iterations
