"""A live voice as one reader or sink uses it: blocks, changes from another thread, and the fade that ends it.

Model: every end (stop, delete, expiry, shutdown, the end of a finite stream) is one last block of `FADE_SECONDS` at
    most, under a half cosine from 1 to 0. Changes are left in a slot that the next block picks up, so the thread
    that renders is the only one that touches the voice.
"""

from __future__ import annotations

from concurrent.futures import Executor
from typing import Any

from service.engine import LiveVoice
from service.sessions.block_threads import Quickness
from synth.encode.formats import Block
from synth.scene.scene import Scene
from synth.voice.fades import faded

FADE_SECONDS = 0.01  # an end is silent 20 ms after it was asked for; much shorter would be felt as a click of its own


class Source:
    """Blocks of one live voice. One thread or task calls `block` and `last`; `change` may come from any."""

    def __init__(self, voice: LiveVoice) -> None:
        self._voice = voice
        self._change: Any = None
        self._quickness = Quickness()
        self.largest_reduction_db = 0.0  # of all blocks so far
        self.sample_rate = voice.sample_rate
        self.channels = voice.channels
        self.fade_frames = max(1, round(FADE_SECONDS * voice.sample_rate))

    @property
    def reduction_db(self) -> float:
        """Return the largest gain reduction of the safety limiter in the last block, in dB."""
        return self._voice.reduction_db

    def prepare(self, scene: Scene) -> Any:
        """Return the solved change to `scene`; slow, for a thread."""
        return self._voice.prepare(scene)

    def change(self, change: Any) -> None:
        """Have the next block cross-fade to `change`; one that no block has picked up yet is replaced."""
        self._change = change
        self._quickness.begin_anew()  # the block that takes it over may build tables

    def block(self, frames: int) -> Block:
        """Return the next `frames` as float32 [frames, channels]."""
        change, self._change = self._change, None
        if change is not None:
            self._voice.apply(change)
        block = self._voice.render(frames)
        self.largest_reduction_db = max(self.largest_reduction_db, self._voice.reduction_db)
        return block

    def last(self, frames: int) -> Block:
        """Return `frames` that fade to silence; nothing may follow."""
        return faded(self.block(frames), self.fade_frames)

    async def next_block(self, frames: int, pool: Executor) -> Block:
        """Return `block`, rendered here while the voice is quick and in `pool` while it is not."""
        return await self._quickness.rendered(self.block, frames, pool)
