"""The kernels of `area_grid`: which blocks of a finger can touch, the sums over their points, and Newton's method.

Model   See `area_grid`. A block is WIDE points along the scan. `lay_blocks` writes h1 + h2 of the blocks that can be
        above a height. From then on z only rises, so a block without a point above it is not read again. The steps are
        taken in float32; the last ones, in float64, do not depend on where the first began.
Source  Fagiani & Barbieri (2016), eq. 1; Newton's method here is Michelot's (1986) projection on the simplex.
Limits  MOST_STEPS was never reached in the tests.
"""

from __future__ import annotations

import math

import numpy as np

from synth.kernels import inlined, inner, signed_kernel, summing

WIDE = 64  # points of a block, along the scan
FIRST = 0.02  # of the scale below the highest point, or the last z: where Newton's method starts
ROUGH, SETTLED = 1e-6, 1e-9  # of the scale: the steps in float32, and the last one, end after a change this small
EMPTY = 1e-14  # of the scale, summed over the points: smaller targets count as none, and z is the highest point
MOST_STEPS = 60  # never reached in the tests; limits the time per place
PIECES = "f4[::1], i8[:,::1], f4[:,::1], f4[::1], f4[:,::1], i8[::1], f8, f8"  # types of `AreaGrid.pieces`
ROWS, FINER_X, FINER_Y, STRIDE, SPAN = range(5)  # entries of `shape`


@inlined
def place_of(cells, finer):
    """Return the cell, the place in the cell, and the distance from that place to the next, `cells` from the first."""
    at = cells * finer
    whole = np.int64(math.floor(at))
    return whole // finer, whole % finer, np.float32(at - whole)


@inlined
def mix(a, b, c, d, w00, w10, w01, w11, height, under):
    """Write the height of a block and the mixture of four rows of the texture."""
    for i in range(WIDE):
        under[i] = height[i] + (w00 * a[i] + w10 * b[i] + w01 * c[i] + w11 * d[i])


@inner
def lay_blocks(tops, starts, heights, texture, crests, shape, per, highest, x, y, floor, under):
    """Write h1 + h2 of the blocks that can be above `floor`, and return how many there are."""
    rows, finer_x, finer_y, stride, span = shape[ROWS], shape[FINER_X], shape[FINER_Y], shape[STRIDE], shape[SPAN]
    column, part_x, fx = place_of(x * per, finer_x)
    row, part_y, fy = place_of(y * rows, finer_y)
    next_part_x, next_column = (part_x + 1, column) if part_x + 1 < finer_x else (0, column + 1)
    next_part_y, next_row = (part_y + 1, row) if part_y + 1 < finer_y else (0, row + 1)
    one = np.float32(1.0)
    w00, w10, w01, w11 = (one - fx) * (one - fy), fx * (one - fy), (one - fx) * fy, fx * fy
    near, next_near = (part_y * finer_x + part_x) * stride + column, (part_y * finer_x + next_part_x) * stride
    far, next_far = (next_part_y * finer_x + part_x) * stride + column, (next_part_y * finer_x + next_part_x) * stride
    next_near, next_far = next_near + next_column, next_far + next_column
    read = 0
    for block in range(len(tops)):
        if tops[block] + highest <= floor:
            break
        here, along = (row + starts[block, 0]) % rows, starts[block, 1]
        if tops[block] + crests[here, column + along] <= floor:
            continue
        there = ((next_row + starts[block, 0]) % rows) * span + along
        here = here * span + along
        mix(
            texture[near + here : near + here + WIDE], texture[next_near + here : next_near + here + WIDE],
            texture[far + there : far + there + WIDE], texture[next_far + there : next_far + there + WIDE],
            w00, w10, w01, w11, heights[block], under[read],
        )  # fmt: skip
        read += 1
    return read


@summing
def block_sums(block, z):
    """Return the sum of max(h - z, 0) over a block, and the number of points above z, in float32."""
    area, count = np.float32(0.0), np.float32(0.0)
    for i in range(WIDE):
        depth = block[i] - z
        area += max(depth, np.float32(0.0))
        count += np.float32(1.0) if depth > np.float32(0.0) else np.float32(0.0)
    return area, count


@summing
def exact_block_sums(block, z):
    """Return the same in float64; a block without a point above z adds exact zeros."""
    area, count = 0.0, 0.0
    for i in range(WIDE):
        depth = np.float64(block[i]) - z
        area += max(depth, 0.0)
        count += 1.0 if depth > 0.0 else 0.0
    return area, count


@inner
def sums_of(under, left, blocks, z):
    """Return the sum of max(h - z, 0), and the number of points above z, roughly; and how many blocks have such points.

    left: numbers of the blocks to read; those without a point above z are taken out, since z only rises.
    """
    area, count, level, kept = 0.0, 0.0, np.float32(z), 0
    for k in range(blocks):
        some, number = block_sums(under[left[k]], level)
        if number > 0.0:
            area += some
            count += number
            left[kept] = left[k]
            kept += 1
    return area, count, kept


@inner
def exact_sums(under, left, blocks, z):
    """Return the same sums in float64."""
    area, count = 0.0, 0.0
    for k in range(blocks):
        some, number = exact_block_sums(under[left[k]], z)
        area += some
        count += number
    return area, count


@inner
def highest_point(tops, starts, heights, texture, crests, shape, per, highest, x, y, under):
    """Return the highest point."""
    margin = FIRST
    while True:
        floor = tops[0] + highest - margin
        blocks = lay_blocks(tops, starts, heights, texture, crests, shape, per, highest, x, y, floor, under)
        top = -math.inf
        for block in range(blocks):
            for i in range(WIDE):
                top = max(top, np.float64(under[block, i]))
        if top >= floor:
            return top
        margin *= 2.0


@inner
def newton(under, left, blocks, level, area, count, target, steps):
    """Return z, the points that touch and the steps, from a `level` at or below z with its sums."""
    for _step in range(MOST_STEPS):
        change = (area - target) / count
        level += change
        before = count
        some, number, kept = sums_of(under, left, blocks, level)
        steps += 1
        if number == before or abs(change) < ROUGH or number == 0.0:
            break
        area, count, blocks = some, number, kept
    for _step in range(MOST_STEPS):
        area, count = exact_sums(under, left, blocks, level)
        steps += 1
        if count == 0.0:  # rounded onto the highest point
            level -= ROUGH
            continue
        change = (area - target) / count
        level += change
        if abs(change) < SETTLED:
            break
    return level, count, steps


@signed_kernel(f"void({PIECES}, f8[::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[::1], i8[::1])")
def solve_area(
    tops, starts, heights, texture, crests, shape, per, highest, x, y, targets, guess, height, touching, iterations
):
    """Write z, the number of points that touch and the number of steps, at each place.

    x, y: where the first point of the finger meets the texture, in periods.
    guess: a z that is near, or NaN: the z of the place before.
    """
    under, left = np.empty(heights.shape, np.float32), np.empty(len(tops), np.int64)
    z, before, missed = math.nan, math.nan, FIRST
    for p in range(len(x)):
        near = guess[p]
        if math.isnan(near):  # continue the line through both places before
            near = z if math.isnan(before) else 2.0 * z - before
        if targets[p] < EMPTY or math.isnan(near):
            near = highest_point(tops, starts, heights, texture, crests, shape, per, highest, x[p], y[p], under)
        level, count, steps = near, 0.0, 1
        if targets[p] >= EMPTY:
            margin, area, blocks = 2.0 * missed + 1e-4, -1.0, 0
            while area < targets[p]:  # Newton's method starts at or below z
                level = near - margin
                read = lay_blocks(tops, starts, heights, texture, crests, shape, per, highest, x[p], y[p], level, under)
                for k in range(read):
                    left[k] = k
                area, count, blocks = sums_of(under, left, read, level)
                steps += 1
                margin *= 4.0
            level, count, steps = newton(under, left, blocks, level, area, count, targets[p], steps)
            missed = 0.75 * missed + 0.25 * abs(level - near)
        height[p], touching[p], iterations[p] = level, count, steps
        before, z = z, level


@signed_kernel(f"void({PIECES}, f8[::1], f8[::1], f8[:,::1], f8[:,::1], f8[:,::1])")
def measure_area(tops, starts, heights, texture, crests, shape, per, highest, x, y, z, depth, touching):
    """Write the sum of max(h - z, 0) and the number of points above z, at each place and each of its z."""
    under, left = np.empty(heights.shape, np.float32), np.arange(len(tops))
    for p in range(len(x)):
        floor = z[p, 0]
        for i in range(1, z.shape[1]):
            floor = min(floor, z[p, i])
        blocks = lay_blocks(tops, starts, heights, texture, crests, shape, per, highest, x[p], y[p], floor, under)
        for i in range(z.shape[1]):
            depth[p, i], touching[p, i] = exact_sums(under, left, blocks, z[p, i])
