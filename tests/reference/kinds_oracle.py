"""z of eq. 1 for a texture of any kind, by quadrature on its true heights.

Model   the heights of texture and finger at POINTS places of the contact, a trapezoid rule for the mean of
        max(h - z, 0), and a bracketed root search for z. Nothing is shared with the engine but the heights.
Limits  2e-4 of the peak-to-peak for everyday scenes (the same with twice the points, to that).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

POINTS = 20_000


def approach(finger: Any, profile: Any, turns: npt.NDArray[np.float64], indentation: float) -> npt.NDArray[np.float64]:
    """Return z (m) at each place of the texture (turns of its period).

    finger, profile: of a scene. indentation: w / k in metres.
    """
    x = np.linspace(0.0, finger.contact_length, POINTS + 1)
    ridges = finger.ridge_amplitude * np.cos(2.0 * math.pi * x / finger.ridge_period)
    return np.array([level(profile.heights(x - turn * profile.period) - ridges, indentation) for turn in turns])


def level(heights: npt.NDArray[np.float64], indentation: float) -> float:
    """Return z where the trapezoid mean of max(h - z, 0) is `indentation`, from the sorted heights, exactly."""
    weights = np.ones(len(heights))
    weights[[0, -1]] = 0.5
    order = np.argsort(heights)[::-1]
    h, w = heights[order], weights[order] / (len(heights) - 1)
    length, moment = np.cumsum(w), np.cumsum(w * h)
    above = moment - length * h  # the mean of max(h - h_i, 0)
    count = max(1, int(np.searchsorted(above, indentation)))
    return float((moment[count - 1] - indentation) / length[count - 1])
