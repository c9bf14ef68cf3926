"""The points of a finger at which viscous skin is simulated, and the heights of the surfaces there at any phase.

Model   h of eq. 2 at equally spaced points of the contact length, minus the dome (x - L/2)^2 / (2 R), with straight
        lines between the points. Two cosines turn with the phase: finger + cos(angle) texture + sin(angle) quarter.
        Any other texture is a table of one period that moves past the points, read with linear interpolation. The table
        is the projection of the profile onto straight lines between points (`polyline`), for every offset of the
        points: its n-th harmonic is multiplied by sinc^2(n d) 3 / (2 + cos(2 pi n d)), with d the distance of points in
        periods. Areas over a few pieces are thus preserved at every offset, and a corner that passes the points makes
        no ripple.
        Where the contact grows with the load, the points lie over its length at the heaviest load (`Span`).
Source  Fagiani & Barbieri (2016), eqs 1-2; de Boor (2001) for the projection.
Limits  The table has at least FINER knots per distance of points. The error of its interpolation is 1/200 of the error
        of the points. A contact shorter than the distance of points is simulated badly.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from synth.arrays import Array
from synth.contact.exact_solver import angles_of_centres
from synth.contact.geometry import Geometry
from synth.contact.growing_contact import GrowingContact
from synth.contact.load_balance import Contact
from synth.kernels import inner

FINER = 8  # knots per distance of points; with fewer the interpolation shows in the acceleration
FEWEST_KNOTS = 4096  # per period


@dataclass(frozen=True, slots=True)
class SkinPoints:
    """Points fixed to the finger. Heights are relative to `height_scale`.

    rows: float64 [3, points]. Two cosines: finger, texture at phase 0, texture a quarter period on. Any other texture:
        finger, place in the table (knots, 0 to N), unused.
    table: float64 [2 N + 2], two periods long; empty for two cosines.
    height_scale: a1 + a2 (m).
    texture_period: m.
    """

    rows: Array
    table: Array
    height_scale: float
    texture_period: float

    @classmethod
    def of_contact(cls, contact: Contact, load: float, points: int) -> SkinPoints:
        """Return `points` points over the length of `contact` at `load` (N). At least one surface has a height."""
        geometry, pieces = contact.geometry_at(load), points - 1
        scale = geometry.height_scale
        assert scale > 0.0 and pieces > 0, f"{points} points on surfaces of {scale} m"
        angle1 = angles_of_points(geometry.ridges, pieces) + geometry.ridge_phase
        b1, b2 = geometry.ridge_amplitude / scale, geometry.texture_amplitude / scale
        off_middle = geometry.contact_length * (np.arange(points) / pieces - 0.5)
        finger = -b1 * np.cos(angle1) - 0.5 * contact.dome * off_middle**2 / scale
        if geometry.profile is not None:
            places, table = _moving_table(geometry, points)
            return cls(np.stack([finger, places, np.zeros(points)]), table, scale, geometry.texture_period)
        angle2 = angles_of_points(geometry.texture_periods, pieces) + geometry.texture_phase
        rows = np.stack([finger, b2 * np.cos(angle2), b2 * np.sin(angle2)])
        return cls(rows, np.empty(0), scale, geometry.texture_period)

    @property
    def count(self) -> int:
        """Number of points."""
        return int(self.rows.shape[1])


@dataclass(frozen=True, slots=True)
class Span:
    """The part of the length of the points that is in contact at a load w (N), about its middle.

    It is coefficient w^exponent, from `shortest` to 1. k grows as the part to the power `stiffening`.
    """

    coefficient: float = 1.0
    exponent: float = 0.0
    shortest: float = 1.0
    stiffening: float = 0.0

    @classmethod
    def of(cls, contact: Contact, heaviest: float) -> Span:
        """Return the span of points over the length of `contact` at `heaviest` (N)."""
        if not isinstance(contact, GrowingContact):
            return WHOLE
        growth, whole = contact.growth, contact.length(heaviest)
        coefficient = contact.geometry.contact_length / whole / growth.reference_load**growth.exponent
        return cls(coefficient, growth.exponent, growth.shortest / whole, contact.stiffness.length_exponent)

    @property
    def numbers(self) -> Array:
        """The fields, for the kernel."""
        return np.array([self.coefficient, self.exponent, self.shortest, self.stiffening])


WHOLE = Span()


def _moving_table(geometry: Geometry, points: int) -> tuple[Array, Array]:
    """Return the places of `points` points in the table, and the table, for a texture that is a profile."""
    profile = geometry.profile
    assert profile is not None, "two cosines need no table"
    apart = geometry.contact_length / (points - 1) / profile.period
    knots = max(FEWEST_KNOTS, math.ceil(FINER / apart))
    lines = np.fft.rfft(geometry.texture(np.arange(knots) / knots * profile.period) / geometry.height_scale)
    passed = np.arange(len(lines)) * apart
    lines *= 3.0 * np.sinc(passed) ** 2 / (2.0 + np.cos(2.0 * math.pi * passed))
    table = np.fft.irfft(lines, knots)
    places = np.asarray(np.arange(points) * apart % 1.0 * knots, np.float64)
    return places, np.concatenate([table, table, table[:2]])


@inner
def write_heights(rows, table, turns, heights):
    """Write h at every point.

    turns: phase, -1/2 to 1/2.
    """
    if len(table) == 0:
        cosine, sine = math.cos(2.0 * math.pi * turns), math.sin(2.0 * math.pi * turns)
        for j in range(len(heights)):
            heights[j] = rows[0, j] + (cosine * rows[1, j] + sine * rows[2, j])
        return
    shift = (math.ceil(turns) - turns) * (len(table) // 2 - 1)
    for j in range(len(heights)):
        place = rows[1, j] + shift
        k = int(place)
        heights[j] = rows[0, j] + (table[k] + (place - k) * (table[k + 1] - table[k]))


@inner
def write_rates(rows, table, turns, rates):
    """Write the derivative of h over the phase as an angle (1/rad) at every point."""
    if len(table) == 0:
        cosine, sine = math.cos(2.0 * math.pi * turns), math.sin(2.0 * math.pi * turns)
        for j in range(len(rates)):
            rates[j] = cosine * rows[2, j] - sine * rows[1, j]
        return
    knots = len(table) // 2 - 1
    shift, steep = (math.ceil(turns) - turns) * knots, knots / (2.0 * math.pi)
    for j in range(len(rates)):
        k = int(rows[1, j] + shift)
        rates[j] = (table[k] - table[k + 1]) * steep


def angles_of_points(periods: float, pieces: int) -> Array:
    """Return the angle (rad) at the ends of `pieces` equal parts of `periods` periods: float64 [pieces + 1]."""
    ends = angles_of_centres(periods, pieces) + math.pi * periods / pieces
    return np.concatenate([[0.0], ends])
