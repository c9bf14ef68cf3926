"""The modified profile of a viscous contact, cut where skin begins to touch: heights, area above z, force, memory.

Model   An element that touches obeys p = kappa A (h - z - efree). Along the finger efree is smooth but for one kink,
        the front: behind it the skin has followed the surface, ahead of it it is still free. So each point keeps two
        states: `held`, as if the surface had held it since it began to touch, and `free`, as if it had been left to
        itself since then. What it did is the larger efree of the two, for pressure only pushes. Both are joined by
        straight lines, and each piece is cut where they cross: g = h - max(of the two lines) is a polygon again, and
        the area above z exact. p / (kappa A) is max(g - z, 0).
Source  this house; the area of a piece is that of `synth.contact.sampled`.
Limits  second order in the distance of points: 513 leave 0.35 % of the peak-to-peak of z in the default scene (4 ms,
        80 mm/s), where one state a point, whose front jumps from point to point, left 7 %. A patch narrower than the
        distance of points ends too soon when the point behind it leaves: jumps of z, 2e-4 of its peak-to-peak there.
        They are largest for skin that relaxes while a front goes from point to point: at 10 mm/s and 4 ms z is 1.7 %
        off with 513 points, 0.14 % with 2049.
"""

from __future__ import annotations

from synth.effects.simulation.skin import DECAY, FOLLOW, LOSE
from synth.kernels import kernel, summing

TINY = 1e-200  # of a1 + a2: memories round to multiples of 1e-216, so that none becomes a slow denormal number
FLAT = 1e-30  # of a1 + a2: the least rise of a piece, so that a level one is all above z or all below

HELD, FREE = 0, 1  # the two states of a point
SURFACE, HELD_FREE, FREE_FREE, POINTS = 0, 1, 2, 3  # rows of `nodes`: h, efree of the two states, g
CUTS, PLACES, FIRST, SECOND = 0, 1, 2, 3  # rows of `pieces`: g at the cut, its place in [0, 1], 1 / |rise| either side


@kernel
def free_indentations(elements, keep, terms, nodes):
    """Write efree of both states of every point.

    elements: float64 [2, 1 + n, points], indentation and n memories of each state.
    """
    for state in range(2):
        free, indentation = nodes[HELD_FREE + state], elements[state, 0]
        for j in range(free.shape[0]):
            free[j] = keep * indentation[j]
        for i in range(terms.shape[1]):
            lose, memory = terms[LOSE, i], elements[state, 1 + i]
            for j in range(free.shape[0]):
                free[j] -= lose * memory[j]


@summing
def modified_profile(nodes, pieces):
    """Write g at points and cuts; return the mean of g, the cuts left out: at most the mean of g."""
    surface, held, free, points = nodes[SURFACE], nodes[HELD_FREE], nodes[FREE_FREE], nodes[POINTS]
    for j in range(points.shape[0]):
        points[j] = surface[j] - max(held[j], free[j])
    surface1, held1, free1, points1 = surface[1:], held[1:], free[1:], points[1:]
    cuts, places, first, second = pieces[CUTS], pieces[PLACES], pieces[FIRST], pieces[SECOND]
    for j in range(points1.shape[0]):
        apart = abs(held[j] - free[j])
        place = apart / max(apart + abs(held1[j] - free1[j]), FLAT)  # any place serves where the lines do not cross
        recovered = max(held[j] + place * (held1[j] - held[j]), free[j] + place * (free1[j] - free[j]))
        cut = surface[j] + place * (surface1[j] - surface[j]) - recovered
        rise, fall = max(abs(cut - points[j]), FLAT), max(abs(points1[j] - cut), FLAT)
        both = 1.0 / (rise * fall)
        cuts[j], places[j] = cut, place
        first[j], second[j] = fall * both, rise * both
    total = 0.0
    for j in range(points1.shape[0]):
        total += points[j] + points1[j]
    return 0.5 * total / points1.shape[0]


@summing
def modified_area(nodes, pieces, z):
    """Return the mean over L of max(g - z, 0), and the part of L where g is above z."""
    points, points1 = nodes[POINTS], nodes[POINTS, 1:]
    cuts, places, first, second = pieces[CUTS], pieces[PLACES], pieces[FIRST], pieces[SECOND]
    area, length = 0.0, 0.0
    for j in range(cuts.shape[0]):
        middle = max(cuts[j] - z, 0.0)
        left, right = max(points[j] - z, 0.0) + middle, middle + max(points1[j] - z, 0.0)
        left_part = min(1.0, left * first[j]) * places[j]
        right_part = min(1.0, right * second[j]) * (1.0 - places[j])
        area += left_part * left + right_part * right
        length += left_part + right_part
    return 0.5 * area / cuts.shape[0], length / cuts.shape[0]


@summing
def slope_integral(rates, nodes, pieces, z):
    """Return the mean over L of max(g - z, 0) times `rates`, minus the texture's slope by its angle (1 / rad).

    The slope is that of the texture at the points, a straight line between them: then work at the points is work done.
    """
    points, points1 = nodes[POINTS], nodes[POINTS, 1:]
    cuts, places, first, second = pieces[CUTS], pieces[PLACES], pieces[FIRST], pieces[SECOND]
    total = 0.0
    for j in range(cuts.shape[0]):
        left, middle, right = max(points[j] - z, 0.0), max(cuts[j] - z, 0.0), max(points1[j] - z, 0.0)
        slope, slope1 = rates[j], rates[j + 1]
        turn = slope + places[j] * (slope1 - slope)
        part = min(1.0, (left + middle) * first[j])
        area = left * ((3.0 - part) * slope + part * turn) + middle * ((3.0 - part) * turn + part * slope)
        total += places[j] * part * area
        part = min(1.0, (middle + right) * second[j])
        area = middle * ((3.0 - part) * turn + part * slope1) + right * ((3.0 - part) * slope1 + part * turn)
        total += (1.0 - places[j]) * part * area
    return total / (6.0 * cuts.shape[0])


@kernel
def remember(elements, terms, nodes, z):
    """Take every point to the end of a step that ended at `z`.

    A point that begins to touch is held from where it was free; one that leaves is free from where it was held.
    """
    surface, points = nodes[SURFACE], nodes[POINTS]
    held_free, free_free = nodes[HELD_FREE], nodes[FREE_FREE]
    held, free = elements[HELD], elements[FREE]
    held_depths, free_depths = held[0], free[0]
    for i in range(terms.shape[1]):
        decay, follow = terms[DECAY, i], terms[FOLLOW, i]
        held_memories, free_memories = held[1 + i], free[1 + i]
        for j in range(points.shape[0]):
            begins = (points[j] > z) & (held_free[j] < free_free[j])
            leaves = (points[j] <= z) & (held_free[j] >= free_free[j])
            held_memory, free_memory = held_memories[j], free_memories[j]
            held_depth, free_depth = held_depths[j], free_depths[j]
            held_before = free_memory if begins else held_memory
            held_moved = (surface[j] - z) - (free_depth if begins else held_depth)
            free_before = held_memory if leaves else free_memory
            free_moved = held_free[j] - held_depth if leaves else free_free[j] - free_depth
            held_memories[j] = (decay * held_before + follow * held_moved + TINY) - TINY
            free_memories[j] = (decay * free_before + follow * free_moved + TINY) - TINY
    for j in range(points.shape[0]):
        leaves = (points[j] <= z) & (held_free[j] >= free_free[j])
        recovered = held_free[j] if leaves else free_free[j]
        held_depths[j] = surface[j] - z
        free_depths[j] = (recovered + TINY) - TINY
