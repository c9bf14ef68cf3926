"""A voice into a writer: every frame once, in order, limited where asked, peaks as written."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
import numpy.typing as npt
import pytest

from clients.commands.export import BLOCK_FRAMES, export

Block = npt.NDArray[np.float32]


class Ramp:
    """A voice whose sample is the frame's number, negated in the second channel."""

    channels = 2

    def __init__(self) -> None:
        self.done = 0

    def render(self, frames: int) -> Block:
        numbers = np.arange(self.done, self.done + frames, dtype=np.float32)
        self.done += frames
        return np.stack([numbers, -2 * numbers], axis=1)


class Kept:
    """A writer that keeps its blocks."""

    def __init__(self) -> None:
        self.blocks: list[Block] = []

    def write(self, block: Block) -> None:
        self.blocks.append(block)


@pytest.mark.parametrize("frames", [1, BLOCK_FRAMES - 1, BLOCK_FRAMES, 3 * BLOCK_FRAMES + 7])
def test_every_frame_is_written_once(frames: int) -> None:
    writer, told = Kept(), list[int]()
    written = export(Ramp(), writer, frames, None, told.append)
    sound = np.concatenate(writer.blocks)
    assert np.array_equal(sound[:, 0], np.arange(frames, dtype=np.float32))
    assert written.frames == sum(told) == frames
    assert written.peaks == (frames - 1, 2 * (frames - 1))
    assert max(len(block) for block in writer.blocks) <= BLOCK_FRAMES


def test_no_frames_is_no_blocks() -> None:
    writer = Kept()
    assert export(Ramp(), writer, 0, None, lambda _frames: None).peaks == (0.0, 0.0)
    assert writer.blocks == []


def test_integer_sound_passes_the_limiter_and_the_peak_is_the_limited_one() -> None:
    class Halves:
        """A limiter that gives its sound in two blocks where one came."""

        def limited(self, blocks: Iterable[Block]) -> Iterator[Block]:
            for block in blocks:
                yield from np.split(block * np.float32(0.5), [4])

        def take_reduction(self) -> float:
            return 6.0

    writer, told = Kept(), list[int]()
    written = export(Ramp(), writer, 11, Halves(), told.append)
    assert np.array_equal(np.concatenate(writer.blocks)[:, 0], np.arange(11, dtype=np.float32) / 2)
    assert (written.frames, written.peaks, written.reduction_db) == (11, (5.0, 10.0), 6.0)
    assert told == [4, 7]
