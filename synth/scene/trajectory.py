"""Recorded points of a scan: their rules and their reading.

Stage: 1 (SCENE), used by `scan_section`.
Limits: recorded points must be at least 1 us apart, and the speed between them must be 10 m/s at most. Times of a clock
that began more than a day before count from the first point. `point_spacing` then merges or moves apart points that are
too close in time.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from decimal import ROUND_FLOOR, Context
from typing import Any

from pydantic import ValidationInfo
from pydantic_core import PydanticCustomError

from synth.scene.point_columns import in_order
from synth.scene.quantity import Dimension, show_quantity
from synth.scene.rules import MOST_FAULTS, Quantity, Refusal, Rule, item_refusal, refusal, refuse, refused

FASTEST = 10.0
"""m/s. Largest speed of a scene, also between two recorded points."""

CLOSEST_POINTS = 1e-6
"""s. Shortest interval between recorded points. No tracker separates closer points: one of them is a mistake."""

FEWEST_POINTS = 2
"""Smallest number of recorded points: from here to there."""

MOST_POINTS = 1_000_000
"""Largest number of recorded points: 16 minutes at 1 kHz, about 100 MB while they are read."""

Point = tuple[float, ...]
"""[t, position, load], or over an area [t, x, y, direction, load]."""

LOWEST_LOAD = "lowest_load"
"""Key of the validation context: the smallest load (N) of the scene, negative where an effect allows a pull."""


class Load(Quantity):
    """A load. It must be at least 0, unless an effect of the scene holds a finger that pulls."""

    def down_to(self, found: ValidationInfo) -> Quantity:
        """Return the rule for the scene that is being read, with that scene's lowest load."""
        lowest = (found.context or {}).get(LOWEST_LOAD, self.low)
        return replace(self, low=lowest) if lowest < self.low else self

    def read_in(self, value: object, found: ValidationInfo) -> float:
        """Return the load in N."""
        return self.down_to(found).read(value)


LOAD = Load(Dimension.LOAD, 0.0, 1e3, usual=20.0)  # ten times the load that the paper calls useful
TIME, PLACE = Quantity(Dimension.TIME, 0.0, 86400.0), Quantity(Dimension.LENGTH, -1e4, 1e4)
ANGLE = Quantity(Dimension.ANGLE, -1000.0, 1000.0)
CLOCK = Quantity(Dimension.TIME, 0.0, 1e10)  # 300 years: a clock that counts from 1970 too, but no count of ms
POINT_RULES = CLOCK, PLACE, LOAD
AREA_POINT_RULES = CLOCK, PLACE, PLACE, ANGLE, LOAD
LONGEST_RECORDING = f"at most {TIME.show(TIME.high)} after the first point"
POINTS = "[t, position, load], or [t, x, y, direction, load]"
LATE = "Times are in s: divide a clock in ms by 1000, or subtract the first time."
UNITS = "Check the units: times are in s and positions in m."
UNTURNED = 1e-6  # rad: a smaller angle is the rounding of a whole turn, in float32 too


class Trajectory(Rule):
    """Recorded points, all of one form, each number in SI or text with its unit."""

    takes_lists = True

    def arranged(self, value: object) -> object:
        """Return the points of a table with named columns in the order of a point. Raises ArrayError."""
        return in_order(value)

    allowed = (
        f"{FEWEST_POINTS} to {MOST_POINTS} points {POINTS}: t {CLOCK.allowed} and {LONGEST_RECORDING}, "
        f"position, x and y {PLACE.allowed}, direction {ANGLE.allowed}, load {LOAD.allowed}"
    )

    def read(self, value: object, load: Quantity = LOAD) -> tuple[Point, ...]:
        """Return the points in SI, with rising times. `load` is the rule of the load."""
        if not isinstance(value, list | tuple) or not FEWEST_POINTS <= len(value) <= MOST_POINTS:
            raise refused(self.allowed, "Write a list of points such as [[0, 0, 0.3], [0.1, 0.008, 0.3], ...].")
        refusals: list[Refusal] = []
        points: list[Point] = []
        rules = (*(AREA_POINT_RULES if over_area(value[0]) else POINT_RULES)[:-1], load)
        for index, point in enumerate(value):
            read = _read_point(point, index, rules, refusals)
            if read is not None:
                first = points[0][0] if points else read[0]
                if read[0] - first > TIME.high:
                    refusals.append(refusal([index, 0], point[0], LONGEST_RECORDING, UNITS))
                    break
                if points:
                    refusals += _steps(points[-1], read, index)
                points.append(read)
            elif index == 0 and refusals and _is_beyond_clocks(point):
                break
            if len(refusals) > MOST_FAULTS:
                break
        refuse("trajectory", refusals)
        first = points[0][0]
        return tuple((since(first, point[0]), *point[1:]) for point in points) if first > TIME.high else tuple(points)

    def schema(self) -> dict[str, Any]:
        """Return the schema of the list of points."""
        return {"anyOf": [{
            "type": "array",
            "minItems": FEWEST_POINTS,
            "maxItems": MOST_POINTS,
            "items": {
                "type": "array",
                "prefixItems": [rule.schema() for rule in rules],
                "minItems": len(rules),
                "maxItems": len(rules),
            },
        } for rules in (POINT_RULES, AREA_POINT_RULES)]}  # fmt: skip

    def read_in(self, value: object, found: ValidationInfo) -> tuple[Point, ...]:
        """Return the points in SI. Loads may go down to the lowest load of the scene."""
        return self.read(value, LOAD.down_to(found))


def over_area(point: object) -> bool:
    """Return whether a recorded point has the place of the finger over an area."""
    return isinstance(point, list | tuple) and len(point) == len(AREA_POINT_RULES)


def is_turned(direction: float) -> bool:
    """Return whether `direction` (rad) differs from that of the x axis; a whole turn makes no difference."""
    return direction != 0.0 and abs(math.remainder(direction, math.tau)) > UNTURNED


def _read_point(point: object, index: int, rules: tuple[Quantity, ...], refusals: list[Refusal]) -> Point | None:
    """Return the point in SI, or add to `refusals` and return None."""
    if not isinstance(point, list | tuple) or len(point) != len(rules):
        hint = "Write three numbers, such as [0.1, 0.008, 0.3], or five with a place. All points have one form."
        refusals.append(refusal([index], point, POINTS, hint))
        return None
    numbers: list[float] = []
    for place, (rule, value) in enumerate(zip(rules, point, strict=True)):
        try:
            numbers.append(rule.read(value))
        except PydanticCustomError as error:
            late = rule is CLOCK and isinstance(value, int | float) and CLOCK.high < value < math.inf
            told = refused(rule.allowed, LATE) if late else error
            refusals.append(item_refusal([index, place], value, told))
    return tuple(numbers) if len(numbers) == len(rules) else None


def place_of(point: Point) -> Point:
    """Return the position, or x and y, of a recorded point."""
    return point[1:3] if over_area(point) else point[1:2]


def _steps(before: Point, after: Point, index: int) -> Iterator[Refusal]:
    """Yield a refusal if the step from one point to the next is too short in time or too fast."""
    duration = after[0] - before[0]
    moved = math.hypot(*(new - old for new, old in zip(place_of(after), place_of(before), strict=True)))
    if not duration >= 0.999 * CLOSEST_POINTS:
        allowed = f"at least 1 us after the previous point, which is at {show_quantity(before[0], Dimension.TIME)}"
        yield refusal([index, 0], after[0], allowed, "Sort the points by time and keep one of each time.")
    elif moved > FASTEST * duration * (1.0 + 1e-9):
        reach = rounded_text(FASTEST * duration, Dimension.LENGTH, ROUND_FLOOR)
        allowed = f"within {reach} of the previous point ({show_quantity(FASTEST, Dimension.SPEED)} at most)"
        yield refusal([index, 1], after[1], allowed, UNITS)


def since(first: float, time: float) -> float:
    """Return how much later than `first` a `time` is, s.

    A float64 holds a time since 1970 to 0.24 us. A clock that counts microseconds is therefore exact in the difference.
    """
    passed = time - first
    if first <= TIME.high:
        return passed
    counted = round(passed, 6)
    return counted if abs(counted - passed) <= math.ulp(time) else passed


def _is_beyond_clocks(point: object) -> bool:
    """Return whether the time of a point is later than any clock in seconds says: one fault tells enough."""
    time = point[0] if isinstance(point, list | tuple) and point else None
    return isinstance(time, int | float) and time > CLOCK.high


def rounded_text(number: float, dimension: Dimension, rounding: str) -> str:
    """Return `number` as text of three digits, rounded in the direction of allowed values."""
    digits = Context(prec=3, rounding=rounding).create_decimal(repr(number))
    return show_quantity(float(digits), dimension)
