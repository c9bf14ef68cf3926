"""Patches and pressures of a steady contact, at some phases of a period.

Stage   STUDY.
Model   Along a line h - z is sampled at SAMPLES a period of the shorter of both surfaces. A patch is a run of samples
        above 0. The pressure is k / (L W) times h - z; the largest is that of the highest sample. Of a fingertip on a
        texture along a line, the highest place across the scan is taken at each x.
Source  Fagiani & Barbieri (2016), eqs 1 and 4.
Limits  A patch narrower than the distance of samples is missed. Over an area, and where there would be more than
        MOST_SAMPLES, both numbers are unknown; so is the number of patches of a fingertip.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.contact.load_balance import Contact
from synth.plan.contact_picture import Surfaces, surfaces_of

SAMPLES, MOST_SAMPLES = 64, 1 << 14  # per period of the shorter surface; over the contact
PHASES = 64  # at which they are taken


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
