"""The approach z at a vanishing load: only the highest crests touch, each of them a parabola.

Model   Every crest that z reaches, of height t and curvature c, adds 4 sqrt(2) / 3 (t - z)^1.5 / sqrt(c) to F, or, at
        an end of the contact where the slope does not vanish, the area under its parabola to one side. As w -> 0, z is
        the envelope of the crests and the touching part of L vanishes with it.
Source  Fagiani & Barbieri (2016), eq. 1, in the limit w -> 0; derived here.
Limits  the next term of a crest's area is of order (t - z) relative to it: below w / k = 1e-18 (a1 + a2) that is lost
        in rounding. A crest that is cut by an end of the contact is cut in the parabola too.
"""

from __future__ import annotations

import math

import numpy as np

from synth.contact.patches import profile
from synth.kernels import inner

FLAT = 1e-7  # half cells from the end of a cell to the top of its parabola, below which the end is the crest
SAME_PLACE = 1e-5  # half cells between two crests, below which they are one, seen from both sides of a cell's end
REACH = 1e-6  # of a1 + a2: the top crest is pressed in by less than this at w / k = 1e-18, up to 1e5 ridges


@inner
def crest_of_cell(cell, first, last):
    """Return position, height, slope and curvature of the highest point of a cell, and whether it is a crest of h.

    The end of a cell is a crest only at an end of the contact (`first`, `last`: the cell is the first or last one).
    """
    best = -1.0
    top = profile(cell, -1.0)[0]
    for j in range(1, 17):
        t = -1.0 + 0.125 * j
        y = profile(cell, t)[0]
        if y > top:
            best, top = t, y
    low, high = max(best - 0.125, -1.0), min(best + 0.125, 1.0)
    t = best
    for _ in range(8):
        _y, slope, curvature, _area = profile(cell, t)
        t = min(max(t - slope / curvature, low), high) if curvature < 0.0 else high if slope > 0.0 else low
    top, slope, curvature, _area = profile(cell, t)
    flat = abs(slope) <= FLAT * abs(curvature)
    if t == -1.0 and not flat:
        return t, top, slope, curvature, first
    if t == 1.0 and not flat:
        return t, top, slope, curvature, last
    return t, top, 0.0, curvature, True


@inner
def crest_sum(crests, count, depth, half):
    """Return F and the touching part of L when the top crest is pressed in by `depth`.

    crests: rows are depth below the top, slope, curvature (both positive: falling), room to the left and to the right.
    """
    area = 0.0
    length = 0.0
    for j in range(count):
        y = depth - crests[0, j]
        if y <= 0.0:
            continue
        slope, curvature = crests[1, j], crests[2, j]
        width = 2.0 * y / (slope + math.sqrt(slope * slope + 2.0 * curvature * y))
        left, right = min(width, crests[3, j]), min(width, crests[4, j])
        area += (left + right) * y - 0.5 * slope * (left**2 + right**2) - curvature * (left**3 + right**3) / 6.0
        length += left + right
    return area * half, length * half


@inner
def crest_approach(tables, k1, k2, work, target):
    """Return z / (a1 + a2) and the touching part of L for F = `target` (at least 0, below 1e-18), by the crests alone.

    tables, k1, k2, work: the cells as `exact_solver.fill_cells` left them.
    """
    cells = tables.shape[1]
    floor = -2.0
    for i in range(cells):
        floor = max(floor, work[1, i])
    crests = np.empty((5, cells))
    top = -2.0
    at = -10.0
    count = 0
    for i in range(cells):
        if work[0, i] < max(floor, top - REACH):
            continue
        cell = (tables[0, i], tables[1, i], k1, work[3, i], work[4, i], k2, 0.0)
        t, height, slope, curvature, crest = crest_of_cell(cell, i == 0, i == cells - 1)
        place = 2.0 * i + t
        if not crest or place - at <= SAME_PLACE:
            continue
        at = place
        crests[0, count] = height
        crests[1, count] = abs(slope)
        crests[2, count] = max(-curvature, 1e-9)
        crests[3, count] = t + 1.0 if i == 0 else 2.0
        crests[4, count] = 1.0 - t if i == cells - 1 else 2.0
        top = max(top, height)
        count += 1
    for j in range(count):
        crests[0, j] = top - crests[0, j]
    if target <= 0.0:
        return top, 0.0
    half = 0.5 / cells
    depth = REACH
    for _ in range(60):
        area, length = crest_sum(crests, count, depth, half)
        step = (area - target) / length
        depth -= step
        if abs(step) <= 1e-9 * depth:
            break
    return top - depth, crest_sum(crests, count, depth, half)[1]
