"""The footprint of a fingertip on a flat plate: an oval whose size follows from one load.

Stage   CONTACT.
Model   The fingertip is a paraboloid with ridges. Its radii follow from the length and the width of the footprint at
        REFERENCE_LOAD: there the outermost crests touch. Twice these lengths bound the fingertip, which a load of 5 N
        does not reach.
Source  Fagiani & Barbieri (2016), eqs 4, 5; Johnson, Contact Mechanics (1985), sec. 4.3, for a paraboloid on an elastic
        foundation. The radii are this project's.
Limits  The mean over the oval takes a ridge for a cosine, in closed form.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from synth.arrays import Array
from synth.contact.stiffness import Stiffness
from synth.surfaces.ridge_field import turned_back

REFERENCE_LOAD = 1.0  # N: the load of the nominal footprint (the paper takes 1 cm^2 for 1 N); an unverified default
REACH = 2.0  # the oval in which the fingertip may touch, relative to the nominal footprint


@dataclass(frozen=True, slots=True)
class Footprint:
    """The fingertip on a flat plate at 1 N.

    length, width: along and across the scan, m.
    depth: height of the paraboloid between its top and the edge of the footprint, m.
    """

    length: float
    width: float
    depth: float

    @property
    def reach(self) -> tuple[float, float]:
        """Length and width (m) of the region in which the fingertip may touch."""
        return REACH * self.length, REACH * self.width

    @classmethod
    def of(cls, length: float, width: float, ridge_amplitude: float, stiffness: Stiffness) -> Footprint:
        """Return the footprint of `length` and `width` (m); stiffness: on a flat plate, at `length`."""
        wanted = 4.0 / math.pi * stiffness.indentation(REFERENCE_LOAD)  # mean of max(h - z, 0) over the oval, m
        low, high = 0.0, 2.0 * wanted + 2.0 * ridge_amplitude
        for _ in range(100):  # bisection: the mean rises with the depth
            depth = 0.5 * (low + high)
            low, high = (depth, high) if _mean_above(depth, ridge_amplitude) < wanted else (low, depth)
        return cls(length, width, 0.5 * (low + high))

    def drop(self, x: Array, y: Array, direction: float = 0.0) -> Array:
        """Return how far the paraboloid lies below its top (m) at every pair of `x` and `y` (m): [columns, rows].

        direction: angle by which the fingertip is turned about its middle, rad.
        """
        along, across = turned_back(x, y, direction)
        return np.asarray(self.depth * ((2.0 * along / self.length) ** 2 + (2.0 * across / self.width) ** 2))


def _mean_above(depth: float, amplitude: float) -> float:
    """Return the mean over the oval of the heights above a plate that only the crests at its edge touch (m).

    depth: of the paraboloid at the edge, m.
    amplitude: of the ridges, m.
    Equal areas of a paraboloid have equal drops, so a place at the angle u of its ridge contributes
    max(depth - amplitude (1 - cos u), 0)^2 / (2 depth). Its mean over u is a closed form.
    """
    angle = math.pi if depth >= 2.0 * amplitude else math.acos(1.0 - depth / amplitude)
    over = depth - amplitude
    total = (over**2 + 0.5 * amplitude**2) * angle
    total += 2.0 * over * amplitude * math.sin(angle) + 0.25 * amplitude**2 * math.sin(2.0 * angle)
    return total / (2.0 * math.pi * depth)
