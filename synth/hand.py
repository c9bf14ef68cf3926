"""A scene in a hand: what is prepared where neither speed nor load is known beforehand.

Stage   2, for hands and for streams.
Model   A hand is prepared for round a nominal scan, which also sets an automatic full scale: the scene's own speed and
        load, or usual ones where those would be silent.
Source  HAND_SPEED, HAND_LOAD and HAND_AMPLITUDE are the defaults of a scene (design, section 4).
Limits  rows of load hold 4 times the harmonics that the nominal speed lets through: a hand slower than a quarter of it
        sounds duller than the texture is.
"""

from __future__ import annotations

from dataclasses import replace

from synth.cache import ResponseCache
from synth.effect_choice import outputs_of, with_added_scales
from synth.preparation import Preparation, band_limit, prepare
from synth.scene import Channel, Scene

HAND_SPEED, HAND_LOAD = 0.08, 0.3  # m/s and N of a usual hand
HAND_BAND = 0.1  # of the band: where a usual hand's fundamental lies at most, so that a fine texture is heard
HAND_AMPLITUDE = 20e-6  # m: for the full scale of a stream that begins with a texture of no height


def prepare_hand(scene: Scene, full_scale: tuple[float | None, ...], cache: ResponseCache | None = None) -> Preparation:
    """Return `scene` solved for a hand: any speed, any load.

    full_scale: of each channel; None: chosen so that the nominal scan peaks at 0.8.
    """
    return prepare(with_full_scale(nominal_scene(scene), full_scale), cache, by_hand=True)


def with_session_scale(solved: Preparation, cache: ResponseCache | None = None) -> Preparation:
    """Return `solved` with the full scale of what is silent now taken from a usual hand: it may sound later."""
    kept = [None if channel.extent == 0.0 else channel.full_scale for channel in solved.all_channels]
    scales = tuple(asked or scale for asked, scale in zip(asked_scales(solved.scene), kept, strict=True))
    if None not in scales:
        return solved
    hand = prepare_hand(solved.scene, scales, cache)
    pairs = zip(solved.channels, hand.channels, strict=True)
    channels = tuple(replace(now, full_scale=then.full_scale) for now, then in pairs)
    if solved.effects is None or hand.effects is None:
        return replace(solved, channels=channels)
    return replace(solved, channels=channels, effects=solved.effects.scaled_as(hand.effects))


def asked_scales(scene: Scene) -> tuple[float | None, ...]:
    """Return the full scale that `scene` asks for of each channel, those that its effects add included."""
    added = (scale for effect, settings in outputs_of(scene) for scale in effect.scales(settings))
    return (*(channel.full_scale for channel in scene.output.channel_list), *added)


def with_full_scale(scene: Scene, full_scale: tuple[float | None, ...]) -> Scene:
    """Return `scene` with the full scale of each channel, those that its effects add included."""
    own = len(scene.output.channel_list)
    listed = zip(scene.output.channel_list, full_scale[:own], strict=True)
    channels = tuple(Channel.model_construct(quantity=channel.quantity, full_scale=value) for channel, value in listed)
    output = scene.output.model_copy(update={"channels": channels})
    changed = scene.model_copy(update={"output": output})
    return with_added_scales(changed, full_scale[own:]) if full_scale[own:] else changed


def nominal_scene(scene: Scene) -> Scene:
    """Return `scene` with the constant scan of a usual hand on it: its own speed and load, unless they are silent."""
    scan, texture = scene.scan, scene.texture
    limit = band_limit(scene)
    speed = abs(scan.speed)
    if speed == 0.0 or speed / texture.period >= limit:
        speed = min(HAND_SPEED, HAND_BAND * limit * texture.period)
    update = {"speed": speed, "load": scan.load or HAND_LOAD, "stroke": None, "trajectory": None}
    found = texture if texture.amplitude else texture.model_copy(update={"amplitude": HAND_AMPLITUDE})
    return scene.model_copy(update={"scan": scan.model_copy(update=update), "texture": found})
