"""The motion at a place away from the contact, such as the nail, as an additional channel.

Kind    OUTPUT: adds one channel, `propagated_displacement`, `propagated_velocity` or `propagated_acceleration`, after
        the channels of the scene. It is the scene's channel of that quantity, with the gain and the delay of the way
        from the contact to the place.
Model   A wave leaves the edge of the contact, at the radius R, and passes the place at the distance r:
            amplitude (r / R)^-g, after the time (r - R) / c; within R nothing changes.
        g is lowest at 225 Hz and larger by 0.2 away from it (`voice.skin_wave` has the whole gain).
        At the nail, motion below 50 Hz is that of the contact: the fingertip moves nearly as one body. The skin and the
        wrist have no such part.
        The power of the distance is the only attenuation. It was measured on skin, so it includes the spreading of the
        wave. TouchSim's factor asin(R / r) / asin(1), which is the spreading alone, is therefore left out.
Source  Power law, its lowest exponent, and c = 7 m/s: Manfredi et al. (2012), doi 10.1371/journal.pone.0031203. g of
        1.1 at best and 1.3 elsewhere is one reading of the two exponents of its figure 3: unverified default.
        TouchSim, which also counts the delay from R: Saal et al. (2017), doi 10.1073/pnas.1704856114. 8 mm beside the
        contact: Sofia & Jones (2013), who find waves markedly weaker there. Other distances, 50 Hz and the shapes over
        frequency are unverified defaults.
Limits  The speed is that of high frequencies at every frequency; waves of low frequencies are slower. No reflections,
        no bone, no joints: the wrist is the surface of a long finger. R does not follow the load. A constant scan of
        the contact is exact. Otherwise a filter makes the channel; the channel's error includes that of the filter.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field

from synth.effects.effect import OutputEffect, Price
from synth.errors import Fault, SceneError
from synth.scene.finger_section import KINDS
from synth.scene.quantity import Dimension
from synth.scene.rules import Choice, Quantity
from synth.scene.scene import Scene
from synth.scene.section import Section

if TYPE_CHECKING:
    from synth.plan.preparation import Preparation
    from synth.response_cache import ResponseCache
    from synth.voice.propagated_motion import PropagatedStage

ADDED = "propagated_"
UNITS = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s^2"}
QUANTITIES = tuple(UNITS)
PLACES: Mapping[str, tuple[float, float]] = {"nail": (15e-3, 50.0), "skin": (8e-3, 0.0), "wrist": (0.17, 0.0)}
"""Distance from the middle of the contact (m), and frequency (Hz) below which the place moves with the contact. A lower
frequency at the nail would let slow textures reach it as waves only."""


class PropagationSettings(Section):
    """The place, the way to it, and the channel."""

    place: Annotated[Literal["nail", "skin", "wrist"], Choice(tuple(PLACES))] = Field(
        default="nail", description="Where the motion is measured: on the nail, beside the contact, or at the wrist."
    )
    distance: Annotated[float | None, Quantity(Dimension.LENGTH, 0.0, 0.5)] = Field(
        default=None,
        description="Distance r along the skin from the middle of the contact; null: 15 mm for the nail, 8 mm for the "
        "skin, 170 mm for the wrist (unverified default).",
    )
    contact_radius: Annotated[float | None, Quantity(Dimension.LENGTH, 1e-6, 0.1)] = Field(
        default=None, description="Radius R of the contact; null: half of finger.contact_length."
    )
    wave_speed: Annotated[float, Quantity(Dimension.SPEED, 0.5, 100.0)] = Field(
        default=7.0, description="Speed c of the wave."
    )
    exponent: Annotated[float, Quantity(Dimension.NONE, 0.0, 4.0)] = Field(
        default=1.1,
        description="Power g of the distance at 225 Hz; it is larger by 0.2 away from there (unverified default).",
    )
    quantity: Annotated[Literal["displacement", "velocity", "acceleration"] | None, Choice(QUANTITIES)] = Field(
        default=None, description="Channel of the scene that is propagated; null: the first that is one of these."
    )
    full_scale: Annotated[float | None, Quantity(Dimension.NONE, 1e-24, 1e9)] = Field(
        default=None,
        description="Value, in the SI unit of the channel, that a sample of 1.0 stands for; null: the steady peak "
        "becomes 0.8.",
    )


class Propagation(OutputEffect["Preparation"]):
    """The effect; see the module."""

    name = "propagation"
    summary = "The motion at the nail, beside the contact or at the wrist, as an additional channel."
    settings = PropagationSettings
    without_auto = (
        'It adds a channel and changes no other, so "auto" has no difference to measure. Write {} or leave it out.'
    )
    units: Mapping[str, str] = MappingProxyType({ADDED + quantity: unit for quantity, unit in UNITS.items()})
    fingers = tuple(KINDS)
    price = Price(94.0, 4_000_000)

    def reason(self, scene: Scene, settings: PropagationSettings) -> str:
        """See `Effect`."""
        distance, radius, quantity = distance_of(settings), radius_of(scene, settings), source_of(scene, settings)
        where = {"nail": "at the nail", "skin": "on the skin beside the contact", "wrist": "at the wrist"}
        text = f"The {quantity} {where[settings.place]} is an additional channel, {1e3 * distance:.4g} mm from the "
        if distance <= radius:
            return f"{text}middle of the contact and within its radius of {1e3 * radius:.4g} mm: that of the contact."
        late = 1e3 * (distance - radius) / settings.wave_speed
        return f"{text}middle of the contact: waves arrive {late:.3g} ms later and weaker."

    def channels(self, scene: Scene, settings: PropagationSettings) -> tuple[str, ...]:
        """See `OutputEffect`."""
        return (ADDED + source_of(scene, settings),)

    def scales(self, settings: PropagationSettings) -> tuple[float | None, ...]:
        """See `OutputEffect`."""
        return (settings.full_scale,)

    def scaled(self, settings: PropagationSettings, full_scale: tuple[float | None, ...]) -> PropagationSettings:
        """See `OutputEffect`."""
        return settings.model_copy(update={"full_scale": full_scale[0]})

    def prepare(self, solved: Preparation, settings: PropagationSettings, cache: ResponseCache) -> PropagatedStage:
        """See `OutputEffect`."""
        from synth.voice.propagated_motion import PropagatedStage
        from synth.voice.skin_wave import SkinWave

        source = source_of(solved.scene, settings)
        _distance, body = PLACES[settings.place]
        distance, radius = distance_of(settings), radius_of(solved.scene, settings)
        way = SkinWave.of(distance, radius, settings.wave_speed, settings.exponent, body)
        return PropagatedStage.of(solved, ADDED + source, source, way, settings.full_scale, cache)


def distance_of(settings: PropagationSettings) -> float:
    """Return the distance (m) of the place from the middle of the contact."""
    return PLACES[settings.place][0] if settings.distance is None else settings.distance


def radius_of(scene: Scene, settings: PropagationSettings) -> float:
    """Return the radius (m) of the contact."""
    return 0.5 * scene.finger.contact_length if settings.contact_radius is None else settings.contact_radius


def source_of(scene: Scene, settings: PropagationSettings) -> str:
    """Return the quantity of the channel that is propagated. Raises SceneError if the scene has no such channel."""
    listed = [channel.quantity for channel in scene.output.channel_list if channel.quantity in QUANTITIES]
    if listed and settings.quantity in (None, *listed):
        return str(settings.quantity or listed[0])
    missing = settings.quantity or "displacement, velocity or acceleration"
    allowed = f"one of the scene's channels: {', '.join(listed)}" if listed else "a scene with a channel of motion"
    hint = f"Add {missing} to output.channels" + (", or leave the quantity out." if listed else ".")
    raise SceneError([Fault("/effects/propagation/quantity", str(settings.quantity or "null"), allowed, hint)])


EFFECT = Propagation()
