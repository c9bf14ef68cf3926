"""Area under h - z and length of the touching part of one grid cell, to round-off, without trigonometry.

Model   t in [-1, 1] runs over the cell. h(t) is the sum over both surfaces of u cos(k t) + (v / k) sin(k t), where u
        and v are height and slope at the cell's centre, and k is half the cell in radians of that surface. For
        k <= pi / 16, short Taylor series of sine and cosine are exact to round-off. Bounds on the third derivative
        divide h - z into pieces that are monotone or curved to one side only, so no touching patch is missed. An edge
        found with residual y and slope y' is corrected by -y^2 / (2 y') in the area, so it needs half the digits.
Source  Fagiani & Barbieri (2016), eqs 1-2: the integrand max(h - z, 0); the rest is derived here.
Limits  Heights are relative to a1 + a2, so of order 1. The area error is about 1e-17 of the cell; for a narrow patch
        it is smaller, in proportion to the width.
"""

from __future__ import annotations

import math

import numpy as np

from synth.kernels import inlined, inner

Cell = tuple[float, float, float, float, float, float, float]  # u1, v1, k1^2, u2, v2, k2^2, z

SMALLEST_PIECE = 2.0**-24  # of half a cell: the area of a smaller piece that is still undecided is below 1e-24
FLAT = 1e-17  # of a1 + a2: a piece with less relief counts as level, since the rounding of h is larger
EDGE_ERROR = 4e-6  # of half a cell: gives an area error of EDGE_ERROR^3 / 6 times the curvature, below 1e-18
NARROW = 2.0**-8  # of half a cell: Simpson's rule is exact to 1e-18 up to here; integrals from 0 would cancel


@inlined
def sine_series(k2: float, t: float) -> tuple[float, float]:
    """Return sin(k t) / k and (1 - cos(k t)) / k^2 for k^2 = `k2`, |k t| <= 0.2."""
    q = k2 * t * t
    s = t * (1.0 + q * (-1.0 / 6.0 + q * (1.0 / 120.0 + q * (-1.0 / 5040.0 + q * (1.0 / 362880.0)))))
    c = 0.5 + q * (-1.0 / 24.0 + q * (1.0 / 720.0 + q * (-1.0 / 40320.0 + q * (1.0 / 3628800.0))))
    return s, t * t * c


@inlined
def profile(cell: Cell, t: float) -> tuple[float, float, float, float]:
    """Return y = h - z at `t` of the cell, its slope, its curvature, and the integral of y from 0 to `t`."""
    u1, v1, k1, u2, v2, k2, z = cell
    s1, c1 = sine_series(k1, t)
    s2, c2 = sine_series(k2, t)
    h1 = u1 - u1 * k1 * c1 + v1 * s1
    h2 = u2 - u2 * k2 * c2 + v2 * s2
    slope = v1 - k1 * (u1 * s1 + v1 * c1) + v2 - k2 * (u2 * s2 + v2 * c2)
    area = u1 * s1 + v1 * c1 + u2 * s2 + v2 * c2 - z * t
    return h1 + h2 - z, slope, -k1 * h1 - k2 * h2, area


@inner
def crossing(cell: Cell, rising: bool, low: float, high: float, t: float) -> tuple[float, float, float]:
    """Return the edge between `low` and `high`, the integral of y from 0 to the edge, and 1 / |slope| at the edge.

    y must be monotone between them (rising or falling) and change sign. The search begins at `t`.
    """
    area = 0.0
    slope = 1.0
    step = 0.0
    for _ in range(60):
        y, slope, _curvature, area = profile(cell, t)
        if (y > 0.0) == rising:
            high = t
        else:
            low = t
        step = -y / slope
        if abs(step) < EDGE_ERROR and slope != 0.0:
            area += 0.5 * y * step
            break
        guess = t + step
        t = guess if low < guess < high else 0.5 * (low + high)
        step = 0.0
        if high - low < 1e-15:
            break
    return t + step, area, 1.0 / max(abs(slope), 1e-12)


@inner
def integral(cell: Cell, left: float, right: float) -> float:
    """Return the integral of y from `left` to `right`."""
    area: float = profile(cell, right)[3] - profile(cell, left)[3]
    return area


@inlined
def parabola_root(
    y: float, slope: float, curvature: float, middle: float, low: float, high: float, rising: bool
) -> float:
    """Return where the parabola through the piece's middle crosses zero, rising or falling, limited to the piece."""
    root = math.sqrt(max(slope * slope - 2.0 * curvature * y, 0.0))
    down = slope + (root if rising else -root)
    t = middle - 2.0 * y / down if down != 0.0 else middle
    return t if low < t < high else 0.5 * (low + high)


@inner
def turning_point(cell: Cell, low: float, high: float, t: float) -> tuple[float, float]:
    """Return where y turns between `low` and `high`, and y there; an end of the piece where y does not turn."""
    y = 0.0
    for _ in range(6):
        t = min(max(t, low), high)
        y, slope, curvature, _area = profile(cell, t)
        step = -slope / curvature if curvature != 0.0 else 0.0
        if abs(step) < 1e-8 or not low < t + step < high:
            break
        t += step
    return t, y


@inner
def polished(cell: Cell, low: float, high: float, t: float) -> float:
    """Return the edge near `t`, between `low` and `high`, to round-off."""
    for _ in range(3):
        y, slope, _curvature, _area = profile(cell, t)
        if slope != 0.0:
            t = min(max(t - y / slope, low), high)
    return t


@inner
def narrow_area(cell: Cell, left: float, right: float) -> float:
    """Return the integral of y over a narrow range by Simpson's rule."""
    ends = profile(cell, left)[0] + profile(cell, right)[0]
    area: float = (ends + 4.0 * profile(cell, 0.5 * (left + right))[0]) * (right - left) / 6.0
    return area


@inner
def curved_piece(
    cell: Cell,
    low: float,
    high: float,
    middle: float,
    y: float,
    slope: float,
    curvature: float,
    y_low: float,
    y_high: float,
) -> tuple[float, float, float]:
    """Return area, length and edge sum of the touching part of a piece that is monotone or curved to one side only.

    y, slope, curvature: at the middle of the piece.
    y_low, y_high: y at its ends.

    The edge sum is the sum of 1 / |slope| over the edges. The area is the sum of the integrals of y up to every edge
    where y falls, minus the sum of those up to every edge where y rises.
    """
    starts, ends = y_low > 0.0, y_high > 0.0
    left, right, turn, edges = low, high, high, 1
    if starts == ends:
        whole = high - low if starts else 0.0
        turn, extreme, edges = low, y_low, 2
        if (curvature > 0.0) == starts and curvature != 0.0:
            turn, extreme = turning_point(cell, low, high, middle - slope / curvature)
        if (extreme >= 0.0) if starts else (extreme <= 0.0):
            return integral(cell, low, high) if starts else 0.0, whole, 0.0
    area, length, edge_sum = 0.0, 0.0, 0.0
    for side in range(edges):
        begin, end = (low, turn) if side == 0 else (turn, high)
        rising = starts == (side == 1)
        guess = parabola_root(y, slope, curvature, middle, begin, end, rising)
        edge, edge_area, steepness = crossing(cell, rising, begin, end, guess)
        edge_sum += steepness
        area += -edge_area if rising else edge_area
        length += -edge if rising else edge
        if rising:
            left = edge
        else:
            right = edge
    if not (starts and ends) and right - left < NARROW:
        left = left if starts else polished(cell, low, turn, left)
        right = right if ends else polished(cell, turn if edges == 2 else low, high, right)
        return narrow_area(cell, left, right), right - left, edge_sum
    if ends:
        area, length = area + profile(cell, high)[3], length + high
    if starts:
        area, length = area - profile(cell, low)[3], length - low
    return area, length, edge_sum


@inner
def touching_part(cell: Cell, bound2: float, bound3: float, stack: np.ndarray) -> tuple[float, float, float]:
    """Return area, length and edge sum (see `curved_piece`) of the part of a cell where h > z.

    bound2, bound3: bounds of the second and third derivative of h over t in this cell.
    stack: float64 [2, >= 32], scratch memory.

    A piece in which the slope may vanish and the curvature may change sign is halved until one of them cannot.
    """
    area = 0.0
    length = 0.0
    edges = 0.0
    stack[0, 0] = -1.0
    stack[1, 0] = 1.0
    depth = 1
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
        if reach <= FLAT:
            area += 2.0 * half * y if y > 0.0 else 0.0
            length += 2.0 * half if y > 0.0 else 0.0
            continue
        if y - reach >= 0.0:
            area += integral(cell, low, high)
            length += high - low
            continue
        one_sided = abs(curvature) >= bound3 * half
        monotone = abs(slope) >= abs(curvature) * half + 0.5 * bound3 * half * half
        if one_sided or monotone or half < SMALLEST_PIECE:
            part, width, edge_sum = curved_piece(
                cell, low, high, middle, y, slope, curvature, profile(cell, low)[0], profile(cell, high)[0]
            )
            area += part
            length += width
            edges += edge_sum
            continue
        stack[0, depth] = low
        stack[1, depth] = middle
        stack[0, depth + 1] = middle
        stack[1, depth + 1] = high
        depth += 2
    return area, length, edges
