"""The live voice of a session: renders its blocks in the event loop or in a thread, and applies changes of scene.

Model: a stream ends with a last block that fades out over at most FADE_SECONDS, with a half cosine. A change of scene
    waits until a block begins, so only the rendering thread uses the voice.
    A block that takes longer than QUICK_SECONDS is slow. After PATIENCE slow blocks in a row, blocks are rendered in a
    thread, until one is quick. In the event loop blocks are timed by the wall clock, because reading a thread's clock
    takes half as long as a block.
Limits: threads share the interpreter, so many rendering threads delay each other and the event loop. One thread or task
    at a time renders (`VoiceStream.turn`).
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
from synth.held_memory import Held
from synth.scene.scene import Scene
from synth.voice.fades import faded

FADE_SECONDS = 0.01  # a stop is silent after 20 ms; a much shorter fade is felt as a click
GRACE_SECONDS = 0.5  # for a reader to take the waiting block when its session ends
STOP_GRACE_SECONDS = 0.01  # the same for a stop, which promises silence within 20 ms
QUICK_SECONDS = 0.001  # a tenth of a block of 10 ms; with more, ten such voices delay each other
PATIENCE = 8  # slow blocks in a row; with fewer, a busy machine moves quick voices to threads

Kind = Literal["http", "live"]
Rendered = TypeVar("Rendered")


def grace_seconds(*, at_once: bool) -> float:
    """Return for how many seconds an ending session waits for its reader. at_once: a stop."""
    return STOP_GRACE_SECONDS if at_once else GRACE_SECONDS


class VoiceStream:
    """The blocks of one live voice.

    largest_reduction_db: of the limiter, in all blocks so far.
    turn: held while a block is rendered outside the event loop.
    coming: the prepared change that waits for the next block.
    held: memory of the voice, and of a prepared change until it is applied.
    quick: blocks are rendered in the event loop.
    """

    kind: Kind = "http"
    """An HTTP stream ends with its reader or play. A live stream outlives its connection."""
    records = False
    """Whether a recording is kept."""

    def __init__(self, voice: LiveVoice) -> None:
        self.voice: Any = voice
        self.sample_rate, self.channels = voice.sample_rate, voice.channels
        self.fade_frames = max(1, round(FADE_SECONDS * voice.sample_rate))
        self.largest_reduction_db = 0.0
        self.turn = asyncio.Lock()
        self.coming: Any = None
        self.held: tuple[Held, ...] = (voice.held(),)
        self.quick = True
        self._slow_blocks = 0

    @property
    def reduction_db(self) -> float:
        """Return the largest gain reduction of the limiter in the last block, in dB."""
        return float(self.voice.reduction_db)

    @property
    def used_bytes(self) -> int:
        """Return the memory of the stream in bytes, without its voice (`held`)."""
        return 0

    @property
    def can_render_here(self) -> bool:
        """Return whether the next block may be rendered in the event loop: the voice is quick and not in use."""
        return self.quick and not self.turn.locked()

    def prepare(self, scene: Scene) -> Any:
        """Return the solved change to `scene`. Slow: call it from a thread."""
        change = self.voice.prepare(scene)
        self.held = self.held[0], self.voice.held(change)
        return change

    def refuse_change(self) -> None:
        """Forget the memory of a prepared change that is not applied."""
        self.held = self.held[:1]

    def change(self, change: Any) -> None:
        """Cross-fade to `change` from the next block on. It replaces a change that still waits. From any thread."""
        self.coming = change
        self.quick = False  # its first block may be slow

    def next_block(self, frames: int) -> Block:
        """Return the next `frames` as float32 [frames, channels]."""
        self.take_change()
        block: Block = self.voice.render(frames)
        self.largest_reduction_db = max(self.largest_reduction_db, self.voice.reduction_db)
        return block

    def last(self, frames: int) -> Block:
        """Return the last `frames`, which fade to silence."""
        return faded(self.next_block(frames), self.fade_frames)

    def take_change(self) -> bool:
        """Begin the cross-fade to the waiting change; return whether there was one."""
        change, self.coming = self.coming, None
        if change is None:
            return False
        self.voice.apply(change)
        self.held = self.held[-1:]
        self.quick = False
        return True

    async def rendered(self, render: Callable[[int], Rendered], frames: int, pool: Executor) -> Rendered:
        """Return `render(frames)`, called in the event loop if the voice is quick, otherwise in `pool`."""
        async with self.turn:
            if self.quick:
                return self.rendered_here(render, frames)
            block, seconds = await asyncio.get_running_loop().run_in_executor(pool, _timed_apart, render, frames)
        self._took(seconds)
        return block

    def rendered_here(self, render: Callable[[int], Rendered], frames: int) -> Rendered:
        """Return `render(frames)`, called in the event loop. Requires `can_render_here`, or `turn`."""
        began = time.perf_counter()
        block = render(frames)
        self._took(time.perf_counter() - began)
        return block

    def tell_counts(self, metrics: Metrics, *, ended: bool = False) -> None:
        """Add the increase of the counts to `metrics`. ended: no further update is applied."""

    def recording(self) -> bytes:
        """Return the JSON of the recording. Slow: call it from a thread."""
        raise AssertionError("this stream keeps no recording")

    def _took(self, seconds: float) -> None:
        """Decide by the time of a block where the next one is rendered."""
        if seconds < QUICK_SECONDS:
            self.quick, self._slow_blocks = True, 0
        else:
            self._slow_blocks += 1
            if self._slow_blocks >= PATIENCE:
                self.quick = False


def _timed_apart(render: Callable[[int], Rendered], frames: int) -> tuple[Rendered, float]:
    """Return the block and its seconds by the thread's clock; the wall clock would count concurrent blocks as slow."""
    began = time.thread_time()
    return render(frames), time.thread_time() - began
