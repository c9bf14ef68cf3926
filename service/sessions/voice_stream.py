"""A live voice as a session holds it: its blocks, rendered where they make nobody late, its changes, and its end.

Model: every end (stop, delete, expiry, shutdown, the end of a finite stream) is one last block of `FADE_SECONDS` at
    most, under a half cosine from 1 to 0. A change of the scene waits in a slot until a block begins, so the thread
    that renders is the only one that touches the voice.
    A block is rendered in the event loop while blocks are quick. One that takes longer than QUICK_SECONDS is slow;
    PATIENCE slow ones in a row send the next ones to a thread, and a quick one brings them back. In the event loop the
    clock is the wall's, since a thread's own costs half a block to read; a busy machine delays a block now and then,
    but not always the same voice's.
Limits: threads that render share the interpreter: many of them at a time make each other and the event loop late. They
    are for the few voices whose every block is dear. One thread or task at a time renders (`VoiceStream.turn`).
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from concurrent.futures import Executor
from typing import Any, Literal, TypeVar

from service.engine import LiveVoice
from service.operations.metrics import Metrics
from synth.encode.formats import Block
from synth.scene.scene import Scene
from synth.voice.fades import faded

FADE_SECONDS = 0.01  # an end is silent 20 ms after it was asked for; much shorter would be felt as a click of its own
GRACE_SECONDS = 0.5  # for a reader to take the block that waits when its session ends
STOP_GRACE_SECONDS = 0.01  # the same for a stop, which promises silence within 20 ms
QUICK_SECONDS = 0.001  # a tenth of a block of 10 ms; more and ten such voices make each other late
PATIENCE = 8  # slow blocks in a row; fewer, and a hand that meets new tables on a busy machine is sent to threads

Kind = Literal["http", "live"]
Rendered = TypeVar("Rendered")


def grace_seconds(*, at_once: bool) -> float:
    """Return how long a reader has to take the block that waits when its session ends; at_once: by a stop."""
    return STOP_GRACE_SECONDS if at_once else GRACE_SECONDS


class VoiceStream:
    """Blocks of one live voice; `change` may be called from any thread."""

    kind: Kind = "http"
    """What the stream is for: a reader or a play that ends with it, or a live connection that it outlives."""
    records = False
    """Whether it keeps a recording, which `recording` returns."""

    def __init__(self, voice: LiveVoice) -> None:
        self.voice: Any = voice
        self.sample_rate, self.channels = voice.sample_rate, voice.channels
        self.fade_frames = max(1, round(FADE_SECONDS * voice.sample_rate))
        self.largest_reduction_db = 0.0  # of all blocks so far
        self.turn = asyncio.Lock()  # held while a thread renders
        self.coming: Any = None  # the change that a block is to begin with
        self.quick = True
        self._slow_blocks = 0

    @property
    def reduction_db(self) -> float:
        """Return the largest gain reduction of the safety limiter in the last block, in dB."""
        return float(self.voice.reduction_db)

    @property
    def used_bytes(self) -> int:
        """Return the memory that it takes beside its voice."""
        return 0

    @property
    def can_render_here(self) -> bool:
        """Return whether a block may be rendered in the event loop: the voice is quick, and nobody else is at it."""
        return self.quick and not self.turn.locked()

    def prepare(self, scene: Scene) -> Any:
        """Return the solved change to `scene`; slow, for a thread."""
        return self.voice.prepare(scene)

    def change(self, change: Any) -> None:
        """Have a block cross-fade to `change` as soon as may be; one that no block has picked up yet is replaced."""
        self.coming = change
        self.quick = False  # the block that takes it over may build tables

    def next_block(self, frames: int) -> Block:
        """Return the next `frames` as float32 [frames, channels]."""
        self.take_change()
        block: Block = self.voice.render(frames)
        self.largest_reduction_db = max(self.largest_reduction_db, self.voice.reduction_db)
        return block

    def last(self, frames: int) -> Block:
        """Return `frames` that fade to silence; nothing may follow."""
        return faded(self.next_block(frames), self.fade_frames)

    def take_change(self) -> bool:
        """Begin the cross-fade to the change that waits; return whether there was one."""
        change, self.coming = self.coming, None
        if change is None:
            return False
        self.voice.apply(change)
        self.quick = False
        return True

    async def rendered(self, render: Callable[[int], Rendered], frames: int, pool: Executor) -> Rendered:
        """Return `render(frames)`, rendered here while that is quick and in `pool` while it is not."""
        async with self.turn:
            if self.quick:
                return self.rendered_here(render, frames)
            block, seconds = await asyncio.get_running_loop().run_in_executor(pool, _timed_apart, render, frames)
        self._took(seconds)
        return block

    def rendered_here(self, render: Callable[[int], Rendered], frames: int) -> Rendered:
        """Return `render(frames)`, rendered here; beside other tasks only if `can_render_here`."""
        began = time.perf_counter()
        block = render(frames)
        self._took(time.perf_counter() - began)
        return block

    def tell_counts(self, metrics: Metrics, *, ended: bool = False) -> None:
        """Add what is new since the last time to `metrics`; ended: nothing is applied any more."""

    def recording(self) -> bytes:
        """Return the JSON of the recording; slow, for a thread."""
        raise AssertionError("this stream keeps no recording")

    def _took(self, seconds: float) -> None:
        """Take note of how long a block took."""
        if seconds < QUICK_SECONDS:
            self.quick, self._slow_blocks = True, 0
        else:
            self._slow_blocks += 1
            if self._slow_blocks >= PATIENCE:
                self.quick = False


def _timed_apart(render: Callable[[int], Rendered], frames: int) -> tuple[Rendered, float]:
    """Return the block and its seconds by the thread's own clock: by the wall's, every block beside others is slow."""
    began = time.thread_time()
    return render(frames), time.thread_time() - began
