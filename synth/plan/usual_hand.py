"""Prepare a scene for a hand, whose speed and load are not known in advance.

Stage   2, for hands and for streams.
Model   A hand is prepared with a nominal scan: the scene's own speed and load, or usual ones if those would be silent.
        Automatic full scale of a stream without a hand: that of its first scene.
        Automatic full scale of a hand: the peak is PEAK at the loudest of the usual loads and speeds (`usual_peaks`),
        or at the scene's own scan if that is louder. A hand within these loads and speeds is not limited. Lighter
        loads, which occur when a finger lands or lifts, count only at speeds up to the scene's own.
        If a simulation replaces the response, its peak is raised by the same ratio as that of the response. The peak of
        a force is raised in proportion to the load.
Source  HAND_LOADS: the loads at which roughness is usefully perceived (Fagiani & Barbieri, 2016, section 2).
        HAND_SPEEDS: unverified default. HAND_SPEED, HAND_LOAD, HAND_AMPLITUDE: the defaults of a scene (design,
        section 4).
Limits  If a hand is so slow that the band contains more harmonics than the table, the sound is too dull.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from functools import partial

import numpy as np

from synth.contact.load_balance import Contact
from synth.contact.scene_contact import contact_of
from synth.kept_files import json_form
from synth.plan.channels import PEAK
from synth.plan.direct_plan import follows_path
from synth.plan.effect_choice import outputs_of, refused_by_hand, with_added_scales
from synth.plan.preparation import Preparation
from synth.plan.prepare import prepare
from synth.plan.request import HAND_LOADS, HAND_SPEEDS, harmonics_below
from synth.plan.scene_table import entry_of
from synth.response.demand import Complex, curves, harmonics_of, points_for
from synth.response.reading_filter import SOLUTIONS
from synth.response_cache import SHARED, ResponseCache
from synth.scene.output_section import Channel
from synth.scene.scene import Scene

HAND_SPEED, HAND_LOAD = 0.08, 0.3  # m/s and N of a usual hand
# Numbers of loads, landing loads and speeds whose peaks are computed. With more, opening takes longer (4 ms per load).
PROBED_LOADS, PROBED_LANDINGS, PROBED_SPEEDS = 12, 5, 9
PROBED_ON_STRETCH = 1, 3  # of a long surface or an area, whose levels vary from place to place
FEWEST_POINTS = 512  # of a period: of 72 levels of the catalogue one is off by 5 %, the others by 3 % at most
MOVING_BAND = 0.49 / 0.40  # of the band: mip levels fade from the band to 1.4 times it, which is as loud as this edge
MOST_HARMONICS = 1024  # of the series of those peaks: slow hands on coarse textures have more and are not the loudest
OF_APPROACH = 3  # index of the approach among the peaks, after the three orders
HAND_BAND = 0.1  # largest fundamental of a usual hand, as a part of the band, so that a fine texture is heard
HAND_AMPLITUDE = 20e-6  # m, for the full scale of a stream that begins with a texture without height


@dataclass(frozen=True, slots=True)
class UsualPeaks:
    """Peaks of displacement, velocity, acceleration and approach (SI).

    usual: over the usual loads and speeds of a hand.
    own: at the scene's own scan.
    """

    usual: tuple[float, ...]
    own: tuple[float, ...]


PEAKS_FORM = json_form(asdict, lambda fields: UsualPeaks(tuple(fields["usual"]), tuple(fields["own"])))


def prepare_hand(
    scene: Scene, full_scale: tuple[float | None, ...], cache: ResponseCache | None = None, *, exact: bool = False
) -> Preparation:
    """Return `scene` solved for any speed and load of a hand.

    full_scale: full scale of each channel, SI. None: chosen so that the peak of the nominal scan is 0.8.
    exact: as of `prepare`.
    """
    return prepare(with_full_scale(nominal_scene(scene), full_scale), cache, by_hand=True, exact=exact)


def with_stream_scale(solved: Preparation, cache: ResponseCache | None = None) -> Preparation:
    """Return `solved` with full scales that a stream can keep.

    A silent channel gets the full scale of a usual hand, because it may sound later. Where effects allow no hand, that
    is a hand whose speed and load are constant.
    """
    kept = [None if channel.extent == 0.0 else channel.full_scale for channel in solved.all_channels]
    known = tuple(one or scale for one, scale in zip(asked_scales(solved.scene), kept, strict=True))
    if None not in known:
        return solved
    nominal, no_hand = with_full_scale(nominal_scene(solved.scene), known), refused_by_hand(solved.scene) is not None
    hand, effects = prepare(nominal, cache, by_hand=not no_hand, paced=no_hand), solved.effects
    pairs = zip(solved.channels, hand.channels, strict=True)
    channels = tuple(replace(now, full_scale=then.full_scale) for now, then in pairs)
    if effects is not None and hand.effects is not None:
        effects = effects.scaled_as(hand.effects)
    return replace(solved, channels=channels, effects=effects)


def with_hand_scale(solved: Preparation, cache: ResponseCache | None = None) -> Preparation:
    """Return `solved` with automatic full scales for the usual loads and speeds of a hand."""
    solved, asked = with_stream_scale(solved, cache), asked_scales(solved.scene)
    if None not in asked:
        return solved
    scene = nominal_scene(solved.scene)
    peaks = usual_peaks(scene, solved.contact, cache or SHARED)
    channels, moved, effects = [], [], solved.effects
    for channel, scale in zip(solved.channels, asked, strict=False):
        place, room = OF_APPROACH if channel.is_approach else channel.order, channel.full_scale
        moved.append(peaks.usual[place] / peaks.own[place] if peaks.own[place] > 0.0 else 1.0)
        if scale is None and solved.simulated:
            room *= moved[-1]
        elif scale is None:
            room = max(room, peaks.usual[place] / PEAK)
        channels.append(replace(channel, full_scale=room))
    if effects is not None and None in asked[len(channels) :]:
        pressed = max(1.0, HAND_LOADS[1] / max(scene.scan.load, scene.scan.lift_load))
        effects = effects.louder(pressed, tuple(moved))
    return replace(solved, channels=tuple(channels), effects=effects)


def usual_peaks(scene: Scene, contact: Contact | None, cache: ResponseCache) -> UsualPeaks:
    """Return the peaks over the usual loads and speeds of a hand.

    scene: a scene with a constant scan.
    contact: contact in the shape that the scene's effects give it; None for the contact without effects.
    """
    solver = contact or contact_of(scene)
    own, speed = max(scene.scan.load, scene.scan.lift_load), scene.scan.speed
    period, limit = solver.geometry.texture_period, MOVING_BAND * scene.output.band_limit
    long = period != scene.texture.period or follows_path(scene)
    landings, probed = PROBED_ON_STRETCH if long else (PROBED_LANDINGS, PROBED_LOADS)
    landing = np.geomspace(min(scene.scan.lift_load, HAND_LOADS[0]), HAND_LOADS[0], landings, endpoint=False)
    usual = np.geomspace(min(HAND_LOADS[0], own), max(HAND_LOADS[1], own), probed)
    loads = [own, *landing.tolist(), *usual.tolist()]
    speeds = np.array([speed, *np.geomspace(HAND_SPEEDS[0], max(HAND_SPEEDS[1], speed), PROBED_SPEEDS)])
    counts = [harmonics_below(float(one) / period, limit, MOST_HARMONICS) for one in speeds]
    key = ("usual peaks", solver.key, tuple(loads), tuple(speeds.tolist()), limit)

    def found() -> UsualPeaks:
        """Solve a series of z at each load, and take its peaks at each speed."""
        points = max(FEWEST_POINTS, math.ceil(SOLUTIONS * limit * period / np.max(speeds)))
        every = [_series(solver, load, points, max(*counts, 1)) for load in loads]
        peaks = np.array([
            [_peaks(series[: count + 1], one / period) for one, count in zip(speeds, counts, strict=True)]
            for series in every
        ])  # fmt: skip
        peaks[1 : 1 + len(landing), speeds > speed] = 0.0
        return UsualPeaks(tuple(np.max(peaks, axis=(0, 1)).tolist()), tuple(peaks[0, 0].tolist()))

    return cache.get(key, found, partial(entry_of, scene, solver, key[2:], PEAKS_FORM))


def _series(contact: Contact, load: float, points: int, highest: int) -> Complex:
    """Return the harmonics of z at `load` (N) from `points` solutions per period."""
    return harmonics_of(contact.heights(np.arange(points) / points, np.full(points, load)), highest)


def _peaks(series: Complex, turns: float) -> list[float]:
    """Return the peaks of z minus its mean, of its two time derivatives, and of z, at `turns` periods per second."""
    level = abs(float(series[0].real))
    if len(series) < 2:
        return [0.0, 0.0, 0.0, level]
    points = points_for(len(series) - 1)
    found = [float(np.max(np.abs(curves(series, order, points)))) * turns**order for order in range(3)]
    return [*found, level + found[0]]


def asked_scales(scene: Scene) -> tuple[float | None, ...]:
    """Return the full scale that `scene` sets for each channel, including those that its effects add."""
    added = (scale for effect, settings in outputs_of(scene) for scale in effect.scales(settings))
    return (*(channel.full_scale for channel in scene.output.channel_list), *added)


def with_full_scale(scene: Scene, full_scale: tuple[float | None, ...]) -> Scene:
    """Return `scene` with the full scale of each channel set, including those that its effects add."""
    own = len(scene.output.channel_list)
    listed = zip(scene.output.channel_list, full_scale[:own], strict=True)
    channels = tuple(Channel.model_construct(quantity=channel.quantity, full_scale=value) for channel, value in listed)
    output = scene.output.model_copy(update={"channels": channels})
    changed = scene.model_copy(update={"output": output})
    return with_added_scales(changed, full_scale[own:]) if full_scale[own:] else changed


def nominal_scene(scene: Scene) -> Scene:
    """Return `scene` with a constant scan for a hand: its own speed and load, or usual ones if those are silent."""
    scan, texture = scene.scan, scene.texture
    limit = scene.output.band_limit
    speed = abs(scan.speed)
    if speed == 0.0 or speed / texture.period >= limit:
        speed = min(HAND_SPEED, HAND_BAND * limit * texture.period)
    update = {"speed": speed, "load": scan.load or HAND_LOAD, "stroke": None, "trajectory": None, "heading": 0.0}
    found = texture if texture.amplitude else texture.model_copy(update={"amplitude": HAND_AMPLITUDE})
    return scene.model_copy(update={"scan": scan.model_copy(update=update), "texture": found})
