"""Makes a table: it solves rows of load, measures their error, and halves intervals where the error is too large.

Stage   RESPONSE: from a contact to its table.
Model   The middle of every interval of load is solved. The error of the interval is that of the cubic between its ends
        at the middle. The middle then becomes a row. The intervals whose halves are expected to miss their target are
        halved next, the worst first. This ends when there is no such interval, or at the limit on rows or work. The
        order is fixed and independent of time, so the same contact always gives the same table. Before that, the
        segments of a profile and the number of phases are refined as far as the first rows require. The change by the
        last refinement is part of the error.
Source  design, sections 1 and 8.
Limits  A table takes at most MOST_BYTES and MOST_WORK cells: 4 MB and about 0.6 s, or up to 2 s for a finger and a
        texture over an area. Two cosines take 0.13 s, and more than 0.3 s in 5 scenes of 200. The error that remains at
        these limits is reported.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from synth.arrays import Array
from synth.response.demand import Complex
from synth.response.load_grid import SolvedRows, first_loads, halfway, heaviest_row, solved_rows
from synth.response.mip_levels import PLACES_A_HARMONIC, MipLevels
from synth.response.place_spline import PADDING, padded, spline_coefficients
from synth.response.table import ResponseTable, rounded
from synth.response.table_error import (
    LEAST,
    USUAL_LOAD,
    TableError,
    folded_swings,
    harmonic_counts,
    images,
    octave_beyond,
    relative,
    swings,
    widest,
)

if TYPE_CHECKING:
    from synth.contact.forces import Response

Indices = np.ndarray[Any, np.dtype[np.intp]]

LIGHTEST_JUDGED = 0.02  # N: lighter loads do not refine a discretisation, since a finger only passes through them
LIGHT_SHARE = 0.1  # weight of errors at lighter loads when intervals are chosen; with 1 they may take half of the rows
HARMONICS = 64  # of the fullest level: all below 1 kHz for a 0.8 mm texture at 12.5 mm/s and faster
HEAVIEST = 5.0  # N: the last row, unless full contact comes first; a heavier load is read as 5 N
PHASES_A_HARMONIC = 4  # phases solved per harmonic; with 2 folding would reach the highest harmonics
MOST_BYTES = 4_000_000  # bytes of the coefficients of a table, all levels
MOST_WORK = 4.8e7  # cells of phases solved: 0.6 s at 12 ns per cell
OTHER_BYTES = 128  # per row: its load and means, and the errors of the interval above it
TARGETS = (5e-4, 1.5e-3, 5e-3)  # errors of displacement, velocity, acceleration: half of the promised ones
TARGET_HARMONICS = 32  # the targets hold up to this number; beyond it only that of displacement
HALVED = 2.5  # least factor by which the error of an interval with a kink falls when it is halved
SCARCE = 4  # rows per interval to be halved: if fewer are left, only the worst intervals are halved
REFINED = 4  # most doublings of segments or phases; each divides the error of segments by 4 to 8 and doubles the work
CHANGES_AN_OCTAVE = 4  # loads at which the change by smaller cells is found: it may double within half an octave
SHARE = 0.5  # of the targets, allowed for the discretisation
SHARE_OF_FOLDS = 3.0  # the same for folding, estimated 2 to 3 times too high; twice the phases leave half of the rows
MANY_KINKS = 1.5  # factor on the error of the cubic in the middle: a profile has kinks all over an interval
ROOM = 1.25  # safety factor for two cosines: in 470 scenes some errors at 64 harmonics were 1.08 times the estimate
FEWEST_ROWS = 100  # rows that the work must allow; with fewer, the rows have a larger error than the discretisation
COSINE_ROWS = 200  # the same for two cosines: where their harmonics cancel, intervals are small
HEAVY = 3.0  # largest factor on the limit of work, to reach FEWEST_ROWS rows: 2 s for an area
NARROWEST = 1e-4  # relative to its load: an interval this narrow is not halved


@dataclass(frozen=True, slots=True)
class TableBounds:
    """Limits on the size and work of a table.

    harmonics: of the fullest level.
    heaviest: load of the last row, N.
    nbytes: bytes of its coefficients.
    work: cells of phases solved.
    targets: relative errors of displacement, velocity and acceleration below which an interval is not halved.
    phases: phases solved per harmonic.
    places: spline coefficients kept per harmonic.
    """

    harmonics: int = HARMONICS
    heaviest: float = HEAVIEST
    nbytes: int = MOST_BYTES
    work: float = MOST_WORK
    targets: tuple[float, float, float] = TARGETS
    phases: int = PHASES_A_HARMONIC
    places: float = PLACES_A_HARMONIC

    def rows(self, levels: MipLevels, work_of_row: float) -> int:
        """Return the number of rows within the limits: at least the first rows and the middles between them."""
        bytes_of_row = 8 * sum(places + PADDING for places in levels.places) + OTHER_BYTES
        affordable = max(self.work // work_of_row, min(FEWEST_ROWS, HEAVY * self.work // work_of_row))
        return int(max(24, min(self.nbytes // bytes_of_row, affordable)))


BOUNDS = TableBounds()


def make_table(
    response: Response, *, period: float, band: float, lift_load: float, bounds: TableBounds = BOUNDS, scene: str = "{}"
) -> ResponseTable:
    """Return the table of `response`.

    period: period of the texture (m).
    band: frequency (Hz) up to which every harmonic is heard in full.
    lift_load: load (N) below which the lift gate fades the output.
    scene: JSON of the scene, kept in the table.
    """
    levels = MipLevels.up_to(bounds.harmonics, bounds.places)
    heaviest, full = heaviest_row(response, bounds.heaviest)
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
    """Return the first rows of `response`, up to `heaviest` (N).

    The segments of a profile or the phases are doubled, whichever have the larger error, until both keep their share of
    the targets or reach the limit on work.
    """
    making = TableMaking(response, bounds, heaviest)
    finer, smaller, larger = response.refined(), response.halved(), response.doubled()
    if finer is not None:
        making = making.on(finer)
    elif smaller is not None:
        making.discrete = making.discrete + making.changed_by(smaller) / (1.0 - smaller.settles)
    elif larger is not None:
        making.discrete = making.discrete + making.changed_by(larger)
    for _ in range(REFINED):
        discrete, folded = making.excess(making.discrete) / SHARE, making.excess(making.folds) / SHARE_OF_FOLDS
        if max(discrete, folded) <= 1.0 or not making.has_room:
            break
        finer = making.response.refined() if discrete > folded else making.response
        if finer is None:
            break
        making = making.on(finer)
    return making


def mean_law(response: Response, heaviest: float) -> tuple[float, float]:
    """Return a (m) and b (m/N^1.5) of the mean a + b w^1.5 of a contact that is full at `heaviest` (N)."""
    closed = response.closed(heaviest)
    assert closed is not None
    growth = closed.slope * heaviest / 1.5
    return closed.mean - growth, growth / heaviest**1.5


class TableMaking:
    """The rows of a table that is being made, and the measured error of each interval between two rows."""

    def __init__(self, response: Response, bounds: TableBounds, heaviest: float) -> None:
        self.response, self.bounds, self.heaviest = response, bounds, heaviest
        self.highest = bounds.harmonics
        self.targets = np.array(bounds.targets)
        self.phases = 1 << (bounds.phases * bounds.harmonics - 1).bit_length()
        self.counts = harmonic_counts(bounds.harmonics)
        self.usual = self._extents(solved_rows(response, np.array([min(USUAL_LOAD, heaviest)]), self.phases).heights)
        self.rows = solved_rows(response, first_loads(heaviest), self.phases)
        self.extents, self.folds = self._measured(self.rows)
        self.missed = np.full((3, len(self.counts), len(self.rows.loads) - 1), np.inf)
        self.work_of_row = self.phases * response.work_at(min(USUAL_LOAD, heaviest))
        self.first = self.rows.loads
        self.discrete = np.zeros_like(self.extents)

    def on(self, response: Response) -> TableMaking:
        """Return the first rows of `response`, which has finer segments or is this one: then at twice the phases."""
        if response is self.response:
            finer = TableMaking(response, replace(self.bounds, phases=2 * self.bounds.phases), self.heaviest)
            finer.discrete = self.discrete
        else:
            finer = TableMaking(response, self.bounds, self.heaviest)
            finer.discrete = finer.relative_to_extents(finer.rows.heights - self.rows.heights, finer.extents)
        return finer

    def changed_by(self, other: Response) -> Array:
        """Return the largest change by the cells of `other` within half an octave of each of the first loads.

        It is relative to the extents [3, counts, first rows].
        """
        steps = CHANGES_AN_OCTAVE * (len(self.first) - 2)
        loads = self.first[-1] * 2.0 ** (np.arange(-steps, 1.0) / CHANGES_AN_OCTAVE)
        rows = solved_rows(self.response, loads, self.phases)
        gaps = solved_rows(other, loads, self.phases).heights - rows.heights
        changed = self.relative_to_extents(gaps, np.maximum(self._extents(rows.heights), self.usual))
        beside = CHANGES_AN_OCTAVE // 2
        around = np.pad(changed, ((0, 0), (0, 0), (beside, beside)), mode="edge")
        windows = np.lib.stride_tricks.sliding_window_view(around, CHANGES_AN_OCTAVE + 1, axis=2)
        within = np.max(windows[:, :, ::CHANGES_AN_OCTAVE], axis=3)
        return np.concatenate([within[:, :, :1], within], axis=2)

    def series(self, values: Array) -> Complex:
        """Return harmonics 0 to the highest, one-sided as in `spectrum`, of `values` [rows, phases]: [rows, n]."""
        return self._transformed(values)[:, : self.highest + 1]

    def _transformed(self, values: Array) -> Complex:
        return np.asarray(np.fft.rfft(values, axis=1)[:, : 2 * self.highest + 1] / values.shape[1])

    def excess(self, errors: Array) -> float:
        """Return the largest of `errors` [3, counts, first rows] at usual loads, relative to its target.

        A shallow contact may be full below the usual loads. Then its heaviest row is used.
        """
        within = np.array(self.counts) <= TARGET_HARMONICS
        judged = self.first >= min(LIGHTEST_JUDGED, self.first[-1])
        worst = errors[:, within][:, :, judged].max(axis=(1, 2))
        return float(np.max(worst / self.targets))

    @property
    def has_room(self) -> bool:
        """Whether FEWEST_ROWS rows (two cosines: COSINE_ROWS) of twice the work would be within the limits."""
        rows = COSINE_ROWS if self.response.of_cosines else FEWEST_ROWS
        return 2 * rows * self.work_of_row <= self.bounds.work

    def relative_to_extents(self, gaps: Array, extents: Array) -> Array:
        """Return the largest change of each quantity, relative to `extents`; gaps: changes of z (m) [rows, phases]."""
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
            if SCARCE * len(chosen) > room:  # the halves of the worst may need the rows more than others do
                chosen = np.sort(chosen[np.argsort(-worst[chosen], kind="stable")][:room])
                chosen = chosen[worst[chosen] > 0.2 * worst.max()] if np.isfinite(worst.max()) else chosen
            self._halve(chosen)

    def error(self, levels: MipLevels) -> TableError:
        """Return the error of every interval: interpolation over the load, folding, spline images, discretisation."""
        folded = np.maximum(self.folds[:, :, :-1], self.folds[:, :, 1:])
        unseen = MANY_KINKS if self.response.refined() is not None else 1.0
        largest = LEAST + unseen * widest(self.missed) + folded + images(levels, self.counts)[:, :, np.newaxis]
        octave = np.clip(np.searchsorted(self.first, self.rows.loads[:-1], side="right") - 1, 0, len(self.first) - 2)
        largest += np.maximum(self.discrete[:, :, octave], self.discrete[:, :, octave + 1])
        beyond = octave_beyond(self._transformed(self.rows.heights), self.extents[:, -1])
        beyond = np.maximum(beyond[:, :-1], beyond[:, 1:])
        largest *= ROOM if self.response.refined() is None else 1.0
        return TableError(rounded(self.rows.loads).astype(float), self.counts, rounded(largest), rounded(beyond))

    def _worst(self) -> Array:
        """Return the largest expected error of the halves of each interval, relative to its target."""
        within = np.array(self.counts) <= TARGET_HARMONICS
        shares = np.where(within, 1.0 / self.targets[:, np.newaxis], 0.0)
        shares[0] = 1.0 / self.targets[0]
        over = [share * self.missed[k, j] for (k, j), share in np.ndenumerate(shares) if share > 0.0]
        weights = np.where(self.rows.loads[1:] <= LIGHTEST_JUDGED, LIGHT_SHARE, 1.0) / HALVED
        return np.asarray(weights * np.max(np.array(over), axis=0))

    def _halve(self, chosen: Indices) -> None:
        """Solve the middle of each `chosen` interval, measure the error of the cubic there, and make it a row."""
        low, high = self._ends(chosen)
        guess = halfway(low, high)
        middles = solved_rows(self.response, 0.5 * (low.loads + high.loads), self.phases, guess)
        extents, folds = self._measured(middles)
        missed = self.relative_to_extents(guess - middles.heights, extents)
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
        """Return the peak-to-peak of each quantity, at each number of harmonics [3, counts, rows]."""
        return swings(self.series(heights), self.counts, True)

    def _measured(self, rows: SolvedRows) -> tuple[Array, Array]:
        """Return the peak-to-peak to which errors are relative, and the error by folding."""
        extents = np.maximum(self._extents(rows.heights), self.usual)
        half = self.series(rows.heights[:, ::2])
        change = np.zeros((len(half), self.highest + 1), dtype=np.complex128)
        change[:, : half.shape[1]] = self.series(rows.heights)[:, : half.shape[1]] - half
        gaps = folded_swings(change, self.counts, self.phases)
        return extents, relative(gaps, extents, self.counts, self.response.scale_at(USUAL_LOAD))
