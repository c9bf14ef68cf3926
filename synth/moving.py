"""The part of a voice whose speed or load changes: tables met on the way, read by the compiled loops.

Stage   3 (VOICE), its moving half.
Model   see `contact.reading`. Tables are built when a block first meets their level and interval of load, rows of load when
        a block first meets their octave.
Source  design, sections 1 and 4.
Limits  with `wait` false a load beyond the rows that are ready plays the nearest row until they are.
"""

from __future__ import annotations

import math
from typing import Any, Protocol

import numpy as np

from synth.contact.exact import Array
from synth.contact.levels import Levels, levels_up_to
from synth.contact.reading import read_displacement, read_rate
from synth.contact.rows import Rows
from synth.contact.spectrum import Complex, Demand, Spectrum
from synth.contact.surfaces import Surfaces
from synth.contact.tables import CUBIC, QUINTIC, fitted_table, kept_harmonics
from synth.motion import LOAD, SPEED, Motion
from synth.output import Block
from synth.preparation import BAND, ROWS_REACH, ChannelPlan, Preparation

ROW_FINEST = 1.0 / 128.0  # of an octave of load: the closest rows when there is time
LIVE_FINEST = 1.0 / 16.0  # the same while a live voice waits for them: the default range takes under a second
BASE_OF_LIFT = 0.25  # octaves of load begin at this part of lift_load, below which the gate leaves under a tenth
EVERYWHERE = 4e3  # N: beyond any load, the end of the one interval of a response that does not vary with the load


class RowSource(Protocol):
    """Where the series over the load come from."""

    @property
    def edges(self) -> Array:
        """Loads (N) of the rows."""
        ...

    def cubic(self, low: float, high: float, harmonics: int) -> tuple[Complex, ...]:
        """Return the series of the cubic between two rows."""
        ...


class OneRow:
    """A response at one load: it does not vary with the load."""

    def __init__(self, spectrum: Spectrum) -> None:
        self.spectrum = spectrum
        self.edges: Array = np.array([-EVERYWHERE, EVERYWHERE])

    def cubic(self, low: float, high: float, harmonics: int) -> tuple[Complex, ...]:
        """Return the series itself, and nothing that varies."""
        series = np.zeros(harmonics + 1, dtype=np.complex128)
        found = self.spectrum.harmonics[: harmonics + 1]
        series[: len(found)] = found
        nothing = np.zeros_like(series)
        return series, nothing, nothing, nothing


class MovingReader:
    """Tables and state of one preparation in motion: `read` renders a block.

    wait: rows that a block needs are solved before it is rendered; otherwise the nearest rows play.
    """

    def __init__(self, solved: Preparation, phase: int, *, load_varies: bool, wait: bool) -> None:
        assert solved.spectrum is not None and solved.contact is not None
        self.solved, self.wait = solved, wait
        self.rate, self.period = solved.scene.output.sample_rate, solved.scene.texture.period
        self.levels = _levels(solved, load_varies)
        self.rows: Rows | None = None
        source: RowSource = OneRow(solved.spectrum)
        if load_varies:
            self.rows = self._rows_for(solved)
            source = self.rows
        self.surfaces = {
            degree: Surfaces(source, self.levels, degree, self._density(degree))
            for degree in sorted({_degree(channel) for channel in solved.channels})
        }
        self.phase = np.array([phase], dtype=np.uint64)
        self._before = np.full(4, math.nan)

    @property
    def memory_bytes(self) -> int:
        """Bytes of tables and rows."""
        rows = 0 if self.rows is None else self.rows.memory_bytes
        return rows + sum(surface.memory_bytes for surface in self.surfaces.values())

    def _rows_for(self, solved: Preparation) -> Rows:
        assert solved.contact is not None
        demand = solved.demand()
        keep = self.levels.highest[0]
        scan = solved.scene.scan
        finest = ROW_FINEST if self.wait else LIVE_FINEST
        demand = Demand(demand.highest, demand.orders, solved.tolerance)
        rows = Rows(solved.contact, demand, keep, BASE_OF_LIFT * scan.lift_load, finest)
        rows.cover(scan.load, scan.load)
        return rows

    def _density(self, degree: int) -> float:
        """Return cells a harmonic that the tolerance needs, from the scan's own load and speed."""
        spectrum = self.solved.spectrum
        assert spectrum is not None
        orders = tuple(sorted({c.order for c in self.solved.channels if _degree(c) == degree}))
        series = spectrum.harmonics[: min(self.solved.highest, self.levels.highest[0]) + 1].copy()
        fitted = fitted_table(series, degree, orders, self.solved.table_tolerance)
        return len(fitted.coefficients) / (len(series) - 1)

    def read(self, motion: Motion, out: Block) -> None:
        """Write the block of `motion` to `out` (float32 [frames, channels]) and move the phase on."""
        begin = self.phase[0]
        for number, channel in enumerate(self.solved.channels):
            self.phase[0] = begin
            self._channel(number, channel, motion, out)

    def _channel(self, number: int, channel: ChannelPlan, motion: Motion, out: Block) -> None:
        tables = self.surfaces[_degree(channel)]
        hold = 0.0 if self.wait and self.rows is not None else 1.0
        constants = np.array(
            [self.rate, self.period, self.solved.scene.scan.lift_load, 1.0 / channel.full_scale, hold]
        )
        frame = 0
        while frame < motion.frames:
            shared = (
                tables.pool, tables.offsets, tables.bits, tables.fades, tables.edges, constants, self.phase,
                motion.samples, motion.position, frame, out, number,
            )  # fmt: skip
            frame = read_displacement(*shared) if channel.order == 0 else read_rate(*shared, channel.order)
            if frame < motion.frames:
                self._meet(tables, motion.samples[:, frame])

    def _meet(self, tables: Surfaces, sample: Array) -> None:
        """Build what the loop missed at one frame."""
        load = float(sample[LOAD])
        if self.rows is not None and self.wait and not tables.edges[0] <= load <= tables.edges[-1]:
            self.rows.cover(load, load)
            tables.refresh()
            return
        turns = abs(float(sample[SPEED])) / (self.rate * self.period)
        level = int(np.searchsorted(self.levels.fade_to, turns, side="right"))
        interval = int(np.clip(np.searchsorted(tables.edges, load, side="right") - 1, 0, len(tables.edges) - 2))
        for number in range(level, min(level + 2, len(self.levels.highest))):
            tables.build(number, interval)

    def take_over_rows(self) -> None:
        """Use the rows that became ready since, for a live voice whose rows are solved in a thread."""
        for tables in self.surfaces.values():
            tables.refresh()


def _degree(channel: ChannelPlan) -> int:
    return CUBIC if channel.order == 0 else QUINTIC


def _levels(solved: Preparation, load_varies: bool) -> Levels:
    """Return the levels that the channels need: no more harmonics than the tolerance, the rate or the bandwidth lets through."""
    spectrum = solved.spectrum
    assert spectrum is not None
    most = min(len(spectrum.harmonics) - 1, solved.reach)
    if load_varies:
        most = min(most, ROWS_REACH * max(solved.highest, 1))
    orders = tuple(sorted({channel.order for channel in solved.channels}))
    needed = kept_harmonics(spectrum.harmonics[: most + 1], orders, solved.tolerance)
    bandwidth = solved.scene.output.bandwidth
    scale = 1.0 if bandwidth is None else min(1.0, bandwidth / (BAND * solved.scene.output.sample_rate))
    levels = levels_up_to(needed)
    return Levels(levels.highest, levels.fade_from * scale, levels.fade_to * scale) if scale < 1.0 else levels


def completed(motion: Motion, rate: int, period: float, before: Any) -> Motion:
    """Return `motion` with the derivatives that it lacks taken from the frame before.

    before: float64 [4], position (m), speed (m/s), load (N), load rate (N/s) of the last frame, NaN at the start; it is
    brought up to date.
    """
    samples = motion.samples.copy()
    if len(motion.position):
        samples[0] = _rate_of(motion.position, before[0], rate)
        before[0] = motion.position[-1]
    samples[1] = _rate_of(samples[0], before[1], rate)
    samples[3] = _rate_of(samples[2], before[2], rate)
    samples[4] = _rate_of(samples[3], before[3], rate)
    before[1], before[2], before[3] = samples[0, -1], samples[2, -1], samples[3, -1]
    return Motion(samples, motion.position, True)


def _rate_of(values: Array, before: float, rate: int) -> Array:
    start = values[0] if math.isnan(before) else before
    return np.diff(values, prepend=start) * rate
