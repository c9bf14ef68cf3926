"""A hand's voice whose sound is known exactly: a sine, its level the load, with ramps of a known length.

`PlainHand` renders block by block; `expected` computes a whole stream at once from what was applied at which frame.
"""

from __future__ import annotations

import itertools
import threading
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from synth.encode.formats import Block
from synth.held_memory import Held
from synth.motion.motion import Update
from synth.scene.scene import Scene, scene_document
from synth.surfaces import profile_of
from synth.surfaces.height_field import HeightField
from synth.voice.fades import faded
from tests.service.plain_engine import FULL_SCALE, pitch

LEVEL_AT_FIRST = 0.5  # before the first update: a scene that moves by itself
EVENT_BYTES = 280  # of an update, in a recording
RAMP_FRAMES = 96  # of a change of load
FADE_SECONDS = 0.01  # of a release
NO_LOAD = 0.0

Wave = npt.NDArray[np.float32]


@dataclass
class Applied:
    """What reached a hand, each with the first frame that it is heard at."""

    levels: list[tuple[int, float]] = field(default_factory=list)
    scenes: list[tuple[int, Scene]] = field(default_factory=list)
    updates: list[tuple[int, Update]] = field(default_factory=list)
    lifted: list[int] = field(default_factory=list)
    released: int | None = None


def levels(applied: Applied, frames: int) -> npt.NDArray[np.float64]:
    """Return the level at each frame: linear ramps of RAMP_FRAMES from one load to the next."""
    n = np.arange(frames)
    level = np.full(frames, LEVEL_AT_FIRST)
    before = LEVEL_AT_FIRST
    for index, (since, goal) in enumerate(applied.levels):
        part = np.clip((n[since:] - since + 1) / RAMP_FRAMES, 0.0, 1.0)
        level[since:] = before + (goal - before) * part
        if index + 1 < len(applied.levels):
            at = applied.levels[index + 1][0]
            before = before + (goal - before) * min(1.0, (at - since) / RAMP_FRAMES)
    return level


def expected(scene: Scene, applied: Applied, frames: int) -> Wave:
    """Return the stream of `scene`, float32 [frames], from frame 0 on."""
    rate = scene.output.sample_rate
    n = np.arange(frames)
    wave = np.sin(2 * np.pi * (pitch(scene) / rate * n))
    for since, changed in applied.scenes:
        wave[since:] = np.sin(2 * np.pi * (pitch(changed) / rate * n[since:]))
    wave *= levels(applied, frames)
    if applied.released is not None:
        wave *= np.clip(1.0 - (n - applied.released + 1) / round(FADE_SECONDS * rate), 0.0, 1.0)
    return np.asarray(wave, dtype=np.float32)


class PlainHand:
    """See `service.engine.HandVoice`; `applied` is what a test compares with."""

    motion_delay = 0.002
    lowest_load = 0.0
    memory = Held()

    def __init__(self, scene: Scene, *, record: bool) -> None:
        self.scene = scene
        self.sample_rate = scene.output.sample_rate
        self.quantities = tuple(channel.quantity for channel in scene.output.channel_list)
        self.channels = len(self.quantities)
        self.full_scale = tuple(channel.full_scale or FULL_SCALE for channel in scene.output.channel_list)
        self.frame = 0
        self.reduction_db = 0.0
        self.before_limiter: Block | None = None
        self.applied = Applied()
        self.fails: Exception | None = None
        self.gate: threading.Event | None = None
        self.waits = False
        self._record = record
        self.ended_recording = False
        self._load = 0.3
        self.first = scene

    @property
    def finished(self) -> bool:
        released = self.applied.released
        return released is not None and self.frame >= released + round(FADE_SECONDS * self.sample_rate)

    def held(self, change: Any = None) -> Held:
        return self.memory

    @property
    def over_area(self) -> bool:
        return isinstance(profile_of(self.scene), HeightField) and not self.scene.effects

    @property
    def plan_document(self) -> dict[str, Any]:
        return {"simulated": [], "left_out": [], "response": {"pitch": pitch(self.scene)}, "warnings": []}

    def touch(self, update: Update) -> None:
        self._load = self._load if update.load is None else update.load
        self.applied.updates.append((self.frame, update))
        self.applied.levels.append((self.frame, self._load))

    def lift(self) -> None:
        self.applied.lifted.append(self.frame)
        self.applied.levels.append((self.frame, NO_LOAD))

    def release(self) -> None:
        if self.applied.released is None:
            self.applied.released = self.frame

    def prepare(self, scene: Scene) -> Scene:
        return scene

    def apply(self, change: Scene) -> None:
        self.scene = change
        self.applied.scenes.append((self.frame, change))

    def render(self, frames: int) -> Block:
        if self.fails is not None:
            raise self.fails
        if self.gate is not None:
            self.waits = True
            assert self.gate.wait(30.0), "the test never opened the gate"
        block = self._render(frames)
        self.frame += frames
        return block

    def _render(self, frames: int) -> Block:
        first = self.frame
        n = np.arange(first, first + frames)
        wave = np.sin(2 * np.pi * (pitch(self.scene) / self.sample_rate * n)) * self._levels(n)
        if self.applied.released is not None:
            fade = round(FADE_SECONDS * self.sample_rate)
            wave *= np.clip(1.0 - (n - self.applied.released + 1) / fade, 0.0, 1.0)
        return np.repeat(wave.astype(np.float32)[:, np.newaxis], self.channels, axis=1)

    def _levels(self, n: npt.NDArray[np.int64]) -> npt.NDArray[np.float64]:
        before = LEVEL_AT_FIRST
        changes = self.applied.levels
        for (since, goal), (following, _) in itertools.pairwise(changes):
            before = before + (goal - before) * min(1.0, (following - since) / RAMP_FRAMES)
        if not changes:
            return np.full(len(n), before)
        since, goal = changes[-1]
        return np.asarray(before + (goal - before) * np.clip((n - since + 1) / RAMP_FRAMES, 0.0, 1.0))

    def cut(self, block: Block, frames: int) -> Block:
        self.frame += frames - len(block)
        return faded(block, frames)

    @property
    def recorded_bytes(self) -> int:
        return EVENT_BYTES * len(self.applied.updates) if self._record else 0

    def end_recording(self) -> None:
        self.ended_recording = self._record

    def recording(self) -> dict[str, Any]:
        assert self._record, "it was not asked to record"
        updates = [[frame, update.seq] for frame, update in self.applied.updates]
        return {"scene": scene_document(self.first), "updates": updates}
