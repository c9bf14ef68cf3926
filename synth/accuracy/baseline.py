"""The baseline: a sum over samples and SciPy's `brentq`, for every frame, as a table of one period, or along a motion.

Stage   no stage. A report of accuracy compares it with `methods` and `motion_methods`.
Model   Eq. 1 is integral over [0, L] of max(h - z, 0) dx = w L / k. The integral is computed on equally spaced points,
        and `brentq` finds z, one phase at a time. Under a fingertip the integral is a sum over equally spaced points of
        its area. "Frames" are solved at each output frame, or are oversampled and then band-limited. A "table" is one
        period, solved once and read like any series. From size to size, both the points and the solutions increase.
        Along a motion the rules are those at the place and the load of each of equal steps, over the length that the
        heaviest load touches. The filter that makes frames of the steps is that of the engine.
Source  Fagiani & Barbieri (2016), eqs 1-5.
Limits  The times are those of `brentq` at PROBES phases, scaled to the number of phases. The errors are those of the
        same roots, found by Newton's method on the points that touch: it ends, because the sum is convex and piecewise
        linear in z. The filter that reduces oversampled frames to the frame rate is not counted. It takes 1 % of the
        time of the solutions. A fingertip has tables only, because a sum over its area at every frame would take hours.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

import numpy as np

from synth.accuracy.method import LeftOutMethod, Method, Ready
from synth.accuracy.methods import Case, Solve, read_by, seconds_a_phase
from synth.accuracy.motion import MotionCase
from synth.arrays import Array
from synth.contact.area_path import ContactOnArea
from synth.contact.load_balance import Contact
from synth.motion.scan_motion import ScanMotion
from synth.response.series_curve import SeriesCurve
from synth.surfaces.height_field import HeightField

SIZES = tuple((25 * 2**power, 2 ** round(0.45 * power)) for power in range(8))
"""Points per ridge and solutions per frame. Folding is proportional to solutions^-2.5, and the error of the rule to
points^-2. The largest size takes 3 ms per phase."""
TABLED = 512  # phases of a table per solution per frame of the same size
TIMED = 16  # phases of a timed run of frames, and places of a motion at which `brentq` is timed
AREA_SIZES = ((4, 64), (8, 128), (16, 256), (32, 512))
"""Points per ridge along and across, and phases, of the sum over the area of a fingertip."""
SIZES_ALONG = tuple((25 * 2**power, 0.25 * 2 ** round(0.45 * power)) for power in range(7))
"""Points per ridge of a comb, and steps as a part of those of the plan."""
AREA_SIZES_ALONG = ((2, 0.25), (4, 0.5), (8, 0.5), (16, 1.0))
"""Points per ridge along and across of a finger over an area, and steps as a part of those of the plan."""
MOST_POINTS = 1 << 22  # of an area; more take gigabytes


class Rule(ABC):
    """A sum over points of one contact, whose z is found with `brentq`.

    nbytes: memory, bytes.
    """

    nbytes: int

    @abstractmethod
    def heights(self, phase: float, across: float) -> Array:
        """Return h (m) of every point; phase: turns; across: how far the texture has moved across, m."""

    @abstractmethod
    def weighted(self, h: Array) -> tuple[Array, Array]:
        """Return the points that may touch, as heights (m) and weights."""

    def solved(self, phases: Array, targets: Array, across: Array | None = None) -> Array:
        """Return z (m) at each of `phases` (turns), found with `brentq`.

        targets: weighted sum of max(h - z, 0) at each phase, m.
        across: how far the texture has moved across at each phase, m; None: not at all.
        """
        from scipy.optimize import brentq

        found, moved = [], np.zeros(len(phases)) if across is None else across
        for phase, target, aside in zip(phases.tolist(), targets.tolist(), moved.tolist(), strict=True):
            h, v = self.weighted(self.heights(phase, aside))
            excess, top = partial(_excess, h, v, target), float(h.max())
            found.append(brentq(excess, _below(excess, top), top, xtol=1e-20, rtol=4.0 * np.finfo(float).eps))
        return np.array(found)

    def roots(self, phases: Array, targets: Array, across: Array | None = None) -> Array:
        """Return the same z by Newton's method on the points that touch."""
        found, moved = np.empty(len(phases)), np.zeros(len(phases)) if across is None else across
        for i, (phase, target, aside) in enumerate(zip(phases, targets, moved, strict=True)):
            h, v = self.weighted(self.heights(float(phase), float(aside)))
            z, touching = _below(partial(_excess, h, v, target), float(h.max())), -1
            some = h > z
            while some.any() and np.count_nonzero(some) != touching:  # none: the target is below the rounding of h
                h, v = h[some], v[some]
                touching = len(h)
                z = (float(np.sum(v * h)) - target) / float(np.sum(v))
                some = h > z
            found[i] = z
        return found


def _excess(h: Array, v: Array, target: float, z: float) -> float:
    """Return by how much the sum of max(h - z, 0) over points of weights `v` exceeds `target`, m."""
    return float(np.sum(v * np.maximum(h - z, 0.0))) - target  # `@` would start threads


def _below(excess: Callable[[float], float], top: float) -> float:
    """Return a height (m) below `top` at which `excess` is not negative."""
    pressed = 1e-6
    while excess(top - pressed) < 0.0:
        pressed *= 2.0
    return top - pressed


class Trapezoid(Rule):
    """The trapezoid rule on one contact along a line, over its length at one load.

    load: N.
    points: points per ridge.
    """

    def __init__(self, contact: Contact, load: float, points: float) -> None:
        geometry = contact.geometry_at(load)
        self._geometry = geometry
        pieces = max(8, math.ceil(points * geometry.ridges))
        self._places = np.linspace(0.0, geometry.contact_length, pieces + 1)
        self._weights = np.full(pieces + 1, 1.0 / pieces)
        self._weights[[0, -1]] *= 0.5
        ridges = np.cos(2.0 * np.pi * self._places / geometry.ridge_period + geometry.ridge_phase)
        from_middle = self._places - 0.5 * geometry.contact_length
        self._finger = -geometry.ridge_amplitude * ridges - 0.5 * contact.dome * from_middle**2
        self.nbytes = self._places.nbytes + self._weights.nbytes + self._finger.nbytes

    def heights(self, phase: float, across: float) -> Array:
        """See `Rule`; a texture along a line is the same across."""
        geometry = self._geometry
        return np.asarray(geometry.texture(self._places - phase % 1.0 * geometry.texture_period) + self._finger)

    def weighted(self, h: Array) -> tuple[Array, Array]:
        """See `Rule`."""
        return h, self._weights


class PointSum(Rule):
    """The sum over equally spaced points of a finger over an area.

    points: points per ridge, along and across.
    """

    def __init__(self, contact: Any, points: float) -> None:
        self._texture, self._period = contact.geometry.profile, contact.geometry.texture_period
        length, width = contact.own_size
        along, across = (math.ceil(points * one / contact.geometry.ridge_period) for one in (length, width))
        x = ((np.arange(along) + 0.5) / along - 0.5) * length
        self._y = ((np.arange(across) + 0.5) / across - 0.5) * width
        inside = (x[:, np.newaxis] / length) ** 2 + (self._y / width) ** 2 < 0.25
        self._finger = np.where(inside | contact.hard_edges, contact.own_heights(x, self._y), -np.inf)
        self._places = x + contact.own_middle
        self._weight = length * width / (along * across * contact.own_area)
        self.nbytes = 2 * self._finger.nbytes

    def heights(self, phase: float, across: float) -> Array:
        """See `Rule`."""
        x = self._places - phase % 1.0 * self._period
        if isinstance(self._texture, HeightField):
            return np.asarray(self._finger + self._texture.area(x, self._y - across).T)
        return np.asarray(self._finger + self._texture.heights(x)[:, np.newaxis])

    def weighted(self, h: Array) -> tuple[Array, Array]:
        """See `Rule`."""
        h = h[np.isfinite(h)]
        return h, np.full(len(h), self._weight)


def baseline_methods(case: Case) -> Iterator[Method]:
    """Yield the baseline as frames, then as tables, each with the fewest points first."""
    if case.contact.geometry.over_area:
        return
    if not case.contact.of_one_line:
        for points, phases in AREA_SIZES:
            name = f"sum over points and brentq, {points} points a ridge, tabled, {phases} phases"
            yield _tabled(case, PointSum(case.contact, points), name, phases)
        return
    rules = [(points, count, Trapezoid(case.contact, case.load, points)) for points, count in SIZES]
    for points, count, rule in rules:
        yield _framed(case, rule, f"trapezoid and brentq, {points} points a ridge, oversampling {count}", count)
    for points, count, rule in rules:
        name = f"trapezoid and brentq, {points} points a ridge, tabled, {TABLED * count} phases"
        yield _tabled(case, rule, name, TABLED * count)


def of_load(case: Case, solve: Callable[[Array, Array], Array]) -> Solve:
    """Return `solve`, of a `Rule`, at the load of `case`."""
    target = case.contact.indentation(case.load)
    return lambda phases: solve(phases, np.full(len(phases), target))


def _framed(case: Case, rule: Rule, name: str, count: int) -> Method:
    frames, roots, solved = max(1, TIMED // count), of_load(case, rule.roots), of_load(case, rule.solved)
    steps = np.arange(frames * count) / (count * case.period_frames)
    period, phases = case.solved_period(roots, count)
    ready = Ready(frames, rule.nbytes, lambda: solved(steps), period)
    return Method(name, "baseline", lambda: ready, phases * seconds_a_phase(roots))


def _tabled(case: Case, rule: Rule, name: str, phases: int) -> Method:
    roots, solved = of_load(case, rule.roots), of_load(case, rule.solved)

    @cache
    def set_up() -> Ready:
        return read_by(case, SeriesCurve(case.series(roots, phases)), setup=phases * seconds_a_phase(solved))

    return Method(name, "baseline", set_up, phases * seconds_a_phase(roots))


@dataclass(frozen=True)
class RuleAlong:
    """A rule at the places and loads of a motion.

    contact: over one length that serves all loads.
    y: place of the finger across, m, where the motion has no path.
    """

    rule: Rule
    contact: Contact
    y: float = 0.0

    def heights(self, phases: Array, loads: Array, path: Array | None = None) -> Array:
        """Return z (m) as `Contact.heights` does, on its line or along a path without turns."""
        return self.rule.roots(phases, self.contact.indentations(loads), self._across(phases, path))

    def solved(self, phases: Array, loads: Array, path: Array | None = None) -> Array:
        """Return the same z, found with `brentq`."""
        return self.rule.solved(phases, self.contact.indentations(loads), self._across(phases, path))

    def _across(self, phases: Array, path: Array | None) -> Array:
        return np.full(len(phases), -self.y) if path is None else path[0]


def baseline_along(case: MotionCase) -> Iterator[Method]:
    """Yield the baseline of `case`, with the fewest points first."""
    if any(without_baseline(case)):
        return
    contact = case.contact.over_loads(ScanMotion(case.scene).recorded_loads()[1])
    if contact.of_one_line:
        heaviest = ScanMotion(case.scene).recorded_loads()[1]
        for points, ratio in SIZES_ALONG:
            yield _baseline_at(
                case, RuleAlong(Trapezoid(contact, heaviest, points), contact), "trapezoid", points, ratio
            )
        return
    assert isinstance(contact, ContactOnArea)
    ridges = math.prod(one / contact.geometry.ridge_period for one in contact.own_size)
    for points, ratio in AREA_SIZES_ALONG:
        if points**2 * ridges <= MOST_POINTS:
            rule = RuleAlong(PointSum(contact, points), contact, case.scene.scan.y)
            yield _baseline_at(case, rule, "sum over points", points, ratio)


def without_baseline(case: MotionCase) -> Iterator[LeftOutMethod]:
    """Yield why the baseline does not apply."""
    name = "trapezoid and brentq" if case.contact.of_one_line else "sum over points and brentq"
    if case.solved.simulated:
        return
    if not case.contact.of_one_surface:
        yield LeftOutMethod(name, "baseline", "The load moves the ends of the contact, over which its sum is made.")
    elif case.contact.geometry.over_area and (case.scene.scan.turned or case.scene.scan.turns):
        yield LeftOutMethod(name, "baseline", "Its points are in rows along x, and the finger is turned.")


def _baseline_at(case: MotionCase, rule: RuleAlong, kind: str, points: float, ratio: float) -> Method:
    """Return a rule, solved at `ratio` times the steps of the plan."""
    a_root = case.seconds_a_solution(rule.heights)

    @cache
    def set_up() -> Ready:
        """Return the rule, ready to run; its frames are those whose steps are as many as the timed places."""
        places = case.probed(TIMED)

        def values(_points: int) -> Array:
            """Return the frames of the piece."""
            return case.solved_values(case.solver(ratio, rule.heights))

        frames = len(places[0]) * case.rate / case.steps(ratio)
        return Ready(frames, rule.rule.nbytes, lambda: rule.solved(*places), values, case.prepared[1])

    name = f"{kind} and brentq, {points:g} points a ridge, {case.steps(ratio):.0f} steps a second"
    return Method(name, "baseline", set_up, case.seconds(a_root, ratio))
