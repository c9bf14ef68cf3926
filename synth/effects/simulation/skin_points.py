"""The points of a finger that are simulated one by one, and the heights of the surfaces there at any place.

Model   A comb or a probe has one row of equally spaced points over its length: h of eq. 2, minus the dome (x - L/2)^2 /
        (2 R). A finger over an area has rows of points at equal distances along and across its own surface: those that
        can touch. Straight lines join the points of a row. With h - (step^2 / 12) h'' at the points, they enclose the
        areas of its curve. A piece between two points has a weight: its share of the nominal area, and 0 between rows.
        Two cosines turn with the phase: finger + cos(angle) texture + sin(angle) quarter. Any other texture is a
        lattice of one period, in which every point is read at its own place, turned by the direction of the finger and
        moved along and across, with linear interpolation. The lattice is the projection of the texture onto straight
        lines between points, for every offset of the points: its n-th harmonic is multiplied by sinc^2(n
        d) 3 / (2 + cos(2 pi n d)), with d the distance of points in periods. Areas over a few pieces are thus preserved
        at every offset, and a corner that passes the points makes no ripple. Across, it is the mean over a row, sinc(n
        d).
        Where the contact grows with the load, the points lie over its length at the heaviest load (`Span`). Over an
        area each piece then has the share that lies in the square of the contact, cut along and across.
Source  Fagiani & Barbieri (2016), eqs 1-2; de Boor (2001) for the projection.
Limits  A lattice along a line has at least FINER knots per distance of points. The error of its interpolation is 1/200
        of the error of the points. A contact shorter than the distance of points is simulated badly.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from synth.arrays import Array
from synth.contact.area_path import ContactOnArea
from synth.contact.area_shapes import GrowingCombOnArea
from synth.contact.exact_solver import angles_of_centres
from synth.contact.geometry import Geometry
from synth.contact.growing_contact import GrowingContact
from synth.contact.load_balance import Contact
from synth.kernels import inlined, inner
from synth.surfaces.height_field import HeightField

FINER = 8  # knots per distance of points; with fewer the interpolation shows in the acceleration
FEWEST_KNOTS = 4096  # per period
FINER_OVER_AREA, MOST_KNOTS = 4, 1 << 21  # per distance of points, and of an area (16 MB)
GOLDEN = 0.618033988749895  # shift of each row of an area against the one before, distances of points
SEEN = 64  # places along and across at which the part of a finger that can touch is found
ORIGIN, PERIOD, WIDTH, ASIDE, DIRECTION, PIECES_ALONG, ROWS_ACROSS = range(7)
"""Numbers of a place: x of the middle of the finger, and periods along and across (m); how far the texture has moved
across (m), and the direction of the finger (rad), where it stays on its line; pieces and rows over its region."""
NO_RIMS = np.empty((2, 0))


@dataclass(frozen=True, slots=True)
class SkinPoints:
    """Points fixed to the finger. Heights are relative to `height_scale`.

    rows: float64 [3, points]. Two cosines: finger, texture at phase 0, texture a quarter period on. Any other texture:
        finger, and x and y from its middle (m).
    lattice: float64 [rows + 1, knots + 1], one period with its first row and column again; one row along a line; empty
        for two cosines.
    place: float64 [7], see ORIGIN.
    weights: float64 [points - 1], of the pieces: share of the nominal area, times the number of pieces.
    height_scale: a1 + a2 (m).
    rims: float64 [2, points - 1], of a contact that grows over an area: distance of each piece from the middle along
        and across, in pieces and rows, less 1/2; else no columns.
    """

    rows: Array
    lattice: Array
    place: Array
    weights: Array
    height_scale: float
    rims: Array = field(default_factory=lambda: NO_RIMS)

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
        place = np.array([0.5 * geometry.contact_length, geometry.texture_period, 1.0, 0.0, 0.0, 0.0, 0.0])
        weights = np.ones(pieces)
        if geometry.profile is not None:
            lattice = _along_line(geometry, geometry.contact_length / pieces)
            return cls(np.stack([finger, off_middle, np.zeros(points)]), lattice, place, weights, scale)
        angle2 = angles_of_points(geometry.texture_periods, pieces) + geometry.texture_phase
        rows = np.stack([finger, b2 * np.cos(angle2), b2 * np.sin(angle2)])
        return cls(rows, np.empty((0, 0)), place, weights, scale)

    @classmethod
    def over_area(cls, contact: ContactOnArea, lowest: float, points: int) -> SkinPoints:
        """Return some `points` points of a finger over an area, where it can touch.

        lowest: height (m) of the finger above which it can touch.
        """
        geometry, (length, width) = contact.geometry, contact.own_size
        scale, texture = geometry.height_scale, geometry.profile
        seen = np.asarray((np.arange(SEEN) + 0.5) / SEEN - 0.5, np.float64)
        able = max(float(np.mean(contact.own_heights(seen * length, seen * width) >= lowest)), 1.0 / SEEN**2)
        apart = math.sqrt(able * length * width / points)
        count, pieces = max(2, math.ceil(width / apart)), max(2, math.ceil(length / apart))
        while not np.any((found := _touching(contact, lowest, pieces, count))[3]):
            pieces += 1  # all points are between the ridges
        step, across = length / pieces, width / count
        *rows, joined = found
        rows[0] = rows[0] / scale
        weights = (step * across / contact.own_area * (len(joined) - 1)) * joined[:-1]
        line = contact.line
        if isinstance(texture, HeightField):
            lattice = _over_area(texture, step, across, scale)
            place = np.array(
                [contact.own_middle, texture.period, texture.across, -line.y, line.direction, pieces, count]
            )
        else:
            lattice = _along_line(geometry, step)
            place = np.array([contact.own_middle, geometry.texture_period, 1.0, 0.0, 0.0, pieces, count])
        rims = NO_RIMS
        if not contact.of_one_surface:
            x, y = rows[1:]
            rims = np.abs(np.stack([0.5 * (x[:-1] + x[1:]) / step, y[:-1] / across])) - 0.5
        return cls(np.stack(rows), lattice, place, np.ascontiguousarray(weights), scale, rims)

    @property
    def count(self) -> int:
        """Number of points."""
        return int(self.rows.shape[1])

    @property
    def texture_period(self) -> float:
        """Period along the scan, m."""
        return float(self.place[PERIOD])

    @property
    def of_area(self) -> bool:
        """Whether the texture varies across, so that places have a path."""
        return len(self.lattice) > 2

    @property
    def in_rows(self) -> bool:
        """Whether there are several rows of points."""
        return bool(np.any(self.weights == 0.0))


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
        if not isinstance(contact, GrowingContact | GrowingCombOnArea):
            assert contact.of_one_surface, "points follow the ends of a growing comb only"
            return WHOLE
        growth, whole = contact.growth, contact.length(heaviest)
        coefficient = contact.geometry.contact_length / whole / growth.reference_load**growth.exponent
        return cls(coefficient, growth.exponent, growth.shortest / whole, contact.stiffness.length_exponent)

    @property
    def numbers(self) -> Array:
        """The fields, for the kernel."""
        return np.array([self.coefficient, self.exponent, self.shortest, self.stiffening])


WHOLE = Span()


def _touching(contact: ContactOnArea, lowest: float, pieces: int, count: int) -> Array:
    """Return height, x and y (m) of the points that can touch, and whether each is joined to the next [4, points].

    lowest: see `SkinPoints.over_area`.
    pieces: along each of `count` rows.
    """
    (length, width), found = contact.own_size, []
    step, across = length / pieces, width / count
    for row in range(count):
        moved = 0.0 if contact.hard_edges else GOLDEN * row % 1.0 - 0.5
        x = np.asarray(step * (np.arange(-1, pieces + 2) + moved) - 0.5 * length, np.float64)
        y = across * (row + 0.5) - 0.5 * width
        known = contact.own_heights(x, np.array([y]))[:, 0]
        x, heights = x[1:-1], known[1:-1] - np.diff(known, 2) / 12.0  # of the same areas under straight lines
        near = np.convolve(heights >= lowest, np.ones(3), "same") > 0.0  # a line to the next point may be higher
        joined = near & np.append(near[1:], False)
        found.append(np.stack([heights, x, np.full(len(x), y), joined])[:, near])
    return np.concatenate(found, axis=1)


def _along_line(geometry: Geometry, apart: float) -> Array:
    """Return the lattice of a texture along a line; apart: distance of points, m."""
    apart /= geometry.texture_period
    knots = max(FEWEST_KNOTS, math.ceil(FINER / apart))
    heights = geometry.texture(np.arange(knots) / knots * geometry.texture_period) / geometry.height_scale
    return _closed(_projected(heights[np.newaxis], apart))


def _over_area(texture: HeightField, step: float, across: float, scale: float) -> Array:
    """Return the lattice of a texture over an area; step, across: distances of points along and across, m."""
    knots = [FINER_OVER_AREA * texture.period / step, FINER_OVER_AREA * texture.across / across]
    fewer = math.sqrt(max(1.0, knots[0] * knots[1] / MOST_KNOTS))
    columns, rows = (max(8, math.ceil(one / fewer)) for one in knots)
    places = np.arange(columns) / columns * texture.period, np.arange(rows) / rows * texture.across
    heights = np.asarray(texture.lattice(*places), np.float64) / scale
    lines = np.fft.rfft(_projected(heights, step / texture.period), axis=0)
    lines *= np.sinc(np.arange(len(lines)) * (across / texture.across))[:, np.newaxis]
    return _closed(np.fft.irfft(lines, rows, axis=0))


def _projected(heights: Array, apart: float) -> Array:
    """Return the projection of each row of `heights`; apart: distance of points, in periods. See Model."""
    lines = np.fft.rfft(heights)
    passed = np.arange(lines.shape[1]) * apart
    lines *= 3.0 * np.sinc(passed) ** 2 / (2.0 + np.cos(2.0 * math.pi * passed))
    return np.asarray(np.fft.irfft(lines, heights.shape[1]))


def _closed(heights: Array) -> Array:
    """Return `heights` with their first row and column again at the end."""
    return np.ascontiguousarray(np.pad(heights, ((0, 1), (0, 1)), "wrap"))


@inner
def write_heights(rows, lattice, place, turns, aside, direction, heights):
    """Write h at every point.

    turns: phase, -1/2 to 1/2.
    aside: how far the texture has moved across, m.
    direction: of the finger, rad.
    """
    if lattice.shape[0] == 0:
        cosine, sine = math.cos(2.0 * math.pi * turns), math.sin(2.0 * math.pi * turns)
        for j in range(len(heights)):
            heights[j] = rows[0, j] + (cosine * rows[1, j] + sine * rows[2, j])
        return
    count, knots = lattice.shape[0] - 1, lattice.shape[1] - 1
    c, s = math.cos(direction) / place[PERIOD], math.sin(direction) / place[PERIOD]
    begin = place[ORIGIN] / place[PERIOD] - turns
    if count == 1:
        line = lattice[0]
        for j in range(len(heights)):
            along = begin + (c * rows[1, j] - s * rows[2, j])
            along = (along - math.floor(along)) * knots
            k = min(int(along), knots - 1)
            heights[j] = rows[0, j] + (line[k] + (along - k) * (line[k + 1] - line[k]))
        return
    ratio = place[PERIOD] / place[WIDTH]
    side, sine, cosine = -aside / place[WIDTH], s * ratio, c * ratio
    for j in range(len(heights)):
        along = begin + (c * rows[1, j] - s * rows[2, j])
        across = side + (sine * rows[1, j] + cosine * rows[2, j])
        along, across = (along - math.floor(along)) * knots, (across - math.floor(across)) * count
        k, i = min(int(along), knots - 1), min(int(across), count - 1)
        near = lattice[i, k] + (along - k) * (lattice[i, k + 1] - lattice[i, k])
        far = lattice[i + 1, k] + (along - k) * (lattice[i + 1, k + 1] - lattice[i + 1, k])
        heights[j] = rows[0, j] + (near + (across - i) * (far - near))


@inner
def write_rates(rows, lattice, place, turns, aside, direction, rates):
    """Write the derivative of h over the phase as an angle (1/rad) at every point.

    turns, aside, direction: as of `write_heights`.
    """
    if lattice.shape[0] == 0:
        cosine, sine = math.cos(2.0 * math.pi * turns), math.sin(2.0 * math.pi * turns)
        for j in range(len(rates)):
            rates[j] = cosine * rows[2, j] - sine * rows[1, j]
        return
    knots, steep = lattice.shape[1] - 1, (lattice.shape[1] - 1) / (2.0 * math.pi)
    if lattice.shape[0] == 2:
        line, begin = lattice[0], place[ORIGIN] / place[PERIOD] - turns
        for j in range(len(rates)):
            along = begin + rows[1, j] / place[PERIOD]
            k = min(int((along - math.floor(along)) * knots), knots - 1)
            rates[j] = (line[k] - line[k + 1]) * steep
        return
    c, s = math.cos(direction), math.sin(direction)
    for j in range(len(rates)):
        k, i, _part, part = knot_of(rows, lattice, place, turns, aside, c, s, j)
        near, far = lattice[i, k] - lattice[i, k + 1], lattice[i + 1, k] - lattice[i + 1, k + 1]
        rates[j] = (near + part * (far - near)) * steep


@inner
def write_rates_across(rows, lattice, place, turns, aside, direction, rates):
    """Write the derivative of h over the distance moved across, as an angle of the period along, at every point."""
    steep = (lattice.shape[0] - 1) / (2.0 * math.pi) * place[PERIOD] / place[WIDTH]
    c, s = math.cos(direction), math.sin(direction)
    for j in range(len(rates)):
        k, i, part, _part = knot_of(rows, lattice, place, turns, aside, c, s, j)
        near, far = lattice[i, k] - lattice[i + 1, k], lattice[i, k + 1] - lattice[i + 1, k + 1]
        rates[j] = (near + part * (far - near)) * steep


@inlined
def knot_of(rows, lattice, place, turns, aside, c, s, j):
    """Return the knot of an area before point `j`, along and across, and the way from there to the next, 0 to 1.

    c, s: cosine and sine of the direction of the finger.
    """
    count, knots = lattice.shape[0] - 1, lattice.shape[1] - 1
    along = (place[ORIGIN] + (c * rows[1, j] - s * rows[2, j])) / place[PERIOD] - turns
    across = (s * rows[1, j] + c * rows[2, j] - aside) / place[WIDTH]
    along, across = (along - math.floor(along)) * knots, (across - math.floor(across)) * count
    k, i = min(int(along), knots - 1), min(int(across), count - 1)
    return k, i, along - k, across - i


def angles_of_points(periods: float, pieces: int) -> Array:
    """Return the angle (rad) at the ends of `pieces` equal parts of `periods` periods: float64 [pieces + 1]."""
    ends = angles_of_centres(periods, pieces) + math.pi * periods / pieces
    return np.concatenate([[0.0], ends])
