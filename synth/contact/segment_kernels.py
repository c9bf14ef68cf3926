"""The kernels of `profile_solver`: the area of a polyline above a height, and the height that leaves a given area.

Stage   CONTACT.
Model   See `profile_solver`, which describes segments, blocks and ends.
Source  Fagiani & Barbieri (2016), eq. 1.
"""

from __future__ import annotations

import math

import numpy as np

from synth.contact.exact_solver import first_guess
from synth.kernels import kernel, summing

BLOCK = 16  # segments; a smaller block costs more bounds, a larger one more sums where z crosses it
MOST_STEPS = 60  # never reached in the tests; limits the time per phase
SETTLED = 1e-15  # of a1 + a2: Newton's method ends at a step this small
LEFT = 1e-15  # of a1 + a2: largest second-order term at which Newton's method ends; passing a knot changes the term
CHORD = 1.0 / 6.0  # mean height of the chords of x^2 above it, with x in segments; another value shifts the dome
EMPTY = 1e-18  # of a1 + a2: smaller indentations count as none, and z is the highest point


@kernel
def begin_place(numbers, phase):
    """Return the position of L on the texture, and the rotation of the finger there.

    The values are: the knot at or before x = 0, its distance before x = 0 (in segments), the number of segments over L,
    and the cosine and sine of the rotation.
    """
    count = int(numbers[0])
    along = -(phase - math.floor(phase)) * numbers[0] - numbers[2]
    whole = math.floor(along)
    before = along - whole
    turn = before * numbers[3] - numbers[4]
    return int(whole) % count, before, math.ceil(numbers[1] + before), math.cos(turn), math.sin(turn)


@kernel
def knots_over(pieces, knot, before, count):
    """Return the heights of the texture at the knots over L, as a view; under a dome a copy, with the dome subtracted.

    The heights do not include the finger's ridges.
    """
    texture, numbers = pieces[0], pieces[3]
    run, bend = texture[0, knot : knot + count + 1], numbers[5]
    if bend > 0.0:
        run, middle = run.copy(), 0.5 * numbers[1] + before
        for i in range(count + 1):
            run[i] -= bend * ((i - middle) ** 2 - CHORD)
    return run


@kernel
def bound_blocks(pieces, knot, before, count, cosine, sine, work):
    """Write upper bound, lower bound and area of every whole block of the inner segments; return the number of blocks.

    work: float64 [3, blocks].
    """
    texture, _finger, blocks, numbers = pieces
    reach = 0.5 * BLOCK * numbers[3]
    along, across = math.sin(reach), 1.0 - math.cos(reach)
    inner = (count - 2) // BLOCK
    for b in range(inner):
        at = knot + 1 + BLOCK * b
        height = cosine * blocks[0, b] + sine * blocks[1, b]
        slope = cosine * blocks[1, b] - sine * blocks[0, b]
        spread = abs(slope) * along + abs(height) * across
        work[0, b] = texture[2, at] + height + spread
        work[1, b] = texture[3, at] + height - spread
        work[2, b] = texture[1, at] + cosine * blocks[2, b] + sine * blocks[3, b]
    if numbers[5] > 0.0:
        lower_blocks(numbers[5], 0.5 * numbers[1] + before, inner, work)
    return inner


@kernel
def lower_blocks(bend, middle, inner, work):
    """Subtract the dome from the blocks; its top lies `middle` segments after the first knot."""
    half = 0.5 * BLOCK
    for b in range(inner):
        off = abs(1.0 + BLOCK * b + half - middle)
        work[0, b] -= bend * (max(off - half, 0.0) ** 2 - CHORD)
        work[1, b] -= bend * ((off + half) ** 2 - CHORD)
        work[2, b] -= bend * BLOCK * (off * off + half * half / 3.0)


@summing
def segments_above(run, cosines, sines, cosine, sine, z):
    """Return sums over the segments between the knots of `run`, in segments.

    The sums are twice the area above z, the length above z, and 1 / |rise| of the segments that cross z.
    """
    area, length, edges = 0.0, 0.0, 0.0
    for i in range(len(run) - 1):
        p = run[i] + (cosine * cosines[i] + sine * sines[i]) - z
        q = run[i + 1] + (cosine * cosines[i + 1] + sine * sines[i + 1]) - z
        both = max(p, 0.0) + max(q, 0.0)
        steep = 1.0 / max(abs(p - q), 1e-30)
        part = min(1.0, both * steep)
        area += part * both
        length += part
        edges += steep if p * q < 0.0 else 0.0
    return area, length, edges


@kernel
def end_above(p, q, width, z):
    """Return the sums of `segments_above` for one segment of `width` between the heights p and q."""
    p, q = p - z, q - z
    both = max(p, 0.0) + max(q, 0.0)
    steep = 1.0 / max(abs(p - q), 1e-30)
    part = min(1.0, both * steep)
    return width * part * both, width * part, (width * steep if p * q < 0.0 else 0.0)


@kernel
def ends_of(pieces, run, before, count, cosine, sine):
    """Return the heights at both ends of the first and the last segment, cut at the ends of L, and their widths."""
    _texture, finger, _blocks, numbers = pieces
    p = run[0] + cosine * finger[0, 0] + sine * finger[1, 0]
    q = run[1] + cosine * finger[0, 1] + sine * finger[1, 1]
    last = count - 1
    r = run[last] + cosine * finger[0, last] + sine * finger[1, last]
    s = run[count] + cosine * finger[0, count] + sine * finger[1, count]
    width = numbers[1] + before - last
    return p + before * (q - p), q, 1.0 - before, r, r + width * (s - r), width


@kernel
def area_over(pieces, work, inner, run, count, cosine, sine, ends, z):
    """Return F(z), the touching part of L and F''(z), relative to L and a1 + a2; run: see `knots_over`."""
    _texture, finger, _blocks, numbers = pieces
    p, q, first, r, s, last = ends
    area, length, edges = end_above(p, q, first, z)
    more = end_above(r, s, last, z)
    area, length, edges = area + more[0], length + more[1], edges + more[2]
    full, touching = 0.0, 0
    for b in range(inner):
        if work[0, b] <= z:
            continue
        if work[1, b] >= z:
            full += work[2, b] - BLOCK * z
            touching += BLOCK
            continue
        i = 1 + BLOCK * b
        j = i + BLOCK + 1
        more = segments_above(run[i:j], finger[0, i:j], finger[1, i:j], cosine, sine, z)
        area, length, edges = area + more[0], length + more[1], edges + more[2]
    i = 1 + BLOCK * inner
    more = segments_above(run[i:count], finger[0, i:count], finger[1, i:count], cosine, sine, z)
    area, length, edges = area + more[0], length + more[1], edges + more[2]
    return (full + 0.5 * area) / numbers[1], (touching + length) / numbers[1], edges / numbers[1]


@kernel
def highest_point(pieces, run, count, cosine, sine, ends):
    """Return the largest height of the polyline over L: z at no load."""
    finger = pieces[1]
    top = max(max(ends[0], ends[1]), max(ends[3], ends[4]))
    for i in range(1, count):
        top = max(top, run[i] + cosine * finger[0, i] + sine * finger[1, i])
    return top


@kernel
def balance(pieces, work, phase, target, guess):
    """Return z, the touching part of L at `phase` and `target`, and the number of iterations.

    guess: z, or NaN for none.
    """
    numbers = pieces[3]
    knot, before, count, cosine, sine = begin_place(numbers, phase)
    run = knots_over(pieces, knot, before, count)
    inner = bound_blocks(pieces, knot, before, count, cosine, sine, work)
    ends = ends_of(pieces, run, before, count, cosine, sine)
    if target < EMPTY:
        return highest_point(pieces, run, count, cosine, sine, ends), 0.0, 1
    return settle(pieces, work, inner, run, count, cosine, sine, ends, target, guess)


@kernel
def settle(pieces, work, inner, run, count, cosine, sine, ends, target, guess):
    """Return z, the touching part and the number of iterations, by Newton's method within a bracket."""
    lowest, highest = -math.inf, math.inf
    z = guess if guess == guess else 0.0
    part = 0.0
    for iteration in range(1, MOST_STEPS + 1):
        total, part, bend = area_over(pieces, work, inner, run, count, cosine, sine, ends, z)
        excess = total - target
        if excess >= 0.0:
            lowest = max(lowest, z)
        else:
            highest = min(highest, z)
        if part <= 0.0:
            z = 0.5 * (lowest + highest) if lowest > -math.inf else z - max(target, 0.125) * (1 << min(iteration, 20))
            continue
        step = excess / part
        crowding = min(max(0.5 * bend / part * step, -0.5), 0.5)
        curved = step * (1.0 + crowding)
        if abs(step) <= SETTLED * (1.0 + abs(z)):
            return z + step, part, iteration
        if 0.0 < bend * curved * curved <= LEFT * part and abs(crowding) < 0.1:
            return z + curved, max(part - bend * curved, 0.0), iteration
        z += curved if abs(crowding) < 0.25 else step
        if not lowest <= z <= highest:
            z = 0.5 * (lowest + highest) if highest < math.inf and lowest > -math.inf else z
        if highest - lowest <= 4e-16:
            return z, part, iteration
    return z, part, MOST_STEPS


@kernel
def solve_segments(pieces, numbers, phases, targets, guess, height, touching, iterations):
    """Write z / (a1 + a2), the touching part of L and the number of iterations at each phase.

    pieces: `SegmentGrid.pieces`, here and in the kernels above.
    numbers: float64 [1, 6] of the grid, or [phases, 6] for a different contact at each phase on the same polyline.
    targets: w / k / (a1 + a2), one for all, or one per phase.
    """
    texture, finger, blocks, _numbers = pieces
    work = np.empty((3, blocks.shape[1] + 1))
    for i in range(len(phases)):
        target = targets[i] if len(targets) > 1 else targets[0]
        here = (texture, finger, blocks, numbers[i] if len(numbers) > 1 else numbers[0])
        begin = first_guess(guess, height, i, math.nan)
        height[i], touching[i], iterations[i] = balance(here, work, phases[i], target, begin)


@kernel
def measure_segments(pieces, phases, heights, depth, touching):
    """Write F(z) / (a1 + a2) and the touching part of L at each phase and each of its z / (a1 + a2)."""
    work = np.empty((3, pieces[2].shape[1] + 1))
    for i in range(len(phases)):
        knot, before, count, cosine, sine = begin_place(pieces[3], phases[i])
        run = knots_over(pieces, knot, before, count)
        inner = bound_blocks(pieces, knot, before, count, cosine, sine, work)
        ends = ends_of(pieces, run, before, count, cosine, sine)
        for j in range(heights.shape[1]):
            z = heights[i, j]
            depth[i, j], touching[i, j], _bend = area_over(pieces, work, inner, run, count, cosine, sine, ends, z)
