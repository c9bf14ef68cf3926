"""The safety limiter, which keeps the output of a voice within full scale.

Model   Samples within full scale pass unchanged. Before a sample beyond full scale, the gain of all channels falls over
        LOOK_AHEAD to the gain that this sample needs, and recovers over RELEASE_TIME. The limiter is the last step
        before every live, device and integer output, and cannot be switched off.
        A frame needs the gain 1 / peak, where peak is its largest channel, or 1 where the peak is within full scale.
        The held gain g is the least gain that the frame or any of the `ahead` frames before it needs. It recovers
        toward 1.01 by a share `recovery` per frame until it is 1:

            g = min(needed by the last ahead + 1 frames, g + (1.01 - g) recovery, 1)

        The gain applied, `ahead` frames later, is g averaged over two windows in turn, which span ahead + 1 frames
        together. Every g in them is low enough for the frame, so their average is too. The gain has no step, and its
        slope has none except where g turns. A frame with a sample that is not finite becomes silence and is treated as
        the highest peak.
        Gains are multiples of 2^-40, so the running sums are exact: nothing drifts, the sizes of blocks do not affect
        the samples, and a plain comparison shows whether the gain is back at 1.
Source  design, sections 4 and 8; the times are unverified defaults. A held minimum and box averages are the usual parts
        of a look-ahead limiter; the integer gains are this project's.
Limits  The limiter is bit-exact again 0.24 s (LOOK_AHEAD + 4.7 RELEASE_TIME) after the last sample beyond full scale,
        at the latest. A steady tone beyond full scale is distorted, such as 100 Hz at twice full scale. A peak beyond
        2^40 times full scale is clipped. The work per frame does not grow with `ahead`; while nothing is limited, a
        block is only scanned and copied.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from itertools import chain
from typing import Any

import numpy as np

from synth.arrays import Block
from synth.kernels import signed_kernel, unfused

Integers = np.ndarray[Any, np.dtype[np.int64]]
Samples = np.ndarray[tuple[int], np.dtype[np.float32]]

ONE = 1 << 40  # a gain of 1; smaller: rounding is audible in float32; larger: sums of sums exceed 2^63
LEAST = 1  # -241 dB: the gain for a frame that is not finite; 0 has no value in decibels
AIM = ONE + ONE // 100  # target of the recovery: a lower one takes longer, a higher one makes the corner at 1 sharper
RECOVERY_ONE = 1 << 22  # a recovery of 1; AIM RECOVERY_ONE must stay below 2^63
LONGEST_AHEAD = 4094  # frames; (ahead / 2 + 1)^2 ONE must stay below 2^63
SMALLEST_NORMAL = np.float32(2.0**-126)  # smaller values are denormal, slow on many processors: they become zero
SILENCE = np.float32(0.0)

# Entries of `numbers`.
GAIN = 0  # g of the last input frame, in units of 1 / ONE
FIRST_SUM = 1  # sum of the gains in the first window
SECOND_SUM = 2  # sum of the first sums in the second window: the gain applied, in units of 1 / (ONE windows)
FRAME = 3  # number of input frames so far
OLDEST = 4  # index of the oldest entry in the queue
QUEUED = 5  # number of entries in the queue
LOWEST = 6  # least SECOND_SUM since `take_reduction`
NOT_FINITE = 7  # number of input frames with a sample that is not finite
NUMBERS = 8
LOOK_AHEAD = 1.5e-3  # s; shorter: the gain falls so steeply that it clicks; longer: changes are heard later
RELEASE_TIME = 0.05  # s; shorter: rougher; longer: the sound stays quiet after a peak


@unfused
def _fits(samples: Samples) -> bool:
    """Return whether every sample is a number within full scale."""
    beyond = 0
    for i in range(len(samples)):
        beyond += not abs(samples[i]) <= np.float32(1.0)
    return beyond == 0


@unfused
def _needed(block: Block, i: int, numbers: Integers) -> int:
    """Return the gain that frame `i` needs, rounded down, in units of 1 / ONE."""
    peak = 0.0
    for channel in range(block.shape[1]):
        if not np.isfinite(block[i, channel]):
            numbers[NOT_FINITE] += 1
            return LEAST
        peak = max(peak, abs(np.float64(block[i, channel])))
    return ONE if peak <= 1.0 else max(LEAST, int(ONE / peak))


@unfused
def _queue(needed: int, queue: Integers, numbers: Integers) -> None:
    """Append `needed` of the present frame; drop entries that left the window or that exceed a later one."""
    places, frame = queue.shape[1], numbers[FRAME]
    if numbers[QUEUED] > 0 and queue[1, numbers[OLDEST]] <= frame - places:
        numbers[OLDEST] = (numbers[OLDEST] + 1) % places
        numbers[QUEUED] -= 1
    while numbers[QUEUED] > 0 and queue[0, (numbers[OLDEST] + numbers[QUEUED] - 1) % places] >= needed:
        numbers[QUEUED] -= 1
    if needed < ONE:
        place = (numbers[OLDEST] + numbers[QUEUED]) % places
        queue[0, place], queue[1, place] = needed, frame
        numbers[QUEUED] += 1


@unfused
def _move(numbers: Integers, first: Integers, second: Integers, queue: Integers, recovery: int) -> None:
    """Advance the held gain and its two averages by a frame."""
    back = numbers[GAIN] + (AIM - numbers[GAIN]) * recovery // RECOVERY_ONE
    gain = min(ONE, back, queue[0, numbers[OLDEST]] if numbers[QUEUED] > 0 else ONE)
    one, other = numbers[FRAME] % len(first), numbers[FRAME] % len(second)
    numbers[GAIN] = gain
    numbers[FIRST_SUM] += gain - first[one]
    first[one] = gain
    numbers[SECOND_SUM] += numbers[FIRST_SUM] - second[other]
    second[other] = numbers[FIRST_SUM]


@unfused
def _copy(samples: Samples, to: Samples) -> None:
    """Copy `samples` to another array of their size."""
    for i in range(len(to)):
        to[i] = samples[i]


@unfused
def _limit(
    block: Block, late: Samples, numbers: Integers, first: Integers, second: Integers, queue: Integers, recovery: int
) -> None:
    """Apply the gains of a block to the first frames of `late`: the pending ones, then those of the block."""
    channels = block.shape[1]
    taken = len(late) - block.size
    for i in range(len(block)):
        _queue(_needed(block, i, numbers), queue, numbers)
        _move(numbers, first, second, queue, recovery)
        numbers[LOWEST] = min(numbers[LOWEST], numbers[SECOND_SUM])
        numbers[FRAME] += 1
        level = numbers[SECOND_SUM] / (len(first) * len(second) * ONE)
        for j in range(i * channels, (i + 1) * channels):
            if not np.isfinite(late[taken + j]):
                late[taken + j] = SILENCE
            if level < 1.0:
                late[j] = np.float32(max(-1.0, min(1.0, late[j] * level)))


@signed_kernel("void(f4[:,::1], f4[:,::1], f4[:,::1], i8[::1], i8[::1], i8[::1], i8[:,::1], i8)", fused=False)
def hold_within(
    block: Block, out: Block, pending: Block, numbers: Integers, first: Integers, second: Integers, queue: Integers,
    recovery: int,
) -> None:  # fmt: skip
    """Take in `block` and fill `out` with as many frames, `ahead` frames late, all within -1..1.

    block, out: [frames, channels]; they may be the same.
    pending: the next frames of the output [ahead, channels].
    numbers: [NUMBERS], see the entries above.
    first, second: the two windows, of ahead + 2 places together.
    queue: rising gains that are needed, and the frames that need them [2, ahead + 1].
    recovery: in units of 1 / RECOVERY_ONE.
    """
    whole, ahead, samples = len(first) * len(second) * ONE, pending.size, out.ravel()
    late = np.empty(ahead + block.size, np.float32)
    _copy(pending.ravel(), late[:ahead])
    _copy(block.ravel(), late[ahead:])
    if numbers[SECOND_SUM] == whole and numbers[QUEUED] == 0 and _fits(late[ahead:]):
        numbers[FRAME] += len(block)
    else:
        _limit(block, late, numbers, first, second, queue, recovery)
    for i in range(len(samples)):
        samples[i] = late[i] if abs(late[i]) >= SMALLEST_NORMAL else SILENCE
    _copy(late[block.size :], pending.ravel())


class Limiter:
    """Keeps a stream of blocks within full scale, finite and free of denormals. For one thread.

    Samples within full scale pass bit for bit, except that denormals become zero.

    ahead: frames by which the output is late, and over which the gain falls before a peak; with 0 the gain falls at
        once.
    """

    def __init__(self, channels: int, sample_rate: int, ahead: int = 0) -> None:
        assert 0 <= ahead <= LONGEST_AHEAD, f"a limiter looks 0 to {LONGEST_AHEAD} frames ahead, not {ahead}"
        self.channels = channels
        self.ahead = ahead
        self._recovery = round(-math.expm1(-1.0 / (RELEASE_TIME * sample_rate)) * RECOVERY_ONE)
        self._pending: Block = np.zeros((ahead, channels), dtype=np.float32)
        self._first = np.full(ahead // 2 + 1, ONE)
        self._second = np.full(ahead - ahead // 2 + 1, len(self._first) * ONE)
        self._queue = np.zeros((2, ahead + 1), dtype=np.int64)
        self._whole = len(self._first) * len(self._second) * ONE
        self._numbers = np.zeros(NUMBERS, dtype=np.int64)
        self._numbers[[GAIN, FIRST_SUM, SECOND_SUM, LOWEST]] = ONE, len(self._first) * ONE, self._whole, self._whole

    @property
    def frames_not_finite(self) -> int:
        """Number of input frames with a sample that is not finite, which is a bug upstream. They became silence."""
        return int(self._numbers[NOT_FINITE])

    @property
    def pending(self) -> Block:
        """A copy of the next frames of the output [ahead, channels], before their gain."""
        return self._pending.copy()

    def take_reduction(self) -> float:
        """Return the largest gain reduction (dB) since the last call, or 0."""
        lowest = self._numbers.item(LOWEST)
        if lowest == self._whole:
            return 0.0
        self._numbers[LOWEST] = self._whole
        return -20.0 * math.log10(lowest / self._whole)

    def process(self, block: Block) -> Block:
        """Return as many frames as `block` (float32 [frames, channels]) has, `ahead` frames late, within -1..1."""
        out = np.empty(block.shape, dtype=np.float32)
        self.process_into(np.ascontiguousarray(block, dtype=np.float32), out)
        return out

    def process_into(self, block: Block, out: Block) -> None:
        """Fill `out`, which may be `block`. Both are contiguous float32 [frames, channels]."""
        if block.shape[1] != self.channels:
            raise ValueError(f"the block has {block.shape[1]} channels, the limiter {self.channels}")
        if block.shape != out.shape or not out.flags.carray:
            raise ValueError(f"out must have the {len(block)} frames of the block and be contiguous")
        hold_within(block, out, self._pending, self._numbers, self._first, self._second, self._queue, self._recovery)

    def limited(self, blocks: Iterable[Block]) -> Iterator[Block]:
        """Yield a finite sound without delay: the same number of frames, in blocks of different lengths.

        Raises AssertionError for a sample that is not finite: this is a bug upstream, and a file render may fail.
        """
        late = self.ahead
        for block in chain(blocks, [np.zeros((self.ahead, self.channels), dtype=np.float32)]):
            ready = self.process(block)[late:]
            assert not self.frames_not_finite, "a voice rendered NaN or infinity"
            late -= min(late, len(block))
            if len(ready):
                yield ready


def look_ahead(sample_rate: int) -> int:
    """Return the limiter's look-ahead in frames at this rate."""
    return round(LOOK_AHEAD * sample_rate)
