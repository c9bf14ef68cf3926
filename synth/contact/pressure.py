"""Integrals of the pressure field at any phase and z, for a texture of any profile, over its polyline.

Model   Over each segment of `profile_solver`, y = h - z is a straight line and the slope h_t' of the texture is
        constant. So these integrals are sums of elementary ones:

            S = mean of max(y, 0) h_t'      T = mean of h_t' where y > 0      N_g = mean of max(y, 0)^g

        N_1 is the mean indentation and N_0 the touching part of the length. dS/dz = -T and dN_g/dz = -g N_(g-1).
        Over a segment where y goes from p to q, the mean of y^g is (q^(g+1) - p^(g+1)) / ((g + 1) (q - p)); where p
        and q are nearly equal, a series replaces the quotient.
Source  Fagiani & Barbieri (2016), eqs 1-2; the rest is derived here.
Limits  The relative error for the polyline is 1e-12; for the error of the polyline see `profile_solver`.
"""

from __future__ import annotations

import numpy as np

from synth.arrays import Array
from synth.contact.profile_solver import SegmentGrid
from synth.contact.segment_kernels import begin_place, knots_over
from synth.kernels import kernel, summing

LEVEL = 1e-3  # of y: on a segment that rises by less, a series gives the mean of a power, to a relative error of 1e-14


def slope_integrals(grid: SegmentGrid, length: float, phases: Array, heights: Array) -> Array:
    """Return S (m), T, N_1 (m) and N_0 at each phase (turns) and z (m): float64 [4, phases].

    length: L, m.
    """
    sums, scale = np.empty((4, len(phases))), grid.height_scale
    sum_segment_slopes(grid.pieces, phases, heights / scale, sums)
    return np.asarray(sums * [[scale * scale / length], [scale / length], [scale], [1.0]])


def power_integrals(grid: SegmentGrid, phases: Array, heights: Array, exponent: float) -> Array:
    """Return N_g (m^g) and N_(g-1) at each phase (turns) and z (m): float64 [2, phases].

    exponent: g, above 0.
    """
    sums, scale = np.empty((2, len(phases))), grid.height_scale
    sum_segment_powers(grid.pieces, phases, heights / scale, exponent, sums)
    return np.asarray(sums * [[scale**exponent], [scale ** (exponent - 1.0)]])


@kernel
def fill_place(pieces, phase, z, depths, widths):
    """Write h - z at both ends of every segment over L, and the width of each (in segments); return their number.

    depths: float64 [2, capacity], at the start and the end of each segment.
    """
    finger, numbers = pieces[1], pieces[3]
    knot, before, count, cosine, sine = begin_place(numbers, phase)
    run = knots_over(pieces, knot, before, count)
    for i in range(count):
        depths[0, i] = run[i] + (cosine * finger[0, i] + sine * finger[1, i]) - z
        depths[1, i] = run[i + 1] + (cosine * finger[0, i + 1] + sine * finger[1, i + 1]) - z
        widths[i] = 1.0
    last = count - 1
    widths[last] = numbers[1] + before - last
    depths[1, last] = depths[0, last] + widths[last] * (depths[1, last] - depths[0, last])
    depths[0, 0] += before * (depths[1, 0] - depths[0, 0])
    widths[0] -= before
    return knot, count


@summing
def slope_sums(heights, heights1, begins, ends, widths):
    """Return S, T, N_1 and N_0 summed over the segments, with lengths in segments and slopes as rise per segment."""
    slope, rise, depth, touching = 0.0, 0.0, 0.0, 0.0
    for i in range(len(widths)):
        p, q = begins[i], ends[i]
        both = max(p, 0.0) + max(q, 0.0)
        part = min(1.0, both / max(abs(p - q), 1e-30)) * widths[i]
        area = 0.5 * part * both
        steep = heights1[i] - heights[i]
        slope += area * steep
        rise += part * steep
        depth += area
        touching += part
    return slope, rise, depth, touching


@kernel
def sum_segment_slopes(pieces, phases, heights, sums):
    """Write, per phase and z: S and T times L, and N_1, all over a1 + a2; and N_0.

    pieces: `SegmentGrid.pieces`.
    sums: float64 [4, phases].
    """
    texture, finger, _blocks, numbers = pieces
    depths, widths = np.empty((2, finger.shape[1])), np.empty(finger.shape[1])
    for i in range(len(phases)):
        knot, count = fill_place(pieces, phases[i], heights[i], depths, widths)
        run, run1 = texture[0, knot : knot + count], texture[0, knot + 1 : knot + count + 1]
        found = slope_sums(run, run1, depths[0, :count], depths[1, :count], widths[:count])
        sums[0, i], sums[1, i] = found[0], found[1]
        sums[2, i], sums[3, i] = found[2] / numbers[1], found[3] / numbers[1]


@kernel
def level_mean(part, exponent):
    """Return the mean of (1 - part s)^exponent over s from 0 to 1, as a series for a small `part`."""
    cubic = (exponent - 2.0) * part / 24.0
    return 1.0 - exponent * part * (0.5 - (exponent - 1.0) * part * (1.0 / 6.0 - cubic))


@kernel
def segment_powers(p, q, begin, end, exponent):
    """Return the means of max(y, 0)^exponent and of max(y, 0)^(exponent - 1) where y goes linearly from p to q.

    begin, end: max(p, 0)^exponent and max(q, 0)^exponent.
    exponent: above 0.
    """
    if p > q:
        p, q, begin, end = q, p, end, begin
    if q <= 0.0:
        return 0.0, 0.0
    rise = q - p
    if rise < LEVEL * q:
        return end * level_mean(rise / q, exponent), end / q * level_mean(rise / q, exponent - 1.0)
    return (q * end - max(p, 0.0) * begin) / ((exponent + 1.0) * rise), (end - begin) / (exponent * rise)


@kernel
def sum_segment_powers(pieces, phases, heights, exponent, sums):
    """Write, per phase and z, N_g and N_(g-1) in powers of a1 + a2.

    sums: float64 [2, phases].

    Each knot's power is computed only once, because powers take most of the time.
    """
    finger, numbers = pieces[1], pieces[3]
    depths, widths = np.empty((2, finger.shape[1])), np.empty(finger.shape[1])
    for i in range(len(phases)):
        _knot, count = fill_place(pieces, phases[i], heights[i], depths, widths)
        power, below = 0.0, 0.0
        end = max(depths[0, 0], 0.0) ** exponent
        for j in range(count):
            p, q = depths[0, j], depths[1, j]
            begin, end = end, (q**exponent if q > 0.0 else 0.0)
            more, less = segment_powers(p, q, begin, end, exponent)
            power += widths[j] * more
            below += widths[j] * less
        sums[0, i], sums[1, i] = power / numbers[1], below / numbers[1]
