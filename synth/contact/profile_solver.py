"""The approach z for a texture of any profile, to round-off of a polyline of it.

Model   The texture is a polyline of N equal segments per period that moves with the texture. So its surface is the same
        at every place, and z has no jumps. The cosine of the finger is taken at the same knots. Its chords add a
        ripple at harmonic N only, and its amplitude is multiplied by tan(u) / u, where u is half a segment in radians,
        so that each segment keeps its area. A dome (x - L/2)^2 / (2 R) of the finger is subtracted at the knots too,
        minus a constant that keeps the area of its chords. F(z), the mean of max(h - z, 0) over L, is exact for the
        polyline; segments at the ends of L are cut. From the preceding phases, Newton's method takes 2 or 3 steps.
        Blocks of 16 segments have cheap bounds on h, from three parts: the texture's extremes over 16 segments from
        each knot, the finger's cosine about the middle, and the dome at its nearest and farthest. A block above z adds
        its area, a block below z adds nothing, and only the other blocks are summed segment by segment.
        The polyline is the least-squares projection of the profile onto the polylines with these knots. With hat
        functions phi_j at the knots, the heights H_j solve sum_k <phi_j, phi_k> H_k = <phi_j, h>. The projection
        keeps the area over a segment and its neighbours. Where the profile is smooth, areas err by the fourth power of
        the segment. Round a corner between knots, the errors of the neighbouring segments cancel. Chords would
        lie below every crest, with an error of second order.
Source  Fagiani & Barbieri (2016), eqs 1-2. de Boor (2001), A Practical Guide to Splines, least-squares approximation by
        linear splines.
Limits  Exact for the polyline to 1e-13 of a1 + a2. The error of the polyline is second order in the segment where few
        segments touch, and third order or higher elsewhere. Halving the segments measures it (`spectrum`). A profile
        that is linear between knots is reproduced to round-off. Features far shorter than a segment are averaged.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from synth.arrays import Array
from synth.contact.exact_solver import Approaches, angles_of_centres
from synth.contact.geometry import Geometry
from synth.contact.segment_kernels import BLOCK, measure_segments, solve_segments
from synth.response_cache import kept
from synth.surfaces.profile import Profile

FEWEST_SEGMENTS = 64  # per period: enough to show the shape of a texture of a few ridges
MOST_SEGMENTS = 1 << 16  # per period, to begin with; the measured error may require finer ones
BULGE = 2e-3  # of a1 + a2: largest distance of the first polyline from a profile of known curvature
NODES, WEIGHTS = (0.5 - 0.5 * math.sqrt(0.6), 0.5, 0.5 + 0.5 * math.sqrt(0.6)), (5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0)
"""Gauss's rule of three nodes on 0..1: exact for a parabola times a hat function."""
PARTS = 4  # per segment, each with its own nodes
POINTS_A_RIDGE = 128  # segments per ridge, to begin with
FEWEST = 8  # segments in the contact, however short it is
DOME_WORK = 1.6  # work of a block under a dome, relative to one without


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


@dataclass(frozen=True, slots=True)
class SegmentGrid:
    """The polyline of one contact, relative to a1 + a2.

    segments: per period.
    texture: float64 [4, knots]. Rows: heights; area (in segments), largest and smallest height of the 16 segments from
        each knot. The knots cover a period and at least the length of the contact.
    finger: float64 [2, knots]: minus the cosine and minus the sine of the ridges at the knots.
    blocks: float64 [4, blocks]: the same at the middle of each block, and their areas.
    numbers: knots per period, segments over L, place of the first knot (in segments), radians of the ridges per
        segment, phase of the ridges at x = 0 (rad), and height of the dome one segment from the middle of L.
    height_scale: a1 + a2, m.
    """

    segments: int
    texture: Array
    finger: Array
    blocks: Array
    numbers: Array
    height_scale: float

    @classmethod
    def of_geometry(cls, geometry: Geometry, dome: float = 0.0) -> SegmentGrid:
        """Return the grid of `geometry`, whose texture is a profile, with at least `geometry.segments` per period.

        dome: 1 / R (1/m) of the parabola that is subtracted from the finger, about the middle of the length.
        """
        profile = geometry.profile
        assert profile is not None, "two cosines belong to `exact_solver`"
        scale, period = geometry.height_scale, profile.period
        wanted = geometry.segments or first_segments(profile, geometry.ridge_period, scale, POINTS_A_RIDGE)
        length, ridge = geometry.contact_length, geometry.ridge_period
        least = max(FEWEST * period / length, 2.0 * BLOCK * period / ridge)
        count = wanted * max(1, math.ceil(least / wanted))
        first = knots_of(profile, count)[1] - geometry.texture_phase * period / (2.0 * math.pi)
        spanned = length * count / period
        window = math.ceil(spanned) + 2 + BLOCK
        texture = _texture(profile, count, scale, 1 << (window - 1).bit_length())
        half = math.pi * period / (count * ridge)
        amplitude = geometry.ridge_amplitude / scale * math.tan(half) / half
        angles = angles_of_centres(window * period / (count * ridge), window) - half
        finger = np.stack([-amplitude * np.cos(angles), -amplitude * np.sin(angles)])
        blocks = _blocks(angles, half, amplitude)
        bend = 0.5 * dome * (period / count) ** 2 / scale
        numbers = np.array([count, spanned, first * count / period, 2.0 * half, geometry.ridge_phase, bend])
        return cls(count, texture, finger, blocks, numbers, scale)

    @property
    def name(self) -> str:
        """Name of the solver in reports."""
        return f"segments, {self.segments} per period"

    @property
    def cells(self) -> int:
        """Work per phase, in cells of the exact solver: a block costs about as much as a cell, more under a dome."""
        return round((DOME_WORK if float(self.numbers[5]) > 0.0 else 1.0) * int(self.blocks.shape[1]))

    @property
    def nbytes(self) -> int:
        """Memory of the grid in bytes."""
        return int(self.texture.nbytes + self.finger.nbytes + self.blocks.nbytes)

    def solve(
        self,
        phases: Array,
        indentation: float | Array,
        guess: Array | None = None,
        numbers: Array | None = None,
    ) -> Approaches:
        """Return the approach as `Grid.solve` does.

        numbers: those of a different contact at each phase; None: those of this grid.
        """
        count = len(phases)
        height, touching, iterations = np.empty(count), np.empty(count), np.zeros(count, dtype=np.int64)
        begin = np.empty(0) if guess is None else guess / self.height_scale
        targets = np.atleast_1d(np.asarray(indentation, dtype=float)) / self.height_scale
        each = self.numbers[np.newaxis] if numbers is None else numbers
        solve_segments(self.pieces, each, phases, targets, begin, height, touching, iterations)
        return Approaches(height * self.height_scale, touching, iterations)

    def numbers_of(self, geometry: Geometry, lengths: Array) -> Array:
        """Return the numbers of contacts of `lengths` (m, at most that of `geometry`) about its middle [lengths, 6].

        geometry: of this grid. A shorter contact begins further on, which shifts the phases of finger and texture.
        """
        begins = 0.5 * (geometry.contact_length - lengths)
        numbers = np.tile(self.numbers, (len(lengths), 1))
        numbers[:, 1] = lengths * (self.segments / geometry.texture_period)
        numbers[:, 2] -= begins / geometry.texture_period % 1.0 * self.segments
        numbers[:, 4] += 2.0 * math.pi * (begins / geometry.ridge_period % 1.0)
        return numbers

    def measure(self, phases: Array, heights: Array) -> tuple[Array, Array]:
        """Return the mean of max(h - z, 0) (m) and the touching part of L, as `Grid.measure` does."""
        levels = np.ascontiguousarray(heights.reshape(len(phases), -1)) / self.height_scale
        depth, touching = np.empty(levels.shape), np.empty(levels.shape)
        measure_segments(self.pieces, phases, levels, depth, touching)
        return depth.reshape(heights.shape) * self.height_scale, touching.reshape(heights.shape)

    @property
    def pieces(self) -> tuple[Array, Array, Array, Array]:
        """The arrays that the kernels read."""
        return self.texture, self.finger, self.blocks, self.numbers


@kept  # contacts whose length follows the load share an entry: the window is a power of two
def _texture(profile: Profile, count: int, scale: float, window: int) -> Array:
    """Return the rows of `SegmentGrid.texture` over a period of `count` segments and a window, at a scale (m)."""
    heights = knots_of(profile, count)[0] / scale
    starts = count + window
    run = np.resize(heights, starts + BLOCK + 1)
    sums, highest, lowest, width = run, run, run, 1
    while width < BLOCK:  # sums and extremes over `width` knots from each knot on
        sums = sums[:-width] + sums[width:]
        highest = np.maximum(highest[:-width], highest[width:])
        lowest = np.minimum(lowest[:-width], lowest[width:])
        width *= 2
    first, last = run[:starts], run[BLOCK : BLOCK + starts]
    areas = sums[:starts] + 0.5 * (last - first)
    return np.stack([first, areas, np.maximum(highest[:starts], last), np.minimum(lowest[:starts], last)])


def _blocks(angles: Array, half: float, amplitude: float) -> Array:
    """Return the rows of `SegmentGrid.blocks`: block b begins at knot 1 + 16 b."""
    middles = angles[1 + BLOCK // 2 :: BLOCK]
    begins = angles[1::BLOCK][: len(middles)]
    steps = begins[:, np.newaxis] + 2.0 * half * np.arange(BLOCK + 1)
    weights = np.ones(BLOCK + 1)
    weights[[0, -1]] = 0.5
    return np.stack(
        [
            -amplitude * np.cos(middles),
            -amplitude * np.sin(middles),
            -amplitude * np.cos(steps) @ weights,
            -amplitude * np.sin(steps) @ weights,
        ]
    )
