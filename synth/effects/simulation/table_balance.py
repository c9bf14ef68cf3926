"""One step of a contact whose energy is a table: by its momentum, or along its equilibria.

Model   U = k1 E(z) - k2 E(z - d0), k1 = k + P / d0, k2 = P / d0; reaction R = -dU/dz = k1 I(z) - k2 I(z - d0).
        With mass m or damping c, over a step h at the phase and load of its middle, s = z1 - z0:
        m (v1 - v0) / h + c s / h = -[U(z1) - U(z0)] / s - w,  s = h (v0 + v1) / 2.
        Multiplied by s: m v^2 / 2 + U + w z changes by -c s^2 / h exactly, so nothing but the surface and the load
        drives it. Without both, z goes downhill in U + w z to the first place where R = w, piece by piece of the table,
        each a cubic whose first root is found between its extremes.
Source  Gonzalez (1996), J. Nonlinear Sci. 6; McLachlan, Quispel & Robidoux (1999), Phil. Trans. R. Soc. A 357; for
        collisions Chatziioannou & van Walstijn (2015), J. Sound Vib. 340; Bilbao, Torin & Chatziioannou (2015), Acta
        Acust. united Ac. 101. Adhesive law: Maugis (1992), J. Colloid Interface Sci. 150, with a force that falls
        linearly with the gap.
Limits  solved to round-off. With adhesion a step of little mass and damping may have several solutions: the one nearest
        the place where the velocity leads, in the direction in which the forces push.
"""

from __future__ import annotations

import math

import numpy as np

from synth.effects.simulation.potential_reading import cell_of, path_across, piece_at
from synth.kernels import inlined, kernel

EPSILON = 2.0**-52
BAND = 64.0  # roundings of forces and of z within which a finger rests; with few a damped one swings on at 1e-19 m
MOST_ITERATIONS = 100  # bisection ends before
MARCH = 1.6  # growth of the strides toward a solution; above 2 they would pass over neighbouring ones


@inlined
def path_from(pool, layout, row, weights, d, cell):
    """Return I about `d` (m), where paths begin: cell, d, j0 to j3, scale, and the ends of the cell from d (m)."""
    cell = cell_of(pool, layout, d, cell)
    j0, j1, j2, j3 = piece_at(pool, layout, row, weights, cell, d)
    low, high = pool[layout.bounds + cell] - d, pool[layout.bounds + cell + 1] - d
    return cell, d, j0, j1, j2, j3, pool[layout.scales + cell], low, high


@inlined
def no_path(cell):
    """Return a path along which there is nothing."""
    return cell, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, -np.inf, np.inf


@inlined
def mean_over(pool, layout, row, weights, path, s):
    """Return the mean of I over `s` (m) from where `path` begins, its derivative, and half its second derivative."""
    cell, d, j0, j1, j2, j3, scale, low, high = path
    if low <= s <= high:
        u = s * scale
        slope = scale * (0.5 * j1 + u * (j2 * (2.0 / 3.0) + u * (0.75 * j3)))
        bend = scale * scale * (j2 * (1.0 / 3.0) + u * (0.75 * j3))
        return j0 + u * (0.5 * j1 + u * (j2 * (1.0 / 3.0) + u * (0.25 * j3))), slope, bend
    mean, slope, _cell = path_across(pool, layout, row, weights, cell, d, s)
    return mean, slope, np.inf


@inlined
def rounding_of(first, second, law, load, height):
    """Return the sum of forces (N) below which they balance: some roundings of each, and of z."""
    k1, k2 = law
    forces = k1 * abs(first[2]) + k2 * abs(second[2]) + abs(load)
    slopes = k1 * abs(first[3]) * first[6] + k2 * abs(second[3]) * second[6]
    return BAND * EPSILON * (forces + abs(height) * slopes)


@inlined
def excess_at(pool, layout, row, weights, first, second, law, drive, s):
    """Return g, dg/ds and half d2g/ds2 of what a step solves: inertia (s - ahead) + drag s - (mean of R) + load."""
    k1, k2 = law
    inertia, drag, ahead, load = drive
    mean1, slope1, bend1 = mean_over(pool, layout, row, weights, first, s)
    mean2, slope2, bend2 = mean_over(pool, layout, row, weights, second, s) if k2 > 0.0 else (0.0, 0.0, 0.0)
    resisting = inertia * (s - ahead) + drag * s
    total = resisting - k1 * mean1 + k2 * mean2 + load
    size = abs(resisting) + k1 * abs(mean1) + k2 * abs(mean2) + abs(load)
    return total, inertia + drag - k1 * slope1 + k2 * slope2, k1 * abs(bend1) + k2 * abs(bend2), size


@kernel
def bracket_of(pool, layout, row, weights, first, second, law, drive):
    """Return two moves (m) between which g changes sign, the nearest to `ahead` where the forces push."""
    ahead = drive[2]
    total = excess_at(pool, layout, row, weights, first, second, law, drive, ahead)[0]
    sign = -1.0 if total > 0.0 else 1.0
    stride = abs(total) / (drive[0] + drive[1] + law[0])  # g is no steeper: nothing is passed over
    near = ahead
    while stride > 0.0:
        far = near + sign * stride
        if far == near or excess_at(pool, layout, row, weights, first, second, law, drive, far)[0] * sign >= 0.0:
            return min(near, far), max(near, far)
        near, stride = far, MARCH * stride
    return ahead, ahead


@inlined
def energy_move(pool, layout, row, weights, first, second, law, drive, band):
    """Return s - ahead (m) of one step; drive: 2 m / h^2 and c / h (N/m), h v0 (m) and the load (N)."""
    inertia, drag, ahead, _load = drive
    least = inertia + drag - 0.5 * law[1]  # dg/ds is at least this: above zero there is one solution
    low, high = -np.inf, np.inf
    s = ahead
    if least < 0.0:
        low, high = bracket_of(pool, layout, row, weights, first, second, law, drive)
        s = 0.5 * (low + high)
        least = 0.0
    move = s - ahead
    for _ in range(MOST_ITERATIONS):
        total, slope, bend, size = excess_at(pool, layout, row, weights, first, second, law, drive, s)
        if abs(total) <= band and (s == 0.0 or abs(total) <= 4.0 * EPSILON * size):
            return move
        if total > 0.0:
            high = min(high, s)
        else:
            low = max(low, s)
        step = -total / max(slope, least) if slope > 0.0 or least > 0.0 else np.inf
        if not low < s + step < high and (low > -np.inf and high < np.inf):
            step = 0.5 * (low + high) - s
            move += step
            s = ahead + move
            if high - low <= EPSILON * (abs(low) + abs(high)):
                return move
            continue
        move += step
        s = ahead + move
        inside = first[7] <= s <= first[8] and second[7] <= s <= second[8]
        if abs(step) <= EPSILON * abs(s) or (inside and bend * step * step <= EPSILON * size):
            return move
    return move


@kernel
def cubic(c0, c1, c2, c3, x):
    """Return the cubic at `x`."""
    return c0 + x * (c1 + x * (c2 + x * c3))


@kernel
def root_between(c0, c1, c2, c3, low, high):
    """Return the root of a cubic that falls from above zero at `low` to zero or less at `high`, without a turn."""
    x = -c0 / c1 if c1 < 0.0 else low
    if not low <= x <= high:
        x = 0.5 * (low + high)
    for _ in range(MOST_ITERATIONS):
        value = cubic(c0, c1, c2, c3, x)
        if value > 0.0:
            low = x
        else:
            high = x
        slope = c1 + x * (2.0 * c2 + 3.0 * x * c3)
        step = -value / slope if slope < 0.0 else np.inf
        if abs(step) <= EPSILON * abs(x):
            return x + step
        x = x + step if low <= x + step <= high else 0.5 * (low + high)
        if high - low <= EPSILON * abs(high):
            return x
    return x


@kernel
def first_root(c0, c1, c2, c3, end):
    """Return the first x in 0..end at which a cubic, above zero at 0, is zero or less; -1 where there is none."""
    if c0 <= 0.0:
        return 0.0
    if end == np.inf:  # beyond the table I is a line
        return -c0 / c1 if c1 < 0.0 else -1.0
    turn1, turn2 = end, end
    inner = c2 * c2 - 3.0 * c1 * c3
    if inner > 0.0:
        q = -(c2 + math.copysign(math.sqrt(inner), c2))
        turn1, turn2 = q / (3.0 * c3), c1 / q
        turn1 = turn1 if 0.0 < turn1 < end else end
        turn2 = turn2 if 0.0 < turn2 < end else end
    low = 0.0
    for stop in (min(turn1, turn2), max(turn1, turn2), end):
        if cubic(c0, c1, c2, c3, stop) <= 0.0:
            return root_between(c0, c1, c2, c3, low, stop)
        low = stop
    return -1.0


@kernel
def downhill_move(pool, layout, row, weights, first, second, law, load, band):
    """Return how far (m) the first stable equilibrium lies downhill, and whether there is one."""
    k1, k2 = law
    excess = k1 * first[2] - k2 * second[2] - load
    if abs(excess) <= band:
        return 0.0, True
    up = excess > 0.0
    sign = 1.0 if up else -1.0
    place = 0.0
    _cell, _d, p0, p1, p2, p3, scale1, low1, high1 = first
    _cell, _d, q0, q1, q2, q3, scale2, low2, high2 = second
    cell1, cell2 = first[0], second[0]
    last = layout.last
    while True:
        end1, end2 = (high1, high2) if up else (-low1, -low2)
        reach = min(end1, end2) - sign * place
        a1, b1 = k1 * scale1, k2 * scale2
        a2, b2 = a1 * scale1, b1 * scale2
        c0, c1 = k1 * p0 - k2 * q0 - load, a1 * p1 - b1 * q1
        c2, c3 = a2 * p2 - b2 * q2, a2 * scale1 * p3 - b2 * scale2 * q3
        found = first_root(sign * c0, c1, sign * c2, c3, reach)
        if found >= 0.0:
            return place + sign * found, True
        if reach == np.inf:
            return place, False
        place = sign * min(end1, end2)
        if end1 <= end2:
            cell1 = min(max(cell1 + (1 if up else -1), 0), last)
        if k2 > 0.0 and end2 <= end1:
            cell2 = min(max(cell2 + (1 if up else -1), 0), last)
        p0, p1, p2, p3 = piece_at(pool, layout, row, weights, cell1, first[1] + place)
        scale1 = pool[layout.scales + cell1]
        low1, high1 = pool[layout.bounds + cell1] - first[1], pool[layout.bounds + cell1 + 1] - first[1]
        if k2 > 0.0:
            q0, q1, q2, q3 = piece_at(pool, layout, row, weights, cell2, second[1] + place)
            scale2 = pool[layout.scales + cell2]
            low2, high2 = pool[layout.bounds + cell2] - second[1], pool[layout.bounds + cell2 + 1] - second[1]


@kernel
def elastic_place(pool, layout, row, weights, d, cell, target, base):
    """Return d (m) at which I is `target` (m), above zero, and its cell; `d` and `cell` are a first guess."""
    lowest, low, high = pool[layout.bounds + 1], -np.inf, pool[layout.bounds + layout.last]  # I is 0 at the top
    for _ in range(MOST_ITERATIONS):
        cell = cell_of(pool, layout, d, cell)
        depth, rise, _j2, _j3 = piece_at(pool, layout, row, weights, cell, d)
        touching = -rise * pool[layout.scales + cell]
        excess = depth - target
        if excess >= 0.0:
            low = max(low, d)
        else:
            high = min(high, d)
        if abs(excess) <= EPSILON * (2.0 * target + touching * (abs(d) + abs(base))):
            return d, cell
        ahead = d + excess / touching if touching > 0.0 else np.inf
        if not low < ahead < high:
            ahead = 0.5 * (low + high) if low > -np.inf else min(lowest, d - 1.0 / pool[layout.scales])
        d = ahead
    return d, cell
