"""Roughness of a measured surface: Rq, Ra, peak to valley, and rms slopes.

Stage   SURFACES, from files.
Model   Rq and Ra are the root mean square and the mean absolute height about the mean of all points. For an area they
        are called Sq and Sa. The slopes are those between neighbouring points, along x and along y. Peak to valley is
        the largest less the smallest height.
Source  ISO 21920-2 and ISO 25178-2.
Limits  No filter is applied: waviness counts. A finer spacing shows steeper slopes.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from synth.surfaces.readers.surface_file import Heights


class Roughness(NamedTuple):
    """rq, ra, peak_to_valley: m. slopes: rms slope along x, then y."""

    rq: float
    ra: float
    peak_to_valley: float
    slopes: tuple[float, ...]


def roughness_of(heights: Heights, spacing: tuple[float, ...]) -> Roughness:
    """Return the roughness of `heights` (m), [n] or [rows, columns]. spacing: m, between columns, then rows."""
    about_mean = heights - np.mean(heights)
    slopes = tuple(
        math.sqrt(float(np.mean((np.diff(heights, axis=axis) / step) ** 2)))
        for axis, step in zip((-1, 0)[: heights.ndim], spacing, strict=True)
    )
    return Roughness(
        math.sqrt(float(np.mean(about_mean**2))),
        float(np.mean(np.abs(about_mean))),
        float(np.ptp(heights)),
        slopes,
    )
