"""The kernels of `fingertip_solver`: eq. 1 as sums over the nodes of a texture, each of which reads a fold.

Model   The sums and Newton's method are those of `fingertip_solver`. Places are in columns of the fold, levels in its
        levels below the top.
Source  Fagiani & Barbieri (2016), eq. 1.
"""

from __future__ import annotations

import math

import numpy as np

from synth.kernels import inlined, inner, signed_kernel, summing

MOST_STEPS = 100  # never reached in the tests; limits the time per phase
SETTLED = 1e-7  # of the scale: Newton's method ends after a step this small, with an error of its square
EMPTY = 1e-14  # of the scale: smaller indentations count as none, and z is the highest point
FIRST = 0.5  # of the depth to which a paraboloid is pressed in: the first step from the highest point, and the longest
BELOW = 0.02  # of the scale: how far below a first guess of z the nodes are looked at
Place, ONE = np.uint64, np.uint64(1)  # an unsigned index: with a signed one Numba checks for negative indices
PIECES = "f4[:,:,::1], f8[:,::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[::1]"


@inlined
def cubic(a0, d0, a1, d1, t):
    """Return value and slope at `t` of the cubic with the values a and the slopes d at 0 and 1."""
    rise = a1 - a0
    p, q = d0 + d1 - 2.0 * rise, 3.0 * rise - 2.0 * d0 - d1
    return a0 + t * (d0 + t * (q + t * p)), d0 + t * (2.0 * q + 3.0 * t * p)


@inlined
def column_above(areas, ends, c, start, level):
    """Return A and N of the column `c` at `level`, both relative; start: level of its highest point.

    Between its highest point and the next level, A is a power of the depth that continues there with equal slope.
    """
    if not level > start:
        return 0.0, 0.0
    last = areas.shape[0] - 1
    if level >= last:  # where the whole column touches, or Newton's method passes
        return ends[c, 0] + (level - last) * ends[c, 1], ends[c, 1]
    i = Place(level)
    a1, d1 = areas[i + ONE, c, 0], areas[i + ONE, c, 1]
    if start > i:
        whole, part = i + 1.0 - start, (level - start) / (i + 1.0 - start)
        power = max(d1 * whole / a1, 1.0) if a1 > 0.0 else 1.0
        a = a1 * part**power
        return a, power * a / (level - start)
    return cubic(areas[i, c, 0], areas[i, c, 1], a1, d1, level - i)


@inner
def beside(areas, ends, first, c, u, level):
    """Return `above` where the levels of one of the columns are not whole: beside its highest point, or below them."""
    after = c + ONE
    if not level > min(first[c], first[after]):
        return 0.0, 0.0
    a, d = column_above(areas, ends, c, first[c], level)
    b, e = column_above(areas, ends, after, first[after], level)
    return a + u * (b - a), d + u * (e - d)


@inlined
def above(areas, ends, first, place, level):
    """Return B and -dB/d(level) times the distance of levels; place in columns, level in levels below the top."""
    c = Place(place)
    after, u, whole = c + ONE, place - c, math.floor(level)
    if whole < max(first[c], first[after]) or whole >= areas.shape[0] - 1:
        return beside(areas, ends, first, c, u, level)
    i = Place(whole)
    high, low = areas[i], areas[i + ONE]
    a0, d0 = high[c, 0] + u * (high[after, 0] - high[c, 0]), high[c, 1] + u * (high[after, 1] - high[c, 1])
    a1, d1 = low[c, 0] + u * (low[after, 0] - low[c, 0]), low[c, 1] + u * (low[after, 1] - low[c, 1])
    return cubic(a0, d0, a1, d1, level - whole)


@inlined
def begins(places, moved, span):
    """Return the number of the first node at or after the first column, at a phase that moves them by `moved`."""
    return np.searchsorted(places, span - moved)


@inlined
def node_at(places, begin, k, moved, span):
    """Return the number and the place (columns) of the node `k` after the one at the first column."""
    i = begin + k
    if i < len(places):
        return i, max(places[i] + moved - span, 0.0)
    return i - len(places), places[i - len(places)] + moved


@inner
def gather(first, places, weights, levels, moved, span, lowest, columns, kept):
    """Write the nodes that may touch above `lowest`; return their number and the highest point, in levels.

    columns: number of the column before each [nodes].
    kept: part of the way to the next column, level, weight, and the first whole level of both columns [4, nodes].
    """
    count, top, last, begin = 0, -math.inf, len(first) - 1, begins(places, moved, span)
    for k in range(len(places)):
        i, place = node_at(places, begin, k, moved, span)
        c = int(place)
        if c >= last:
            break
        near, far = first[Place(c)], first[Place(c) + ONE]
        reach = levels[i] - min(near, far)
        top = max(top, reach)
        if reach > lowest:
            columns[count] = c
            kept[0, count], kept[1, count], kept[2, count] = place - c, levels[i], weights[i]
            kept[3, count] = math.ceil(max(near, far))
            count += 1
    return count, top


@inner
def sums_of(areas, ends, first, columns, kept, count, z):
    """Return the sums of B and -dB/d(level) over gathered nodes, and the deepest level that touches; z in levels."""
    last = areas.shape[0] - 1
    depth, touching = inner_sums(areas, columns, kept, count, z)
    deepest = 0.0
    for i in range(count):
        level = kept[1, i] - z
        if kept[3, i] <= level < last:
            deepest = max(deepest, level)
            continue
        a, d = beside(areas, ends, first, Place(columns[i]), kept[0, i], level)
        if d > 0.0:
            depth += kept[2, i] * a
            touching += kept[2, i] * d
            deepest = max(deepest, level)
    return depth, touching, deepest


@summing
def inner_sums(areas, columns, kept, count, z):
    """Return both sums over the nodes between the first and the last whole level of their columns.

    The loop has no branches, so that several nodes are read at once.
    """
    last, depth, touching = areas.shape[0] - 1, 0.0, 0.0
    parts, levels, weights, starts = kept[0], kept[1], kept[2], kept[3]
    for number in range(count):
        k = Place(number)
        level, u, c = levels[k] - z, parts[k], Place(columns[k])
        i = Place(min(max(level, 0.0), last - 1.0))
        t = level - i
        a0 = areas[i, c, 0] + u * (areas[i, c + ONE, 0] - areas[i, c, 0])
        d0 = areas[i, c, 1] + u * (areas[i, c + ONE, 1] - areas[i, c, 1])
        a1 = areas[i + ONE, c, 0] + u * (areas[i + ONE, c + ONE, 0] - areas[i + ONE, c, 0])
        d1 = areas[i + ONE, c, 1] + u * (areas[i + ONE, c + ONE, 1] - areas[i + ONE, c, 1])
        a, d = cubic(a0, d0, a1, d1, t)
        weight = weights[k] if starts[k] <= level and level < last and d > 0.0 else 0.0
        depth += weight * a
        touching += weight * d
    return depth, touching


@signed_kernel(f"f8({PIECES}, f8, f8[::1], f8[::1], f8[::1], f8[::1], f8[::1], i8[::1])")
def solve_nodes(
    areas, ends, first, places, weights, levels, numbers, scale, phases, targets, guess, height, touching, iterations
):
    """Write z (m), the part that touches and the number of steps at each of `phases`; return the deepest level.

    guess: z (m) that Newton's method starts from, or NaN: from the parabola through the three phases before.
    """
    drop, span = numbers[1], numbers[2] / numbers[0]
    below, deepest, pressed = BELOW * scale / drop, 0.0, numbers[3] / drop
    kept, columns = np.empty((4, len(places))), np.empty(len(places), np.int64)
    z, last, earlier = math.nan, math.nan, math.nan
    for p in range(len(phases)):
        moved = (phases[p] - math.floor(phases[p])) * span
        ahead = 3.0 * (z - last) + earlier
        if math.isnan(ahead):
            ahead = z if math.isnan(last) else 2.0 * z - last
        earlier, last = last, z
        z = guess[p] / drop if not math.isnan(guess[p]) else ahead
        lowest = z - below if not math.isnan(z) else math.inf
        count, top = gather(first, places, weights, levels, moved, span, lowest, columns, kept)
        if targets[p] < EMPTY * scale:
            z = top
            height[p], touching[p], iterations[p] = z * drop, 0.0, 1
            continue
        if not z < top:
            z = top - FIRST * pressed * math.sqrt(targets[p])
        low, high, longest = -math.inf, top, FIRST * pressed * math.sqrt(targets[p])
        for turn in range(MOST_STEPS):
            if z < lowest:
                lowest = z - below
                count, top = gather(first, places, weights, levels, moved, span, lowest, columns, kept)
            depth, width, deep = sums_of(areas, ends, first, columns, kept, count, z)
            deepest = max(deepest, deep)
            iterations[p] = turn + 1
            change = 0.0
            if depth > 0.0:  # Newton's step for the root of F, which is nearly straight
                change = 2.0 * (depth - math.sqrt(depth * targets[p])) / width
            if depth >= targets[p]:
                low = z
            else:
                high = z
            if depth <= 0.0 or not low <= z + change <= high:
                change = 0.5 * (low + high) - z if low > -math.inf else -math.inf
            if change < -longest:
                change, longest = -longest, 2.0 * longest
            z += change
            if abs(change) * drop < SETTLED * scale:
                break
        height[p], touching[p] = z * drop, width / drop
    return deepest


@signed_kernel(f"void({PIECES}, f8[::1], f8[:,::1], f8[:,::1], f8[:,::1])")
def measure_nodes(areas, ends, first, places, weights, levels, numbers, phases, z, depth, touching):
    """Write F (m) and the part that touches at each of `phases` and each of its z (m): [phases, levels]."""
    drop, span = numbers[1], numbers[2] / numbers[0]
    kept, columns = np.empty((4, len(places))), np.empty(len(places), np.int64)
    for p in range(len(phases)):
        moved = (phases[p] - math.floor(phases[p])) * span
        for j in range(z.shape[1]):
            low = z[p, j] / drop
            count, _top = gather(first, places, weights, levels, moved, span, low, columns, kept)
            depth[p, j], width, _deepest = sums_of(areas, ends, first, columns, kept, count, low)
            touching[p, j] = width / drop


@signed_kernel(f"void({PIECES}, f8[::1], f8[::1], f8[::1], f8[:,::1])")
def sum_node_slopes(areas, ends, first, places, weights, levels, numbers, slopes, phases, z, out):
    """Write S, T, N_1 and N_0 at each of `phases` and z (m): [4, phases]."""
    drop, span, last = numbers[1], numbers[2] / numbers[0], len(first) - 1
    for p in range(len(phases)):
        moved = (phases[p] - math.floor(phases[p])) * span
        slope, rise, depth, width = 0.0, 0.0, 0.0, 0.0
        begin = begins(places, moved, span)
        for k in range(len(places)):
            i, place = node_at(places, begin, k, moved, span)
            if int(place) >= last:
                break
            a, d = above(areas, ends, first, place, levels[i] - z[p] / drop)
            depth += weights[i] * a
            width += weights[i] * d / drop
            slope += weights[i] * a * slopes[i]
            rise += weights[i] * d / drop * slopes[i]
        out[0, p], out[1, p], out[2, p], out[3, p] = slope, rise, depth, width
