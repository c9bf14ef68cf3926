"""What comes out of a scene: the quantities, the frames, and how exact they must be.

Stage: 1 (SCENE). Every field is declared once: its type with its rule, its default in SI, a sentence that says what it
means.
Limits: rates, durations and tolerances as fixed by the project's design; the range of full scales is derived below.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError, ValidationInfo
from pydantic_core import PydanticCustomError

from synth.scene.quantity import Dimension, show_quantity
from synth.scene.rules import (
    Choice,
    Fields,
    Quantity,
    QuantityOrName,
    Refusal,
    Rule,
    refusal,
    refusals_of,
    refuse,
    refused,
    told,
)
from synth.scene.section import Section, section_schema, without

QuantityName = Literal["displacement", "velocity", "acceleration", "approach"]
QUANTITY_NAME = Choice(("displacement", "velocity", "acceleration", "approach"))

THRESHOLD_NAME = Choice(("fingertip", "probe", "pen"))

FULL_SCALE_RANGES = {
    "approach": Quantity(Dimension.LENGTH, 1e-12, 1e3),
    "displacement": Quantity(Dimension.LENGTH, 1e-12, 1e3),
    "velocity": Quantity(Dimension.SPEED, 1e-18, 1e6),
    "acceleration": Quantity(Dimension.ACCELERATION, 1e-24, 1e9),
}
"""Full scales of each quantity. The low ends hold the full scale of 1 nm of motion at the slowest speeds; above them
the largest motion of any scene divided by the full scale still fits a 32-bit float."""

DEFAULT_BANDWIDTH = 1000.0
"""Hz. Skin feels nothing above it (google/audio-to-tactile, its documentation). A wider band costs more, and most of
the size of an acceleration then lies where nobody feels it."""

FULL_BAND = "full"
"""The bandwidth that leaves the limit to the sample rate."""

BAND = 0.40
"""Of the sample rate: harmonics below it keep the tolerance (design, section 4)."""

MOST_CHANNELS = 16
"""Channels of one output: more than any haptic interface here has, and few enough that a typing slip cannot fill
memory."""


class FullScale(Rule):
    """A value of the section's own quantity."""

    allowed = "; ".join(f"{name} {rule.allowed}" for name, rule in FULL_SCALE_RANGES.items())

    def read(self, value: object, quantity: object = None) -> float:
        """Return the value in SI; where the quantity is not known, any quantity will do."""
        if quantity in FULL_SCALE_RANGES:
            return FULL_SCALE_RANGES[str(quantity)].read(value)
        for rule in FULL_SCALE_RANGES.values():
            try:
                return rule.read(value)
            except PydanticCustomError:
                continue
        raise refused(self.allowed, "Write a number in the SI unit of the quantity, or text with its unit.")

    def schema(self) -> dict[str, Any]:
        """Return the union over the quantities."""
        numbers = {"type": "number", "minimum": 1e-24, "maximum": 1e9}
        texts = [rule.schema()["anyOf"][1] for rule in FULL_SCALE_RANGES.values()]
        return {"anyOf": [numbers, *texts]}

    def read_in(self, value: object, found: ValidationInfo) -> float:
        """Return the value in SI, of the quantity of the same section, which is declared before."""
        return self.read(value, found.data.get("quantity"))


FullScaleField = Annotated[
    float | None,
    FullScale(),
    Field(description="Value of the quantity that becomes 1.0 in the audio; by default the peak becomes 0.8."),
]


class Channel(Section):
    """One channel of the output. Text alone is the channel's quantity."""

    quantity: Annotated[QuantityName, QUANTITY_NAME] = Field(
        default="acceleration", description="What the samples of this channel are."
    )
    full_scale: FullScaleField = None


class Channels(Rule):
    """A list of quantities, or of objects with a quantity and its full scale."""

    allowed = f"a list of 1 to {MOST_CHANNELS} channels, each a quantity ({QUANTITY_NAME.allowed}) or an object"

    def read(self, value: object) -> tuple[Channel, ...]:
        """Return the channels."""
        if not isinstance(value, list | tuple) or not 1 <= len(value) <= MOST_CHANNELS:
            raise refused(self.allowed, 'Write ["displacement", {"quantity": "velocity", "full_scale": "0.1 m/s"}].')
        refusals: list[Refusal] = []
        channels: list[Channel] = []
        for index, channel in enumerate(value):
            try:
                named = {"quantity": QUANTITY_NAME.read(channel)} if isinstance(channel, str) else channel
                channels.append(Channel.model_validate(named))
            except PydanticCustomError as error:
                refusals.append(refusal([index], channel, **told(error)))
            except ValidationError as error:
                refusals += refusals_of(error, index)
        refuse("channels", refusals)
        return tuple(channels)

    def schema(self) -> dict[str, Any]:
        """Return the list."""
        items = {"anyOf": [*QUANTITY_NAME.schema()["anyOf"], section_schema(Channel)]}
        return {"anyOf": [{"type": "array", "minItems": 1, "maxItems": MOST_CHANNELS, "items": items}]}


class Output(Section):
    """What the samples are, and how many of them.

    `quantity` and `full_scale` are those of the first channel where `channels` is given; `channel_list` holds them all.
    """

    quantity: Annotated[QuantityName, QUANTITY_NAME] = Field(
        default="acceleration", description="What the samples of the one channel are."
    )
    channels: Annotated[tuple[Channel, ...] | None, Channels()] = Field(
        default=None,
        description="One quantity a channel, each with its own full scale, instead of quantity and full_scale.",
    )
    sample_rate: Annotated[int, Quantity(Dimension.FREQUENCY, 1e3, 192e3, whole=True)] = Field(
        default=48000, description="Frames a second."
    )
    duration: Annotated[float, Quantity(Dimension.TIME, 1e-3, 86400.0)] = Field(
        default=2.0, description="Length of a finite render; a live stream goes on until it is stopped."
    )
    full_scale: FullScaleField = None
    bandwidth: Annotated[
        float | Literal["full"],
        QuantityOrName(Quantity(Dimension.FREQUENCY, 1.0, 96e3), Choice((FULL_BAND,))),
    ] = Field(
        default=DEFAULT_BANDWIDTH,
        description="Frequency above which components are removed. Where it is full, or above 0.45 of the sample "
        "rate, the rate alone sets the limit.",
    )
    fade: Annotated[float, Quantity(Dimension.TIME, 0.0, 60.0)] = Field(
        default=0.0, description="Time a finite render takes to fade in at its start, and out at its end."
    )

    @property
    def band_limit(self) -> float:
        """The frequency (Hz) below which harmonics keep the tolerance."""
        return min(BAND * self.sample_rate, self.bandwidth_hz)

    @property
    def bandwidth_hz(self) -> float:
        """The bandwidth as a number (Hz); infinite where it is full."""
        return math.inf if isinstance(self.bandwidth, str) else self.bandwidth

    @property
    def channel_list(self) -> tuple[Channel, ...]:
        """Every channel in order, at least one."""
        return self.channels or (Channel(quantity=self.quantity, full_scale=self.full_scale),)

    @classmethod
    def conflicts(cls, given: Fields) -> list[Refusal]:
        """Refuse one quantity beside a list of them, and fades that overlap."""
        refusals = [
            refusal(
                [name], given[name], f"{name}, or channels, not both", "Write it inside the channel, or leave it out."
            )
            for name in ("quantity", "full_scale")
            if name in given and "channels" in given
        ]
        fade, duration = cls.value_of(given, "fade"), cls.value_of(given, "duration")
        if fade is not None and duration is not None and fade > 0.5 * duration:
            longest = show_quantity(0.5 * duration, Dimension.TIME)
            hint = "Write a shorter fade or a longer duration."
            refusals.append(refusal(["fade"], given["fade"], f"at most half the duration, here {longest}", hint))
        return refusals

    def derived(self) -> Fields:
        """Return the quantity and full scale of the first channel if there is a list."""
        if not self.channels:
            return {}
        return {"quantity": self.channels[0].quantity, "full_scale": self.channels[0].full_scale}

    def document(self) -> dict[str, Any]:
        """Return the section with either the list of channels or the one quantity."""
        return without(super().document(), *(("quantity", "full_scale") if self.channels else ("channels",)))


class Accuracy(Section):
    """How exact the samples must be."""

    tolerance: Annotated[
        float | Literal["exact", "imperceptible"],
        QuantityOrName(Quantity(Dimension.NONE, 1e-7, 3e-2), Choice(("exact", "imperceptible"))),
    ] = Field(
        default=1e-3,
        description="Largest error of each quantity relative to its own peak-to-peak; exact: to round-off; "
        "imperceptible: the error spectrum stays 6 dB below the human detection threshold.",
    )
    threshold: Annotated[Literal["fingertip", "probe", "pen"], THRESHOLD_NAME] = Field(
        default="fingertip",
        description="Detection threshold that imperceptible, and the margins of an accuracy report, go by: of a bare "
        "fingertip, of a small probe on it, or of a pen held in the hand.",
    )
