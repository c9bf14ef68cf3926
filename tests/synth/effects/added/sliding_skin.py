"""The skin of a moist finger lags a little behind the hand, by a fixed part of its speed.

Kind    MOTION: moves the skin, and adds no channel.
Model   The place of the skin is that of the hand less a time times its speed.
Source  A test of the interface.
Limits  None.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from pydantic import Field

from synth.arrays import Array
from synth.effects.effect import MotionEffect, Price
from synth.motion.motion import ACROSS, SPEED, Motion
from synth.scene.finger_section import KINDS
from synth.scene.quantity import Dimension
from synth.scene.rules import Quantity
from synth.scene.scene import Scene
from synth.scene.section import Section

if TYPE_CHECKING:
    from synth.effects.effect import OutputStage, Passage
    from synth.plan.preparation import Preparation
    from synth.response_cache import ResponseCache


class SlidingSettings(Section):
    """The lag."""

    time: Annotated[float, Quantity(Dimension.TIME, 0.0, 1.0)] = Field(default=5e-3, description="Time of the lag.")


@dataclass(frozen=True, slots=True)
class Lag:
    """Moves the skin.

    time: of the lag, s.
    rate: of the output, at which the motion of a hand has its frames, Hz.
    """

    time: float
    rate: int

    def start(self) -> dict[str, Any]:
        """See `Mover`."""
        return {"walked": None, "before": None}

    def follow(self, state: dict[str, Any], hand: Motion) -> Array:
        """See `Mover`."""
        speeds = hand.samples[SPEED, np.newaxis]
        if hand.path.size:
            places = np.stack([hand.position, hand.path[ACROSS]])
            before = places[:, :1] if state["before"] is None else state["before"]
            speeds, state["before"] = np.diff(places, axis=1, prepend=before) * self.rate, places[:, -1:]
        elif len(hand.position):
            places = hand.position[np.newaxis]
        else:  # only its speed is known: the skin begins at 0
            begun = self.time * speeds[0, 0] if state["walked"] is None else state["walked"]
            ends = begun + np.cumsum(speeds, axis=1) / self.rate
            places, state["walked"] = ends - speeds / self.rate, ends[0, -1]
        return np.stack([places - self.time * speeds, speeds, np.zeros_like(places)], axis=1)


class NoChannel:
    """The stage of an effect that adds no channel."""

    channels = ()
    signals = ()

    def louder(self, times: float, moved: tuple[float, ...]) -> NoChannel:
        """See `OutputStage`."""
        return self

    def start(self, phase: int) -> None:
        """See `OutputStage`."""

    def begin_at(self, state: Any, phase: int) -> None:
        """See `OutputStage`."""

    def delay(self, state: Any) -> int:
        """See `OutputStage`."""
        return 0

    def step(self, state: Any, passage: Passage, block: Any) -> None:
        """See `OutputStage`."""


class SlidingSkin(MotionEffect["Preparation"]):
    """The effect; see the module."""

    name = "sliding_skin"
    summary = "The skin lags behind the hand."
    settings = SlidingSettings
    without_auto = "A test has no use for it."
    fingers = tuple(KINDS)
    price = Price(20.0, 280_000)

    def reason(self, scene: Scene, settings: SlidingSettings) -> str:
        """See `Effect`."""
        return f"The skin is {1e3 * settings.time:.3g} ms late."

    def mover(self, scene: Scene, settings: SlidingSettings, *, by_hand: bool) -> Lag:
        """See `MotionEffect`."""
        return Lag(settings.time, scene.output.sample_rate)

    def told(self, scene: Scene, settings: SlidingSettings, *, by_hand: bool) -> dict[str, Any]:
        """See `MotionEffect`."""
        return {"reason": "", "place_error": 0.0, "lag_seconds": settings.time}

    def channels(self, scene: Scene, settings: SlidingSettings) -> tuple[str, ...]:
        """See `OutputEffect`."""
        return ()

    def scales(self, settings: SlidingSettings) -> tuple[float | None, ...]:
        """See `OutputEffect`."""
        return ()

    def scaled(self, settings: SlidingSettings, full_scale: tuple[float | None, ...]) -> SlidingSettings:
        """See `OutputEffect`."""
        return settings

    def prepare(self, solved: Preparation, settings: SlidingSettings, cache: ResponseCache) -> OutputStage:
        """See `OutputEffect`."""
        return NoChannel()


EFFECT = SlidingSkin()
