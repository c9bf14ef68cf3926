"""A stretch of a long surface, made periodic: levels and errors of the whole surface are estimated on it.

Stage   2 (PLAN). What is rendered always comes from the whole surface (`direct_reader`, `frame_solver`).
Model   A surface is long where its period has more harmonics in the band than a series may have. Its stretch is a piece
        of it that is LENGTH long, or LENGTHS contact lengths if that is longer. Of all such pieces it is the one with
        the largest rms slope, so that an automatic full scale allows for all of them. A straight line is subtracted.
        Over one contact length the end is cross-faded to the heights before the beginning. The stretch then repeats
        without a step, and `response.spectrum` solves it like any texture.
Limits  Waves longer than the stretch are not in its levels; the peaks of displacement and approach also allow for
        places of the whole surface. Smooth surfaces, with fewer than SMOOTH waves in a stretch, have few harmonics that
        matter and need no stretch. A height field has no stretch.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from synth.contact.geometry import Geometry
from synth.contact.load_balance import Contact
from synth.contact.profile_solver import evenly_spaced
from synth.response_cache import kept
from synth.scene.scene import Scene
from synth.surfaces import profile_of
from synth.surfaces.grooves import Grooves
from synth.surfaces.measured import MeasuredProfile
from synth.surfaces.profile import Array, Profile

LENGTH, LENGTHS = 50e-3, 4.0  # m, and contact lengths: a shorter stretch has fewer lines, a longer one takes longer
FEWEST_STRETCHES = 2.0  # stretches in a period; a shorter period needs no stretch
SMOOTH = 4.0  # waves of the equivalent sinusoid in a stretch; with fewer the stretch does not show them
POINTS = 1 << 14  # heights of a stretch of a surface that is not given as heights: 3 um apart
MOST_SEGMENTS = 1 << 22  # of a whole surface, 134 MB; a surface with more heights has one segment per height


@dataclass(frozen=True, slots=True)
class Stretch:
    """A stretch of a surface.

    begin: where it begins, m.
    profile: the periodic profile that is made of it.
    """

    begin: float
    profile: Profile

    @property
    def period(self) -> float:
        """Its length, m."""
        return self.profile.period


def stretch_of(scene: Scene, harmonics: int, most: int) -> Stretch | None:
    """Return the stretch on which the levels of `scene` are estimated; None: its own period.

    harmonics: number of harmonics in the band.
    most: largest number of harmonics of a series.
    """
    length = max(LENGTH, LENGTHS * scene.finger.contact_length)
    if harmonics <= most or scene.texture.period < FEWEST_STRETCHES * length:
        return None
    profile = profile_of(scene)
    profile = profile.profile if isinstance(profile, Grooves) else profile
    if profile.of_area or profile.cosine is not None or SMOOTH * profile.equivalent().period > length:
        return None
    return _roughest(profile, length, scene.finger.contact_length)


@kept
def _roughest(profile: Profile, length: float, overlap: float) -> Stretch:
    """Return the stretch of `length` (m) with the largest rms slope; overlap: of its ends, m."""
    spaced = evenly_spaced(profile)
    count = len(profile.corners) if spaced else math.ceil(POINTS * profile.period / length)
    first, spacing = float(profile.corners[0]) if spaced else 0.0, profile.period / count
    heights = profile.heights(np.asarray(first + spacing * np.arange(count)))
    points, faded = round(length / spacing), max(1, round(overlap / spacing))
    whole = count // points
    squares = np.diff(heights[: whole * points], append=heights[:1]) ** 2
    begin = int(np.argmax(squares.reshape(whole, points).sum(axis=1))) * points
    return Stretch(first + spacing * begin, _repeating(heights, begin, points, faded, spacing))


def _repeating(heights: Array, begin: int, points: int, faded: int, spacing: float) -> Profile:
    """Return `points` of `heights` from `begin` on as a period; `faded`: number of points over which its ends fade."""
    run = heights[np.arange(begin - faded, begin + points) % len(heights)]
    rise = (np.mean(run[points:]) - np.mean(run[:faded])) / points
    run = run - rise * np.arange(len(run))
    own, before = run[faded:], run[:faded]
    part = (np.arange(faded) + 1.0) / (faded + 1.0)
    part = part * part * (3.0 - 2.0 * part)
    kept = own.copy()
    kept[points - faded :] = (1.0 - part) * own[points - faded :] + part * before
    return MeasuredProfile(kept - np.mean(kept), spacing)


def on_whole(contact: Contact, scene: Scene) -> Contact:
    """Return `contact`, of a stretch, on the whole surface of `scene`, with segments of about the same length."""
    geometry, segments = Geometry.of_scene(scene), getattr(contact.grid, "segments", None)
    if segments is not None:
        assert geometry.profile is not None
        corners = max(1, len(geometry.profile.corners))
        wanted = min(segments * geometry.texture_period / contact.geometry.texture_period, MOST_SEGMENTS)
        geometry = replace(geometry, segments=corners * max(1, round(wanted / corners)))
    return contact.on(geometry)
