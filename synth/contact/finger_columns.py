"""The area of a fingertip above a level, in columns across the scan: what eq. 1 needs of the finger alone.

Model   A(x, l) is the integral over y of max(h1(x, y) - l, 0): the area above the level l of the cross-section at x.
        The heights h1 are sampled at equal steps. Between samples they are polynomials of degree 5 along x and along y.
        In each column the surface is a polyline of close rows. A and N = -dA/dl, the width that lies above the level,
        are exact for the polyline at equal steps of l, and cubic between them.
Source  Fagiani & Barbieri (2016), eq. 1. The columns are this project's.
Limits  Samples, columns, rows and levels are numerics: all become closer together with `coarser`, and the change is the
        error that is told. Below the lowest level of a column A is linear in l only where the whole column touches, so
        the levels must reach as deep as the finger is pressed in: `FingerSurface.columns` makes them deeper on demand.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.contact.footprint import REACH, Footprint
from synth.kernels import inlined, kernel
from synth.response_cache import kept
from synth.surfaces.ridge_field import WAVES, RidgeField

Floats = np.ndarray[Any, np.dtype[np.float32]]

SAMPLES = 24  # per ridge along and across: polynomials of degree 5 between them err by 1e-6 of the ridges and more
ORDER = 6  # by which that error falls with the distance of the samples
MOST_SAMPLES = 4000  # along or across: 128 MB; reached by fingertips of 38 mm, and at 100 mm they err by some 1e-4
FEWEST_SAMPLES = 96  # over the length or the width of the smallest fingertip
COLUMNS = 64  # per ridge, or FEWEST over the length
ROWS = 2  # per sample across; with 6 columns change by 3e-6 of the acceleration, and take twice as long to make
FEWEST = 256  # columns of the smallest fingertip
BESIDE = 4  # samples beyond the oval on every side
LEVELS = 128  # over the height of the ridges and the depth of the nominal footprint
NEARER = 0.6  # power of the distance of columns: at small loads the error of levels is the larger one
SHALLOWEST = 0.75  # of that height: less deep columns are not made
DEEPER = 1.3  # factor between the depths for which columns are made: a finger at many loads needs few
LEVEL = 1e-15  # m: a row that rises less counts as level
Place = np.uint64  # an unsigned index: with a signed one Numba checks for negative indices
ONE, TWO, THREE, FOUR, FIVE = Place(1), Place(2), Place(3), Place(4), Place(5)
MOST_SWELL = math.sqrt(2.0 * WAVES)  # bound of the random field of the ridges' heights


@dataclass(frozen=True)
class FingerColumns:
    """A and N of a fingertip at equal steps of x and of the level.

    first: x of the first column, m.
    step: between columns, m.
    top: the highest level, m; every column lies below it.
    drop: between levels, m.
    areas: float32 [columns, levels, 2]: A (m^2), and N times `drop` (m^2), at the levels top - i drop.
    ends: the same at the last level, float64 [columns, 2]: below it, rounding would grow with the depth.
    tops: height of the highest point of each column, m; -inf: none.
    """

    first: float
    step: float
    top: float
    drop: float
    areas: Floats
    ends: Array
    tops: Array


@dataclass(frozen=True, slots=True)
class FingerSurface:
    """The surface of a fingertip: ridges on a paraboloid, within an oval.

    field: the ridges.
    footprint: on a flat plate at 1 N.
    """

    field: RidgeField
    footprint: Footprint

    def heights(self, x: Array, y: Array) -> Array:
        """Return the height (m) at every pair of `x` and `y` (m, from the middle): [len(x), len(y)]."""
        return self.field.heights(x, y) - self.footprint.drop(x, y)

    def columns(self, depth: float, coarser: float) -> FingerColumns:
        """Return columns whose levels reach at least `depth` (m) below the top of the fingertip.

        coarser: factor on the distance of columns; that of levels has its power NEARER, that of samples, and so of
            rows, its cube root.
        Deeper columns have the same values at the levels that they share, so results do not depend on the depth.
        """
        usual = self.footprint.depth + 2.0 * self.field.amplitude
        drop, least = coarser**NEARER * usual / LEVELS, SHALLOWEST * usual
        steps = max(math.ceil(math.log(max(depth, least) / least) / math.log(DEEPER)), 0)
        reached = min(least * DEEPER**steps, self.tall)
        return finger_columns(self, math.ceil(reached / drop) + 3, drop, coarser)

    @property
    def tall(self) -> float:
        """Bound of the distance from the highest to the lowest point (m); further below, every column touches whole."""
        ridges = self.field.amplitude * (1.0 + MOST_SWELL * self.field.height_spread)
        return REACH**2 * self.footprint.depth + 2.0 * ridges


@kept
def samples_of(surface: FingerSurface, coarser: float) -> tuple[float, float, Array]:
    """Return the distances of the samples along and across (m), and the heights (m) [along, across].

    coarser: factor on the distance of columns. That of samples has the root by which the error of both is of order 2.
    There are BESIDE samples more than the oval needs on every side.
    """
    length, width = surface.footprint.reach
    wanted = SAMPLES / coarser ** (2.0 / ORDER)
    most = MOST_SAMPLES / max(coarser, 1.0) ** (2.0 / ORDER)  # also of many samples the change shows their error
    steps = [min(max(wanted * one / surface.field.period, FEWEST_SAMPLES), most) for one in (length, width)]
    along, across = (one / math.ceil(count) for one, count in zip((length, width), steps, strict=True))
    counts = math.ceil(steps[0]), math.ceil(steps[1])
    x, y = (
        np.asarray(np.arange(-BESIDE, count + BESIDE + 1) * step - 0.5 * size, np.float64)
        for count, step, size in zip(counts, (along, across), (length, width), strict=True)
    )
    return along, across, surface.heights(x, y)


@kept
def finger_columns(surface: FingerSurface, levels: int, drop: float, coarser: float) -> FingerColumns:
    """Return the columns of `surface`.

    levels: their number.
    drop: their distance, m.
    coarser: factor on the distance of columns; that of samples follows from it.
    """
    (length, width), ridge = surface.footprint.reach, surface.field.period
    columns = math.ceil(max(COLUMNS * length / ridge, FEWEST) / coarser)
    along, across, samples = samples_of(surface, coarser)
    x = (np.arange(columns) + 0.5) * (length / columns) - 0.5 * length
    chords = 0.5 * width * np.sqrt(np.maximum(1.0 - (2.0 * x / length) ** 2, 0.0)) / across
    places = (x + 0.5 * length) / along + BESIDE
    rows = ROWS if coarser <= 1.0 else 1
    top = float(np.max(samples)) + drop
    areas, tops = np.zeros((columns, levels, 2), np.float32), np.full(columns, -math.inf)
    ends = np.zeros((columns, 2))
    deposit(samples, places, chords, sixths(np.arange(rows) / rows), across, top, drop, areas, ends, tops)
    return FingerColumns(float(x[0]), length / columns, top, drop, areas, ends, tops)


def areas_above(surface: FingerSurface, x: Array, levels: Array) -> Array:
    """Return A (m^2) at each of `x` (m, from the middle) above each of `levels` (m), [..., len(x)].

    Between levels A is cubic, and between columns linear; outside the first and the last column it is 0.
    """
    columns = surface.columns(0.0, 1.0)
    columns = surface.columns(columns.top - float(np.min(levels)), 1.0)
    place = (x - columns.first) / columns.step
    outside = (place < 0.0) | (place > len(columns.areas) - 1)
    left = np.clip(np.floor(place).astype(np.intp), 0, len(columns.areas) - 2)
    right = place - left
    found = (1.0 - right) * _between_levels(columns, left, levels) + right * _between_levels(columns, left + 1, levels)
    return np.where(outside, 0.0, found)


def _between_levels(columns: FingerColumns, numbers: Any, levels: Array) -> Array:
    """Return A of the columns `numbers` above `levels`: cubic by A and N, and linear below the last level."""
    depth = np.maximum((columns.top - levels) / columns.drop, 0.0)
    last = columns.areas.shape[1] - 1
    whole = np.minimum(depth.astype(np.intp), last - 1)
    t = np.minimum(depth - whole, 1.0)
    (low, into), (high, out) = (np.moveaxis(columns.areas[numbers, one], -1, 0) for one in (whole, whole + 1))
    rise = high - low
    cubic = low + t * (into + t * (3.0 * rise - 2.0 * into - out + t * (into + out - 2.0 * rise)))
    end = columns.ends[numbers]
    return np.asarray(np.where(depth > last, end[:, 0] + (depth - last) * end[:, 1], cubic), np.float64)


def sixths(t: Array) -> Array:
    """Return the weights of six samples at -2 to 3 of the polynomial of degree 5 through them at `t`: [len(t), 6]."""
    known = np.arange(-2, 4)
    return np.stack(
        [np.prod([(t - other) / (own - other) for other in known if other != own], axis=0) for own in known],
        axis=1,
    )


@kernel
def deposit(samples, places, chords, weights, across, top, drop, areas, ends, tops):
    """Write A, N times `drop` and the highest point of every column.

    samples: heights, m [along, across].
    places: of the columns, in samples.
    chords: half the width of the oval at each column, in samples.
    weights: of six samples at each row between two samples [rows, 6].
    across: distance of the samples, m.
    """
    count, levels, rows = samples.shape[1], areas.shape[1], len(weights)
    line, fine = np.empty(count), np.empty(count * rows)
    lows, highs = np.empty(len(fine)), np.empty(len(fine))
    begun, moment = np.empty(levels + 1), np.empty(levels + 1)
    width, area, lowest, middle = np.empty(levels), np.empty(levels), top - (levels - 1) * drop, 0.5 * (count - 1)
    for c in range(len(places)):
        blend(samples, places[c], line)
        begun[:], moment[:], width[:], area[:] = 0.0, 0.0, 0.0, 0.0
        first, last = middle - chords[c], middle + chords[c]
        begin, end = max(int(first) - 1, 2), min(int(last) + 2, count - 3)
        tops[c] = refine_rows(line, begin, end, weights, fine)
        row, past = begin * rows + 1, end * rows - 2
        rows_between(fine, row, past, lows, highs)
        for number in range(row, past):
            r = Place(number)
            if not highs[r] > lowest:
                continue
            inside = min((number + 1.0) / rows, last) - max(number / rows, first)  # the oval may end within a row
            if inside > 0.0:
                lay_row(lows[r], highs[r], inside * across, top, drop, levels, width, area, begun, moment)
        whole, volume = 0.0, 0.0
        for n in range(levels):
            whole += begun[n]
            volume += moment[n]
            ends[c, 0], ends[c, 1] = area[n] + volume + whole * n * drop, (width[n] + whole) * drop
            areas[c, n, 0], areas[c, n, 1] = ends[c, 0], ends[c, 1]


@inlined
def lay_row(low, high, metres, top, drop, levels, width, area, begun, moment):
    """Add a row of `metres` that rises from `low` to `high`: to the levels between, and to all below."""
    past = max(math.ceil((top - low) / drop), 0)  # the first level at or below the row
    steep = 1.0 / max(high - low, LEVEL)
    for number in range(max(math.ceil((top - high) / drop), 0), min(past, levels)):
        n = Place(number)
        over = high - (top - number * drop)
        part = min(over * steep, 1.0) * metres
        width[n] += part
        area[n] += 0.5 * part * over
    if past < levels:
        begun[Place(past)] += metres
        moment[Place(past)] += metres * (0.5 * (low + high) - top)


@kernel
def blend(samples, place, line):
    """Write the heights of one column, of degree 5 between the samples along; place: of the column, in samples."""
    at = int(place)
    t, count = place - at, samples.shape[1]
    line[:] = 0.0
    for own in range(-2, 4):
        weight = 1.0
        for other in range(-2, 4):
            if other != own:
                weight *= (t - other) / (own - other)
        for i in range(count):
            line[i] += weight * samples[at + own, i]


@kernel
def refine_rows(line, begin, end, weights, fine):
    """Write the heights of all rows between the samples `begin` and `end`; return the highest."""
    rows, highest = len(weights), -math.inf
    for k in range(rows):
        a, b, c = weights[k, 0], weights[k, 1], weights[k, 2]
        d, e, f = weights[k, 3], weights[k, 4], weights[k, 5]
        for number in range(begin - 2, end - 2):
            i = Place(number)
            h = a * line[i] + b * line[i + ONE] + c * line[i + TWO] + d * line[i + THREE] + e * line[i + FOUR]
            h += f * line[i + FIVE]
            highest = max(highest, h)
            fine[Place((number + 2) * rows + k)] = h
    return highest


@kernel
def rows_between(fine, begin, end, lows, highs):
    """Write the lower and the higher end of each row from `begin` on, of the mean of a curved row, not of its chord."""
    for number in range(begin, end):
        i = Place(number)
        h, after = fine[i], fine[i + ONE]
        bend = (fine[i - ONE] - h - after + fine[i + TWO]) / 24.0
        lows[i], highs[i] = min(h, after) - bend, max(h, after) - bend
