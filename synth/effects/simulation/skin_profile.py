"""The profile g = h - efree of a contact of viscous skin: a polygon over the points, and its integrals above z.

Stage   part of `skin_steps`
Model   Straight lines join the points of each state of the skin (`held`, `free`). Each piece is cut where the two lines
        cross. g = h - max(of the two lines) is straight between points and cuts, so its area above z is exact.
        A piece counts with its weight, which is 1 along a line. Along a line the contact may span a part of the points,
        about their middle. The pieces that its ends cut count in part.
Source  Fagiani & Barbieri (2016), eq. 1.
Limits  Exact for the polygon. The error of the polygon itself depends on the distance of points, see `skin_steps`.
"""

from __future__ import annotations

import math

from synth.kernels import inner, summing

LEAST_PIECES = 3.0  # least length of a contact that shrinks: at least one whole piece must remain to bound z
FLAT = 1e-30  # of a1 + a2: least rise of a piece, so that a level piece is entirely above z or below

SURFACE, HELD_FREE, FREE_FREE, POINTS = 0, 1, 2, 3  # rows of `nodes`: h, efree of each state, g
CUTS, PLACES, FIRST, SECOND = 0, 1, 2, 3  # rows of `pieces`: g and place (0 to 1) of the cut, 1 / |rise| of both sides


@inner
def part_of(span, load):
    """Return the part of the length of the points that is in contact at `load` (N); span: see `Span`."""
    return min(max(span[0] * load ** span[1], span[2]), 1.0) if span[1] > 0.0 else 1.0


@summing
def cut_weights(weights, rims, along, across, part, cut):
    """Write the weights of the pieces of an area within a square contact, relative to its area.

    rims: see `SkinPoints`.
    along, across: pieces and rows over the whole length.
    part: of the whole length that is in contact.
    """
    half, beside, grown = 0.5 * along * part, 0.5 * across * part, 1.0 / (part * part)
    first, second = rims[0], rims[1]
    for j in range(len(weights)):
        inside = min(max(half - first[j], 0.0), 1.0) * min(max(beside - second[j], 0.0), 1.0)
        cut[j] = weights[j] * inside * grown


@inner
def window_of(part, count):
    """Return where the contact begins and ends, and the first and the one after the last of its whole pieces.

    part: of the length of the points, about its middle.
    count: pieces.
    """
    begin = 0.5 * count * (1.0 - max(part, LEAST_PIECES / count))
    first = math.ceil(begin)
    return begin, count - begin, first, count - first  # by symmetry: rounding would move the last where begin is tiny


@summing
def modified_profile(nodes, pieces):
    """Write g at points and cuts."""
    surface, held, free, points = nodes[SURFACE], nodes[HELD_FREE], nodes[FREE_FREE], nodes[POINTS]
    for j in range(points.shape[0]):
        points[j] = surface[j] - max(held[j], free[j])
    surface1, held1, free1, points1 = surface[1:], held[1:], free[1:], points[1:]
    cuts, places, first, second = pieces[CUTS], pieces[PLACES], pieces[FIRST], pieces[SECOND]
    for j in range(points1.shape[0]):
        apart = abs(held[j] - free[j])
        place = apart / max(apart + abs(held1[j] - free1[j]), FLAT)  # any place will do if the lines do not cross
        recovered = max(held[j] + place * (held1[j] - held[j]), free[j] + place * (free1[j] - free[j]))
        cut = surface[j] + place * (surface1[j] - surface[j]) - recovered
        rise, fall = max(abs(cut - points[j]), FLAT), max(abs(points1[j] - cut), FLAT)
        both = 1.0 / (rise * fall)
        cuts[j], places[j] = cut, place
        first[j], second[j] = fall * both, rise * both


@summing
def sum_of(points, weights):
    """Return the integral of straight lines through `points`, and that of 1, in pieces with `weights`."""
    points1, total, whole = points[1:], 0.0, 0.0
    for j in range(points1.shape[0]):
        total += weights[j] * (points[j] + points1[j])
        whole += weights[j]
    return 0.5 * total, whole


@summing
def area_of(nodes, pieces, weights, z, begin, end):
    """Return the integrals of max(g - z, 0) and of 1 where g is above z, from one piece to another, in pieces."""
    weights = weights[begin:end]
    points, points1 = nodes[POINTS, begin:end], nodes[POINTS, begin + 1 : end + 1]
    cuts, places = pieces[CUTS, begin:end], pieces[PLACES, begin:end]
    first, second = pieces[FIRST, begin:end], pieces[SECOND, begin:end]
    area, length = 0.0, 0.0
    for j in range(cuts.shape[0]):
        middle = max(cuts[j] - z, 0.0)
        left, right = max(points[j] - z, 0.0) + middle, middle + max(points1[j] - z, 0.0)
        left_part = min(1.0, left * first[j]) * places[j]
        right_part = min(1.0, right * second[j]) * (1.0 - places[j])
        area += weights[j] * (left_part * left + right_part * right)
        length += weights[j] * (left_part + right_part)
    return 0.5 * area, length


@summing
def slope_integral(rates, nodes, pieces, weights, z, begin, end):
    """Return the integral of max(g - z, 0) times `rates`, from one piece to another, in pieces.

    rates: minus the slope of the texture over its angle (1/rad) at the points. It is interpolated linearly between
        them, so that work at the points equals the work done.
    """
    points, points1 = nodes[POINTS, begin:end], nodes[POINTS, begin + 1 : end + 1]
    rates, rates1, weights = rates[begin:end], rates[begin + 1 : end + 1], weights[begin:end]
    cuts, places = pieces[CUTS, begin:end], pieces[PLACES, begin:end]
    first, second = pieces[FIRST, begin:end], pieces[SECOND, begin:end]
    total = 0.0
    for j in range(cuts.shape[0]):
        left, middle, right = max(points[j] - z, 0.0), max(cuts[j] - z, 0.0), max(points1[j] - z, 0.0)
        slope, slope1 = rates[j], rates1[j]
        turn = slope + places[j] * (slope1 - slope)
        part = min(1.0, (left + middle) * first[j])
        area = left * ((3.0 - part) * slope + part * turn) + middle * ((3.0 - part) * turn + part * slope)
        total += weights[j] * places[j] * part * area
        part = min(1.0, (middle + right) * second[j])
        area = middle * ((3.0 - part) * turn + part * slope1) + right * ((3.0 - part) * slope1 + part * turn)
        total += weights[j] * (1.0 - places[j]) * part * area
    return total / 6.0


@inner
def line_above(g0, g1, rate0, rate1, width):
    """Return area, length and work (area times rate) of the part above 0 of a line from g0 to g1 over `width`."""
    left, right = max(g0, 0.0), max(g1, 0.0)
    part = min(1.0, (left + right) / max(abs(g1 - g0), FLAT))
    work = left * ((3.0 - part) * rate0 + part * rate1) + right * ((3.0 - part) * rate1 + part * rate0)
    return 0.5 * width * part * (left + right), width * part, width * part * work / 6.0


@inner
def ends_above(rates, points, z, window):
    """Return area, length and work, as `line_above` does, of the pieces that the ends of the contact cut.

    Only skin without memory has such ends, and its g is straight between points.
    """
    begin, end, first, last = window
    left, right = first - begin, end - last
    g0, rate0 = points[first], rates[first]
    g1, rate1 = g0 + left * (points[first - 1] - g0), rate0 + left * (rates[first - 1] - rate0)
    area, length, work = line_above(g0 - z, g1 - z, rate0, rate1, left)
    g0, rate0 = points[last], rates[last]
    g1, rate1 = g0 + right * (points[last + 1] - g0), rate0 + right * (rates[last + 1] - rate0)
    other = line_above(g0 - z, g1 - z, rate0, rate1, right)
    return area + other[0], length + other[1], work + other[2]


@inner
def modified_area(nodes, pieces, weights, z, window):
    """Return the mean over L of max(g - z, 0), and the part of L where g is above z; over an area A0 replaces L."""
    begin, end, first, last = window
    area, length = area_of(nodes, pieces, weights, z, first, last)
    if begin > 0.0:
        one = ends_above(nodes[SURFACE], nodes[POINTS], z, window)
        area, length = area + one[0], length + one[1]
    return area / (end - begin), length / (end - begin)
