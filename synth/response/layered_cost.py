"""Lattice, layers and cost of a layered table, chosen within bounds before it is made.

Stage   RESPONSE: making a layered table.
Model   The smaller the indentation at a light load and the flatter the texture, the closer are the layers. The distance
        of two levels of z is a whole number of layers, and grows with the depth. The lattice has PLACES_A_CELL places
        per cell of the finger. Where that exceeds the bounds, places are removed first in the direction in which they
        are closer, then in both.
Source  design, section 8: making a table is bounded. The rule for the layers is this project's.
Limits  The seconds are those of one core with AVX-512. 70 random tables took 0.2 to 1.2 times the prediction.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from synth.arrays import Array
from synth.contact.area_grid import AreaGrid
from synth.contact.area_layers import BATCH, LayerPlan
from synth.contact.area_solver import ROWS as LINES
from synth.contact.load_balance import Contact
from synth.response.layered_reading import PADDING
from synth.response.level_crossings import HISTORY
from synth.response.table_making import HEAVIEST
from synth.surfaces.height_field import HeightField

LIGHTEST = 1e-3  # N: the usual lift load, below which the output fades
ROWS = 48, 24  # of load; with 24 displacement errs 1.4 to 3 times as much as with 48, with 16 another 2 to 3 times
MOST_BYTES = 64 << 20
MOST_SECONDS = 4.0  # on one core
PLACES_A_CELL = 2.0  # in each direction
FEWEST_PLACES = 32  # per period
ONE_LINE = 4  # the same across, of a texture that does not vary across: the taps of a cubic spline
COARSER = 0.9  # factor by which the places in a direction are reduced, until the bounds are kept
ALIKE = 1.1  # largest ratio of two spacings that are made coarser together
LIGHT = 0.02  # N: lightest load of usual touch; lighter loads err more
LAYER = 0.03  # square of the distance of two layers, divided by the depth at LIGHT and by the height of the texture
FLATTEST = 0.1  # a flatter texture counts as this high, relative to that depth
LEVEL = 0.66  # largest distance of the first levels, relative to that depth
FEWEST_LAYERS, MOST_LAYERS = 8, 32  # over the height of a texture, or over the reach of the finger if that is smaller
MARGIN = 0.05  # of the finger's reach: distance of the lowest level below the lowest z at SEEN places
SEEN = 16  # places that are solved to estimate depths and heights
FIXED = 0.4  # s: time of the exact solver, which measures the error
SAMPLE, SERIES, PRODUCT, ROW = 40.0, 5.0, 0.55, 45.0
"""Time per place (ns) of a sample, a Fourier series, a product of two, and a row (tests/bench/bench_layered.py)."""


@dataclass(frozen=True, slots=True)
class LayeredBounds:
    """Limits of a layered table.

    lightest, heaviest: loads of the first and the last row, N.
    rows: numbers of rows of load, 5 or more each. The first one that keeps the whole lattice within the bounds is
        chosen, or else the last one.
    nbytes: memory of the table.
    seconds: of making it on one core, as predicted.
    """

    lightest: float = LIGHTEST
    heaviest: float = HEAVIEST
    rows: tuple[int, ...] = ROWS
    nbytes: int = MOST_BYTES
    seconds: float = MOST_SECONDS


LAYERED_BOUNDS = LayeredBounds()


@dataclass(frozen=True, slots=True)
class LayeredCost:
    """The cost of a table that is not made yet.

    plan: its lattice and layers.
    rows: of load.
    levels: number of levels of z.
    nbytes: memory of the table.
    making_bytes: memory while it is made.
    seconds: of making it, on one core.
    """

    plan: LayerPlan
    rows: int
    levels: int
    nbytes: int
    making_bytes: int
    seconds: float

    @classmethod
    def of(cls, grid: AreaGrid, plan: LayerPlan, lowest: float, rows: int) -> LayeredCost:
        """Return the cost of a plan with levels down to `lowest` (relative to the scale of `grid`)."""
        batches, layers, (columns, lines) = plan.batches_down_to(lowest), plan.layers, plan.places
        images = [np.unique(plan.images(levels)) for levels in batches]
        levels = sum(len(one) for one in batches)
        series = len(np.unique(np.concatenate(images))) + levels + 2 * layers + 2 * (rows + 2)
        nanoseconds = SAMPLE * math.prod(plan.samples(grid)) + SERIES * series + PRODUCT * levels * layers + ROW * rows
        floats = layers + max(len(one) for one in images) + HISTORY + 3 * BATCH + rows
        return cls(
            plan=plan,
            rows=rows,
            levels=levels,
            nbytes=2 * (columns + PADDING) * (lines + PADDING) * (rows + 2),
            making_bytes=4 * columns * lines * floats,
            seconds=FIXED + 1e-9 * columns * lines * nanoseconds,
        )

    def within(self, bounds: LayeredBounds) -> bool:
        """Return whether the cost is within `bounds`."""
        return self.nbytes <= bounds.nbytes and self.seconds <= bounds.seconds


def layered_cost(contact: Contact, bounds: LayeredBounds = LAYERED_BOUNDS) -> LayeredCost:
    """Return lattice, layers and cost of the layered table of `contact`, a finger on a height field."""
    grid, texture = grid_of(contact), contact.geometry.profile
    assert isinstance(texture, HeightField)
    levels = levels_of(contact, bounds)
    periods = np.array([texture.period, texture.across])
    fewest = np.array([FEWEST_PLACES, FEWEST_PLACES if texture.slope_across else ONE_LINE])
    wanted = np.maximum(PLACES_A_CELL * np.array([grid.texture.columns, grid.texture.shape[LINES]]), fewest)
    for rows in bounds.rows[:-1]:
        cost = cost_of(grid, wanted, levels, rows)
        if cost.within(bounds):
            return cost
    while True:
        cost = cost_of(grid, wanted, levels, bounds.rows[-1])
        if cost.within(bounds) or np.all(wanted == fewest):
            return cost
        spacings = np.where(wanted > fewest, periods / wanted, np.inf)
        wanted = np.where(spacings <= ALIKE * spacings.min(), np.maximum(COARSER * wanted, fewest), wanted)


def cost_of(grid: AreaGrid, wanted: Array, levels: tuple[float, int, float], rows: int) -> LayeredCost:
    """Return the cost of a lattice with at least the `wanted` places along and across; levels: as of `levels_of`."""
    from scipy.fft import next_fast_len

    step, stride, lowest = levels
    columns, lines = (int(next_fast_len(math.ceil(one), real=True)) for one in wanted)
    return LayeredCost.of(grid, LayerPlan.of(grid, (columns, lines), step, stride, lowest), lowest, rows)


def levels_of(contact: Contact, bounds: LayeredBounds) -> tuple[float, int, float]:
    """Return the step between layers, the steps between levels, and the lowest level, relative to the height scale."""
    grid = grid_of(contact)
    along, across = np.arange(SEEN) / SEEN, np.asarray(np.arange(SEEN) * 0.618 % 1.0, np.float64)
    light, heavy = (
        contact.indentation(load) for load in (min(max(LIGHT, bounds.lightest), bounds.heaviest), bounds.heaviest)
    )
    touching = grid.solve_places(along, across, light).touching
    depth = light / float(np.median(touching)) / grid.height_scale
    lowest = float(grid.solve_places(along, across, heavy).height.min()) / grid.height_scale
    reach = grid.texture.highest + float(grid.tops[0]) - lowest
    tall = min(max(grid.texture.highest - float(grid.texture.heights.min()), FLATTEST * depth), reach)
    step = min(max(math.sqrt(LAYER * depth * tall), tall / MOST_LAYERS), tall / FEWEST_LAYERS)
    return step, max(1, math.floor(LEVEL * depth / step)), lowest - MARGIN * reach


def grid_of(contact: Contact) -> AreaGrid:
    """Return the cells of a finger on a height field."""
    assert isinstance(contact.grid, AreaGrid), "a layered table needs a height field"
    return contact.grid
