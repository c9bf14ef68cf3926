"""Making a table: rows are solved, their error is measured, and intervals are halved where it asks for it.

Stage   RESPONSE, from a contact to its table.
Model   Every interval of load is solved in its middle. What the cubic between its ends missed there is its error, and
        the middle becomes a row. The intervals whose halves are expected to miss their target are halved next, the
        worst first, until none is left or the bound on rows or on work is reached. The order is fixed, and no clock is
        read: the same contact has the same table. The segments of a profile, and the phases, are refined first where
        the first rows ask for it; what half the segments change there is part of the error.
Source  design, sections 1 and 8.
Limits  MOST_BYTES and MOST_WORK cells: 4 MB and some 0.3 s, 0.6 s for a profile. What that leaves is in the error.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.contact.forces import Response
from synth.response.load_grid import SolvedRows, first_loads, halfway, heaviest_row, solved_rows
from synth.response.mip_levels import PLACES_A_HARMONIC, MipLevels
from synth.response.place_spline import PADDING, padded, spline_coefficients
from synth.response.spectrum import Complex
from synth.response.table import ResponseTable, rounded
from synth.response.table_error import (
    LEAST,
    USUAL_LOAD,
    TableError,
    folding,
    images,
    octave_beyond,
    relative,
    swings,
    told_harmonics,
    widest,
)

Indices = np.ndarray[Any, np.dtype[np.intp]]

LIGHTEST_JUDGED = 0.01  # N: below it a discretisation is told, not bought: a finger only passes there
HARMONICS = 64  # of the fullest level: below 1 kHz of a 0.8 mm texture at 12.5 mm/s and faster
HEAVIEST = 5.0  # N: rows reach so far, or to full contact; a finger that presses harder is read as at 5 N
PHASES_A_HARMONIC = 4  # solved; with 2 the highest harmonics would be those that fold
MOST_BYTES = 4_000_000  # of coefficients: a table, all levels
MOST_WORK = 2.4e7  # cells of phases solved: 0.3 s at 12 ns a cell
OTHER_BYTES = 128  # of a row: its load and means, and the errors of the interval above it
TARGETS = (5e-4, 1.5e-3, 5e-3)  # of displacement, velocity, acceleration: half of what is promised
TARGET_HARMONICS = 32  # up to which the targets hold; beyond them that of displacement alone
HALVED = 2.5  # by so much the error of an interval falls when it is halved, at least where a kink runs through
SCARCE = 4  # times the intervals to be halved: with fewer rows left than that, only the worst are halved
REFINED = 3  # times a discretisation is halved at most: each time its error falls by four to eight, its work doubles
SHARE = 0.5  # of the targets: what a discretisation may err by, and what may fold
MOST_PHASES_A_HARMONIC = 16  # the phases are doubled up to so many where more folds: rough profiles have many harmonics
PROFILE_WORK = 2.0  # times as much work for a profile as for two cosines: 0.6 s
MANY_KINKS = 1.5  # times what a cubic missed in its middle: a profile makes kinks all over an interval, two cosines few
ROOM = 1.25  # times what is found of two cosines: of 200 scenes some errors at 64 harmonics were 1.24 times as large
FEWEST_ROWS = 100  # that the bound on work must leave for: fewer would err by more than the discretisation does
NARROWEST = 1e-4  # of its load: narrower intervals are not halved, whatever their error


@dataclass(frozen=True, slots=True)
class TableBounds:
    """What a table may cost: harmonics of its fullest level, rows to `heaviest` (N), bytes, and cells of work.

    targets: errors of displacement, velocity and acceleration below which no interval of load is halved. phases,
    places: a harmonic: those solved, and those held.
    """

    harmonics: int = HARMONICS
    heaviest: float = HEAVIEST
    nbytes: int = MOST_BYTES
    work: float = MOST_WORK
    targets: tuple[float, float, float] = TARGETS
    phases: int = PHASES_A_HARMONIC
    places: float = PLACES_A_HARMONIC

    def rows(self, levels: MipLevels, work_of_row: float) -> int:
        """Return how many rows the bounds allow, at least the first ones and their middles."""
        bytes_of_row = 8 * sum(places + PADDING for places in levels.places) + OTHER_BYTES
        return int(max(24, min(self.nbytes // bytes_of_row, self.work // work_of_row)))


BOUNDS = TableBounds()


def make_table(
    response: Response, *, period: float, band: float, lift_load: float, bounds: TableBounds = BOUNDS, scene: str = "{}"
) -> ResponseTable:
    """Return the table of `response` for a texture of `period` (m) and a `band` (Hz); lift_load: N, of the gate.

    scene: JSON that the table tells with it.
    """
    levels = MipLevels.up_to(bounds.harmonics, bounds.places)
    heaviest, full = heaviest_row(response, bounds.heaviest)
    if response.refined() is None:
        making = TableMaking(response, bounds, heaviest)
    else:
        bounds = replace(bounds, work=PROFILE_WORK * bounds.work)
        making = refined_making(response, bounds, heaviest)
    making.halve(bounds.rows(levels, making.work_of_row))
    rows = making.rows
    values, slopes = making.series(rows.heights), making.series(rows.slopes)
    pool = [
        padded(np.stack([spline_coefficients(one, n, places) for one in (values, slopes)], axis=1)).ravel()
        for n, places in zip(levels.highest, levels.places, strict=True)
    ]
    return ResponseTable(
        period=period,
        band=band,
        lift_load=lift_load,
        levels=levels,
        loads=rounded(rows.loads),
        means=rounded(np.stack([values[:, 0].real, slopes[:, 0].real])),
        pool=rounded(np.concatenate(pool)),
        error=making.error(levels),
        full=full,
        mean_law=mean_law(response, heaviest) if full else (0.0, 0.0),
        scene=scene,
    )


def refined_making(response: Response, bounds: TableBounds, heaviest: float) -> TableMaking:
    """Return the first rows of a profile's `response` up to `heaviest` (N), of a discretisation and of as many phases
    as keep their shares of the targets, where the bound on work leaves room for them.
    """
    making = TableMaking(response, bounds, heaviest)
    for _ in range(REFINED):
        finer = making.response.refined()
        if finer is None:
            break
        coarse, making = making, TableMaking(finer, bounds, heaviest)
        making.compare(coarse)
        if making.keeps(making.discrete) or not making.has_room(bounds):
            break
    while not making.keeps(making.folded) and making.phases < MOST_PHASES_A_HARMONIC * bounds.harmonics:
        if not making.has_room(bounds):
            break
        discrete, bounds = making.discrete, replace(bounds, phases=2 * bounds.phases)
        making = TableMaking(making.response, bounds, heaviest)
        making.discrete = discrete
    return making


def mean_law(response: Response, heaviest: float) -> tuple[float, float]:
    """Return a (m) and b (m/N^1.5) of the mean a + b w^1.5 of a full contact, from that at `heaviest` (N)."""
    closed = response.closed(heaviest)
    assert closed is not None
    growth = closed.slope * heaviest / 1.5
    return closed.mean - growth, growth / heaviest**1.5


class TableMaking:
    """Rows of one response as they grow, and what is known of the error of each interval between two of them."""

    def __init__(self, response: Response, bounds: TableBounds, heaviest: float) -> None:
        self.response, self.highest = response, bounds.harmonics
        self.targets = np.array(bounds.targets)
        self.phases = 1 << (bounds.phases * bounds.harmonics - 1).bit_length()
        self.counts = told_harmonics(bounds.harmonics)
        self.usual = self._extents(solved_rows(response, np.array([min(USUAL_LOAD, heaviest)]), self.phases).heights)
        self.rows = solved_rows(response, first_loads(heaviest), self.phases)
        self.extents, self.folds = self._measured(self.rows)
        self.missed = np.full((3, len(self.counts), len(self.rows.loads) - 1), np.inf)
        self.work_of_row = self.phases * response.work_at(min(USUAL_LOAD, heaviest))
        self.first = self.rows.loads
        self.discrete = np.zeros_like(self.extents)

    def series(self, values: Array) -> Complex:
        """Return harmonics 0 to the highest of `values` [rows, phases], one-sided as in `spectrum`."""
        return self._transformed(values)[:, : self.highest + 1]

    def _transformed(self, values: Array) -> Complex:
        return np.asarray(np.fft.rfft(values, axis=1)[:, : 2 * self.highest + 1] / values.shape[1])

    def compare(self, coarse: TableMaking) -> None:
        """Take what the discretisation of `coarse`, in segments twice as long, changes of the first rows."""
        self.discrete = self._relative(self.rows.heights - coarse.rows.heights, self.extents)

    @property
    def folded(self) -> Array:
        """What folds from harmonics that so few phases do not show: relative errors [3, counts, rows]."""
        return self.folds * folding(self.counts, self.phases)[:, np.newaxis]

    def keeps(self, errors: Array) -> bool:
        """Return whether the `errors` of the first rows keep their share of the targets."""
        within = np.array(self.counts) <= TARGET_HARMONICS
        worst = errors[:, within][:, :, self.first >= LIGHTEST_JUDGED].max(axis=(1, 2))
        return bool(np.all(worst <= SHARE * self.targets))

    def has_room(self, bounds: TableBounds) -> bool:
        """Return whether enough rows of twice as much work would be within the bounds."""
        return 2 * FEWEST_ROWS * self.work_of_row <= bounds.work

    def _relative(self, gaps: Array, extents: Array) -> Array:
        """Return the largest size of a change of z [rows, phases] in each quantity, relative to `extents`."""
        found = swings(self.series(gaps), self.counts, False)
        return relative(found, extents, self.counts, self.response.scale_at(USUAL_LOAD))

    def halve(self, most_rows: int) -> None:
        """Halve intervals until each is expected to keep its target, or there are `most_rows` rows."""
        while True:
            worst, room = self._worst(), most_rows - len(self.rows.loads)
            worst[np.diff(self.rows.loads) < NARROWEST * self.rows.loads[1:]] = 0.0
            chosen = np.flatnonzero(np.isinf(worst) if np.isinf(worst).any() else worst > 1.0)
            if not len(chosen) or room <= 0:
                return
            if SCARCE * len(chosen) > room:  # the worst of them: what they leave may need the rows more than the others
                chosen = np.sort(chosen[np.argsort(-worst[chosen], kind="stable")][:room])
                chosen = chosen[worst[chosen] > 0.2 * worst.max()] if np.isfinite(worst.max()) else chosen
            self._halve(chosen)

    def error(self, levels: MipLevels) -> TableError:
        """Return the error of every interval: what its parent missed, what folds at either end, and images."""
        folded = np.maximum(self.folded[:, :, :-1], self.folded[:, :, 1:])
        unseen = MANY_KINKS if self.response.refined() is not None else 1.0
        largest = LEAST + unseen * widest(self.missed) + folded + images(levels, self.counts)[:, :, np.newaxis]
        octave = np.clip(np.searchsorted(self.first, self.rows.loads[:-1], side="right") - 1, 0, len(self.first) - 2)
        largest += np.maximum(self.discrete[:, :, octave], self.discrete[:, :, octave + 1])
        beyond = octave_beyond(self._transformed(self.rows.heights), self.extents[:, -1])
        beyond = np.maximum(beyond[:, :-1], beyond[:, 1:])
        largest *= ROOM if self.response.refined() is None else 1.0
        return TableError(rounded(self.rows.loads).astype(float), self.counts, rounded(largest), rounded(beyond))

    def _worst(self) -> Array:
        """Return of each interval the largest error that is expected of its halves, over the target."""
        within = np.array(self.counts) <= TARGET_HARMONICS
        shares = np.where(within, 1.0 / self.targets[:, np.newaxis], 0.0)
        shares[0] = 1.0 / self.targets[0]
        over = [share * self.missed[k, j] for (k, j), share in np.ndenumerate(shares) if share > 0.0]
        return np.asarray(np.max(np.array(over), axis=0) / HALVED)

    def _halve(self, chosen: Indices) -> None:
        """Solve the middle of each of the `chosen` intervals, measure what the cubic missed there, make it a row."""
        low, high = self._ends(chosen)
        guess = halfway(low, high)
        middles = solved_rows(self.response, 0.5 * (low.loads + high.loads), self.phases, guess)
        extents, folds = self._measured(middles)
        missed = self._relative(guess - middles.heights, extents)
        both = np.repeat(self.missed, 1 + np.isin(np.arange(self.missed.shape[2]), chosen), axis=2)
        at = chosen + np.arange(len(chosen))
        both[:, :, at] = both[:, :, at + 1] = missed
        self.missed = both
        self.extents = np.insert(self.extents, chosen + 1, extents, axis=2)
        self.folds = np.insert(self.folds, chosen + 1, folds, axis=2)
        self.rows = self.rows.joined(middles)

    def _ends(self, chosen: Indices) -> tuple[SolvedRows, SolvedRows]:
        rows = self.rows
        low, high = (SolvedRows(rows.loads[at], rows.heights[at], rows.slopes[at]) for at in (chosen, chosen + 1))
        return low, high

    def _extents(self, heights: Array) -> Array:
        """Return the peak-to-peak of each quantity of rows, at each number of harmonics."""
        return swings(self.series(heights), self.counts, True)

    def _measured(self, rows: SolvedRows) -> tuple[Array, Array]:
        """Return the peak-to-peak that errors are relative to, and what half as many places change, of each row."""
        extents = np.maximum(self._extents(rows.heights), self.usual)
        series = self.series(rows.heights)
        half = np.fft.rfft(rows.heights[:, ::2], axis=1) * (2.0 / self.phases)
        change = np.zeros_like(series)
        kept = min(half.shape[1] - 1, series.shape[1])
        change[:, :kept] = series[:, :kept] - half[:, :kept]
        gaps = swings(change, self.counts, False)
        return extents, relative(gaps, extents, self.counts, self.response.scale_at(USUAL_LOAD))
