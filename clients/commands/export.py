"""A voice into a writer, block after block: the sound of any length in the memory of one block.

Stage: voice -> encode. Finite float sound is written as it is, value / full scale; integer sound passes the safety
limiter first, because integers clip.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    Block = npt.NDArray[np.float32]

BLOCK_FRAMES = 1 << 14  # frames; larger only costs memory, smaller makes Python's share of the time felt


class RendersBlocks(Protocol):
    """The part of a voice that an export needs."""

    @property
    def channels(self) -> int:
        """Return how many channels a block has."""

    def render(self, frames: int) -> Block:
        """Return the next float32 block [frames, channels]."""


class Limits(Protocol):
    """The part of the safety limiter that an export needs."""

    def limited(self, blocks: Iterable[Block]) -> Iterator[Block]:
        """Yield the whole sound limited, in blocks of other lengths."""

    def take_reduction(self) -> float:
        """Return the largest gain reduction, in dB, since this was last asked."""


class TakesBlocks(Protocol):
    """The part of a writer that an export needs."""

    def write(self, block: Block) -> None:
        """Take the next block [frames, channels]."""


@dataclass(frozen=True, slots=True)
class Export:
    """What was written: frames, each channel's largest sample relative to full scale, as written, and how far the
    limiter turned it down.
    """

    frames: int
    peaks: tuple[float, ...]
    reduction_db: float


def export(
    voice: RendersBlocks,
    writer: TakesBlocks,
    frames: int,
    limiter: Limits | None,
    advance: Callable[[int], None],
) -> Export:
    """Render `frames` of `voice` into `writer`.

    limiter: the safety limiter of integer sound, None for float. advance: told the frames of every block written.
    """
    import numpy as np

    peaks = np.zeros(voice.channels)
    sound = (voice.render(min(BLOCK_FRAMES, frames - done)) for done in range(0, frames, BLOCK_FRAMES))
    for block in sound if limiter is None else limiter.limited(sound):
        writer.write(block)
        np.maximum(peaks, np.abs(block).max(axis=0), out=peaks)
        advance(len(block))
    return Export(frames, tuple(map(float, peaks)), 0.0 if limiter is None else limiter.take_reduction())
