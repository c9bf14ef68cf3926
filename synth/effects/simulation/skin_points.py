"""The points of a finger at which viscous skin is followed, and how many of them a tolerance takes.

Model   h of eq. 2 (see `skin_surface`) at equally spaced points of the contact's length, less the dome (x - L/2)^2 /
        (2 R), joined by straight lines. The number of points is the smallest tried whose elastic z, about its mean,
        comes near that of the contact's own solver over a period of the texture.
Source  Fagiani & Barbieri (2016), eqs 1-2.
Limits  the error is that of the elastic contact. That of viscous skin (default scene, 4 ms, 513 points) was as much at
        10 mm/s, twice it at 80 mm/s and 7 times it at 320 mm/s, and to 10 times it for skin that relaxes. A load whose
        contact is shorter than the distance of points is badly met.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from synth.arrays import Array
from synth.contact.balance import Contact
from synth.contact.sampled import angles_of_points
from synth.effects.simulation.skin_balance import elastic_heights
from synth.effects.simulation.skin_surface import Tables, texture_tables
from synth.response.phases import turns_to_phase

FEWEST_POINTS = 65  # the first number tried; fewer save less than a call of the simulation costs
MOST_POINTS = 4097  # 8 us a step and more: 0.4 of a core at 48 kHz. More would not keep up with a second voice
PROBES = 256  # phases over a period; half as many missed 5 % of the largest error
FLOOR = 1e-12  # of a1 + a2: errors of z below it count as none (design, section 8)


@dataclass(frozen=True, slots=True)
class SkinPoints:
    """Points fixed to the finger.

    tables: heights of finger and texture, relative to `height_scale` (a1 + a2, m): see `skin_surface`. texture_period:
    m.
    """

    tables: Tables
    height_scale: float
    texture_period: float

    @classmethod
    def of_contact(cls, contact: Contact, load: float, points: int) -> SkinPoints:
        """Return `points` points of `contact` over its length at `load` (N); one surface must have a height."""
        geometry, pieces = contact.geometry_at(load), points - 1
        scale = geometry.height_scale
        assert scale > 0.0 and pieces > 0, f"{points} points on surfaces of {scale} m"
        angle1 = angles_of_points(geometry.ridges, pieces) + geometry.ridge_phase
        b1, b2 = geometry.ridge_amplitude / scale, geometry.texture_amplitude / scale
        off_middle = geometry.contact_length * (np.arange(points) / pieces - 0.5)
        finger = -b1 * np.cos(angle1) - 0.5 * contact.dome * off_middle**2 / scale
        if geometry.profile is not None:
            return cls(texture_tables(geometry, finger), scale, geometry.texture_period)
        angle2 = angles_of_points(geometry.texture_periods, pieces) + geometry.texture_phase
        return cls(np.stack([finger, b2 * np.cos(angle2), b2 * np.sin(angle2)]), scale, geometry.texture_period)

    @property
    def count(self) -> int:
        """How many there are."""
        return int(self.tables[0].shape[0])

    @property
    def nbytes(self) -> int:
        """Bytes that they hold."""
        return sum(table.nbytes for table in self.tables)

    def elastic(self, phases: Array, indentation: float) -> Array:
        """Return z (m) of the elastic contact at each of `phases` (turns) and a mean indentation w / k (m)."""
        height = np.empty(len(phases))
        elastic_heights(self.tables, turns_to_phase(phases), indentation / self.height_scale, height)
        return height * self.height_scale


def elastic_error(contact: Contact, load: float, points: int) -> float:
    """Return the largest error of the elastic z about its mean, of its peak-to-peak, with `points` points."""
    phases = np.arange(PROBES) / PROBES
    wanted, _slope = contact.approach(phases, load)
    found = SkinPoints.of_contact(contact, load, points).elastic(phases, contact.indentation(load))
    error = (found - np.mean(found)) - (wanted - np.mean(wanted))
    largest = max(float(np.max(np.abs(error))) - FLOOR * contact.geometry_at(load).height_scale, 0.0)
    return largest / float(np.ptp(wanted)) if largest > 0.0 else 0.0


def points_for(contact: Contact, load: float, tolerance: float, most: int = MOST_POINTS) -> tuple[int, float]:
    """Return the number of points that `tolerance` takes at `load` (N), at most `most`, and the error they leave.

    tolerance, and the error: of the peak-to-peak of z.
    """
    size = 2.0 * math.log2(FEWEST_POINTS - 1)
    while True:
        points = min(round(2.0 ** (0.5 * size)) + 1, most)
        error = elastic_error(contact, load, points)
        if error <= tolerance or points == most:
            return points, error
        size += 1.0
