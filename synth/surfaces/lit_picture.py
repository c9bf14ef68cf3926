"""The picture of a surface: a square of it from above, lit from the side.

Stage   SURFACES, for display only.
Model   Lambert's law: the brightness of a point is the cosine of the angle between its normal and the light, which
        comes from the left at 45 degrees. A pixel is the mean over SAMPLES slopes along the scan. The slopes of real
        surfaces differ by a factor of a thousand. They are therefore scaled from their rms slope s to an rms slope of
        LEVEL (s / LEVEL)^COMPRESSION, so a steeper surface still looks steeper.
Limits  Slopes are not to scale, and no shadow is cast. If a surface varies along the scan only, its rows are equal. If
        it varies across too, a row of pixels shows the line in the middle of the row.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from synth.surfaces.height_field import HeightField
from synth.surfaces.profile import Profile

SIDE = 5e-3  # m, side of the square: seven threads of linen, two wales of 14-wale corduroy, but not one of 4-wale
PIXELS = 240  # per side: 21 um each, a third of the finest waves of the catalogue; twice as many would double the file
SAMPLES = 8  # slopes per pixel; with fewer, surfaces finer than a pixel show false stripes
LEVEL, COMPRESSION = 0.6, 0.3  # chosen by eye: polished metal is still visible, and threads keep shades of grey

Picture = np.ndarray[Any, np.dtype[np.uint8]]


def lit_picture(profile: Profile) -> Picture:
    """Return the brightness of SIDE x SIDE of `profile`, uint8 [PIXELS, PIXELS]; columns lie along the scan."""
    places = np.linspace(0.0, SIDE, PIXELS * SAMPLES + 1)
    if isinstance(profile, HeightField):
        heights = profile.area(places, np.asarray((np.arange(PIXELS) + 0.5) * (SIDE / PIXELS), np.float64))
    else:
        heights = profile.heights(places)[np.newaxis]
    slopes = np.diff(heights, axis=1) / np.diff(places)
    steepness = profile.rms[1]
    if steepness > 0.0:
        slopes *= LEVEL / steepness * (steepness / LEVEL) ** COMPRESSION
    towards = (1.0 + slopes) / (math.sqrt(2.0) * np.sqrt(1.0 + slopes**2))  # slopes that rise to the right are brighter
    pixels = np.maximum(towards, 0.0).reshape(-1, PIXELS, SAMPLES).mean(axis=2)
    return np.broadcast_to(np.rint(255.0 * pixels).astype(np.uint8), (PIXELS, PIXELS))
