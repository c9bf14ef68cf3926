"""An engine whose live voices are silent at once: what a stream then costs is the server, not the synthesis."""

from __future__ import annotations

from typing import Any

import numpy as np

from synth.encode.formats import Block
from synth.held_memory import Held
from synth.scene.scene import Scene
from tests.service.plain_engine import PlainEngine, PlainLive


class ZeroHand(PlainLive):
    """A hand's voice: zeros, whatever it is told."""

    finished = False
    reduction_db = 0.0
    before_limiter = None
    motion_delay = 0.0
    lowest_load = 0.0
    over_area = False

    @property
    def plan_document(self) -> dict[str, Any]:
        return {"simulated": [], "left_out": []}

    def render(self, frames: int) -> Block:
        self.frame += frames
        return np.zeros((frames, self.channels), np.float32)

    def held(self, change: object = None) -> Held:
        return Held()

    def touch(self, update: object) -> None:
        """Take no notice."""

    def lift(self) -> None:
        """Stay silent."""

    def release(self) -> None:
        self.finished = True

    def cut(self, block: Block, frames: int) -> Block:
        return block[:frames]

    recorded_bytes = 0

    def end_recording(self) -> None:
        """Record nothing."""

    def recording(self) -> dict[str, Any]:
        return {}

    def close(self) -> None:
        """Hold nothing."""


class ZeroEngine(PlainEngine):
    """Plain but for its live voices."""

    def open_hand(self, scene: Scene, *, record: bool = False) -> ZeroHand:  # type: ignore[override]
        self._about_to("hand")
        return ZeroHand(scene)
