"""A voice into a writer, block after block: the sound of any length in the memory of one block.

Stage: voice -> encode. Finite float sound is written as it is, value / full scale; integer sound passes the safety
limiter first, because integers clip.
"""

from __future__ import annotations

from collections.abc import Callable
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


class TakesBlocks(Protocol):
    """The part of a writer that an export needs."""

    def write(self, block: Block) -> None:
        """Take the next block [frames, channels]."""


@dataclass(frozen=True, slots=True)
class Export:
    """What was written: frames, and each channel's largest sample relative to full scale, as written."""

    frames: int
    peaks: tuple[float, ...]


def export(
    voice: RendersBlocks,
    writer: TakesBlocks,
    frames: int,
    limit: Callable[[Block], Block] | None,
    advance: Callable[[int], None],
) -> Export:
    """Render `frames` of `voice` into `writer`.

    limit: the safety limiter of integer sound, None for float. advance: told the frames of every block written.
    """
    import numpy as np

    peaks = np.zeros(voice.channels)
    done = 0
    while done < frames:
        block = voice.render(min(BLOCK_FRAMES, frames - done))
        if limit is not None:
            block = limit(block)
        writer.write(block)
        np.maximum(peaks, np.abs(block).max(axis=0), out=peaks)
        done += len(block)
        advance(len(block))
    return Export(done, tuple(float(peak) for peak in peaks))
