"""Reading a table along any motion: position and load at every frame in, one quantity at every frame out.

Stage   RESPONSE: reading its result.
Model   z is read at every few frames; a short filter (`reading_filter`) makes the quantity from it. So every term of a
        changing load and speed counts. The output is `delay` frames behind the motion. Before the first frame the
        finger stands where it begins.
Source  design, section 1; docs/table.md.
Limits  The errors of the table and of the filter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from synth.arrays import Array
from synth.response import reading_loop as loop
from synth.response.reading_filter import ReadingFilter, reading_filter
from synth.response.table import Floats, ResponseTable


@dataclass(frozen=True, slots=True)
class TableReader:
    """Reads one quantity of a table at one rate. It keeps no state: `start` returns one, `read` updates it.

    table: the table.
    filter: from z to the quantity.
    numbers: arguments of `reading_loop.read_block`: pool, levels, rows, weights, rules.
    """

    table: ResponseTable
    filter: ReadingFilter
    numbers: tuple[Array | Floats, ...]

    @classmethod
    def of(cls, table: ResponseTable, quantity: str, rate: int, gain: float = 1.0) -> TableReader:
        """Return the reader of `quantity`, in SI times `gain`, at `rate` (Hz).

        quantity: displacement, velocity, acceleration or approach.
        """
        chosen = reading_filter(quantity, rate, table.band)
        fades = table.levels.fades
        levels = np.stack([*fades, *table.layout.T.astype(float), 1.0 / (fades[1] - fades[0])], axis=1)
        rows = np.concatenate([table.loads[np.newaxis], table.means]).astype(float)
        weights = np.ascontiguousarray(chosen.weights.T)
        rules = np.zeros(11)
        rules[loop.RATE], rules[loop.PERIOD] = rate, table.period
        rules[loop.SCALE] = 1.0 / (table.period * table.band)
        rules[loop.LIFT], rules[loop.GAIN], rules[loop.HOLD] = table.lift_load, gain, chosen.hold
        rules[loop.WITH_MEAN], rules[loop.FULL] = quantity == "approach", table.full
        rules[loop.LAW], rules[loop.LAW_SLOPE] = table.mean_law
        rules[loop.MOST] = table.covered[1]
        return cls(table, chosen, (table.pool, np.ascontiguousarray(levels), rows, weights, rules))

    @property
    def delay(self) -> int:
        """Frames by which the output is behind the motion: frame n of a block belongs to frame n - delay of it."""
        return self.filter.delay

    def start(self) -> Array:
        """Return the state of a reader that has read nothing."""
        return np.zeros(loop.HISTORY + self.filter.taps)

    def read(self, state: Array, motion: Array, position: Array, phase: int, out: Floats, column: int) -> int:
        """Write the next frames of the quantity to a column of `out`, update `state`, and return the next phase.

        motion: float64 [5, frames], as in `motion.Motion`.
        position: of the texture (m) at each frame. Where it is empty, the texture goes on from `phase` at the speed of
            the motion.
        phase: 64-bit fraction of a turn.
        out: float32 [frames, columns].
        """
        after: int = loop.read_block(*self.numbers, motion, position, phase, state, out, column)
        return after
