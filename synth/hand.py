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
    kept = [None if channel.extent == 0.0 else channel.full_scale for channel in solved.channels]
    listed = solved.scene.output.channel_list
    scales = tuple(asked.full_scale or scale for asked, scale in zip(listed, kept, strict=True))
    if None not in scales:
        return solved
    hand = prepare_hand(solved.scene, scales, cache)
    pairs = zip(solved.channels, hand.channels, strict=True)
    return replace(solved, channels=tuple(replace(now, full_scale=then.full_scale) for now, then in pairs))


def with_full_scale(scene: Scene, full_scale: tuple[float | None, ...]) -> Scene:
    """Return `scene` with the full scale of each channel."""
    listed = zip(scene.output.channel_list, full_scale, strict=True)
    channels = tuple(Channel.model_construct(quantity=channel.quantity, full_scale=value) for channel, value in listed)
    output = scene.output.model_copy(update={"channels": channels})
    return scene.model_copy(update={"output": output})


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
