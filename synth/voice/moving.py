"""The part of a voice whose speed or load changes: tables met on the way, read by the compiled loops.

Stage   3 (VOICE), its moving half.
Model   see `contact.reading`. Tables are built when a block first meets their level and interval of load, rows of load
        when a block first meets their octave.
Source  design, sections 1 and 4.
Limits  all voices of one response share its tables and its rows (`moving_tables`); each takes new rows over when it
        likes.
"""

from __future__ import annotations

import math

import numpy as np

from synth.arrays import Array
from synth.motion.motion import LARGEST_LOAD, LOAD, SPEED, Motion
from synth.plan.preparation import Preparation
from synth.response.cell_reading import read_displacement, read_rate
from synth.response.load_cells import Surfaces
from synth.response.load_rows import FINEST
from synth.response.speed_levels import levels_heard
from synth.voice.limiter import Block
from synth.voice.moving_tables import NOWHERE_FINE, MovingTables, degree_of
from synth.voice.row_solver import MOVED, Followed

REST_TIME = 0.25  # s that a hand keeps its load before rows are made fine there; shorter: presses fill the memory
LOOK_SECONDS = 0.05  # of sound between two looks at where a hand rests and which rows there are; taking some over costs
# 0.1 ms, and looking, in each block, a tenth of it


class MovingReader:
    """One voice in motion: `read` renders a block.

    solved: with the voice's own full scale. tables: of its response, which other voices may share.
    """

    def __init__(self, solved: Preparation, phase: int, tables: MovingTables) -> None:
        self.shared = tables
        self.solved, self.rows = solved, self.shared.rows
        self.rate, self.period = solved.scene.output.sample_rate, solved.scene.texture.period
        self._edges = self.shared.edges_at_first
        self.surfaces = {degree: Surfaces(store, self._edges) for degree, store in self.shared.stores.items()}
        self.phase = np.array([phase], dtype=np.uint64)
        self._runs = tuple((number, c.order, self.surfaces[degree_of(c)]) for number, c in enumerate(solved.channels))
        self._layouts: list[Array] = []
        self._followed: Followed | None = None
        self.look_frames = round(LOOK_SECONDS * self.rate)
        self._unwatched = 0  # frames since the last look
        self._ends = (0.0, math.inf)  # N: the first and the last of the rows
        self._rest, self._rested, self._fine = NOWHERE_FINE, 0, NOWHERE_FINE
        self._news, self._seen = self._edges, (self._edges, NOWHERE_FINE)
        self.may_rest = True  # a hand that is not heard of keeps its load and does not rest
        self.takes_over = True  # by itself, while it reads a hand; a live voice that is recorded does it instead
        self._lay_out()

    def twin(self) -> MovingReader:
        """Return another reader of the same tables and rows, at phase 0, of a hand that rests where this one does."""
        made = MovingReader(self.solved, 0, self.shared)
        made.use_rows(self._edges)
        made._rest, made._rested, made._fine = self._rest, self._rested, self._fine
        return made

    def _lay_out(self) -> None:
        """Bring the layouts of the channels up to date with the rows."""
        self._ends = float(self._edges[0]), float(self._edges[-1])
        lift = self.solved.scene.scan.lift_load
        hold = 0.0 if self.shared.wait and self.rows is not None else 1.0
        self._layouts = [
            self.surfaces[degree_of(channel)].layout([self.rate, self.period, lift, 1.0 / channel.full_scale, hold])
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
            if self.solved.channels[number].is_approach:
                out[:, number] += self._level(motion.samples[LOAD]) / self.solved.channels[number].full_scale

    def _level(self, loads: Array) -> Array:
        """Return the mean of z over a period (m) at the loads (N), faded as displacement is."""
        assert self.solved.mean is not None
        s = np.clip(loads / self.solved.scene.scan.lift_load, 0.0, 1.0)
        return np.asarray(s**3 * (10.0 + s * (6.0 * s - 15.0)) * self.solved.mean(np.cbrt(np.maximum(loads, 0.0))))

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
        """Build what the loop missed at one frame: a level, and the next only where it fades into that.

        A hand that touches passes through a hundred intervals of load, most of them at speeds that are a level's own.
        """
        load = float(sample[LOAD])
        if self.rows is not None and self.shared.wait:
            if not load <= LARGEST_LOAD:
                raise ValueError(f"a load of {load!r} N is beyond the largest, {LARGEST_LOAD:g} N")
            self.rows.cover(load, load, self.shared.finest)
            if self._use_all_rows():
                return
        turns = abs(float(sample[SPEED])) / (self.rate * self.period)
        interval = int(np.clip(np.searchsorted(tables.edges, load, side="right") - 1, 0, len(tables.edges) - 2))
        tables.build(levels_heard(self.shared.levels, turns), interval)

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
        if self._rest[0] <= load <= self._rest[1] and self.may_rest:
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
