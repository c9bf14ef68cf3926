"""The parts of one grid cell that touch, as intervals: none is missed, and their edges are found to round-off.

Model   In a cell, t in [-1, 1] runs over it and y = h - z = sum over both surfaces of u cos(k t) + (v / k) sin(k t),
        less what a dome takes off: offset + lean t + bow t^2 (z is part of the offset). The cell is cut into pieces
        that are monotone, or curved to one side only, by bounds on the second and third derivative, as in `patches`;
        in each there are at most two edges. Intervals that meet at a cut are joined again, so that an end of an
        interval is an edge, where y vanishes, or an end of the cell.
Source  Fagiani & Barbieri (2016), eqs 1-2: the integrand max(h - z, 0); the rest is derived here.
Limits  heights relative to a1 + a2 (so of order 1); an edge errs by about 1e-11 of the width of its patch, or by what
        1e-16 (a1 + a2) of height makes of it.
"""

from __future__ import annotations

from synth.contact.kernels import inlined, kernel
from synth.contact.patches import FLAT, SMALLEST_PIECE, parabola_root, sine_series

Cell = tuple[float, float, float, float, float, float, float, float, float]
"""u1, v1, k1^2, u2, v2, k2^2, offset, lean, bow"""

LEFT, RIGHT, LEFT_EDGE, RIGHT_EDGE = range(4)  # rows of what is found; the last two are 1 at an edge, 0 at a cut
MOST_INTERVALS = 32  # of a cell; seven functions that span h leave six edges at most, and level rounding some more
EDGE_STEP = 4e-6  # of half a cell: Newton's last step, which leaves its square
EDGE_BEND = 3e-6  # of its slope: what the last step may change the slope by; so an edge is right to 1e-11 of a patch


@inlined
def relief(cell: Cell, t: float) -> tuple[float, float, float]:
    """Return y = h - z, its slope and its curvature at `t` of the cell."""
    u1, v1, k1, u2, v2, k2, offset, lean, bow = cell
    s1, c1 = sine_series(k1, t)
    s2, c2 = sine_series(k2, t)
    h1 = u1 - u1 * k1 * c1 + v1 * s1
    h2 = u2 - u2 * k2 * c2 + v2 * s2
    slope = v1 - k1 * (u1 * s1 + v1 * c1) + v2 - k2 * (u2 * s2 + v2 * c2)
    return h1 + h2 - offset - t * (lean + bow * t), slope - lean - 2.0 * bow * t, -k1 * h1 - k2 * h2 - 2.0 * bow


@inlined
def edge_between(cell: Cell, rising: bool, low: float, high: float, t: float) -> float:
    """Return the edge between `low` and `high`, where y is monotone (rising or falling) and changes its sign.

    t: where to begin.
    """
    for _ in range(60):
        y, slope, curvature = relief(cell, t)
        if (y > 0.0) == rising:
            high = t
        else:
            low = t
        step = -y / slope if slope != 0.0 else high - low
        guess = t + step
        if abs(step) <= EDGE_STEP and abs(step * curvature) <= EDGE_BEND * abs(slope):
            t = min(max(guess, low), high)
            break
        if high - low < 1e-15:
            break
        t = guess if low < guess < high else 0.5 * (low + high)
    return t


@inlined
def turning_point(cell: Cell, low: float, high: float, t: float) -> tuple[float, float]:
    """Return where y turns between `low` and `high`, and y there; an end of the piece where it does not turn inside."""
    y = 0.0
    for _ in range(8):
        t = min(max(t, low), high)
        y, slope, curvature = relief(cell, t)
        step = -slope / curvature if curvature != 0.0 else 0.0
        if abs(step) < 1e-8 or not low < t + step < high:
            break
        t += step
    return t, y


@inlined
def joined(found, count, left, right, left_edge, right_edge):
    """Add an interval to the `count` that are found, or to the last where it goes on; return how many there are."""
    goes_on = count > 0 and found[RIGHT_EDGE, count - 1] == 0.0 and left_edge == 0.0
    if (goes_on and found[RIGHT, count - 1] == left) or count == MOST_INTERVALS:
        found[RIGHT, count - 1] = right
        found[RIGHT_EDGE, count - 1] = right_edge
    else:
        found[LEFT, count], found[RIGHT, count] = left, right
        found[LEFT_EDGE, count], found[RIGHT_EDGE, count] = left_edge, right_edge
        count += 1
    return count


@kernel
def curved_piece(cell, low, high, found, count):
    """Add the touching intervals of a piece that is monotone or curved to one side only; return how many there are."""
    middle = 0.5 * (low + high)
    y, slope, curvature = relief(cell, middle)
    y_low, y_high = relief(cell, low)[0], relief(cell, high)[0]
    if (y_low > 0.0) != (y_high > 0.0):
        rising = y_high > 0.0
        guess = parabola_root(y, slope, curvature, middle, low, high, rising)
        edge = edge_between(cell, rising, low, high, guess)
        if rising:
            return joined(found, count, edge, high, 1.0, 0.0)
        return joined(found, count, low, edge, 0.0, 1.0)
    touching = y_low > 0.0
    if touching == (curvature <= 0.0):  # it touches all over, or nowhere
        return joined(found, count, low, high, 0.0, 0.0) if touching else count
    turn, extreme = turning_point(cell, low, high, middle - slope / curvature)
    if (extreme >= 0.0) if touching else (extreme <= 0.0):
        return joined(found, count, low, high, 0.0, 0.0) if touching else count
    guess = parabola_root(y, slope, curvature, middle, low, turn, not touching)
    left = edge_between(cell, not touching, low, turn, guess)
    guess = parabola_root(y, slope, curvature, middle, turn, high, touching)
    right = edge_between(cell, touching, turn, high, guess)
    if not touching:
        return joined(found, count, left, right, 1.0, 1.0)
    count = joined(found, count, low, left, 0.0, 1.0)
    return joined(found, count, right, high, 1.0, 0.0)


@kernel
def touching_intervals(cell, bound2, bound3, stack, found):
    """Write the touching intervals of a cell to `found`, float64 [4, MOST_INTERVALS], rising; return how many.

    bound2, bound3: bounds of the second and third derivative of y over t in this cell. stack: float64 [2, >= 32],
    scratch. A piece in which the slope may vanish and the curvature change sign is halved until it is clear.
    """
    stack[0, 0] = -1.0
    stack[1, 0] = 1.0
    depth = 1
    count = 0
    while depth > 0:
        depth -= 1
        low = stack[0, depth]
        high = stack[1, depth]
        middle = 0.5 * (low + high)
        half = 0.5 * (high - low)
        y, slope, curvature = relief(cell, middle)
        reach = abs(slope) * half + 0.5 * bound2 * half * half
        if y + reach <= 0.0:
            continue
        if reach <= FLAT or y - reach >= 0.0:
            if y > 0.0:
                count = joined(found, count, low, high, 0.0, 0.0)
            continue
        one_sided = abs(curvature) >= bound3 * half
        monotone = abs(slope) >= abs(curvature) * half + 0.5 * bound3 * half * half
        if one_sided or monotone or half < SMALLEST_PIECE:
            count = curved_piece(cell, low, high, found, count)
            continue
        stack[0, depth] = middle
        stack[1, depth] = high
        stack[0, depth + 1] = low
        stack[1, depth + 1] = middle
        depth += 2
    return count
