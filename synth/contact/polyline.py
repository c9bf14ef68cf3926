"""A periodic profile as a polyline of equal segments, for `profile_solver`.

Model   The polyline is the least-squares projection of the profile h onto the polylines with these knots. With hat
        functions phi_j at the knots, the heights H_j solve sum_k <phi_j, phi_k> H_k = <phi_j, h>. The projection
        keeps the area over a segment and its neighbours. Where the profile is smooth, areas err by the fourth power of
        the segment. Round a corner between knots, the errors of the neighbouring segments cancel. Chords would
        lie below every crest, with an error of second order.
Source  de Boor (2001), A Practical Guide to Splines, least-squares approximation by linear splines.
Limits  A profile that is linear between knots is reproduced to round-off. The error elsewhere is measured as the
        change when the segments are halved (`spectrum`). Features far shorter than a segment are averaged.
"""

from __future__ import annotations

import math

import numpy as np

from synth.arrays import Array
from synth.response_cache import kept
from synth.surfaces.profile import Profile

FEWEST_SEGMENTS = 64  # per period: enough to show the shape of a texture of a few ridges
MOST_SEGMENTS = 1 << 16  # per period, to begin with; the measured error may require finer ones
BULGE = 2e-3  # of a1 + a2: largest distance of the first polyline from a profile of known curvature
NODES, WEIGHTS = (0.5 - 0.5 * math.sqrt(0.6), 0.5, 0.5 + 0.5 * math.sqrt(0.6)), (5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0)
"""Gauss's rule of three nodes on 0..1: exact for a parabola times a hat function."""
PARTS = 4  # per segment, each with its own nodes


@kept  # a growing contact has a new solver at each load, on the same polyline
def knots_of(profile: Profile, segments: int) -> tuple[Array, float]:
    """Return the heights (m) at `segments` equally spaced knots over a period, and the place (m) of the first knot.

    The first knot lies on the first corner of the profile, if it has corners. Equally spaced corners all lie on knots
    where `segments` is a multiple of their number.
    """
    first = float(profile.corners[0]) if len(profile.corners) else 0.0
    step = profile.period / segments
    if profile.straight and evenly_spaced(profile) and segments % len(profile.corners) == 0:  # it is the polyline
        exact = profile.heights(np.asarray(first + step * np.arange(segments)))
        exact.flags.writeable = False
        return exact, first
    breaks = np.arange(segments * PARTS + 1) / PARTS
    inside = np.sort(((profile.corners - first) / step) % segments)
    inside = inside[np.abs(inside - np.round(inside * PARTS) / PARTS) > 1e-9]
    if len(inside):
        breaks = np.sort(np.concatenate([breaks, inside]))
    widths = np.diff(breaks)
    middles = 0.5 * (breaks[1:] + breaks[:-1])
    segment = np.minimum(middles.astype(np.int64), segments - 1)
    left, right = np.zeros(segments), np.zeros(segments)
    for node, weight in zip(NODES, WEIGHTS, strict=True):
        place = breaks[:-1] + node * widths
        share = weight * widths * profile.heights(first + step * place)
        ahead = place - segment
        left += np.bincount(segment, share * (1.0 - ahead), segments)
        right += np.bincount(segment, share * ahead, segments)
    products = left + np.roll(right, 1)
    turns = np.arange(segments // 2 + 1) / segments
    gram = (2.0 + np.cos(2.0 * math.pi * turns)) / 3.0
    heights = np.fft.irfft(np.fft.rfft(products) / gram, segments)
    heights.flags.writeable = False
    return heights, first


def first_segments(profile: Profile, ridge_period: float, scale: float, points_a_ridge: int) -> int:
    """Return the initial number of segments per period.

    ridge_period: of the finger, m.
    scale: a1 + a2, m.
    points_a_ridge: least number of segments per finger ridge.
    """
    least = max(FEWEST_SEGMENTS, math.ceil(points_a_ridge * profile.period / ridge_period))
    bend = profile.curvature_bound
    if math.isfinite(bend) and bend > 0.0:
        least = max(least, math.ceil(profile.period * math.sqrt(bend / (12.0 * BULGE * scale))))
    corners = len(profile.corners)
    least = min(least, max(MOST_SEGMENTS, corners))
    return math.ceil(least / corners) * corners if evenly_spaced(profile) else least


@kept  # a long profile has many corners
def evenly_spaced(profile: Profile) -> bool:
    """Return whether the corners of `profile` divide its period into equal parts."""
    corners = len(profile.corners)
    if corners == 0:
        return False
    turns = (profile.corners - profile.corners[0]) * (corners / profile.period)
    return bool(np.max(np.abs(turns - np.arange(corners))) < 1e-6)
