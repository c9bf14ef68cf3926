"""The baseline for a steady scan: a sum over samples and SciPy's `brentq`, for every frame or as a table of one period.

Stage   no stage. A report of accuracy compares it with `methods`.
Model   Eq. 1 is integral over [0, L] of max(h - z, 0) dx = w L / k. The integral is computed on equally spaced points,
        and `brentq` finds z, one phase at a time. Under a fingertip the integral is a sum over equally spaced points of
        its area. "Frames" are solved at each output frame, or are oversampled and then band-limited. A "table" is one
        period, solved once and read like any series. From size to size, both the points and the solutions increase.
Source  Fagiani & Barbieri (2016), eqs 1-5.
Limits  The times are those of `brentq` at PROBES phases, scaled to the number of phases. The errors are those of the
        same roots, computed in closed form: with falling heights h_1 >= h_2 >= ... and weights v_i, the root is the
        largest over k of (v_1 h_1 + ... + v_k h_k - target) / (v_1 + ... + v_k). The filter that reduces oversampled
        frames to the frame rate is not counted. It takes 1 % of the time of the solutions. A fingertip has tables only,
        because a sum over its area at every frame would take hours; Newton's method finds the same roots there.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from synth.accuracy.methods import Case, Method, Ready, read_by, seconds_a_phase
from synth.arrays import Array
from synth.contact.load_balance import Contact
from synth.response.series_curve import SeriesCurve
from synth.surfaces.height_field import HeightField

if TYPE_CHECKING:
    from synth.contact.fingertip import FingertipContact

SIZES = tuple((25 * 2**power, 2 ** round(0.45 * power)) for power in range(8))
"""Points per ridge and solutions per frame. Folding is proportional to solutions^-2.5, and the error of the rule to
points^-2. The largest size takes 3 ms per phase."""
TABLED = 512  # phases of a table per solution per frame of the same size
TIMED = 16  # phases of a timed run of frames
AREA_SIZES = ((4, 64), (8, 128), (16, 256), (32, 512))
"""Points per ridge along and across, and phases, of the sum over the area of a fingertip."""


class Trapezoid:
    """The trapezoid rule on one contact at one load.

    load: N.
    points: points per ridge.
    nbytes: memory, bytes.
    """

    def __init__(self, contact: Contact, load: float, points: float) -> None:
        from scipy.optimize import brentq

        self._find, geometry = brentq, contact.geometry_at(load)
        self._geometry, self._target = geometry, contact.indentation(load)
        pieces = max(8, math.ceil(points * geometry.ridges))
        self._places = np.linspace(0.0, geometry.contact_length, pieces + 1)
        self._weights = np.full(pieces + 1, 1.0 / pieces)
        self._weights[[0, -1]] *= 0.5
        ridges = np.cos(2.0 * np.pi * self._places / geometry.ridge_period + geometry.ridge_phase)
        from_middle = self._places - 0.5 * geometry.contact_length
        self._finger = -geometry.ridge_amplitude * ridges - 0.5 * contact.dome * from_middle**2
        self.nbytes = self._places.nbytes + self._weights.nbytes + self._finger.nbytes

    def solved(self, phases: Array) -> Array:
        """Return z (m) at each of `phases` (turns), found with `brentq`."""
        scale, found = self._geometry.height_scale, []
        for phase in phases:
            h = self._heights(float(phase))
            bottom = float(h.min()) - self._target - 1e-6 * scale
            tight = {"xtol": 1e-15 * scale, "rtol": 4.0 * np.finfo(float).eps}
            found.append(self._find(lambda z, h=h: self._excess(h, z), bottom, float(h.max()), **tight))
        return np.array(found)

    def roots(self, phases: Array) -> Array:
        """Return the same z, in closed form."""
        found = np.empty(len(phases))
        for i, phase in enumerate(phases):
            h = self._heights(float(phase))
            falling = np.argsort(h)[::-1]
            weights = self._weights[falling]
            found[i] = np.max((np.cumsum(weights * h[falling]) - self._target) / np.cumsum(weights))
        return found

    def _heights(self, phase: float) -> Array:
        geometry = self._geometry
        return np.asarray(geometry.texture(self._places - phase % 1.0 * geometry.texture_period) + self._finger)

    def _excess(self, h: Array, z: float) -> float:
        return float(self._weights @ np.maximum(h - z, 0.0)) - self._target


class PointSum:
    """The sum over equally spaced points of a fingertip at one load; its methods are those of `Trapezoid`."""

    def __init__(self, contact: FingertipContact, load: float, points: float) -> None:
        from scipy.optimize import brentq

        assert contact.geometry.profile is not None
        self._find, self._texture, self._period = brentq, contact.geometry.profile, contact.geometry.texture_period
        length, width = contact.footprint.reach
        along, across = (math.ceil(points * one / contact.field.period) for one in (length, width))
        self._places = ((np.arange(along) + 0.5) / along - 0.5) * length
        y = ((np.arange(across) + 0.5) / across - 0.5) * width
        inside = (self._places[:, np.newaxis] / length) ** 2 + (y / width) ** 2 < 0.25
        self._finger = np.where(inside, contact.surface.heights(self._places, y), -np.inf)
        share = length * width / (along * across * contact.footprint.length * contact.footprint.width)
        self._target = contact.indentation(load) / share
        self.nbytes = 2 * self._finger.nbytes

    def solved(self, phases: Array) -> Array:
        """Return z (m) at each of `phases` (turns), found with `brentq`."""
        found = []
        for phase in phases:
            h = self._heights(float(phase))
            top, pressed = float(h.max()), 1e-6
            while self._excess(h, top - pressed) < 0.0:
                pressed *= 2.0
            found.append(self._find(lambda z, h=h: self._excess(h, z), top - pressed, top, xtol=1e-15))
        return np.array(found)

    def roots(self, phases: Array) -> Array:
        """Return the same z by Newton's method on the points that touch."""
        found = np.empty(len(phases))
        for i, phase in enumerate(phases):
            h = self._heights(float(phase)).ravel()
            z = float(h.max()) - 1e-6
            while self._excess(h, z) < 0.0:
                z -= 1e-6
            h, touching = h[h > z], 0
            while len(h) != touching:
                touching = len(h)
                z = (float(h.sum()) - self._target) / touching
                h = h[h > z]
            found[i] = z
        return found

    def _heights(self, phase: float) -> Array:
        under = self._texture.heights(self._places - phase % 1.0 * self._period)
        return np.asarray(self._finger + under[:, np.newaxis])

    def _excess(self, h: Array, z: float) -> float:
        return float(np.sum(np.maximum(h - z, 0.0))) - self._target


def baseline_methods(case: Case) -> Iterator[Method]:
    """Yield the baseline as frames, then as tables, each with the fewest points first."""
    if isinstance(case.contact.geometry.profile, HeightField):
        return
    if not case.contact.of_one_line:
        tip: Any = case.contact  # without a height field only a fingertip has heights over an area
        for points, phases in AREA_SIZES:
            name = f"sum over points and brentq, {points} points a ridge, tabled, {phases} phases"
            yield _tabled(case, PointSum(tip, case.load, points), name, phases)
        return
    rules = [(points, count, Trapezoid(case.contact, case.load, points)) for points, count in SIZES]
    for points, count, rule in rules:
        yield _framed(case, rule, f"trapezoid and brentq, {points} points a ridge, oversampling {count}", count)
    for points, count, rule in rules:
        name = f"trapezoid and brentq, {points} points a ridge, tabled, {TABLED * count} phases"
        yield _tabled(case, rule, name, TABLED * count)


def _framed(case: Case, rule: Trapezoid, name: str, count: int) -> Method:
    frames = max(1, TIMED // count)
    steps = np.arange(frames * count) / (count * case.period_frames)
    period, phases = case.solved_period(rule.roots, count)
    ready = Ready(frames, rule.nbytes, lambda: rule.solved(steps), period)
    return Method(name, "baseline", lambda: ready, phases * seconds_a_phase(rule.roots))


def _tabled(case: Case, rule: Trapezoid | PointSum, name: str, phases: int) -> Method:
    @cache
    def set_up() -> Ready:
        return read_by(case, SeriesCurve(case.series(rule.roots, phases)), setup=phases * seconds_a_phase(rule.solved))

    return Method(name, "baseline", set_up, phases * seconds_a_phase(rule.roots))
