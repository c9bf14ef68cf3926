"""The kernels of `area_grid`: which blocks of a finger can touch, the sums over their cells, and Newton's method.

Model   See `area_grid`. A block is WIDE cells along the scan. For the blocks that can be above a given height,
        `lay_blocks` writes the top and the range of heights of every cell. From then on z only rises, so a block that
        has no cell above z is not read again. The first steps are taken in float32. The last ones are taken in float64,
        and do not depend on where the solver started.
Source  Fagiani & Barbieri (2016), eq. 1.
Limits  MOST_STEPS was never reached in the tests.
"""

from __future__ import annotations

import math

import numpy as np

from synth.kernels import inlined, inner, signed_kernel, summing

WIDE = 32  # cells of a block, along the scan
BEFORE = 8  # columns of a texture that are stored before x = 0: a turned finger reaches them
ROW = 0.97  # distance of the rows of a finger, in rows of the texture; see `area_grid`
FIRST = 0.02  # of the scale: cells are first read down to this margin below the expected z, or below the highest place
ROUGH, SETTLED = 1e-3, 1e-6  # of the scale: Newton's method in float32, and in float64, ends after a step this small
EMPTY = 1e-14  # of the scale, summed over the cells: smaller targets count as none, and z is the highest place
LEAST = 1e-7  # of the scale: added to the range of a cell, so that it is never 0
MOST_STEPS = 60  # never reached in the tests; limits the time per place
PIECES = "f4[::1], f8[:,::1], f8[:,::1], f4[::1], f4[::1], f4[:,::1], i8[::1], f8, f8"  # `AreaGrid.pieces`
ROWS, FINER_X, FINER_Y, STRIDE, SPAN = range(5)  # entries of `shape`
RIM = 2  # column of `places`
Place = np.uint64  # an unsigned index: with a signed one Numba checks for negative indices, which is five times slower
FINGER, LAID = Place(4 * WIDE), Place(3 * WIDE)  # numbers per block in `finger` and in `laid`
SECOND, THIRD, FOURTH = Place(WIDE), Place(2 * WIDE), Place(3 * WIDE)  # offset of the second to fourth row of a block


@inlined
def place_of(cells, finer):
    """Return the cell, the last place in it up to a position, and the fraction of the way from there to the next place.

    cells: the position, in cells from the first.
    finer: places per cell, a power of two.
    """
    at = cells * finer
    whole = math.floor(at)
    cell = math.floor(cells)
    return np.int64(cell), np.int64(whole - cell * finer), np.float32(at - whole)


@inlined
def lay_block(texture, near, beside, far, across, fx, fy, per_x, per_y, lean, size, finger, own, laid, to):
    """Write top, range, and share divided by range, of the cells of a block.

    near, beside, far, across: indices in `texture` of the four places around the first cell: at it or before, the next
        one along, the next one across, and the next one in both directions.
    lean: shift of the finger across from one cell of the block to the next, cells.
    size: of the finger, which decides the share of a cell; see `AreaGrid.finger`.
    own, to: index of the block in `finger` and in `laid`.
    """
    half, middle, zero, one = np.float32(0.5), np.float32(0.5 * (WIDE - 1)), np.float32(0.0), np.float32(1.0)
    for number in range(WIDE):
        i = Place(number)
        a, c = texture[near + i], texture[far + i]
        along, other = texture[beside + i] - a, texture[across + i] - c
        below, above = a + fx * along, c + fx * other
        slope_x = finger[own + SECOND + i] + per_x * (along + fy * (other - along))
        rise = finger[own + THIRD + i]
        slope_y = rise + per_y * (above - below)
        moved = lean * (np.float32(number) - middle) * rise
        width = math.sqrt(slope_x * slope_x + slope_y * slope_y) + np.float32(LEAST)
        laid[to + i] = finger[own + i] + moved + (below + fy * (above - below)) + half * width
        laid[to + SECOND + i] = width
        laid[to + THIRD + i] = min(max(size - finger[own + FOURTH + i], zero), one) / width


@inlined
def under_block(places, arms, shape, per, block, x, y, turn):
    """Return where the first cell of a block is on the texture: the cell, the last place in it, and the rest.

    First for the rows, then for the columns; see `place_of`.
    """
    rows = shape[ROWS]
    at_y = y * rows + places[block, 1] + turn * arms[block, 1]
    row, part_y, fy = place_of(max(at_y - rows * math.floor(at_y / rows), 0.0), shape[FINER_Y])
    column, part_x, fx = place_of(x * per + places[block, 0] + turn * arms[block, 0], shape[FINER_X])
    return row if row < rows else 0, part_y, fy, column, part_x, fx


@inlined
def corners_of(shape, row, part_y, column, part_x):
    """Return the indices in the texture of the place of a cell and of the next ones along, across, and both."""
    rows, finer_x, finer_y, stride, span = shape[ROWS], shape[FINER_X], shape[FINER_Y], shape[STRIDE], shape[SPAN]
    next_part_x, next_column = (part_x + 1, column) if part_x + 1 < finer_x else (0, column + 1)
    next_part_y, next_row = (part_y + 1, row) if part_y + 1 < finer_y else (0, row + 1 if row + 1 < rows else 0)
    near, far = row * span + part_y * finer_x * stride, next_row * span + next_part_y * finer_x * stride
    here, there = part_x * stride + column, next_part_x * stride + next_column
    return Place(near + here), Place(near + there), Place(far + here), Place(far + there)


@inner
def lay_blocks(tops, places, arms, finger, texture, crests, shape, per, highest, x, y, turn, size, floor, laid):
    """Write the cells of the blocks that can be above `floor`, and return the number of these blocks."""
    per_x, per_y, read = np.float32(shape[FINER_X]), np.float32(shape[FINER_Y] * ROW), 0
    lean, own_size = np.float32(turn * arms[len(tops), 0]), np.float32(size)
    for block in range(len(tops)):
        if tops[block] + highest <= floor:
            break
        if places[block, RIM] >= size:
            continue
        row, part_y, fy, column, part_x, fx = under_block(places, arms, shape, per, block, x, y, turn)
        if tops[block] + crests[row, column] <= floor:
            continue
        near, beside, far, across = corners_of(shape, row, part_y, column, part_x)
        lay_block(
            texture, near, beside, far, across, fx, fy, per_x, per_y, lean, own_size,
            finger, Place(block) * FINGER, laid, Place(read) * LAID,
        )  # fmt: skip
        read += 1
    return read


@signed_kernel("void(f4[::1], i8[::1], f4[:,::1])")
def highest_tops(texture, shape, tops):
    """Write the highest top that a cell of the texture can have between each row and column and the next ones.

    The top of a cell is its mean and half the range of its heights. The last column has no neighbour.
    """
    rows, finer_x, finer_y, stride, span = shape[ROWS], shape[FINER_X], shape[FINER_Y], shape[STRIDE], shape[SPAN]
    per_x, per_y, half = np.float32(finer_x), np.float32(finer_y), np.float32(0.5)
    tops[:] = -math.inf
    for row in range(rows):
        for part_y in range(finer_y):
            next_row, next_y = (row, part_y + 1) if part_y + 1 < finer_y else ((row + 1) % rows, 0)
            near, far = part_y * finer_x * stride + row * span, next_y * finer_x * stride + next_row * span
            for part_x in range(finer_x):
                next_x, moved = (part_x + 1, 0) if part_x + 1 < finer_x else (0, 1)
                here, there = part_x * stride, next_x * stride + moved
                one, two, three, four = Place(near + here), Place(near + there), Place(far + here), Place(far + there)
                for number in range(span - 1):
                    i = Place(number)
                    a, b, c, d = texture[one + i], texture[two + i], texture[three + i], texture[four + i]
                    slope_x, slope_y = per_x * max(abs(b - a), abs(d - c)), per_y * max(abs(c - a), abs(d - b))
                    width = np.sqrt(slope_x * slope_x + slope_y * slope_y)
                    tops[Place(row), i] = max(tops[Place(row), i], max(max(a, b), max(c, d)) + half * width)
    tops[:, span - 1] = tops[:, span - 2]


@summing
def block_sums(laid, first, z):
    """Return two sums over the cells of a block, in float32: the mean of max(h - z, 0), and the part above z.

    Each cell is weighted by its share.
    """
    zero, half = np.float32(0.0), np.float32(0.5)
    area, part = zero, zero
    for number in range(WIDE):
        i = first + Place(number)
        depth = laid[i] - z
        within = min(max(depth, zero), laid[SECOND + i])
        touching = within * laid[THIRD + i]
        area += touching * (depth - half * within)
        part += touching
    return area, part


@summing
def exact_block_sums(laid, first, z):
    """Return the same in float64; a block below z adds exact zeros."""
    area, part = 0.0, 0.0
    for number in range(WIDE):
        i = first + Place(number)
        depth = np.float64(laid[i]) - z
        within = min(max(depth, 0.0), np.float64(laid[SECOND + i]))
        touching = within * np.float64(laid[THIRD + i])
        area += touching * (depth - 0.5 * within)
        part += touching
    return area, part


@inner
def sums_of(laid, left, blocks, z):
    """Return both sums over the blocks to be read, in float32, and the number of blocks above z.

    left: numbers of the blocks to read; those below z are removed, since z only rises.
    """
    area, part, level, kept = 0.0, 0.0, np.float32(z), 0
    for k in range(blocks):
        some, touching = block_sums(laid, Place(left[k]) * LAID, level)
        if touching > 0.0:
            area += some
            part += touching
            left[kept] = left[k]
            kept += 1
    return area, part, kept


@inner
def rough_sums(laid, blocks, z):
    """Return both sums over all blocks, in float32."""
    area, part, level = 0.0, 0.0, np.float32(z)
    for k in range(blocks):
        some, touching = block_sums(laid, Place(k) * LAID, level)
        area += some
        part += touching
    return area, part


@inner
def exact_sums(laid, left, blocks, z):
    """Return the same sums in float64."""
    area, part = 0.0, 0.0
    for k in range(blocks):
        some, touching = exact_block_sums(laid, Place(left[k]) * LAID, z)
        area += some
        part += touching
    return area, part


@inner
def highest_place(tops, places, arms, finger, texture, crests, shape, per, highest, x, y, turn, size, laid):
    """Return the highest place of all cells of the finger: z where there is no load."""
    margin = FIRST
    while True:
        floor = tops[0] + highest - margin
        blocks = lay_blocks(
            tops, places, arms, finger, texture, crests, shape, per, highest, x, y, turn, size, floor, laid
        )
        top = -math.inf
        for block in range(blocks):
            for i in range(WIDE):
                if laid[block * 3 * WIDE + 2 * WIDE + i] > 0.0:
                    top = max(top, np.float64(laid[block * 3 * WIDE + i]))
        if top >= floor:
            return top
        margin *= 2.0


@inner
def newton(laid, left, blocks, level, change, target, steps):
    """Return z, the part of the cells that touches, and the steps, from a `level` at or below z.

    change: size of the step that led there; the convergence is quadratic.
    """
    while change > ROUGH and steps < MOST_STEPS:
        area, part, blocks = sums_of(laid, left, blocks, level)
        steps += 1
        if part == 0.0:
            break
        change = (area - target) / part
        level += change
    part = 0.0
    for _step in range(MOST_STEPS):
        area, part = exact_sums(laid, left, blocks, level)
        steps += 1
        if part == 0.0:  # z was rounded onto the highest place
            level -= ROUGH
            continue
        change = (area - target) / part
        level += change
        if abs(change) < SETTLED:
            break
    return level, part, steps


@signed_kernel(f"void({PIECES}, f8[::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[::1], i8[::1])")
def solve_area(
    tops, places, arms, finger, texture, crests, shape, per, highest,
    x, y, turns, sizes, targets, guess, height, touching, iterations,
):  # fmt: skip
    """Write z, the part of the cells that touches and the number of steps, at each place.

    x, y: where the first cell of the finger meets the texture, in periods.
    turns: angle by which the finger is turned from its lattice, rad.
    sizes: of the finger, see `AreaGrid.finger`.
    guess: a z near the solution, or NaN: z is extrapolated from the places before.
    """
    laid, left = np.empty(len(tops) * 3 * WIDE, np.float32), np.empty(len(tops), np.int64)
    z, before, missed = math.nan, math.nan, FIRST
    for p in range(len(x)):
        if targets[p] < EMPTY:
            z = highest_place(
                tops, places, arms, finger, texture, crests, shape, per, highest, x[p], y[p], turns[p], sizes[p], laid
            )
            height[p], touching[p], iterations[p] = z, 0.0, 1
            continue
        near, margin = guess[p], 2.0 * missed + 1e-4
        if math.isnan(near):  # extrapolate the line through the two places before
            near = z if math.isnan(before) else 2.0 * z - before
        if math.isnan(near):
            near = tops[0] + highest
        steps, level, blocks, change, first = 0, near, 0, 0.0, near
        while True:
            floor = level - margin
            blocks = lay_blocks(
                tops, places, arms, finger, texture, crests, shape, per, highest, x[p], y[p], turns[p], sizes[p],
                floor, laid,
            )  # fmt: skip
            area, part = rough_sums(laid, blocks, level)
            steps += 1
            if part > 0.0:
                change = (area - targets[p]) / part
                if level + change >= floor:
                    break
            level = floor
            margin *= 2.0
        level += change
        for k in range(blocks):
            left[k] = k
        level, part, steps = newton(laid, left, blocks, level, abs(change), targets[p], steps)
        missed = 0.75 * missed + 0.25 * abs(level - first)
        height[p], touching[p], iterations[p] = level, part, steps
        before, z = z, level


@signed_kernel(f"void({PIECES}, f8[::1], f8[::1], f8, f8[:,::1], f8[:,::1], f8[:,::1])")
def measure_area(tops, places, arms, finger, texture, crests, shape, per, highest, x, y, size, z, depth, touching):
    """Write the sums over the cells of the mean of max(h - z, 0), and of the part above z, at each place and its z."""
    laid, left = np.empty(len(tops) * 3 * WIDE, np.float32), np.arange(len(tops))
    for p in range(len(x)):
        floor = z[p, 0]
        for i in range(1, z.shape[1]):
            floor = min(floor, z[p, i])
        blocks = lay_blocks(
            tops, places, arms, finger, texture, crests, shape, per, highest, x[p], y[p], 0.0, size, floor, laid
        )
        for i in range(z.shape[1]):
            depth[p, i], touching[p, i] = exact_sums(laid, left, blocks, z[p, i])
