"""Places along a texture at which eq. 1 under a fingertip is summed: the nodes of a quadrature over a period.

Model   A period is divided into pieces. A piece that rises by more than asked, or has one of few corners within, is
        divided at the corner that is nearest to its middle, or at its middle. Each piece has the two nodes of Gauss's
        rule. So the nodes follow the edges of a texture, however steep, and are far apart where it is flat.
Source  Gauss-Legendre quadrature. The division is this project's.
Limits  A rise within a piece is seen at its corners and at LOOKS places.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from synth.arrays import Array
from synth.surfaces.profile import Profile

LOOKS = 9  # places of a piece at which its rise is looked at
MOST_HALVINGS = 40  # never reached: a piece of 1 m is then as long as an atom
GAUSS = 0.5 / math.sqrt(3.0)  # of the length of a piece, from its middle


@dataclass(frozen=True, slots=True)
class TextureNodes:
    """Nodes over one period.

    places: m, rising.
    weights: length that each node stands for, m.
    heights: of the texture, m.
    slopes: dh/dx.
    """

    places: Array
    weights: Array
    heights: Array
    slopes: Array


def texture_nodes(texture: Profile, length: float, rise: float) -> TextureNodes:
    """Return the nodes of `texture`: pieces of at most `length` (m) in which it rises by at most `rise` (m)."""
    ends = pieces(texture, length, rise)
    begins, lengths = ends[:-1], np.diff(ends)
    middles, apart = begins + 0.5 * lengths, GAUSS * lengths
    places = np.stack([middles - apart, middles + apart], axis=1)
    heights = texture.heights(places)
    near = texture.heights(np.stack([begins + 1e-9 * lengths, ends[1:] - 1e-9 * lengths], axis=1))
    mean = (near[:, 1] - near[:, 0]) / lengths  # the mean slope of a piece counts for both of its nodes
    return TextureNodes(places.ravel(), np.repeat(0.5 * lengths, 2), heights.ravel(), np.repeat(mean, 2))


def pieces(texture: Profile, length: float, rise: float) -> Array:
    """Return the ends of the pieces (m), from the first corner, or 0, over a period."""
    period, corners = texture.period, np.asarray(texture.corners, np.float64)
    begin = float(corners[0]) if len(corners) else 0.0
    sparse = len(corners) * length < period
    corners = np.append(corners[1:], np.inf)
    ends = np.linspace(begin, begin + period, math.ceil(period / length) + 1)
    looked = np.arange(LOOKS) / (LOOKS - 1)
    for _ in range(MOST_HALVINGS):
        begins, widths = ends[:-1], np.diff(ends)
        first, past = np.searchsorted(corners, begins, "right"), np.searchsorted(corners, ends[1:], "left")
        heights = texture.heights(begins[:, np.newaxis] + widths[:, np.newaxis] * looked)
        inside = past > first
        middle = begins + 0.5 * widths
        nearest = np.clip(np.searchsorted(corners, middle), first, np.maximum(past - 1, first))
        before = np.clip(nearest - 1, first, None)
        at = np.where(np.abs(corners[before] - middle) < np.abs(corners[nearest] - middle), before, nearest)
        corner = np.where(inside, corners[np.minimum(at, len(corners) - 1)], middle)
        at_corner = texture.heights(np.where(inside, corner, middle))
        above = np.maximum(heights.max(axis=1), at_corner)
        below = np.minimum(heights.min(axis=1), at_corner)
        divided = (widths > 1.001 * length) | (above - below > rise)
        if sparse:  # many corners within short pieces are seen by their rise alone
            divided |= inside & (widths > 0.25 * length)
        if not divided.any():
            return ends
        where = np.where(inside, corner, middle)[divided]
        ends = np.sort(np.concatenate([ends, where]))
    return ends
