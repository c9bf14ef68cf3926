"""The numbers that a study records of one steady scene.

Stage   STUDY.
Model   z is solved at equal phases of a texture period (eq. 1). Its series gives rms, peak, lines and centroid of each
        quantity, in the band of the scene at its speed. At rest every harmonic that the phases resolve counts, and
        only displacement moves. The error of a quantity is that of the series (`response.series_error`), and the
        change from a solver half as fine where it has segments, columns or cells.
        Along a line h - z is sampled at SAMPLES a period of the shorter of both surfaces. A patch is a run of samples
        above 0. The pressure is k / (L W) times h - z; the largest is that of the highest sample. Of a fingertip on a
        texture along a line, the highest place across the scan is taken at each x.
Source  Fagiani & Barbieri (2016), eqs 1 to 7.
Limits  The number of phases is given, so the error is told, not bought. The lines are those of displacement over the
        place p of the texture: amplitude cos(2 pi n p / period + phase). A patch narrower than the distance of samples
        is missed. Over an area, and where there would be more than MOST_SAMPLES, patches and pressure are unknown; so
        is the number of patches of a fingertip.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.contact.geometry import Geometry
from synth.contact.groups import Groups
from synth.contact.load_balance import Contact
from synth.contact.scene_contact import contact_of
from synth.effects.effect import Kind
from synth.errors import Fault, SceneError
from synth.plan.contact_picture import Surfaces, surfaces_of
from synth.plan.effect_choice import asked, outputs_of
from synth.plan.effects_preparation import shape_for
from synth.plan.request import harmonics_in_band
from synth.response.demand import Demand, curves, harmonics_of, points_for
from synth.response.lift_gate import gate
from synth.response.series_error import series_errors
from synth.scene.scene import Scene
from synth.study.series_outcome import ORDERS, Numbers, nothing, of_series, ratio

SAMPLES, MOST_SAMPLES = 64, 1 << 14  # per period of the shorter surface; over the contact
PHASES = 64  # at which they are taken


def outcome_of(scene: Scene, phases: int, lines: int) -> Numbers:
    """Return every variable of one scene: arrays over lines or quantities, and numbers.

    phases: solutions per period, a power of two. lines: number of lines.
    Raises SceneError for a scan that is not steady, and for a contact that cannot be solved.
    """
    scan = scene.scan
    if scan.stroke is not None or scan.trajectory is not None or scan.heading != 0.0:
        hint = "Write scan.speed and scan.load; render strokes, recordings and paths one by one."
        raise SceneError([Fault("/scan", "a scan that is not steady", "a constant speed and load", hint)])
    for effect, _settings, _auto in asked(scene, Kind.MOTION):
        hint = "Leave it out: a study is of a skin that moves with the hand."
        raise SceneError([Fault(f"/effects/{effect.name}", "set", "no effect that moves the skin", hint)])
    found = nothing(lines)
    found["fundamental"] = abs(scan.speed) / scene.texture.period
    if any(asked(scene, Kind.BALANCE)):
        from synth.study.simulated_outcome import simulated

        return found | simulated(scene, lines)
    if outputs_of(scene):
        name = outputs_of(scene)[0][0].name
        hint = "Leave it out: a study records the motion at the contact."
        raise SceneError([Fault(f"/effects/{name}", "set", "no effect that adds a channel", hint)])
    if Geometry.of_scene(scene).texture_amplitude == 0.0 or scan.load == 0.0:
        return found | of_series(np.zeros(2, complex), scene, lines)
    coarse = _shaped(scene, contact_of(scene, refines=True), phases)
    contact = coarse.halved() or coarse
    turns, load = np.arange(phases) / phases, max(scan.load, scan.lift_load)
    solved = contact.solver(load).solve(turns, contact.indentation(load))
    highest, gated = _highest(scene, phases), float(gate(scan.load, scan.lift_load))
    found |= of_series(gated * harmonics_of(solved.height, highest), scene, lines)
    found["line_amplitude"][highest : _in_band(scene, lines)] = math.nan
    other = None if contact is coarse else coarse.approach(turns, load, solved.height)[0]
    found["error"] = _errors(solved.height, other, contact.scale_at(load), highest)
    if scan.speed == 0.0:
        found["error"][1:] = 0.0  # nothing moves
    return found | _pressed(scene, contact, turns, solved.height, float(np.mean(solved.touching)), load)


def _in_band(scene: Scene, most: int) -> int:
    """Return how many of the first `most` harmonics are in the band; at rest all are."""
    return most if scene.scan.speed == 0.0 else min(harmonics_in_band(scene, most), most)


def _highest(scene: Scene, phases: int) -> int:
    """Return how many harmonics count: those in the band that the phases resolve."""
    return _in_band(scene, phases // 2 - 1)


def _shaped(scene: Scene, contact: Contact, phases: int) -> Contact:
    """Return the contact in the shape that the effects of `scene` give it."""
    if not scene.effects:
        return contact
    load, turns = max(scene.scan.load, scene.scan.lift_load), scene.scan.speed / scene.texture.period
    tolerance = scene.accuracy.tolerance if isinstance(scene.accuracy.tolerance, float) else 1e-3
    demand = Demand(max(_highest(scene, phases), 1), ORDERS, tolerance)
    return shape_for(contact, scene, demand, (load, load), turns, tolerance)[0]


def _errors(z: Array, coarse: Array | None, scale: float, highest: int) -> Array:
    """Return the error of each order, relative to its peak-to-peak.

    coarse: z of a solver half as fine, whose change is at least the error that is left; None: there is none.
    scale: of rounding errors of z, m.
    """
    if highest == 0:
        return np.zeros(len(ORDERS))
    found = np.array(series_errors(z, Demand(highest, ORDERS, 1.0), scale)[0])
    if coarse is None:
        return found
    series, points = harmonics_of(z, highest), points_for(highest)
    apart = harmonics_of(coarse, highest) - series
    extents = np.array([float(np.ptp(curves(series, order, points))) for order in ORDERS])
    changed = np.array([float(np.max(np.abs(curves(apart, order, points)))) for order in ORDERS])
    return found + np.nan_to_num(ratio(changed, extents))


def _pressed(scene: Scene, contact: Contact, turns: Array, z: Array, touching: float, load: float) -> Numbers:
    """Return the numbers of the contact: what touches, how hard, and the groups."""
    length, width = contact.geometry_at(load).contact_length, contact.width_at(load)
    spanned = contact.dome > 0.0  # a round finger is solved over a length beyond its contact
    whole = width if spanned else max(scene.finger.contact_length, touching * length)
    patches, gap = patches_and_gap(contact, turns, z, load)
    groups = Groups.of_contact(contact.geometry, contact.stiffness, load)
    numbers = (math.nan,) * 4 if groups is None else groups.numbers
    return {
        "contact_fraction": min(1.0, touching * length / whole),
        "patches": patches,
        "mean_pressure": load / (touching * length * width) if touching > 0.0 else math.nan,
        "largest_pressure": contact.stiffness_at(load) / (length * width) * gap,
        **dict(zip(("ridges", "period_ratio", "amplitude_ratio", "group_load"), numbers, strict=True)),
    }


def patches_and_gap(contact: Contact, turns: Array, heights: Array, load: float) -> tuple[float, float]:
    """Return the mean number of patches, and the largest h - z (m); NaN where they are unknown.

    turns, heights: phases of a period (turns), and z there (m).
    """
    every = max(1, len(turns) // PHASES)
    some, z = turns[::every, np.newaxis], heights[::every, np.newaxis]
    if contact.geometry.over_area:
        return math.nan, math.nan
    if not contact.of_one_line:
        tip: Any = contact
        columns = tip.surface.columns(0.0, 1.0)
        x = columns.first + columns.step * np.arange(len(columns.tops))
        texture = contact.geometry.texture(x - some * contact.geometry.texture_period)
        return math.nan, float(np.max(columns.tops + texture - z))
    surfaces = surfaces_of(contact, contact.geometry_at(load).contact_length)
    count = math.ceil(SAMPLES * surfaces.length / surfaces.shortest) + 1
    if count > MOST_SAMPLES:
        return math.nan, math.nan
    x = np.linspace(surfaces.begin, surfaces.begin + surfaces.length, count)
    gaps = surfaces.overlap(x, some, z) if contact.geometry.profile is not None else _of_cosines(surfaces, x, some, z)
    above = gaps > 0.0
    begun = np.count_nonzero(above[:, 1:] > above[:, :-1], axis=1) + above[:, 0]
    return float(np.mean(begun)), float(np.max(gaps))


def _of_cosines(surfaces: Surfaces, x: Array, turns: Array, z: Array) -> Array:
    """Return `Surfaces.overlap` of two cosines, as one product of matrices: it takes a small part of the time."""
    geometry = surfaces.geometry
    angles = 2.0 * math.pi * (x / geometry.texture_period % 1.0) + geometry.texture_phase
    turned, height = 2.0 * math.pi * turns, geometry.texture_amplitude
    rows = np.concatenate([height * np.cos(turned), height * np.sin(turned), np.ones_like(z), -z], axis=1)
    return np.asarray(rows @ np.stack([np.cos(angles), np.sin(angles), surfaces.finger(x), np.ones_like(x)]))
