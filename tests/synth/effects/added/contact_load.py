"""The load as a channel.

Kind    OUTPUT: adds the channel `contact_load`, in newtons.
Model   w of the scan, or of the motion.
Source  An example for `test_new_effects`.
Limits  None.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated

import numpy as np
from pydantic import Field

from synth.effects.effect import AddedChannel, OutputEffect, Passage, Price
from synth.scene.finger_section import KINDS
from synth.scene.quantity import Dimension
from synth.scene.rules import Quantity
from synth.scene.scene import Scene
from synth.scene.section import Section

if TYPE_CHECKING:
    from synth.arrays import Array, Block
    from synth.plan.preparation import Preparation
    from synth.response_cache import ResponseCache

QUANTITY = "contact_load"


class LoadSettings(Section):
    """The channel."""

    full_scale: Annotated[float | None, Quantity(Dimension.LOAD, 1e-12, 1e6)] = Field(
        default=None, description="Load that a sample of 1.0 stands for."
    )


class ContactLoad(OutputEffect["Preparation"]):
    """The effect; see the module."""

    name = "contact_load"
    summary = "The load as an additional channel."
    settings = LoadSettings
    without_auto = "It adds a channel and changes no other. Write {} or leave it out."
    units: Mapping[str, str] = MappingProxyType({QUANTITY: "N"})
    fingers = tuple(KINDS)
    price = Price(5.0, 270_000)

    def reason(self, scene: Scene, settings: LoadSettings) -> str:
        """See `Effect`."""
        return "The load is an additional channel."

    def channels(self, scene: Scene, settings: LoadSettings) -> tuple[str, ...]:
        """See `OutputEffect`."""
        return (QUANTITY,)

    def scales(self, settings: LoadSettings) -> tuple[float | None, ...]:
        """See `OutputEffect`."""
        return (settings.full_scale,)

    def scaled(self, settings: LoadSettings, full_scale: tuple[float | None, ...]) -> LoadSettings:
        """See `OutputEffect`."""
        return settings.model_copy(update={"full_scale": full_scale[0]})

    def prepare(self, solved: Preparation, settings: LoadSettings, cache: ResponseCache) -> LoadStage:
        """See `OutputEffect`."""
        load = solved.scene.scan.load
        scale = settings.full_scale or abs(load) / 0.8 or 1.0
        return LoadStage(load, settings.full_scale is not None, AddedChannel(QUANTITY, scale, 0.0, 0.0, "the motion"))


@dataclass(slots=True)
class LoadState:
    """The state of a voice: the last loads (N) of a hand."""

    past: Array | None = None


@dataclass(frozen=True, slots=True)
class LoadStage:
    """The effect prepared for one scene; load: of the scan, N."""

    load: float
    fixed: bool
    channel: AddedChannel

    @property
    def channels(self) -> tuple[AddedChannel, ...]:
        """See `OutputStage`."""
        return (self.channel,)

    @property
    def signals(self) -> tuple[()]:
        """See `OutputStage`."""
        return ()

    def louder(self, times: float, moved: tuple[float, ...]) -> LoadStage:
        """See `OutputStage`."""
        raised = self.channel.full_scale * (1.0 if self.fixed else times)
        return replace(self, channel=replace(self.channel, full_scale=raised))

    def start(self, phase: int) -> LoadState:
        """See `OutputStage`."""
        return LoadState()

    def begin_at(self, state: LoadState, phase: int) -> None:
        """See `OutputStage`."""

    def delay(self, state: LoadState) -> int:
        """See `OutputStage`."""
        return 0

    def step(self, state: LoadState, passage: Passage, block: Block) -> None:
        """See `OutputStage`."""
        from synth.motion.motion import LOAD
        from synth.voice.table_reading import delayed

        loads = np.full(len(block), self.load) if passage.motion is None else passage.motion.samples[LOAD].copy()
        if passage.late:
            if state.past is None:
                state.past = np.full(passage.late, loads[0])
            loads = delayed(loads, state.past)
        block[:, passage.column] = loads / self.channel.full_scale


EFFECT = ContactLoad()
