"""Reads a response table along a motion: that of a hand, or the scan's own.

Stage   3 (VOICE).
Model   The phase of the texture follows the position where that is known, and otherwise goes on from block to block.
        Each channel has a `TableReader`. The motion of a hand is not known in advance, so its frames are `delay` late.
        A scan's own motion is known and is read ahead.
Source  design, sections 1 and 8; docs/table.md.
Limits  The errors of the table and of the reader's filter.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from synth.arrays import Block
from synth.motion.motion import LOAD, NOWHERE, SPEED, Motion
from synth.motion.scan_motion import ScanMotion
from synth.plan.preparation import Preparation
from synth.response.phases import phase_step, turns_to_phase
from synth.response.reading_filter import LONGEST_STRIDE
from synth.response.table_reader import TableReader
from synth.scene.scene import Scene


def readers_of(solved: Preparation) -> tuple[TableReader, ...]:
    """Return the reader of each channel of a prepared scene that has a table."""
    assert solved.table is not None
    rate = solved.scene.output.sample_rate
    return tuple(TableReader.of(solved.table, one.quantity, rate, 1.0 / one.full_scale) for one in solved.channels)


class HandReader:
    """Reads the channels of a block along the motion of a hand.

    The hand is assumed to have moved at the speed and load of its first frame before that frame.
    readers: one per channel, of one rate and band.
    period: of the texture (m).
    phase: of the texture at the next frame, a 64-bit fraction of a turn.
    """

    def __init__(self, readers: tuple[TableReader, ...], period: float, rate: int) -> None:
        self._readers, self._period, self._rate = readers, period, rate
        self._states = [reader.start() for reader in readers]
        self._begun = False
        self.phase = 0

    @property
    def delay(self) -> int:
        """Frames by which the output is behind the motion."""
        return self._readers[0].delay

    def read(self, motion: Motion, out: Block) -> None:
        """Write the block of `motion` to `out`, float32 [frames, channels]."""
        samples, place = np.ascontiguousarray(motion.samples), np.ascontiguousarray(motion.position)
        if not self._begun:
            self._come_to(motion)
        after = self.phase
        for number, reader in enumerate(self._readers):
            after = reader.read(self._states[number], samples, place, self.phase, out, number)
        self.phase = after

    def _come_to(self, motion: Motion) -> None:
        """Read the steady motion before the first frame, over the length of the filters, and discard the output."""
        self._begun = True
        phase = int(turns_to_phase(motion.position[:1] / self._period)[0]) if len(motion.position) else self.phase
        frames = 2 * self.delay
        speed = motion.samples.item(SPEED, 0)
        step = phase_step(speed, self._period, self._rate)
        before = (phase - step * frames) % 2**64
        samples = np.zeros((5, frames))
        samples[SPEED], samples[LOAD] = speed, motion.samples[LOAD, 0]
        unheard = np.empty((frames, 1), np.float32)
        for reader, state in zip(self._readers, self._states, strict=True):
            reader.read(state, samples, NOWHERE, before, unheard, 0)


class ScanReader:
    """Reads the channels of a scene's own scan, with frames in any order. Continuing after the last call is cheap.

    readers: as for `HandReader`.
    """

    def __init__(self, readers: tuple[TableReader, ...], scene: Scene) -> None:
        self._readers, self._scene = readers, scene
        self._motion = ScanMotion(scene)
        self._delay = readers[0].delay
        self._next: int | None = None
        self._reader = self._anew()

    def _anew(self) -> HandReader:
        return HandReader(self._readers, self._scene.texture.period, self._scene.output.sample_rate)

    def read(self, first: int, out: Block) -> None:
        """Write the frames from `first` on to `out`, float32 [frames, channels]."""
        if first != self._next:
            self._reader = self._anew()
            begin = first - 2 * self._delay
            begin -= begin % LONGEST_STRIDE  # z is always read at the same frames
            ahead = np.empty((first + self._delay - begin, out.shape[1]), np.float32)
            self._reader.read(self._motion.at(begin, len(ahead)), ahead)
        self._reader.read(self._motion.at(first + self._delay, len(out)), out)
        self._next = first + len(out)


def delayed(values: Any, past: Any) -> Any:
    """Return `values` [..., frames] delayed by the frames of `past` [..., delay], which is updated."""
    both = np.concatenate([past, values], axis=-1)
    past[:] = both[..., both.shape[-1] - past.shape[-1] :]
    return both[..., : values.shape[-1]]
