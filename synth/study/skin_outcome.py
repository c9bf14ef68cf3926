"""What the skin feels of one steady scene: the pressure of its contact at every place and phase, and the receptors.

Stage   STUDY.
Model   The pressure along x is k / (L W) max(h - z, 0) at each phase of a texture period. Of a fingertip it is the mean
        over the width W0, across the scan. `perception.skin` has the rest.
Source  Fagiani & Barbieri (2016), eqs 1, 2, 4.
Limits  A steady scan on a texture along a line, quasi-static: effects that are simulated are refused. Places and phases
        leave some 0.1 dB. Of a scan so slow that more than MOST_PHASES / 2 harmonics are in the band, the rest is left
        out.
"""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from synth.arrays import Array
from synth.contact.finger_columns import areas_above
from synth.contact.scene_contact import contact_of
from synth.effects.effect import Kind
from synth.errors import Fault, SceneError
from synth.perception.skin import harmonics_over_phase, intensity, pattern_felt, spatial_variation, vibration_felt
from synth.plan.contact_picture import surfaces_of
from synth.plan.effect_choice import asked
from synth.plan.request import harmonics_in_band
from synth.scene.scene import Scene
from synth.study.steady_outcome import outcome_of

if TYPE_CHECKING:
    from synth.contact.fingertip import FingertipContact

PHASES, MOST_PHASES, A_HARMONIC = 256, 4096, 4  # of a period; for each harmonic in the band
SAMPLES, FEWEST = 32, 8  # places per period of the shorter surface; fewer than FEWEST are refused
PARTS = 4  # of a place, of which the mean is taken: a patch may be narrow
MOST_CELLS = 1 << 23  # places times phases, 64 MB
FELT_BY = {(True, True): "vibration and spatial pattern", (True, False): "vibration", (False, True): "spatial pattern"}


def skin_felt(scene: Scene) -> dict[str, Any]:
    """Return what is felt of `scene`: the whole finger's level, each receptor class, intensity, and by what it is felt.

    Raises SceneError for a scan that is not steady, a texture over an area, effects that are simulated, and where more
    than MOST_CELLS would be needed.
    """
    for effect, _settings, _auto in (*asked(scene, Kind.MOTION), *asked(scene, Kind.BALANCE)):
        name = effect.name
        hint = "Leave it out: the pressure of each place is that of eq. 1."
        raise SceneError([Fault(f"/effects/{name}", "set", "no effect that is simulated", hint)])
    count = phases_of(scene)
    places, pressure = pressure_of(scene, count)
    whole = float(outcome_of(scene, count, 1)["sensation_level"])
    series = harmonics_over_phase(pressure, count // 2 - 1)
    highest = len(series) - 1
    if scene.scan.speed != 0.0:
        highest = harmonics_in_band(scene, highest)
    spacing = float(places[1] - places[0])
    moved = vibration_felt(series[: highest + 1], spacing, abs(scene.scan.speed) / scene.texture.period)
    pattern = pattern_felt(series, places, scene.texture.period, abs(scene.scan.speed))
    vibrates = any(one.level is not None and one.level > 0.0 for one in moved)
    spatial = pattern.level is not None and pattern.level > 0.0
    return {
        "whole_finger_level": None if math.isnan(whole) else whole,
        "receptors": [asdict(one) for one in (pattern, *moved)],
        "pacinian_power": moved[-1].power,
        "intensity": intensity(moved),
        "spatial_variation": spatial_variation(pattern),
        "felt_by": FELT_BY.get((vibrates, spatial), "nothing"),
    }


def levels_of(scene: Scene) -> dict[str, float]:
    """Return the variables of a study that `skin_felt` has; NaN dB where nothing moves."""
    felt = skin_felt(scene)
    found = {f"{one['receptor'].lower()}_level": one["level"] for one in felt["receptors"]}
    levels = {name: math.nan if level is None else float(level) for name, level in found.items()}
    drives = {f"{one['receptor'].lower()}_drive": one["drive"] for one in felt["receptors"]}
    components = max(one["components"] for one in felt["receptors"][1:])
    told = {name: felt[name] for name in ("intensity", "spatial_variation", "pacinian_power")}
    return levels | drives | told | {"components": components}


def phases_of(scene: Scene) -> int:
    """Return the number of phases: a power of two, A_HARMONIC for each harmonic in the band, MOST_PHASES at most."""
    if scene.scan.speed == 0.0:
        return PHASES
    in_band = harmonics_in_band(scene, MOST_PHASES // A_HARMONIC)
    return max(PHASES, 1 << (A_HARMONIC * in_band - 1).bit_length())


def pressure_of(scene: Scene, phases: int) -> tuple[Array, Array]:
    """Return places along the finger (m), and the pressure there at each phase of a period, Pa [phases, places].

    Raises SceneError for a texture over an area, and where more than MOST_CELLS would be needed.
    """
    contact, load = contact_of(scene), max(scene.scan.load, 0.0)
    if contact.geometry.over_area:
        hint = "Choose a texture along a line, such as corduroy-14-wale or copy-paper."
        raise SceneError([Fault("/texture", scene.texture.kind, "a texture that does not vary across", hint)])
    for effect, settings, _auto in asked(scene, Kind.SHAPE):
        shape: Any = effect
        contact = shape.shaped(contact, settings).covering(load)
    turns = np.arange(phases) / phases
    if load == 0.0 or contact.geometry.height_scale == 0.0:
        return np.linspace(0.0, contact.geometry.contact_length, 64), np.zeros((phases, 64))
    surfaces, tip = None, cast("FingertipContact", contact)
    if contact.of_one_line:
        surfaces = surfaces_of(contact, contact.geometry_at(load).contact_length)
        begin, length, shortest = surfaces.begin, surfaces.length, surfaces.shortest
    else:
        length, shortest = tip.surface.footprint.reach[0], tip.surface.field.period
        begin = -0.5 * length
        if contact.geometry.equivalent[0] > 0.0:
            shortest = min(shortest, contact.geometry.equivalent[1])
    count = _count_of(length / shortest, phases)
    x = begin + length * (np.arange(count) + 0.5) / count  # midpoints: the contact may end abruptly
    z = contact.approach(turns, load)[0]
    foundation = contact.stiffness_at(load) / (contact.geometry_at(load).contact_length * contact.width_at(load))
    if surfaces is None:
        texture = contact.geometry.texture(x - turns[:, np.newaxis] * contact.geometry.texture_period)
        areas = areas_above(tip.surface, x, z[:, np.newaxis] - texture)
        return x, areas * (foundation / tip.surface.footprint.width)
    edges, pressure = begin + length * np.arange(PARTS * count + 1) / (PARTS * count), np.zeros((phases, count))
    together = max(1, MOST_CELLS // (2 * len(edges)))
    for begun in range(0, phases, together):
        some = slice(begun, begun + together)
        gap = surfaces.overlap(edges, turns[some, np.newaxis], z[some, np.newaxis])
        parts = _mean_above(gap[:, :-1], gap[:, 1:])
        pressure[some] = foundation * np.mean(parts.reshape(len(parts), count, PARTS), axis=2)
    return x, pressure


def _mean_above(left: Array, right: Array) -> Array:
    """Return the mean of max(g, 0) between places where g is `left` and `right`, g being straight between them."""
    low, high = np.maximum(left, 0.0), np.maximum(right, 0.0)
    whole, distance = low + high, np.abs(right - left)
    part = np.divide(whole, distance, out=np.ones_like(whole), where=distance > whole)  # of the length that touches
    return np.asarray(0.5 * whole * part)


def _count_of(periods: float, phases: int) -> int:
    """Return the number of places for `periods` of the shorter surface; raises SceneError where they are too many."""
    most = MOST_CELLS // phases
    if FEWEST * periods > most:
        told = f"{periods:.4g} periods of the finer surface under the finger"
        allowed = f"at most {most // FEWEST} where a period of the texture takes {phases} phases"
        hint = "Choose a shorter contact, a longer period, a faster scan, or a smaller output.bandwidth."
        raise SceneError([Fault("/texture", told, allowed, hint)])
    return min(max(math.ceil(SAMPLES * periods), 2), most)
