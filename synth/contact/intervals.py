"""The parts of one grid cell that touch, as intervals: none is missed, and their edges are found to round-off.

Model   cells, heights and y = h - z are those of `patches`, the level being z and the dome's parabola. The cell is cut
        into pieces that are monotone, or curved to one side only, by bounds on the second and third derivative, as
        there; in each there are at most two edges. Intervals that meet at a cut are joined again, so that an end of an
        interval is an edge, where y vanishes, or an end of the cell.
Source  Fagiani & Barbieri (2016), eqs 1-2: the integrand max(h - z, 0); the rest is derived here.
Limits  heights relative to a1 + a2 (so of order 1); an edge errs by about 1e-11 of the width of its patch, or by what
        1e-16 (a1 + a2) of height makes of it.
"""

from __future__ import annotations

from synth.contact.patches import FLAT, SMALLEST_PIECE, Cell, parabola_root, profile, turning_point
from synth.kernels import inlined, kernel

LEFT, RIGHT, LEFT_EDGE, RIGHT_EDGE = range(4)  # rows of what is found; the last two are 1 at an edge, 0 at a cut
MOST_INTERVALS = 32  # of a cell; seven functions that span h leave six edges at most, and level rounding some more
EDGE_STEP = 4e-6  # of half a cell: Newton's last step, which leaves its square
EDGE_BEND = 3e-6  # of its slope: what the last step may change the slope by; so an edge is right to 1e-11 of a patch


@inlined
def edge_between(cell: Cell, rising: bool, low: float, high: float, t: float) -> float:
    """Return the edge between `low` and `high`, where y is monotone (rising or falling) and changes its sign.

    t: where to begin.
    """
    for _ in range(60):
        y, slope, curvature, _area = profile(cell, t)
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
    y, slope, curvature, _area = profile(cell, middle)
    y_low, y_high = profile(cell, low)[0], profile(cell, high)[0]
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
        y, slope, curvature, _area = profile(cell, middle)
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
