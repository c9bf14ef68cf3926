"""A block of a hand that feels one quantity, in one compiled call: where the hand is, what it feels, the limiter.

Stage   3 (VOICE), its quickest path: what most blocks of most streams are.
Model   `following.fill_motion`, then the loops of `contact.reading`, then `output_limiting.hold_within`. Each array
        costs a call some 0.1 us, and twice that where many streams share the caches: three calls pay for it thrice.
Limits  one channel, no effects, nothing that fades. Where a table is missing it is built, and the rest of the block
        takes the three calls.
"""

from __future__ import annotations

import threading
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.kernels import kernel
from synth.motion.motion import LOAD, NOWHERE, Motion
from synth.motion.update_smoothing import BY_POSITION, MODE, Follower, fill_motion
from synth.response.cell_reading import read_displacement, read_rate
from synth.response.load_cells import Offsets
from synth.voice.limiter import Block, Limiter
from synth.voice.limiter_kernel import Integers, hold_within
from synth.voice.moving import MovingReader

Phase = np.ndarray[Any, np.dtype[np.uint64]]


class Room(threading.local):
    """Where a thread puts the motion of a block, one stream's after another's.

    It stays in the processor's own cache so, where the rooms of a hundred streams, of 23 kB each, would not fit: that
    takes a fortieth off a block.
    """

    def __init__(self) -> None:
        self._room: tuple[Array, Array] = np.empty((5, 0)), np.empty(0)

    def of(self, frames: int) -> tuple[Array, Array]:
        """Return samples [5, frames] and positions [frames], valid until asked again."""
        if len(self._room[1]) != frames:
            self._room = np.empty((5, frames)), np.empty(frames)
        return self._room


_room = Room()


class HandBlocks:
    """Renders the blocks of one stream."""

    def __init__(self, limiter: Limiter) -> None:
        assert limiter.channels == 1, "one channel"
        self._limits = limiter.state

    def render(self, follower: Follower, reader: MovingReader, frames: int, limiter: Limiter) -> tuple[Block, float]:
        """Return the next `frames` frames, [frames, 1], limited, and the load (N) at the last of them."""
        samples, position = _room.of(frames)
        block = np.empty((frames, 1), np.float32)
        known = follower.state.item(MODE) == BY_POSITION
        tables, layout, order = reader.alone
        motion = follower.state, float(follower.sample_rate), follower.lowest, samples, position
        read = tables.pool, tables.tables, layout, reader.phase
        if order == 0:
            done = displacement_block(*motion, *read, block, *self._limits)
        else:
            done = rate_block(*motion, *read, order, block, *self._limits)
        if done < frames:
            reader.go_on(Motion(samples, position if known else NOWHERE), done, block)
            limiter.process_into(block, block)
        reader.watch(samples.item(LOAD, 0), frames)
        return block, samples.item(LOAD, frames - 1)


@kernel
def displacement_block(
    state: Array, rate: float, lowest: float, samples: Array, position: Array, pool: Array, tables: Offsets,
    layout: Array, phase: Phase, out: Block, pending: Block, numbers: Integers, first: Integers, second: Integers,
    queue: Integers, recovery: int,
) -> int:  # fmt: skip
    """Fill `out`; return the first frame whose table is missing, from which on nothing is done, or the frame count.

    state, rate, lowest, samples, position: as `following.fill_motion` takes them. pool, tables, layout, phase: as
    `contact.reading`. The rest: as `output_limiting.hold_within`.
    """
    known = state[MODE] == BY_POSITION
    fill_motion(state, rate, lowest, samples, position)
    place = position if known else position[:0]
    done = read_displacement(pool, tables, layout, phase, samples, place, 0, out, 0)
    if done == len(position):
        hold_within(out, out, pending, numbers, first, second, queue, recovery)
    return int(done)


@kernel
def rate_block(
    state: Array, rate: float, lowest: float, samples: Array, position: Array, pool: Array, tables: Offsets,
    layout: Array, phase: Phase, order: int, out: Block, pending: Block, numbers: Integers, first: Integers,
    second: Integers, queue: Integers, recovery: int,
) -> int:  # fmt: skip
    """Do the same for velocity (order 1) and acceleration (2): a loop each, as either takes seconds to compile."""
    known = state[MODE] == BY_POSITION
    fill_motion(state, rate, lowest, samples, position)
    place = position if known else position[:0]
    done = read_rate(pool, tables, layout, phase, samples, place, 0, out, 0, order)
    if done == len(position):
        hold_within(out, out, pending, numbers, first, second, queue, recovery)
    return int(done)
