"""Reads a voice's channels along the motion of a hand or of the scan, from a response table or by direct solutions.

Stage   3 (VOICE).
Model   The phase of the texture follows the position where that is known. Otherwise the speed advances it.
        From a table each channel has a `TableReader`; a `DirectReader` solves all channels at once. The motion of a
        hand is not known in advance, so its frames are `delay` late. A scan's own motion is known and is read ahead.
Source  design, sections 1 and 8; docs/table.md.
Limits  The errors of the table and of the reader's filter, or those of `DirectReader`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from synth.arrays import Array, Block
from synth.motion.motion import LOAD, NOWHERE, SPEED, Motion
from synth.motion.scan_motion import ScanMotion
from synth.plan.preparation import Preparation
from synth.response.phases import phase_step, turns_to_phase
from synth.response.reading_filter import LONGEST_STRIDE, band_filter
from synth.response.table_reader import TableReader
from synth.sampling.direct_reader import DirectReader
from synth.scene.scene import Scene


class ChannelReader(Protocol):
    """Reads all channels of a block. It keeps no state: `start` returns one, `read` updates it."""

    @property
    def delay(self) -> int:
        """Frames by which the output is behind the motion."""

    @property
    def cycle(self) -> int:
        """Length of a cycle in frames; z is read at the same frames of each cycle."""

    def start(self) -> Any:
        """Return the state before the first frame."""

    def read(self, state: Any, motion: Array, position: Array, path: Array, phase: int, out: Block) -> int:
        """Write the next frames to `out`, and return the next phase; see `DirectReader.read`."""


@dataclass(frozen=True, slots=True)
class TableChannels:
    """The readers of a voice's channels from tables of one rate and band."""

    readers: tuple[TableReader, ...]
    cycle = LONGEST_STRIDE

    @property
    def delay(self) -> int:
        """See `ChannelReader`."""
        return self.readers[0].delay

    def start(self) -> list[Array]:
        """See `ChannelReader`."""
        return [reader.start() for reader in self.readers]

    def read(self, state: list[Array], motion: Array, position: Array, path: Array, phase: int, out: Block) -> int:
        """See `ChannelReader`."""
        after = phase
        for number, reader in enumerate(self.readers):
            after = reader.read(state[number], motion, position, phase, out, number)
        return after


def reader_of(solved: Preparation) -> ChannelReader:
    """Return the reader of a prepared scene that has a table, or is solved directly."""
    rate, gains = solved.scene.output.sample_rate, [1.0 / one.full_scale for one in solved.channels]
    names, direct = tuple(one.quantity for one in solved.channels), solved.direct
    if direct is None:
        table = solved.table
        assert table is not None
        read = zip(names, gains, strict=True)
        return TableChannels(tuple(TableReader.of(table, name, rate, gain) for name, gain in read))
    return DirectReader(
        contact=direct.contact,
        line=(-solved.scene.scan.y, solved.scene.scan.direction) if direct.turning is not None else None,
        mean=direct.mean,
        period=solved.scene.texture.period,
        lift_load=solved.scene.scan.lift_load,
        heaviest=direct.heaviest,
        rate=rate,
        filters=tuple(band_filter(name, rate, direct.band, direct.finer) for name in names),
        gains=tuple(gains),
        with_mean=tuple(one.is_approach for one in solved.channels),
    )


class HandReader:
    """Reads the channels of a block along the motion of a hand.

    The hand is assumed to have moved at the speed and load of its first frame before that frame; on a path over an
    area, to have rested there.
    period: of the texture (m).
    phase: of the texture at the next frame, a 64-bit fraction of a turn.
    """

    def __init__(self, reader: ChannelReader, period: float, rate: int) -> None:
        self._reader, self._period, self._rate = reader, period, rate
        self._state = reader.start()
        self._begun = False
        self.phase = 0

    @property
    def delay(self) -> int:
        """Frames by which the output is behind the motion."""
        return self._reader.delay

    def read(self, motion: Motion, out: Block) -> None:
        """Write the block of `motion` to `out`, float32 [frames, channels]."""
        samples, place = np.ascontiguousarray(motion.samples), np.ascontiguousarray(motion.position)
        if not self._begun:
            self._come_to(motion, out.shape[1])
        self.phase = self._reader.read(self._state, samples, place, motion.path, self.phase, out)

    def _come_to(self, motion: Motion, channels: int) -> None:
        """Read the steady motion before the first frame, over the length of the filters, and discard the output."""
        self._begun = True
        phase = int(turns_to_phase(motion.position[:1] / self._period)[0]) if len(motion.position) else self.phase
        frames = -(-2 * self.delay // self._reader.cycle) * self._reader.cycle  # the first frame begins a cycle
        speed = motion.samples.item(SPEED, 0)
        samples = np.zeros((5, frames))
        path = np.repeat(motion.path[:, :1], frames, axis=1)
        if path.size:
            speed = 0.0
        before = (phase - phase_step(speed, self._period, self._rate) * frames) % 2**64
        samples[SPEED], samples[LOAD] = speed, motion.samples[LOAD, 0]
        self._reader.read(self._state, samples, NOWHERE, path, before, np.empty((frames, channels), np.float32))


class ScanReader:
    """Reads the channels of a scene's own scan, with frames in any order. Continuing after the last call is cheap.

    reader: as for `HandReader`.
    """

    def __init__(self, reader: ChannelReader, scene: Scene) -> None:
        self._channels, self._scene = reader, scene
        self._motion = ScanMotion(scene, whole=True)
        self._delay = reader.delay
        self._next: int | None = None
        self._reader = self._anew()

    def _anew(self) -> HandReader:
        return HandReader(self._channels, self._scene.texture.period, self._scene.output.sample_rate)

    def read(self, first: int, out: Block) -> None:
        """Write the frames from `first` on to `out`, float32 [frames, channels]."""
        if first != self._next:
            self._reader = self._anew()
            begin = first - 2 * self._delay
            begin -= begin % self._channels.cycle  # z is always read at the same frames
            ahead = np.empty((first + self._delay - begin, out.shape[1]), np.float32)
            self._reader.read(self._motion.at(begin, len(ahead)), ahead)
        self._reader.read(self._motion.at(first + self._delay, len(out)), out)
        self._next = first + len(out)


def delayed(values: Any, past: Any) -> Any:
    """Return `values` [..., frames] delayed by the frames of `past` [..., delay], which is updated."""
    both = np.concatenate([past, values], axis=-1)
    past[:] = both[..., both.shape[-1] - past.shape[-1] :]
    return both[..., : values.shape[-1]]
