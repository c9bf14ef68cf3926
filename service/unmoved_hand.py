"""A live voice as a hand's: it plays its scene and takes no notice of updates.

Limits: stands in until `synth.live` follows a hand.
"""

from __future__ import annotations

from typing import Any

from synth.cache import ResponseCache
from synth.following import Update
from synth.live import LOOK_AHEAD, LiveVoice
from synth.scene import Scene


class UnmovedHand(LiveVoice):
    """See `service.engine.HandVoice`."""

    motion_delay = LOOK_AHEAD
    lowest_load = 0.0

    def __init__(self, scene: Scene, cache: ResponseCache) -> None:
        super().__init__(scene, cache=cache)

    @property
    def plan_document(self) -> dict[str, Any]:
        """See `HandVoice`."""
        document = self.plan.document()
        return {name: value for name, value in document.items() if name not in ("scene", "cost")}

    def touch(self, update: Update) -> None:
        """Take no notice."""

    def lift(self) -> None:
        """Take no notice."""

    def recording(self) -> dict[str, Any]:
        """Return the scene alone."""
        return {"scene": self.plan.scene, "frames": self.frame}

    def close(self) -> None:
        """Nothing to let go of."""
