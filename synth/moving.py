"""The part of a voice whose speed or load changes: tables met on the way, read by the compiled loops.

Stage   3 (VOICE), its moving half.
Model   see `contact.reading`. Tables are built when a block first meets their level and interval of load, rows of load
        when a block first meets their octave.
Source  design, sections 1 and 4.
Limits  with `wait` false a load beyond the rows that are ready plays the nearest row until they are. All voices of one
        response share its tables and its rows (`MovingTables`); each takes new rows over when it likes.
"""

from __future__ import annotations

import math
import threading

import numpy as np

from synth.channels import ChannelPlan, spendable
from synth.contact.exact import Array
from synth.contact.levels import Levels, levels_up_to
from synth.contact.reading import read_displacement, read_rate
from synth.contact.rows import COARSE, FINEST, PASSING, Rows
from synth.contact.spectrum import Demand
from synth.contact.surfaces import OneRow, RowSource, Surfaces, TableStore
from synth.contact.tables import CUBIC, QUINTIC, fitted_table, kept_harmonics
from synth.motion import LARGEST_LOAD, LOAD, SPEED, Motion
from synth.output import Block
from synth.preparation import BAND, Preparation
from synth.row_solver import MOVED, USUAL_LOADS, Followed, RowSolver

ROW_SHARE, BETWEEN_SHARE = 0.6, 0.245  # of the tolerance: the error of a row, and between rows
# the tightest tolerance of rows for displacement, velocity and acceleration: tighter ones take minutes; the plan tells
ROW_FLOOR = (1e-6, 1e-5, 3e-4)
SINGLE = 1e-5  # from this tolerance on float32 is enough for the tables of velocity and acceleration
BUILT_ROUND = 2.0  # times and parts of the scan's load for which hands find tables built; some 2 to 4 MB a sixteenth of
# an octave: less, and streams are late when a hand first presses; more fills the memory with what nobody feels
NOWHERE_FINE = (0.0, 0.0)  # N: the range of loads in which a hand that does not rest needs fine rows
REST_TIME = 0.25  # s that a hand keeps its load before rows are made fine there; shorter: presses fill the memory
LOOK_SECONDS = 0.05  # of sound between two looks at where a hand rests and which rows there are; taking some over costs
# 0.1 ms, and looking, in each block, a tenth of it
BASE_OF_LIFT = 0.25  # octaves of load begin here at most, as a part of lift_load: the gate leaves under a tenth below


class MovingTables:
    """What all readers of one preparation share: levels, rows of load, and the tables made of them. Thread-safe.

    wait: rows that a block needs are solved before it is rendered; otherwise the nearest rows play, and a thread solves
    more of them while a reader `follow`s a hand.
    """

    def __init__(self, solved: Preparation, *, wait: bool) -> None:
        assert solved.spectrum is not None
        self.solved, self.wait = solved, wait
        self.levels = _levels(solved)
        self.rows = self._rows_for(solved) if solved.load_varies else None
        source: RowSource = self.rows or OneRow(solved.spectrum)
        degrees = sorted({_degree(channel) for channel in solved.channels})
        self.stores = {
            degree: TableStore(
                source, self.levels, degree, self._density(degree),
                single=degree == QUINTIC and solved.tolerance >= SINGLE,
            )
            for degree in degrees
        }  # fmt: skip
        self._solver: RowSolver | None = None
        self._lock, self._settling, self._settled = threading.Lock(), threading.Lock(), False

    @property
    def edges(self) -> Array:
        """Loads (N) of the rows that are ready; another array whenever there are more."""
        return next(iter(self.stores.values())).rows.edges

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

        What streams meet later is then little enough not to make them late.
        """
        load = self.solved.scene.scan.load
        with self._settling:
            if self._settled or self.rows is None:
                return
            self.rows.cover(*USUAL_LOADS, COARSE)
            self.rows.cover(0.0, USUAL_LOADS[0], PASSING)
            self.build(self.edges_at_first, load / BUILT_ROUND, load * BUILT_ROUND)
            self._settled = True

    def build(self, edges: Array, low: float, high: float) -> None:
        """Build the tables of every speed between two loads (N), of the intervals of `edges`."""
        first, last = int(np.searchsorted(edges, low, side="right")) - 1, int(np.searchsorted(edges, high))
        for store in self.stores.values():
            for interval in range(max(first, 0), min(last, len(edges) - 1)):
                store.build(range(len(self.levels.highest)), interval, edges)

    def build_fine(self, low: float, high: float) -> None:
        """Build the tables that a hand which rests between two loads (N) needs; for who solves its rows."""
        self.build(self.edges_fine_in(self.edges, (low, high)), low, high)

    def follow(self) -> Followed | None:
        """Return what a hand tells its load, None where rows need no solving; `leave` it in the end."""
        if self.wait or self.rows is None:
            return None
        with self._lock:
            if self._solver is None:
                self._solver = RowSolver(self.rows, self.build_fine)
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
        orders = tuple(sorted({c.order for c in self.solved.channels if _degree(c) == degree}))
        series = spectrum.harmonics[: min(max(self.solved.highest, 1), self.levels.highest[0]) + 1].copy()
        n = np.arange(1, len(series))
        kink = np.concatenate([[0.0], n**-2.5]).astype(np.complex128)
        sizes = [
            len(fitted_table(curve, degree, orders, self.solved.table_tolerance).coefficients)
            for curve in ((series, kink) if self.rows is not None else (series,))
        ]
        return max(sizes) / len(n)


class MovingReader:
    """One voice in motion: `read` renders a block.

    solved: with the voice's own full scale. tables: shared with other voices of the same response; made here unless
    given. wait: see `MovingTables`.
    """

    def __init__(
        self, solved: Preparation, phase: int, *, wait: bool = True, tables: MovingTables | None = None
    ) -> None:
        self.shared = tables or MovingTables(solved, wait=wait)
        self.solved, self.rows = solved, self.shared.rows
        self.rate, self.period = solved.scene.output.sample_rate, solved.scene.texture.period
        self._edges = self.shared.edges_at_first
        self.surfaces = {degree: Surfaces(store, self._edges) for degree, store in self.shared.stores.items()}
        self.phase = np.array([phase], dtype=np.uint64)
        self._runs = tuple((number, c.order, self.surfaces[_degree(c)]) for number, c in enumerate(solved.channels))
        self._layouts: list[Array] = []
        self._followed: Followed | None = None
        self.look_frames = round(LOOK_SECONDS * self.rate)
        self._unwatched = 0  # frames since the last look
        self._ends = (0.0, math.inf)  # N: the first and the last of the rows
        self._rest, self._rested, self._fine = NOWHERE_FINE, 0, NOWHERE_FINE
        self._news, self._seen = self._edges, (self._edges, NOWHERE_FINE)
        self.takes_over = True  # by itself, while it reads a hand; a live voice that is recorded does it instead
        self._lay_out()

    def twin(self) -> MovingReader:
        """Return another reader of the same tables and rows, at phase 0, of a hand that rests where this one does."""
        made = MovingReader(self.solved, 0, tables=self.shared)
        made.use_rows(self._edges)
        made._rest, made._rested, made._fine = self._rest, self._rested, self._fine
        return made

    def _lay_out(self) -> None:
        """Bring the layouts of the channels up to date with the rows."""
        self._ends = float(self._edges[0]), float(self._edges[-1])
        lift = self.solved.scene.scan.lift_load
        hold = 0.0 if self.shared.wait and self.rows is not None else 1.0
        self._layouts = [
            self.surfaces[_degree(channel)].layout([self.rate, self.period, lift, 1.0 / channel.full_scale, hold])
            for channel in self.solved.channels
        ]

    @property
    def memory_bytes(self) -> int:
        """Bytes of tables and rows, which other voices may share."""
        return self.shared.memory_bytes

    @property
    def edges(self) -> Array:
        """Loads (N) of the rows that this voice uses."""
        return self._edges

    def read(self, motion: Motion, out: Block) -> None:
        """Write the block of `motion` to `out` (float32 [frames, channels]) and move the phase on."""
        begin = self.phase[0] if len(self._runs) > 1 else None
        for number, order, tables in self._runs:
            if begin is not None:
                self.phase[0] = begin
            frame = self._run(tables, motion, 0, out, number, order)
            self._go_on(tables, motion, frame, out, number, order)

    @property
    def alone(self) -> tuple[Surfaces, Array, int]:
        """The tables, the layout and the order of the only channel, for a kernel that reads them itself."""
        assert len(self._runs) == 1, "one channel"
        return self._runs[0][2], self._layouts[0], self._runs[0][1]

    def go_on(self, motion: Motion, frame: int, out: Block) -> None:
        """Fill the only channel of `out` from `frame` on, whose table such a kernel has missed."""
        number, order, tables = self._runs[0]
        self._go_on(tables, motion, frame, out, number, order)

    def _go_on(self, tables: Surfaces, motion: Motion, frame: int, out: Block, number: int, order: int) -> None:
        """Build what `frame` misses and read on, until all frames are read."""
        while frame < motion.samples.shape[1]:
            self._meet(tables, motion.samples[:, frame])
            frame = self._run(tables, motion, frame, out, number, order)

    def _run(self, tables: Surfaces, motion: Motion, frame: int, out: Block, number: int, order: int) -> int:
        """Run the compiled loop of one channel from `frame` on; return the frame that it could not render."""
        layout = self._layouts[number]
        if order == 0:
            done: int = read_displacement(
                tables.pool, tables.tables, layout, self.phase, motion.samples, motion.position, frame, out, number
            )
            return done
        done = read_rate(
            tables.pool, tables.tables, layout, self.phase, motion.samples, motion.position, frame, out, number, order
        )
        return done

    def _meet(self, tables: Surfaces, sample: Array) -> None:
        """Build what the loop missed at one frame."""
        load = float(sample[LOAD])
        if self.rows is not None and self.shared.wait:
            if not load <= LARGEST_LOAD:
                raise ValueError(f"a load of {load!r} N is beyond the largest, {LARGEST_LOAD:g} N")
            self.rows.cover(load, load, self.shared.finest)
            if self._use_all_rows():
                return
        turns = abs(float(sample[SPEED])) / (self.rate * self.period)
        levels = self.shared.levels
        level = int(np.searchsorted(levels.fade_to, turns, side="right"))
        interval = int(np.clip(np.searchsorted(tables.edges, load, side="right") - 1, 0, len(tables.edges) - 2))
        tables.build(range(level, min(level + 2, len(levels.highest))), interval)

    def follow(self) -> None:
        """Have rows solved where the hand is, in a thread, until `close`; nothing where blocks wait for them."""
        if self._followed is None:
            self._followed = self.shared.follow()

    @property
    def followed(self) -> Followed | None:
        """The hand as the solver of rows knows it, None where none is followed."""
        return self._followed

    def read_hand(self, motion: Motion, out: Block) -> None:
        """Do as `read` for a hand that is followed, with the rows that have become ready."""
        self.watch(motion.samples.item(LOAD, 0), len(out))
        self.read(motion, out)

    def watch(self, load: float, frames: int) -> None:
        """Look after a followed hand, which is at `load` (N) in one of `frames`."""
        if self._followed is None:
            return
        self._unwatched += frames
        if self._unwatched >= self.look_frames or not self._ends[0] <= load <= self._ends[1]:
            self._follow(load, self._unwatched)
            self._unwatched = 0
            if self.takes_over and self.has_news():
                self.take_over_rows()

    def _follow(self, load: float, frames: int) -> None:
        """Tell who solves rows of a load that needs new ones: at once beyond the rows, else when the hand rests there.

        A load that is only passed through needs no fine rows: the tables of each would be built for a moment.
        """
        assert self._followed is not None
        if self._rest[0] <= load <= self._rest[1]:
            self._rested += frames
        else:
            self._rest, self._rested = (load / MOVED, load * MOVED), 0
        resting = self._rested >= REST_TIME * self.rate
        low, high = self._followed.fine
        self._fine = self._followed.fine if low <= load <= high else NOWHERE_FINE
        calm = self._followed.calm
        if not calm[0] <= load <= calm[1] and (resting or not self._ends[0] <= load <= self._ends[1]):
            self._followed.now_at(load)

    def has_news(self) -> bool:
        """Return whether there are other rows for this hand than it uses; ask every `look_frames`."""
        asked = self.shared.edges, self._fine
        if asked[0] is self._seen[0] and asked[1] == self._seen[1]:
            return False
        self._seen = asked
        self._news = asked[0] if self._followed is None else self.shared.edges_fine_in(*asked)
        return not np.array_equal(self._news, self._edges)

    def news_matter(self, load: float) -> bool:
        """Return whether the rows that were found last change what sounds at `load` (N)."""
        return _interval_ends(self._news, load) != _interval_ends(self._edges, load)

    def take_over_rows(self) -> None:
        """Use the rows that `has_news` found."""
        self.use_rows(self._news)

    def renew(self) -> None:
        """Use the rows that are there for this hand now."""
        if self.has_news():
            self.take_over_rows()

    def close(self, *, wait: bool = True) -> None:
        """Be followed no more; what is solved can still be read. wait: for a thread that ends with the last."""
        followed, self._followed = self._followed, None
        if followed is not None:
            followed.leave(wait=wait)

    def cover(self, low: float, high: float) -> None:
        """Solve the rows from `low` to `high` (N) as finely as rows may lie, and use them."""
        if self.rows is not None:
            self.rows.cover(low, high, FINEST)
            self._use_all_rows()

    def _use_all_rows(self) -> bool:
        """Use every row that is ready; return whether there are new ones."""
        if self.shared.edges is self._edges:
            return False
        self.use_rows(self.shared.edges)
        return True

    def use_rows(self, edges: Array) -> None:
        """Use the rows at `edges` (N), those of the shared rows now or, in a recording, at some time."""
        self._edges = edges
        for tables in self.surfaces.values():
            tables.use(edges)
        self._lay_out()


def _interval_ends(edges: Array, load: float) -> tuple[float, float]:
    """Return the rows (N) round `load`, the last two on its side where it is beyond them."""
    place = min(max(int(np.searchsorted(edges, load, side="right")) - 1, 0), len(edges) - 2)
    return float(edges[place]), float(edges[place + 1])


def _degree(channel: ChannelPlan) -> int:
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
    bandwidth = solved.scene.output.bandwidth
    scale = 1.0 if bandwidth is None else min(1.0, bandwidth / (BAND * solved.scene.output.sample_rate))
    levels = levels_up_to(needed)
    return Levels(levels.highest, levels.fade_from * scale, levels.fade_to * scale) if scale < 1.0 else levels


def completed(motion: Motion, rate: int, before: Array) -> Motion:
    """Return `motion` with the derivatives that it lacks taken from the frame before.

    before: float64 [4], position (m), speed (m/s), load (N), load rate (N/s) of the last frame, NaN where it is not
    known; it is brought up to date. A derivative is 0 until the frames that it needs are known.
    """
    samples = motion.samples.copy()
    if len(motion.position):
        samples[0] = _rate_of(motion.position, before[0], rate)
        before[0] = motion.position[-1]
    samples[1] = _rate_of(samples[0], before[1], rate)
    samples[3] = _rate_of(samples[2], before[2], rate)
    samples[4] = _rate_of(samples[3], before[3], rate)
    before[1], before[2], before[3] = samples[0, -1], samples[2, -1], samples[3, -1]
    return Motion(np.nan_to_num(samples, copy=False), motion.position, True)


def _rate_of(values: Array, before: float, rate: int) -> Array:
    """Return the change from frame to frame, a second; NaN where the frame before is not known."""
    return np.asarray(np.diff(values, prepend=before) * rate)
