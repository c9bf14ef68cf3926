"""A periodic profile as a polyline: equal segments, whose knots the solver of `profile_solver` reads.

Model   The polyline is the projection of the profile onto all polylines of its knots, in least squares: between hats
        phi_j, the heights H_j solve sum_k <phi_j, phi_k> H_k = <phi_j, h>. So areas over a segment and its neighbours
        are kept: where the profile is smooth they err by the fourth power of the segment, where it has a corner that
        is on no knot the errors of the segments round it cancel. Chords would lie below every crest, by the square.
Source  de Boor (2001), A Practical Guide to Splines, least-squares approximation by linear splines.
Limits  a profile that is linear between knots is reproduced to round-off. What is left elsewhere is measured, as the
        change that segments of half the length make (`spectrum`). Features far shorter than a segment are averaged.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from synth.arrays import Array
from synth.surfaces.profile import Profile

FEWEST_SEGMENTS = 64  # a period: a texture of a few ridges shows its shape
MOST_SEGMENTS = 1 << 16  # a period, to begin with; finer ones are laid out where the measured error asks for them
BULGE = 2e-3  # of a1 + a2: how far the first polyline may lie from its profile where its curvature is known
NODES, WEIGHTS = (0.5 - 0.5 * math.sqrt(0.6), 0.5, 0.5 + 0.5 * math.sqrt(0.6)), (5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0)
"""Gauss's rule of three nodes on 0..1: exact for what is a parabola times a hat."""
PARTS = 4  # of a segment between corners, each with its own nodes


@lru_cache(maxsize=4)  # a contact that grows is laid out anew at each load, on the same polyline
def knots_of(profile: Profile, segments: int) -> tuple[Array, float]:
    """Return the heights (m) at `segments` knots, equally spaced over a period, and the place (m) of the first.

    The first knot is on the first corner of the profile, where it has any: equally spaced corners are all on knots
    where `segments` is a multiple of their number.
    """
    first = float(profile.corners[0]) if len(profile.corners) else 0.0
    step = profile.period / segments
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
    """Return how many segments a period to begin with.

    ridge_period: of the finger (m). scale: a1 + a2 (m). points_a_ridge: segments a ridge of the finger at least.
    """
    least = max(FEWEST_SEGMENTS, math.ceil(points_a_ridge * profile.period / ridge_period))
    bend = profile.curvature_bound
    if math.isfinite(bend) and bend > 0.0:
        least = max(least, math.ceil(profile.period * math.sqrt(bend / (12.0 * BULGE * scale))))
    corners = len(profile.corners)
    least = min(least, max(MOST_SEGMENTS, corners))
    return math.ceil(least / corners) * corners if evenly_spaced(profile) else least


def evenly_spaced(profile: Profile) -> bool:
    """Return whether the corners of `profile` divide its period into equal parts."""
    corners = len(profile.corners)
    if corners == 0:
        return False
    turns = np.sort((profile.corners - profile.corners[0]) % profile.period) * (corners / profile.period)
    return bool(np.max(np.abs(turns - np.arange(corners))) < 1e-6)
