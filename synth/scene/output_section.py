"""The output and accuracy sections of a scene: quantities, frames, and the permitted error.

Stage: 1 (SCENE). Every field is declared once: its type with its rule, its default in SI, and a sentence on its
meaning.
Limits: the ranges of rates, durations and tolerances are from the project's design. Those of full scales are derived
below.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError, ValidationInfo
from pydantic_core import PydanticCustomError

from synth.scene.array_values import texts_as_lists
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
    words_of,
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
"""Allowed full scales of each quantity. The low ends admit the full scale of 1 nm of motion at the slowest speeds. With
any allowed full scale, the largest motion of any scene divided by it still fits a 32-bit float."""

DEFAULT_BANDWIDTH = 1000.0
"""Hz. Skin feels nothing above this frequency (google/audio-to-tactile, its documentation). A wider band costs more,
and most of an acceleration would then be at frequencies that are not felt."""

FULL_BAND = "full"
"""The bandwidth that only the sample rate limits."""

BAND = 0.40
"""Part of the sample rate below which harmonics keep the tolerance (design, section 4)."""

MOST_CHANNELS = 16
"""Largest number of channels: more than any supported haptic interface has, and few enough that a typing error cannot
fill the memory."""


class FullScale(Rule):
    """A full scale: a value of the quantity in the same section."""

    allowed = "; ".join(f"{name} {rule.allowed}" for name, rule in FULL_SCALE_RANGES.items())

    def read(self, value: object, quantity: object = None) -> float:
        """Return the value in SI. If the quantity is not known, a value of any quantity is accepted."""
        if quantity in FULL_SCALE_RANGES:
            return FULL_SCALE_RANGES[str(quantity)].read(value)
        for rule in FULL_SCALE_RANGES.values():
            try:
                return rule.read(value)
            except PydanticCustomError:
                continue
        raise refused(self.allowed, "Write a number in the SI unit of the quantity, or text with its unit.")

    def schema(self) -> dict[str, Any]:
        """Return the union of the schemas of all quantities."""
        numbers = {"type": "number", "minimum": 1e-24, "maximum": 1e9}
        texts = [rule.schema()["anyOf"][1] for rule in FULL_SCALE_RANGES.values()]
        return {"anyOf": [numbers, *texts]}

    def read_in(self, value: object, found: ValidationInfo) -> float:
        """Return the value in SI, read as the section's quantity. That field is declared, and read, before this one."""
        return self.read(value, found.data.get("quantity"))


FullScaleField = Annotated[
    float | None,
    FullScale(),
    Field(description="Value of the quantity that becomes 1.0 in the audio. By default the peak becomes 0.8."),
]


class Channel(Section):
    """One channel of the output. A channel written as text is a quantity."""

    quantity: Annotated[QuantityName, QUANTITY_NAME] = Field(
        default="acceleration", description="Quantity of the samples of this channel."
    )
    full_scale: FullScaleField = None


class Channels(Rule):
    """A list of channels, each a quantity or an object with a quantity and a full scale."""

    allowed = f"a list of 1 to {MOST_CHANNELS} channels, each a quantity ({QUANTITY_NAME.allowed}) or an object"

    def read(self, value: object) -> tuple[Channel, ...]:
        """Return the channels."""
        value = texts_as_lists(value)
        if not isinstance(value, list | tuple) or not 1 <= len(value) <= MOST_CHANNELS:
            raise refused(self.allowed, 'Write ["displacement", {"quantity": "velocity", "full_scale": "0.1 m/s"}].')
        refusals: list[Refusal] = []
        channels: list[Channel] = []
        for index, channel in enumerate(value):
            try:
                named = {"quantity": QUANTITY_NAME.read(channel)} if isinstance(channel, str) else channel
                channels.append(Channel.model_validate(named))
            except PydanticCustomError as error:
                refusals.append(refusal([index], channel, **words_of(error)))
            except ValidationError as error:
                refusals += refusals_of(error, index)
        refuse("channels", refusals)
        return tuple(channels)

    def schema(self) -> dict[str, Any]:
        """Return the schema of the list."""
        items = {"anyOf": [*QUANTITY_NAME.schema()["anyOf"], section_schema(Channel)]}
        return {"anyOf": [{"type": "array", "minItems": 1, "maxItems": MOST_CHANNELS, "items": items}]}


class Output(Section):
    """Quantity, rate, number and scale of the samples.

    If `channels` is given, `quantity` and `full_scale` are those of the first channel. `channel_list` holds every
    channel in both cases.
    """

    quantity: Annotated[QuantityName, QUANTITY_NAME] = Field(
        default="acceleration", description="Quantity of the samples of a one-channel output."
    )
    channels: Annotated[tuple[Channel, ...] | None, Channels()] = Field(
        default=None,
        description="One quantity per channel, each with its own full scale, instead of quantity and full_scale.",
    )
    sample_rate: Annotated[int, Quantity(Dimension.FREQUENCY, 1e3, 192e3, whole=True)] = Field(
        default=48000, description="Frames per second."
    )
    duration: Annotated[float, Quantity(Dimension.TIME, 1e-3, 86400.0)] = Field(
        default=2.0, description="Length of a finite render. A live stream continues until it is stopped."
    )
    full_scale: FullScaleField = None
    bandwidth: Annotated[
        float | Literal["full"],
        QuantityOrName(Quantity(Dimension.FREQUENCY, 1.0, 96e3), Choice((FULL_BAND,))),
    ] = Field(
        default=DEFAULT_BANDWIDTH,
        description="Components at this frequency and above are removed. With full, or a value above 0.45 of the "
        "sample rate, only the sample rate limits the band.",
    )
    fade: Annotated[float, Quantity(Dimension.TIME, 0.0, 60.0)] = Field(
        default=0.0, description="Duration of the fade at the start and of the fade at the end of a finite render."
    )

    @property
    def band_limit(self) -> float:
        """The frequency (Hz) below which harmonics keep the tolerance."""
        return min(BAND * self.sample_rate, self.bandwidth_hz)

    @property
    def bandwidth_hz(self) -> float:
        """The bandwidth as a number (Hz); infinite for the full band."""
        return math.inf if isinstance(self.bandwidth, str) else self.bandwidth

    @property
    def channel_list(self) -> tuple[Channel, ...]:
        """Every channel, in order. There is at least one."""
        return self.channels or (Channel(quantity=self.quantity, full_scale=self.full_scale),)

    @classmethod
    def conflicts(cls, given: Fields) -> list[Refusal]:
        """Refuse a quantity or a full scale together with channels, and fades that overlap."""
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
        """Return the quantity and full scale of the first channel if `channels` is given."""
        if not self.channels:
            return {}
        return {"quantity": self.channels[0].quantity, "full_scale": self.channels[0].full_scale}

    def document(self) -> dict[str, Any]:
        """Return the section with either the channels, or the quantity and its full scale."""
        return without(super().document(), *(("quantity", "full_scale") if self.channels else ("channels",)))


class Accuracy(Section):
    """The permitted error of the samples."""

    tolerance: Annotated[
        float | Literal["exact", "imperceptible"],
        QuantityOrName(Quantity(Dimension.NONE, 1e-7, 3e-2), Choice(("exact", "imperceptible"))),
    ] = Field(
        default=1e-3,
        description="Largest error of each quantity, relative to its own peak-to-peak. exact: the error is round-off. "
        "imperceptible: the error spectrum stays 6 dB below the human detection threshold.",
    )
    threshold: Annotated[Literal["fingertip", "probe", "pen"], THRESHOLD_NAME] = Field(
        default="fingertip",
        description="Detection threshold used by imperceptible and by the margins of an accuracy report: of a bare "
        "fingertip, of a small probe on it, or of a pen held in the hand.",
    )
