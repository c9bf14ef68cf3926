"""The baseline along a motion: a sum over samples or points and SciPy's `brentq`, at equal steps of the motion.

Stage   no stage. A report of accuracy compares it with `motion_methods`.
Model   The rules are those of `baseline`, here at the place and the load of each step. A rule covers the length that
        the heaviest load touches. The filter that makes frames of the steps is that of the engine. From size to size,
        both the points and the steps increase.
Source  Fagiani & Barbieri (2016), eqs 1-5.
Limits  The times are those of `brentq` at TIMED places of the piece, scaled to a second. The errors are those of the
        same roots, found by Newton's method. The filter is not counted.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np

from synth.accuracy.baseline import PointSum, Rule, Trapezoid
from synth.accuracy.method import LeftOutMethod, Method, Ready
from synth.accuracy.motion import MotionCase
from synth.arrays import Array
from synth.contact.load_balance import Contact
from synth.motion.scan_motion import ScanMotion

SIZES = tuple((25 * 2**power, 0.25 * 2 ** round(0.45 * power)) for power in range(7))
"""Points per ridge of a comb, and steps as a part of those of the plan."""
AREA_SIZES = ((2, 0.25), (4, 0.5), (8, 0.5), (16, 1.0))
"""Points per ridge along and across of a finger over an area, and steps as a part of those of the plan."""
TIMED = 16  # places at which `brentq` is timed
MOST_POINTS = 1 << 22  # of an area; more take gigabytes


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
        for points, ratio in SIZES:
            yield _along(case, RuleAlong(Trapezoid(contact, heaviest, points), contact), "trapezoid", points, ratio)
        return
    ridges = math.prod(one / contact.geometry.ridge_period for one in contact.own_size)  # type: ignore[attr-defined]
    for points, ratio in AREA_SIZES:
        if points**2 * ridges <= MOST_POINTS:
            rule = RuleAlong(PointSum(contact, points), contact, case.scene.scan.y)
            yield _along(case, rule, "sum over points", points, ratio)


def without_baseline(case: MotionCase) -> Iterator[LeftOutMethod]:
    """Yield why the baseline does not apply."""
    name = "trapezoid and brentq" if case.contact.of_one_line else "sum over points and brentq"
    if case.solved.simulated:
        return
    if not case.contact.of_one_surface:
        yield LeftOutMethod(name, "baseline", "The load moves the ends of the contact, over which its sum is made.")
    elif case.contact.geometry.over_area and (case.scene.scan.turned or case.scene.scan.turns):
        yield LeftOutMethod(name, "baseline", "Its points are in rows along x, and the finger is turned.")


def _along(case: MotionCase, rule: RuleAlong, kind: str, points: float, ratio: float) -> Method:
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
