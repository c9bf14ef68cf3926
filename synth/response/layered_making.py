"""Makes a layered table, and measures its error.

Stage   RESPONSE: from a contact on a height field to its layered table.
Model   F at all places, level by level (`area_layers`), gives z at all places and rows of load (`level_crossings`). The
        mean of z over some places is computed at many loads, and subtracted from the rows. A cubic B-spline
        interpolates the values in all three directions.
        The error is measured against the exact solver at random places and loads between the rows. The reported error
        of an interval is twice the largest measured in it and in the two intervals on either side.
Source  design, sections 1 and 8.
Limits  40 random surfaces were tested at 40,000 random places and loads in all. On each surface at most 0.2 % of the
        errors exceed the reported error, by half at most (tests/synth/response/test_layered_table.py, with -m
        thorough).
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np

from synth.arrays import Array
from synth.contact.area_layers import AreaLayers, Floats, in_bands
from synth.contact.load_balance import Contact
from synth.response.layered_cost import (
    LAYERED_BOUNDS,
    LayeredBounds,
    LayeredCost,
    grid_of,
    layered_cost,
)
from synth.response.layered_reading import PADDING, read_means, store
from synth.response.layered_table import LayeredTable, Shorts
from synth.response.level_crossings import Crossings, crossings
from synth.response.table_error import widest

MEAN_ROWS = 193  # loads at which the mean is computed
MEAN_PLACES = 256  # places over which it is taken
LARGEST = 32767.0  # of a coefficient
PROBES = 1128  # places and loads at which the error is measured: 48 per interval of 24 rows
SAFETY = 2.0  # reported error over the largest measured one
SEED = 20  # of these places and loads


def make_layered_table(
    contact: Contact, bounds: LayeredBounds = LAYERED_BOUNDS, cost: LayeredCost | None = None, workers: int = 1
) -> LayeredTable:
    """Return the layered table of `contact`, a finger on a height field.

    cost: as of `layered_cost` for these bounds; None: it is computed here.
    workers: threads. The table does not depend on their number.
    """
    cost = cost or layered_cost(contact, bounds)
    plan = cost.plan
    loads, more = load_nodes(bounds, cost.rows), load_nodes(bounds, MEAN_ROWS)
    places = plan.places[0] * plan.places[1]
    chosen = np.unique(np.arange(MEAN_PLACES) * places // MEAN_PLACES)
    layers = AreaLayers.of(grid_of(contact), plan, workers)
    found, some = crossings(layers, contact.indentations(loads), chosen, contact.indentations(more))
    del layers  # frees its memory, before the coefficients need theirs
    curve = take_mean(found.heights, some, loads, more)
    swings = np.ptp(found.heights, axis=1).astype(np.float64)
    coefficients, scales = stored(found.heights, plan.places, workers)
    table = LayeredTable(
        loads=loads,
        curve=curve,
        coefficients=coefficients,
        scales=scales,
        swings=swings,
        errors=np.zeros(len(loads) - 1),
        below=found.below,
        above=found.above,
    )
    return replace(table, errors=measured_errors(contact, table))


def load_nodes(bounds: LayeredBounds, count: int) -> Array:
    """Return `count` loads (N), whose fourth roots are equally spaced."""
    return np.asarray(np.linspace(bounds.lightest**0.25, bounds.heaviest**0.25, count) ** 4)


def spline_through(values: Array) -> Array:
    """Return the coefficients of the cubic B-spline through equally spaced values: two more than these (first axis).

    The third derivative is continuous at the second and at the last but one value.
    """
    from scipy.linalg import solve_banded

    count = len(values)
    bands, aims = np.zeros((9, count + 2)), np.zeros((count + 2, *values.shape[1:]))
    bands[3, 2:], bands[4, 1:-1], bands[5, :-2] = 1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0
    for i, weight in enumerate((1.0, -4.0, 6.0, -4.0, 1.0)):
        bands[4 - i, i], bands[4 + i, -1 - i] = weight, weight
    aims[1:-1] = values
    return np.asarray(solve_banded((4, 4), bands, aims))


def take_mean(heights: Floats, some: Crossings, loads: Array, more: Array) -> Array:
    """Subtract the mean over the places from `heights` [rows, places], and return its coefficients over load.

    heights: z at `loads`, m.
    some: z at `more` loads and a few places.
    """
    ends, followed, rest = loads[[0, -1]], np.empty(len(loads)), np.empty(len(more))
    few = some.heights.mean(axis=1, dtype=np.float64)
    read_means(spline_through(few), ends, loads, followed)
    heights -= followed[:, np.newaxis].astype(np.float32)
    means = heights.mean(axis=1, dtype=np.float64)
    heights -= means[:, np.newaxis].astype(np.float32)
    read_means(spline_through(means), ends, more, rest)
    return spline_through(few + rest)


def stored(heights: Floats, places: tuple[int, int], workers: int) -> tuple[Shorts, Array]:
    """Return coefficients and scales as in `LayeredTable`; heights: z less its mean [rows, places]."""
    from scipy.fft import irfft2, rfft2

    columns, lines = places
    rows = spline_through(np.eye(len(heights))).astype(np.float32) @ heights
    scales = np.ones(len(rows))
    shorts = np.empty((lines + PADDING, columns + PADDING, len(rows)), np.int16)
    along, across = (
        sampled_spline(np.arange(columns // 2 + 1) / columns),
        sampled_spline(np.asarray(np.fft.fftfreq(lines), np.float64)),
    )
    gain = (1.0 / (across[:, np.newaxis] * along)).astype(np.float32)
    for number, row in enumerate(rows):
        series = rfft2(row.reshape(lines, columns), workers=workers)
        series *= gain
        values = irfft2(series, (lines, columns), workers=workers)
        scales[number] = max(float(np.max(np.abs(values))) / LARGEST, float(np.finfo(np.float32).tiny))
        in_bands(partial(store, values, scales[number], number, shorts), len(shorts), workers)
    return shorts, scales


def sampled_spline(turns: Array) -> Array:
    """Return the Fourier transform of the samples of a cubic B-spline at frequencies of `turns` per place."""
    return np.asarray((2.0 + np.cos(2.0 * np.pi * turns)) / 3.0)


def measured_errors(contact: Contact, table: LayeredTable) -> Array:
    """Return the errors of `table` to report, m [rows - 1]."""
    random = np.random.default_rng(SEED)
    intervals, roots = len(table.loads) - 1, table.loads**0.25
    parts = random.uniform(size=(intervals, math.ceil(PROBES / intervals)))
    loads = ((roots[:-1, np.newaxis] + parts * np.diff(roots)[:, np.newaxis]) ** 4).ravel()
    phases, across = random.uniform(size=(2, len(loads)))
    read = table.heights(phases, across, loads)
    exact = grid_of(contact).solve_places(phases, across, contact.indentations(loads), read).height
    return SAFETY * widest(widest(np.abs(read - exact).reshape(parts.shape).max(axis=1)))
