"""What the readers of one moving response share: levels of speed, rows of load, and the tables made of them.

Stage   3 (VOICE), its moving half.
Model   Rows of load are solved, and tables of them built, when a reader first meets them; for hands, which cannot wait,
        beforehand: the loads that hands use once, then those round each hand by a thread (`row_solver`).
Source  design, sections 1 and 4.
Limits  with `wait` false a load beyond the rows that are ready plays the nearest row until they are. What is built
        beforehand is bounded in time and in memory: a long period sounds at first with fewer loads.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Hashable
from time import thread_time

import numpy as np

from synth.arrays import Array
from synth.plan.channels import ChannelPlan, spendable
from synth.plan.preparation import Preparation
from synth.plan.usual_hand import HAND_LOADS
from synth.response.cache import ResponseCache
from synth.response.load_cells import OneRow, RowSource, TableStore
from synth.response.load_rows import COARSE, FINEST, PASSING, Rows
from synth.response.phase_cells import CUBIC, QUINTIC, fitted_table, kept_harmonics
from synth.response.spectrum import Demand
from synth.response.speed_levels import Levels, levels_up_to
from synth.response.table_budget import TableBudget
from synth.scene.output_section import BAND
from synth.voice.row_solver import Followed, RowSolver

ROW_SHARE, BETWEEN_SHARE = 0.6, 0.245  # of the tolerance: the error of a row, and between rows
# the tightest tolerance of rows for displacement, velocity and acceleration: tighter ones take minutes; the plan tells
ROW_FLOOR = (1e-6, 1e-5, 3e-4)
SINGLE = 1e-5  # from this tolerance on float32 is enough for the tables of velocity and acceleration
BUILT_ROUND = 2.0  # times and parts of the scan's load for which hands find tables built; some 2 to 4 MB a sixteenth of
# an octave: less, and streams are late when a hand first presses; more fills the memory with what nobody feels
SETTLE_TIME = (
    2.0  # s of a processor to solve the loads that hands use; usual scenes take 1, a period of 20 mm takes 15.
)
# More, and a hand waits for its first touch; less, and the first loads that it meets are those of the nearest row
NOWHERE_FINE = (0.0, 0.0)  # N: the range of loads in which a hand that does not rest needs fine rows
BASE_OF_LIFT = 0.25  # octaves of load begin here at most, as a part of lift_load: the gate leaves under a tenth below


class MovingTables:
    """What all readers of one preparation share: levels, rows of load, and the tables made of them. Thread-safe.

    wait: rows that a block needs are solved before it is rendered; otherwise the nearest rows play, and a thread solves
    more of them while a reader `follow`s a hand. budget: of memory, shared with other responses.
    """

    def __init__(self, solved: Preparation, *, wait: bool, budget: TableBudget | None = None) -> None:
        assert solved.spectrum is not None
        self.solved, self.wait = solved, wait
        self.levels = _levels(solved)
        self.rows = self._rows_for(solved) if solved.load_varies else None
        source: RowSource = self.rows or OneRow(solved.spectrum)
        degrees = sorted({degree_of(channel) for channel in solved.channels})
        self.stores = {
            degree: TableStore(
                source, self.levels, degree, self._density(degree),
                single=degree == QUINTIC and solved.tolerance >= SINGLE, budget=budget,
            )
            for degree in degrees
        }  # fmt: skip
        self._solver: RowSolver | None = None
        self._lock, self._settling, self._settled = threading.Lock(), threading.Lock(), False

    @property
    def edges(self) -> Array:
        """Loads (N) of the rows that are ready; another array whenever there are more."""
        return next(iter(self.stores.values())).rows.edges

    grows = True  # tables and rows are added while hands touch (see `synth.response.cache`)

    @property
    def memory_bytes(self) -> int:
        """Bytes of tables and rows."""
        rows = 0 if self.rows is None else self.rows.memory_bytes
        return rows + sum(store.memory_bytes for store in self.stores.values())

    @property
    def edges_at_first(self) -> Array:
        """Those with which a reader begins: all where it waits, the coarse ones for a hand that may not rest."""
        return self.edges if self.wait or self.rows is None else self.edges_fine_in(self.edges, NOWHERE_FINE)

    def edges_fine_in(self, edges: Array, fine: tuple[float, float]) -> Array:
        """Return those of the rows at `edges` (N) that are coarse, and all between two loads and next to them."""
        assert self.rows is not None
        kept = self.rows.coarse(edges)
        low, high = np.searchsorted(edges, fine[0], side="right") - 1, np.searchsorted(edges, fine[1])
        kept[max(low, 0) : high + 1] |= fine[1] > 0.0
        return np.asarray(edges[kept])

    def settle(self) -> None:
        """Solve the loads that hands use, and build the tables round the scan's own: once, and it takes up to seconds.

        What streams meet later is then little enough not to make them late. Of a response that is slow to solve only
        what SETTLE_TIME is enough for is solved; a thread does the rest while hands are followed.
        """
        with self._settling:
            if not self._settled and self.rows is not None:
                begun = thread_time()

                def over() -> bool:
                    return thread_time() - begun > SETTLE_TIME

                self._solve_usual(over)
                self.rows.cover(0.0, HAND_LOADS[0], PASSING, over)
                self._build_usual()
            self._settled = True

    def _solve_usual(self, stop: Callable[[], bool]) -> None:
        """Solve the loads that hands use, those next to the scan's own first, until `stop`."""
        assert self.rows is not None
        load, (low, high) = self.solved.scene.scan.load, self._round_scan
        for begin, end in ((load, high), (low, load), HAND_LOADS):
            self.rows.cover(begin, end, COARSE, stop)

    def _build_usual(self) -> None:
        """Build the tables round the scan's load, the nearest first, as far as there are rows and there is room."""
        edges, load = self.edges_at_first, self.solved.scene.scan.load
        nearest = sorted(self._intervals(edges, *self._round_scan), key=lambda place: abs(float(edges[place]) - load))
        levels = range(len(self.levels.highest))
        for store in self.stores.values():
            for interval in nearest:
                if not store.has_room(levels):
                    break
                store.build(levels, interval, edges)

    @property
    def _round_scan(self) -> tuple[float, float]:
        """The loads (N) round the scan's own for which hands find tables built."""
        load = self.solved.scene.scan.load
        return load / BUILT_ROUND, math.nextafter(load * BUILT_ROUND, 0.0)

    def build_fine(self, low: float, high: float) -> None:
        """Build the tables that a hand which rests between two loads (N) needs; for who solves its rows."""
        edges = self.edges_fine_in(self.edges, (low, high))
        for store in self.stores.values():
            for interval in self._intervals(edges, low, high):
                store.build(range(len(self.levels.highest)), interval, edges)

    def _intervals(self, edges: Array, low: float, high: float) -> range:
        """Return the intervals of `edges` in which the loads from `low` to `high` (N) lie."""
        first, last = int(np.searchsorted(edges, low, side="right")) - 1, int(np.searchsorted(edges, high))
        return range(max(first, 0), min(last, len(edges) - 1))

    def follow(self) -> Followed | None:
        """Return what a hand tells its load, None where rows need no solving; `leave` it in the end."""
        if self.wait or self.rows is None:
            return None
        with self._lock:
            if self._solver is None:
                self._solver = RowSolver(self.rows, self.build_fine, self._solve_usual)
            return self._solver.follow(self.solved.scene.scan.load)

    @property
    def finest(self) -> float:
        """The closest rows to begin with: a hand that waits has the finest, `cover` gives them to a recorded load."""
        if not self.wait:
            return COARSE
        return FINEST if self.solved.by_hand else PASSING

    def _rows_for(self, solved: Preparation) -> Rows:
        assert solved.contact is not None
        demand, scan = solved.demand(), solved.scene.scan
        octaves = max(0, math.ceil(math.log2(scan.load / (BASE_OF_LIFT * scan.lift_load)))) if scan.load else 0
        base = scan.load / 2.0**octaves or BASE_OF_LIFT * scan.lift_load  # an octave begins at the scan's own load
        budget = spendable(max(solved.tolerance, ROW_FLOOR[max(demand.orders)]))
        wanted = Demand(demand.highest, demand.orders, ROW_SHARE * budget)
        rows = Rows(solved.contact, wanted, self.levels.highest[0], base, BETWEEN_SHARE * budget)
        rows.cover(scan.load, scan.load, self.finest)
        return rows

    def _density(self, degree: int) -> float:
        """Return cells a harmonic that the tolerance needs, at the scan's own speed.

        Where the load varies, a kink of order 3/2 stands for the loads whose series is not known yet.
        """
        spectrum = self.solved.spectrum
        assert spectrum is not None
        orders = tuple(sorted({c.order for c in self.solved.channels if degree_of(c) == degree}))
        series = spectrum.harmonics[: min(max(self.solved.highest, 1), self.levels.highest[0]) + 1].copy()
        n = np.arange(1, len(series))
        kink = np.concatenate([[0.0], n**-2.5]).astype(np.complex128)
        sizes = [
            len(fitted_table(curve, degree, orders, self.solved.table_tolerance).coefficients)
            for curve in ((series, kink) if self.rows is not None else (series,))
        ]
        return max(sizes) / len(n)


def tables_for(solved: Preparation, cache: ResponseCache, *, wait: bool, response: Hashable = None) -> MovingTables:
    """Return the tables of a hand, new ones where it waits; those who cannot wait share them on the same scene.

    response: what they are of, besides what the scene says: the key of a force.
    """
    if wait:
        return MovingTables(solved, wait=True)
    scene, output = solved.scene, solved.scene.output
    sound = output.sample_rate, output.bandwidth, tuple(channel.quantity for channel in output.channel_list)
    key = ("hand tables", response, scene.finger, scene.texture, scene.scan, scene.effects, sound, scene.accuracy)
    return cache.get(key, lambda: MovingTables(solved, wait=False, budget=cache.tables))


def degree_of(channel: ChannelPlan) -> int:
    """Return the degree of the tables that a channel reads."""
    return CUBIC if channel.order == 0 else QUINTIC


def _levels(solved: Preparation) -> Levels:
    """Return the levels that the channels need: no more harmonics than the tolerance, the rate or the bandwidth lets
    through.
    """
    spectrum = solved.spectrum
    assert spectrum is not None
    most = solved.reach
    orders = tuple(sorted({channel.order for channel in solved.channels}))
    needed = most if solved.load_varies else kept_harmonics(spectrum.harmonics[: most + 1], orders, solved.tolerance)
    output = solved.scene.output
    scale = min(1.0, output.bandwidth_hz / (BAND * output.sample_rate))
    levels = levels_up_to(needed)
    return Levels(levels.highest, levels.fade_from * scale, levels.fade_to * scale) if scale < 1.0 else levels
