"""The safety limiter: what leaves a voice stays within full scale.

Model   Samples within full scale pass unchanged. Before one that would pass full scale, the gain of all
        channels comes down over LOOK_AHEAD to what holds it at full scale, and comes back over RELEASE_TIME
        (`limiter_kernel`). It is last before every live, device and integer output, and nothing switches it off.
Source  design, sections 4 and 8. The times are unverified defaults.
Limits  the limiter is bit-exact again LOOK_AHEAD and 4.7 RELEASE_TIME (0.24 s) after the last sample beyond full scale,
        at the latest. A steady tone that needs turning down is: 100 Hz at twice full scale comes out with distortion.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from itertools import chain

import numpy as np

from synth.arrays import Block
from synth.voice.limiter_kernel import (
    FIRST_SUM,
    GAIN,
    LONGEST_AHEAD,
    LOWEST,
    NOT_FINITE,
    NUMBERS,
    ONE,
    RECOVERY_ONE,
    SECOND_SUM,
    TURNED_DOWN,
    Integers,
    hold_within,
)

LOOK_AHEAD = 1.5e-3  # s; shorter, the gain falls so steeply that it is heard as a click; longer, changes come later
RELEASE_TIME = 0.05  # s; shorter is rougher, longer ducks what follows a peak


class Limiter:
    """Holds a stream of blocks within full scale, finite and free of denormals; used by one thread.

    ahead: frames by which the output is late, and over which the gain comes down before a peak; 0 lets it fall at once.
    Below full scale the samples are those that came, bit for bit but for denormals, which become zero.
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
    def state(self) -> tuple[Block, Integers, Integers, Integers, Integers, int]:
        """What `hold_within` takes behind `block` and `out`: for a kernel that limits what it renders itself."""
        return self._pending, self._numbers, self._first, self._second, self._queue, self._recovery

    @property
    def reduction_db(self) -> float:
        """The present gain reduction in dB, 0 where the limiter does nothing."""
        return self._decibels(self._numbers[SECOND_SUM])

    @property
    def frames_limited(self) -> int:
        """Frames that were turned down so far."""
        return int(self._numbers[TURNED_DOWN])

    @property
    def frames_not_finite(self) -> int:
        """Frames that came with a sample which is not finite, and left as silence: a mistake upstream."""
        return int(self._numbers[NOT_FINITE])

    def take_reduction(self) -> float:
        """Return the largest gain reduction, in dB, since this was last asked; 0 where there was none."""
        lowest = self._numbers.item(LOWEST)
        if lowest == self._whole:
            return 0.0
        self._numbers[LOWEST] = self._whole
        return self._decibels(lowest)

    def prime(self, block: Block) -> None:
        """Take the first `ahead` frames, so that the next block of output begins with them and nothing is late."""
        assert len(block) == self.ahead, f"a limiter is primed with the {self.ahead} frames that it looks ahead"
        self.process(block)

    def process(self, block: Block) -> Block:
        """Return as many frames as `block` (float32 [frames, channels]) has, `ahead` frames late, none beyond -1..1."""
        out = np.empty(block.shape, dtype=np.float32)
        self.process_into(np.ascontiguousarray(block, dtype=np.float32), out)
        return out

    def process_into(self, block: Block, out: Block) -> None:
        """Fill `out`, which may be `block`; both contiguous float32 [frames, channels]. Allocates nothing."""
        if block.shape[1] != self.channels:
            raise ValueError(f"a block of {block.shape[1]} channels came to a limiter of {self.channels}")
        if block.shape != out.shape or not out.flags.carray:
            raise ValueError(f"a block of {len(block)} frames needs as many contiguous ones to go into")
        hold_within(block, out, self._pending, self._numbers, self._first, self._second, self._queue, self._recovery)

    def limited(self, blocks: Iterable[Block]) -> Iterator[Block]:
        """Yield a finite sound, none of it late: as many frames as came in all, in blocks of other lengths.

        What is not finite is our bug here, an AssertionError: nobody is hurt by a render that fails.
        """
        late = self.ahead
        for block in chain(blocks, [np.zeros((self.ahead, self.channels), dtype=np.float32)]):
            ready = self.process(block)[late:]
            assert not self.frames_not_finite, "a voice let NaN or infinity out"
            late -= min(late, len(block))
            if len(ready):
                yield ready

    def _decibels(self, level: int) -> float:
        return 0.0 if level == self._whole else -20.0 * math.log10(level / self._whole)


def look_ahead(sample_rate: int) -> int:
    """Return the frames that a limiter looks ahead at this rate."""
    return round(LOOK_AHEAD * sample_rate)
