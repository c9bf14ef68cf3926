"""z of eq. 1 for a texture of any kind, by quadrature on its true heights.

Model   The heights of texture and finger at POINTS places of the contact, a trapezoid rule for the mean of
        max(h - z, 0), and z from the heights above it. Only the heights are shared with the engine.
Limits  2e-4 of the peak-to-peak for usual scenes (twice the points change z by no more than that).
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from tests.reference.shaped_contact_oracle import smooth_half_length
from tests.reference.stiffness_oracle import Touch, stiffness

POINTS = 20_000
TABLED = 1 << 17  # places of a period: read linearly, they change z of the surfaces that tests draw by 1e-6
DOMED_POINTS = 160_000  # over all that a round finger may touch: 1e-5 of the peak-to-peak


class Tabled:
    """A periodic profile whose heights are read linearly between TABLED equal places, for thousands of phases."""

    def __init__(self, profile: Any) -> None:
        self.period: float = profile.period
        self._heights = profile.heights(np.arange(TABLED + 1) * (self.period / TABLED))

    def heights(self, places: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Return the heights (m) at `places` (m)."""
        at = places * (TABLED / self.period)
        before = np.floor(at)
        number = before.astype(np.int64) & (TABLED - 1)
        lower = self._heights[number]
        return np.asarray(lower + (at - before) * (self._heights[number + 1] - lower))


def approach(finger: Any, profile: Any, turns: npt.NDArray[np.float64], indentation: float) -> npt.NDArray[np.float64]:
    """Return z (m) at each place of the texture (turns of its period).

    finger, profile: of a scene.
    indentation: w / k, m.
    """
    x = np.linspace(0.0, finger.contact_length, POINTS + 1)
    ridges = finger.ridge_amplitude * np.cos(2.0 * math.pi * x / finger.ridge_period)
    found, z = np.empty(len(turns)), -math.inf
    for number, turn in enumerate(turns):
        z = found[number] = level(profile.heights(x - turn * profile.period) - ridges, indentation, z)
    return found


def domed_approach(
    finger: Any,
    profile: Any,
    turns: npt.NDArray[np.float64],
    load: float,
    touch: Touch,
    radius: float,
    points: int = DOMED_POINTS,
) -> npt.NDArray[np.float64]:
    """Return z (m) at each place under a round finger about the middle of the nominal contact.

    load: N.
    touch: the scene with the equivalent sinusoid as its texture; it determines the foundation.
    radius: m.
    points: over all that may touch.
    """
    b = smooth_half_length(touch, load, radius)
    target = 2.0 * b * load / stiffness(replace(touch, load=load, contact_length=2.0 * b)).k
    lowest, highest = profile.extent
    half = math.sqrt(2.0 * radius * (2.0 * finger.ridge_amplitude + highest - lowest) + b * b)
    off = np.linspace(-half, half, points + 1)
    x = 0.5 * finger.contact_length + off
    gap = finger.ridge_amplitude * np.cos(2.0 * math.pi * x / finger.ridge_period) + off**2 / (2.0 * radius)
    places = (x - turn * profile.period for turn in turns)
    return np.array([level(profile.heights(place) - gap, target / (2.0 * half)) for place in places])


def level(heights: npt.NDArray[np.float64], indentation: float, start: float = -math.inf) -> float:
    """Return the z at which the trapezoid mean of max(h - z, 0) is `indentation`, exactly.

    start: a z to begin with, near that of a similar contact; by default all heights are above it.
    Each step is Newton's, for the heights above the last z. The mean is convex in z: a step from a z that is too high
    ends below the root, and all others go up, until the same heights are above.
    """
    weights = np.full(len(heights), 1.0 / (len(heights) - 1))
    weights[[0, -1]] *= 0.5
    z, last = start, -1
    while True:
        above = heights > z
        count = int(np.count_nonzero(above))
        if count == last or (count == 0 and last > 0):
            return z
        if count == 0:  # the start is above all heights
            above, count = np.full(len(heights), True), len(heights)
        share = weights[above]
        z, last = float((np.dot(share, heights[above]) - indentation) / np.sum(share)), count
