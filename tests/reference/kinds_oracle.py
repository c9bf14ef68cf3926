"""z of eq. 1 for a texture of any kind, by quadrature on its true heights.

Model   The heights of texture and finger at POINTS places of the contact, a trapezoid rule for the mean of
        max(h - z, 0), and z from the heights above it. Only the heights are shared with the engine.
Method  Compiled, without any part of the engine: 30 us for each place of a texture in a table.
Limits  2e-4 of the peak-to-peak for usual scenes (twice the points change z by no more than that).
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numba
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
        self.heights = profile.heights(np.arange(TABLED + 1) * (self.period / TABLED))

    def approach(self, finger: Any, turns: npt.NDArray[np.float64], indentation: float) -> npt.NDArray[np.float64]:
        """Return z (m) at each place of the texture; the arguments are those of the function `approach`."""
        x, ridges = comb(finger)
        return np.asarray(levels(self.heights, x * (TABLED / self.period), ridges, turns, indentation))


@numba.njit(cache=True)
def levels(table, places, ridges, turns, indentation):
    """Return z at phases in turns of a texture, whose `table` ends as it begins; places: in distances of its entries.

    One array holds the heights of every phase: to allocate one for each takes longer than to fill it.
    """
    found, heights, last, z = np.empty(len(turns)), np.empty(len(places)), len(table) - 2, -math.inf  # last: 2^n - 1
    for number in range(len(turns)):
        shift = turns[number] * (len(table) - 1)
        for i in range(len(places)):
            place = places[i] - shift
            before = math.floor(place)
            entry = int(before) & last
            heights[i] = table[entry] + (place - before) * (table[entry + 1] - table[entry]) - ridges[i]
        z = found[number] = level(heights, indentation, z)
    return found


def comb(finger: Any) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Return POINTS + 1 places along a finger of a scene, and its ridges there (m)."""
    x = np.linspace(0.0, finger.contact_length, POINTS + 1)
    return x, finger.ridge_amplitude * np.cos(2.0 * math.pi * x / finger.ridge_period)


def approach(finger: Any, profile: Any, turns: npt.NDArray[np.float64], indentation: float) -> npt.NDArray[np.float64]:
    """Return z (m) at each place of the texture (turns of its period).

    finger, profile: of a scene.
    indentation: w / k, m.
    """
    x, ridges = comb(finger)
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


@numba.njit(cache=True)
def level(heights, indentation, start=-math.inf):
    """Return the z at which the trapezoid mean of max(h - z, 0) is `indentation`, exactly.

    start: a z to begin with, near that of a similar contact; by default all heights are above it.
    Each step is Newton's, for the heights above the last z. The mean is convex in z: a step from a z that is too high
    ends below the root, and all others go up, until the same heights are above.
    """
    z, last = start, -1
    while True:
        total, share, count = above(heights, z)
        if count == last or (count == 0 and last > 0):
            return z
        if count == 0:  # the start is above all heights
            total, share, count = above(heights, -math.inf)
        z, last = (total - indentation * (len(heights) - 1)) / share, count


@numba.njit(cache=True, fastmath={"reassoc", "nsz", "contract"})
def above(heights, z):
    """Return the sum of the heights above z by the trapezoid rule, the sum of their weights, and their number."""
    total, count = 0.0, 0
    for i in range(len(heights)):
        touches = heights[i] > z
        total += heights[i] if touches else 0.0
        count += touches
    ends = 0.0
    for height in (heights[0], heights[-1]):
        if height > z:
            total -= 0.5 * height
            ends += 0.5
    return total, count - ends, count
