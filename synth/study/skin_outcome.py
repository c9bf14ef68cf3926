"""What the skin feels of one steady scene: the pressure of its contact at every place and phase, and the receptors.

Stage   STUDY.
Model   The pressure along x is k / (L W) max(h - z, 0) at each phase of a texture period. Of a fingertip it is the mean
        over the width W0, across the scan. `perception.skin` has the rest.
Source  Fagiani & Barbieri (2016), eqs 1, 2, 4.
Limits  A steady scan on a texture along a line, quasi-static: effects that are simulated are left out.
"""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.contact.finger_columns import FingerSurface
from synth.contact.load_balance import Contact
from synth.contact.scene_contact import contact_of
from synth.effects.effect import Kind
from synth.errors import Fault, SceneError
from synth.perception.skin import harmonics_over_phase, intensity, pattern_felt, vibration_felt
from synth.plan.contact_picture import surfaces_of
from synth.plan.effect_choice import asked
from synth.plan.request import harmonics_in_band
from synth.response_cache import kept
from synth.scene.scene import Scene
from synth.study.steady_outcome import outcome_of

PHASES, SAMPLES, MOST_SAMPLES = 256, 32, 1 << 13  # of a period; per period of the shorter surface; over the contact
ROWS = 12  # a ridge, of a fingertip across the scan
FELT_BY = {(True, True): "vibration and spatial pattern", (True, False): "vibration", (False, True): "spatial pattern"}


def skin_felt(scene: Scene) -> dict[str, Any]:
    """Return what is felt of `scene`: the whole finger's level, each receptor class, intensity, and by what it is felt.

    Raises SceneError for a scan that is not steady, a texture over an area, and effects that are simulated.
    """
    if any(asked(scene, Kind.BALANCE)):
        name = next(asked(scene, Kind.BALANCE))[0].name
        hint = "Leave it out: the pressure of each place is that of eq. 1."
        raise SceneError([Fault(f"/effects/{name}", "set", "no effect that is simulated", hint)])
    known = outcome_of(scene, PHASES, 1)
    whole = float(known["sensation_level"])
    places, pressure = pressure_of(scene)
    highest = PHASES // 2 - 1
    if scene.scan.speed != 0.0:
        highest = min(highest, harmonics_in_band(scene, highest))
    series = harmonics_over_phase(pressure, highest)
    spacing = float(places[1] - places[0])
    moved = vibration_felt(series, spacing, abs(scene.scan.speed) / scene.texture.period)
    pattern = pattern_felt(harmonics_over_phase(pressure, PHASES // 2 - 1), places, scene.texture.period)
    vibrates = any(one.level is not None and one.level > 0.0 for one in moved)
    spatial = pattern.level is not None and pattern.level > 0.0
    return {
        "whole_finger_level": None if math.isnan(whole) else whole,
        "receptors": [asdict(one) for one in (pattern, *moved)],
        "pacinian_power": moved[-1].power,
        "intensity": intensity(moved),
        "felt_by": FELT_BY.get((vibrates, spatial), "nothing"),
    }


def levels_of(scene: Scene) -> dict[str, float]:
    """Return the variables of a study that `skin_felt` has; -inf dB where nothing moves."""
    felt = skin_felt(scene)
    found = {f"{one['receptor'].lower()}_level": one["level"] for one in felt["receptors"]}
    levels = {name: -math.inf if level is None else float(level) for name, level in found.items()}
    return levels | {"intensity": felt["intensity"]}


def pressure_of(scene: Scene) -> tuple[Array, Array]:
    """Return places along the finger (m), and the pressure there at each of PHASES phases of a period (Pa)."""
    contact, load = contact_of(scene), max(scene.scan.load, 0.0)
    if contact.geometry.over_area:
        hint = "Choose a texture along a line."
        raise SceneError([Fault("/texture", scene.texture.kind, "a texture that does not vary across", hint)])
    for effect, settings, _auto in asked(scene, Kind.SHAPE):
        shape: Any = effect
        contact = shape.shaped(contact, settings).covering(load)
    turns = np.arange(PHASES) / PHASES
    if load == 0.0 or contact.geometry.height_scale == 0.0:
        return np.linspace(0.0, contact.geometry.contact_length, 64), np.zeros((PHASES, 64))
    z = contact.approach(turns, load)[0]
    area = contact.geometry_at(load).contact_length * contact.width_at(load)
    return _gaps(contact, turns, z, load, contact.stiffness_at(load) / area)


def _gaps(contact: Contact, turns: Array, z: Array, load: float, foundation: float) -> tuple[Array, Array]:
    """Return places, and `foundation` times max(h - z, 0) at each phase."""
    if not contact.of_one_line:
        tip: Any = contact
        x, heights = _surface(tip.surface)
        texture, reach = contact.geometry, tip.surface.footprint
        found = np.zeros((len(turns), len(x)))
        for number, (turn, height) in enumerate(zip(turns.tolist(), z.tolist(), strict=True)):
            h = texture.texture(x - turn * texture.texture_period)
            found[number] = np.mean(np.maximum(heights + (h - height)[:, np.newaxis], 0.0), axis=1)
        return x, foundation * found * (reach.reach[1] / reach.width)
    surfaces = surfaces_of(contact, contact.geometry_at(load).contact_length)
    count = min(math.ceil(SAMPLES * surfaces.length / surfaces.shortest) + 1, MOST_SAMPLES)
    x = np.linspace(surfaces.begin, surfaces.begin + surfaces.length, count)
    return x, foundation * np.maximum(surfaces.overlap(x, turns[:, np.newaxis], z[:, np.newaxis]), 0.0)


@kept
def _surface(surface: FingerSurface) -> tuple[Array, Array]:
    """Return places along a fingertip (m from its middle), and its heights there across the scan (m)."""
    (length, width), ridge = surface.footprint.reach, surface.field.period
    x = np.linspace(-0.5 * length, 0.5 * length, math.ceil(SAMPLES * length / ridge))
    y = np.linspace(-0.5 * width, 0.5 * width, math.ceil(ROWS * width / ridge))
    return x, np.asarray(surface.heights(x, y))
