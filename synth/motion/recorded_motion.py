"""Position and load of a recorded scan at any time: curves through its points that never overshoot them.

Stage   Motion, for trajectories.
Model   Position and load are each a piecewise polynomial of degree 5. At each point it has the recorded value, a slope
        d and a second derivative s, so two derivatives are continuous and the third is bounded. d and s come from the
        parabola through a point and its neighbours. They are then reduced until the curve is monotone from each point
        to the next. With h the interval and D the change over it (mirrored if D < 0), it is monotone if the Bernstein
        coefficients increase:
            0, h d0 / 5, h (2 d0 / 5 + h s0 / 20), D - h (2 d1 / 5 - h s1 / 20), D - h d1 / 5, D
        The coefficients bound the curve, so position and load stay within the range of two neighbouring points.
        The load has zero slope at the first and the last point. Beyond them the position continues in a straight line.
        Time counts from the first point. `rendered_part` leaves out the points after the end of a finite output.
Source  Sufficient conditions for a monotone polynomial in Bernstein form (de Boor, A Practical Guide to Splines, 1978).
        The estimates of d and s, and their reduction, are this project's own.
Limits  Exact at the points and for straight lines. For a smooth motion with points every h, the position error is below
        0.15 h^2 times the second derivative at turns, which are cut off, and below h^3 times the third derivative
        elsewhere. The speed is at most 5 times the mean speed between two points, as in a stop recorded by few points.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.scene.point_spacing import merged_places, spaced_times
from synth.scene.scene import Scene
from synth.scene.trajectory import Point

CLOSE_ENDS, LEAST_DURATION = 0.01, 2e-3  # of the output, s: a recording that ends as near as this ends with it
CLOSE_LOOK = 8  # places between two points at which the largest speed is searched


@dataclass(frozen=True, slots=True)
class Curve:
    """A piecewise polynomial and its two derivatives, each a function of the time (s)."""

    value: Any
    slope: Any
    bend: Any

    @classmethod
    def through(cls, times: Array, values: Array, *, level_ends: bool) -> Curve:
        """Return the curve through `values` at `times`; level_ends: with zero slope at the first and the last point."""
        from scipy.interpolate import BPoly, PPoly

        h, rise = np.diff(times), np.diff(values)
        d, s = _reduced(*_parabolas(h, rise, level_ends=level_ends), h, rise)
        after = h * (0.4 * d[:-1] + 0.05 * h * s[:-1])
        before = h * (0.4 * d[1:] - 0.05 * h * s[1:])
        first, last = values[:-1], values[1:]
        bernstein = np.array([
            first, first + 0.2 * h * d[:-1], first + after, last - before, last - 0.2 * h * d[1:], last,
        ])  # fmt: skip
        value = PPoly.from_bernstein_basis(BPoly(bernstein, times))
        return cls(value, value.derivative(), value.derivative(2))

    def within(self, t: Array) -> Array:
        """Return the times `t` (s), limited to the first and the last point."""
        return np.clip(t, self.value.x[0], self.value.x[-1])


@dataclass(frozen=True, slots=True)
class RecordedMotion:
    """A recording.

    end: time of its last point, s; the first is at 0.
    place, load: curves over the time, m and N. The place is how far the surface has moved along x.
    area: curves of how far it has moved across (m) and of the direction of the finger (rad); None: a motion along x.
    loads: smallest and largest load, N.
    warnings: about changes to the recorded points.
    """

    end: float
    place: Curve
    load: Curve
    loads: tuple[float, float]
    warnings: tuple[str, ...]
    area: tuple[Curve, Curve] | None = None

    @classmethod
    def of(cls, scene: Scene) -> RecordedMotion:
        """Return the motion of the trajectory of `scene`. The latest are kept, since each stage asks for it."""
        points = scene.scan.trajectory
        assert points is not None
        for known, made in tuple(_latest):
            if known is points:
                return made
        made = cls._through(points)
        _latest.append((points, made))
        return made

    @classmethod
    def _through(cls, points: tuple[Point, ...]) -> RecordedMotion:
        recorded = np.fromiter(chain.from_iterable(points), float).reshape(len(points), -1)
        recorded[:, 0] -= recorded[0, 0]
        times, *places, loads = recorded.T
        if len(places) > 1:  # a finger at x, y: the surface has moved the other way
            x, y, direction = places
            places = [-x, -y, np.unwrap(direction)]  # the short way round, as for a live hand
        merged_times, merged = merged_places(times, np.stack(places))
        spaced = spaced_times(times)
        place, *area = (Curve.through(merged_times, row, level_ends=False) for row in merged)
        load = Curve.through(spaced, loads, level_ends=True)
        changed = _changes(times, np.abs(place.value(times) - places[0]), len(merged_times), np.abs(spaced - times))
        end = max(float(times[-1]), float(spaced[-1]))
        known = (float(loads.min()), float(loads.max()))
        return cls(end, place, load, known, changed, (area[0], area[1]) if area else None)

    def fastest(self) -> float:
        """Return the largest absolute speed (m/s)."""
        knots = self.place.value.x
        places = np.linspace(0.0, 1.0, CLOSE_LOOK, endpoint=False)
        looked = knots[:-1, np.newaxis] + np.diff(knots)[:, np.newaxis] * places
        moments = np.append(looked.ravel(), knots[-1])
        across = 0.0 if self.area is None else self.area[0].slope(moments)
        return float(np.max(np.hypot(self.place.slope(moments), across)))


_latest: deque[tuple[tuple[Point, ...], RecordedMotion]] = deque(maxlen=2)
"""Trajectories, compared by identity, and their motions."""


def rendered_part(scene: Scene) -> tuple[Scene, tuple[str, ...]]:
    """Return `scene` without the points of its trajectory that follow the output, and a warning where there are any.

    The part ends with the first point that is not before the end of the output, so nothing after it decides a sample.
    The warning also says where a recording ends before the output does.
    """
    points, duration = scene.scan.trajectory, scene.output.duration
    if points is None:
        return scene, ()
    begin, length = points[0][0], points[-1][0] - points[0][0]
    if length < duration - max(CLOSE_ENDS * duration, LEAST_DURATION):
        return scene, (
            f"The recording ends after {length:.6g} s. The finger lifts there: the rest of {duration:.6g} s is silent.",
        )
    end = begin + duration * (1.0 - 1e-12)
    last = max(next(number for number, point in enumerate(points) if point[0] >= end or number == len(points) - 1), 1)
    if last == len(points) - 1:
        return scene, ()
    scan = scene.scan.model_copy(update={"trajectory": points[: last + 1]})
    scan = scan.model_copy(update=scan.derived())
    told = f"The recording lasts {length:.6g} s. The first {duration:.6g} s are rendered, as output.duration says."
    return scene.model_copy(update={"scan": scan}), (told,)


def _changes(times: Array, off: Array, places: int, shifts: Array) -> tuple[str, ...]:
    """Return a warning about changes to the recorded points, if any.

    times: of the points, s.
    off: error of each position, m.
    places: number of points that are left for the position.
    shifts: of each load, s.
    """
    moved = np.flatnonzero(shifts)
    if places == len(times) and not len(moved):
        return ()
    return (
        f"Points of the recording are too close in time to give a speed, the first at {times[moved[0]]:.6g} s. Merged "
        f"with their neighbours for the position: {len(times) - places} of {len(times)}, off by "
        f"{1e6 * off.max():.3g} um at most. Loads moved in time: {len(moved)}, by {1e3 * shifts.max():.3g} ms at most.",
    )


def _parabolas(h: Array, rise: Array, *, level_ends: bool) -> tuple[Array, Array]:
    """Return slope and second derivative at each point, from the parabola through it and its neighbours."""
    steep = rise / h
    d, s = np.zeros(len(h) + 1), np.zeros(len(h) + 1)
    both = h[:-1] + h[1:]
    d[1:-1] = (h[:-1] * steep[1:] + h[1:] * steep[:-1]) / both
    s[1:-1] = 2.0 * (steep[1:] - steep[:-1]) / both
    if not level_ends:
        d[0], d[-1] = steep[0] - 0.5 * h[0] * s[1], steep[-1] + 0.5 * h[-1] * s[-2]
    return d, s


def _reduced(d: Array, s: Array, h: Array, rise: Array) -> tuple[Array, Array]:
    """Return slopes and second derivatives that make the curve monotone between any two points."""
    side = np.sign(rise)
    left, right = np.append(side[0], side), np.append(side, side[-1])  # at each point
    wide_left, wide_right = np.append(h[0], h), np.append(h, h[-1])
    d = np.where((left == right) & (d * right > 0.0), d, 0.0)
    s = np.where(right > 0.0, np.maximum(s, -4.0 * d / wide_right), s)
    s = np.where(right < 0.0, np.minimum(s, -4.0 * d / wide_right), s)
    s = np.where(left > 0.0, np.minimum(s, 4.0 * d / wide_left), s)
    s = np.where(left < 0.0, np.maximum(s, 4.0 * d / wide_left), s)
    s[0] = s[-1] = 0.0
    used_after = side * h * (0.4 * d[:-1] + 0.05 * h * s[:-1])  # of the rise, at the start of each interval
    used_before = side * h * (0.4 * d[1:] - 0.05 * h * s[1:])  # the same at its end
    whole = np.abs(rise)
    keep_after = _kept(used_after, np.maximum(0.5 * whole, whole - used_before))
    keep_before = _kept(used_before, np.maximum(0.5 * whole, whole - used_after))
    keep = np.minimum(np.append(keep_after, 1.0), np.append(1.0, keep_before))
    keep *= np.minimum(np.append(whole > 0.0, True), np.append(True, whole > 0.0))
    return keep * d, keep * s


def _kept(used: Array, allowed: Array) -> Array:
    """Return the fraction of `used` that is `allowed`, at most 1."""
    return np.where(used > allowed, allowed / np.where(used > allowed, used, 1.0), 1.0)
