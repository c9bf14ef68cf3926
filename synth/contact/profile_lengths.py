"""The approach z of a texture of any profile over many lengths at once, for a contact that grows with the load.

Model   One polyline over the longest contact serves all: a shorter one, about the same middle, begins elsewhere, which
        turns its finger and its texture. See `profile_solver`.
Limits  as `profile_solver`; flat fingers only.
"""

from __future__ import annotations

import math

import numpy as np

from synth.arrays import Array
from synth.contact.geometry import Geometry
from synth.contact.profile_solver import SegmentGrid, balance
from synth.kernels import kernel


def segment_heights_over(geometry: Geometry, phases: Array, lengths: Array, indentations: Array) -> Array:
    """Return z (m) at each of `phases` (turns), with lengths (m) about the middle of `geometry`, and w / k (m)."""
    longest, period = float(np.max(lengths)), geometry.texture_period
    grid = SegmentGrid.of_geometry(geometry.part(0.5 * (geometry.contact_length - longest), longest))
    begins = 0.5 * (longest - lengths)
    ridges, textures = begins / geometry.ridge_period % 1.0, begins / period % 1.0
    numbers = np.tile(grid.numbers, (len(phases), 1))
    numbers[:, 1] = lengths * (grid.segments / period)
    numbers[:, 2] -= textures * grid.segments
    numbers[:, 4] += 2.0 * math.pi * ridges
    heights = np.empty(len(phases))
    solve_segment_lengths(grid.pieces, numbers, phases, indentations / grid.height_scale, heights)
    return heights * grid.height_scale


@kernel
def solve_segment_lengths(pieces, numbers, phases, targets, heights):
    """Write z / (a1 + a2) at each phase; numbers: float64 [phases, 6], those of `SegmentGrid` of each contact."""
    texture, finger, blocks, _numbers = pieces
    work = np.empty((3, blocks.shape[1] + 1))
    begin = math.nan
    for i in range(len(phases)):
        here = (texture, finger, blocks, numbers[i])
        begin, _part, _steps = balance(here, work, phases[i], targets[i], begin)
        heights[i] = begin
