"""The kernel of `area_forces`: sums over the cells of a finger of its pressure, times slopes or to a power.

Model   Within a cell the gap is uniformly distributed, as in `area_grid`: from top - width to top. The slope of the
        texture is that of the plane through the cell. With a power g the mean over a cell is

            (y1^(g + 1) - y0^(g + 1)) / ((g + 1) width),   y1 = max(top - z, 0),   y0 = max(top - width - z, 0)

Source  Fagiani & Barbieri (2016), eq. 1.
Limits  A slope and a pressure that vary together within a cell count by their means only. This error is of second order
        in the size of the cells.
"""

from __future__ import annotations

import numpy as np

from synth.contact.area_solver import (
    FINER_X,
    FINER_Y,
    FINGER,
    PIECES,
    RIM,
    ROW,
    SECOND,
    THIRD,
    WIDE,
    Place,
    corners_of,
    exact_block_sums,
    lay_block,
    under_block,
)
from synth.kernels import inlined, inner, signed_kernel, summing


@inlined
def lay_slopes(texture, near, beside, far, across, fx, fy, per_x, per_y, slopes):
    """Write the change of the texture over each cell of a block, along and across, float32 [2 WIDE].

    The arguments are those of `area_solver.lay_block`.
    """
    for number in range(WIDE):
        i = Place(number)
        a, c = texture[near + i], texture[far + i]
        along, other = texture[beside + i] - a, texture[across + i] - c
        slopes[i] = per_x * (along + fy * (other - along))
        slopes[SECOND + i] = per_y * (c + fx * other - (a + fx * along))


@summing
def block_slopes(laid, slopes, z):
    """Return the sums over a block of the mean of max(h - z, 0), times both changes of the texture."""
    along, aside = 0.0, 0.0
    for number in range(WIDE):
        i = Place(number)
        depth = np.float64(laid[i]) - z
        within = min(max(depth, 0.0), np.float64(laid[SECOND + i]))
        pressed = within * np.float64(laid[THIRD + i]) * (depth - 0.5 * within)
        along += pressed * np.float64(slopes[i])
        aside += pressed * np.float64(slopes[SECOND + i])
    return along, aside


@inner
def block_powers(laid, z, exponent):
    """Return the sum over a block of the mean of max(h - z, 0)^exponent."""
    total = 0.0
    for number in range(WIDE):
        i = Place(number)
        high = np.float64(laid[i]) - z
        if high > 0.0:
            low = max(high - np.float64(laid[SECOND + i]), 0.0)
            total += np.float64(laid[THIRD + i]) * (high ** (exponent + 1.0) - low ** (exponent + 1.0))
    return total / (exponent + 1.0)


@signed_kernel(f"void({PIECES}, f8[::1], f8[::1], f8[::1], f8[::1], f8[::1], f8, f8[:,::1])")
def sum_forces(
    tops, places, arms, finger, texture, crests, shape, per, highest, x, y, turns, sizes, z, exponent, sums
):  # fmt: skip
    """Write, at each place and its z, the sums over the cells of four means: float64 [4, places].

    They are those of max(h - z, 0), of this times the change of the texture over a cell along and across, and of
    max(h - z, 0)^exponent, which is left out if the exponent is 0.
    x, y, turns, sizes: as in `area_solver.solve_area`.
    """
    per_x, per_y = np.float32(shape[FINER_X]), np.float32(shape[FINER_Y] * ROW)
    laid, slopes = np.empty(3 * WIDE, np.float32), np.empty(2 * WIDE, np.float32)
    for p in range(len(x)):
        lean, size = np.float32(turns[p] * arms[len(tops), 0]), np.float32(sizes[p])
        area, along, aside, power = 0.0, 0.0, 0.0, 0.0
        for block in range(len(tops)):
            if tops[block] + highest <= z[p]:
                break
            if places[block, RIM] >= size:
                continue
            row, part_y, fy, column, part_x, fx = under_block(places, arms, shape, per, block, x[p], y[p], turns[p])
            if tops[block] + crests[row, column] <= z[p]:
                continue
            near, beside, far, across = corners_of(shape, row, part_y, column, part_x)
            lay_block(
                texture, near, beside, far, across, fx, fy, per_x, per_y, lean, size,
                finger, Place(block) * FINGER, laid, Place(0),
            )  # fmt: skip
            pressed, touching = exact_block_sums(laid, Place(0), z[p])
            if touching == 0.0:
                continue
            lay_slopes(texture, near, beside, far, across, fx, fy, per_x, per_y, slopes)
            steep, beyond = block_slopes(laid, slopes, z[p])
            area += pressed
            along += steep
            aside += beyond
            if exponent > 0.0:
                power += block_powers(laid, z[p], exponent)
        sums[0, p], sums[1, p], sums[2, p], sums[3, p] = area, along, aside, power
