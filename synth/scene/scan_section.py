"""The scan section of a scene: motion at constant speed, back and forth, or along recorded points.

Stage: 1 (SCENE).
Model of the stroke: the finger starts at rest at position 0, accelerates to `speed`, cruises, turns at `length`, comes
back, turns at 0, and so on. A turn lasts `turn_time`. In a turn the velocity changes from u to -u as u (1 - 2 S(s)),
where s increases from 0 to 1 and S(s) = 3 s^2 - 2 s^3. Position, velocity and acceleration are therefore continuous.
The acceleration peaks at 3 u / turn_time. Each half of a turn covers (5/16) u turn_time. Frame 0 is in the middle of a
turn.
Model of the line: the surface moves along a line at the angle `heading` from its x axis. The middle of
the finger is at `y`, and its length is turned by `direction`. Instead, a recording may give the place and the direction
of the finger at each point.
Limits: a stroke must have room for its turns. Recorded points must be at least 1 us apart, and the speed between them
must be 10 m/s at most. Times of a clock that began more than a day before count from the first point.
`point_spacing` then merges or moves apart points that are too close in time.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from typing import Annotated, Any

from pydantic import Field, ValidationInfo
from pydantic_core import PydanticCustomError

from synth.scene.point_columns import count_of_columns, in_order
from synth.scene.quantity import Dimension, show_quantity
from synth.scene.rules import (
    MOST_FAULTS,
    Fields,
    Quantity,
    Refusal,
    Rule,
    item_refusal,
    refusal,
    refuse,
    refused,
)
from synth.scene.section import Section, without

TURN_REACH = 5.0 / 16.0
"""Distance covered in half a turn, in units of speed * turn_time: the integral of 1 - 2 S over s from 0 to 1/2."""

USUAL_TURN_TIME = 0.1
"""s. Default chosen here, without a source. At 80 mm/s it needs 2.4 m/s^2 and 5 mm of the stroke."""

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
SPEED = Quantity(Dimension.SPEED, -FASTEST, FASTEST, usual=1.0)  # several times the fastest natural strokes
STROKE_SPEED = Quantity(Dimension.SPEED, 1e-6, FASTEST, usual=1.0)
STROKE_LENGTH = Quantity(Dimension.LENGTH, 1e-4, 10.0, usual=1.0)
TURN_TIME = Quantity(Dimension.TIME, 1e-3, 10.0)
LIFT_LOAD = Quantity(Dimension.LOAD, 1e-6, 1.0)
TIME, PLACE = Quantity(Dimension.TIME, 0.0, 86400.0), Quantity(Dimension.LENGTH, -1e4, 1e4)
ANGLE = Quantity(Dimension.ANGLE, -1000.0, 1000.0)
CLOCK = Quantity(Dimension.TIME, 0.0, 1e10)  # 300 years: a clock that counts from 1970 too, but no count of ms
POINT_RULES = CLOCK, PLACE, LOAD
AREA_POINT_RULES = CLOCK, PLACE, PLACE, ANGLE, LOAD
LINE_PLACE = Quantity(Dimension.LENGTH, -10.0, 10.0)
LONGEST_RECORDING = f"at most {TIME.show(TIME.high)} after the first point"
POINTS = "[t, position, load], or [t, x, y, direction, load]"
LATE = "Times are in s: divide a clock in ms by 1000, or subtract the first time."
UNITS = "Check the units: times are in s and positions in m."
UNTURNED = 1e-6  # rad: a smaller angle is the rounding of a whole turn, in float32 too
LINE = ("y", "heading", "direction")
"""The fields of a scan along a line at any angle."""


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
        rules = (*(AREA_POINT_RULES if _over_area(value[0]) else POINT_RULES)[:-1], load)
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


def _over_area(point: object) -> bool:
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
    return point[1:3] if _over_area(point) else point[1:2]


def _steps(before: Point, after: Point, index: int) -> Iterator[Refusal]:
    """Yield a refusal if the step from one point to the next is too short in time or too fast."""
    duration = after[0] - before[0]
    moved = math.hypot(*(new - old for new, old in zip(place_of(after), place_of(before), strict=True)))
    if not duration >= 0.999 * CLOSEST_POINTS:
        allowed = f"at least 1 us after the previous point, which is at {show_quantity(before[0], Dimension.TIME)}"
        yield refusal([index, 0], after[0], allowed, "Sort the points by time and keep one of each time.")
    elif moved > FASTEST * duration * (1.0 + 1e-9):
        reach = _rounded(FASTEST * duration, Dimension.LENGTH, ROUND_FLOOR)
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


class Stroke(Section):
    """Back and forth between position 0 and `length`, with smooth turns. The same heights pass in both directions."""

    length: Annotated[float, STROKE_LENGTH] = Field(
        default=0.05, description="Distance between the two positions where the finger turns."
    )
    speed: Annotated[float, STROKE_SPEED] = Field(
        default=0.08, description="Speed between the turns, the largest of the stroke."
    )
    load: Annotated[float, LOAD] = Field(default=0.3, description="Normal force of the finger on the texture.")
    turn_time: Annotated[float, TURN_TIME] = Field(
        default=USUAL_TURN_TIME,
        description="Duration of a turn, from full speed one way to full speed the other way. For a short stroke the "
        "default is half of the longest possible turn.",
    )

    @property
    def cruise_time(self) -> float:
        """Time in s at full speed between two turns."""
        return max(0.0, self.length / self.speed - 2.0 * TURN_REACH * self.turn_time)

    @property
    def period(self) -> float:
        """Time in s from one start at position 0 to the next."""
        return 2.0 * (self.cruise_time + self.turn_time)

    @classmethod
    def completed(cls, given: Fields) -> Fields:
        """Shorten the default turn if the stroke has no room for it."""
        longest = _longest_turn(cls.value_of(given, "length"), cls.value_of(given, "speed"))
        if "turn_time" in given or longest is None or longest < TURN_TIME.low:
            return given
        return {**given, "turn_time": min(USUAL_TURN_TIME, max(TURN_TIME.low, 0.5 * longest))}

    @classmethod
    def conflicts(cls, given: Fields) -> list[Refusal]:
        """Refuse turns that do not fit into the stroke."""
        length, speed = cls.value_of(given, "length"), cls.value_of(given, "speed")
        longest, turn = _longest_turn(length, speed), cls.value_of(given, "turn_time")
        if longest is None or turn is None or turn <= longest * (1.0 + 1e-9):
            return []
        if longest < TURN_TIME.low:
            shortest = _rounded(2.0 * TURN_REACH * speed * TURN_TIME.low, Dimension.LENGTH, ROUND_CEILING)
            hint = f"Write a length of at least {shortest}, or a lower speed."
            return [refusal(["length"], given.get("length", length), f"room for turns of {TURN_TIME.show(1e-3)}", hint)]
        most = _rounded(longest, Dimension.TIME, ROUND_FLOOR)
        hint = "Write a shorter turn_time, a longer length, or a lower speed."
        return [refusal(["turn_time"], turn, f"at most 1.6 length / speed, here {most}", hint)]


def _rounded(number: float, dimension: Dimension, rounding: str) -> str:
    """Return `number` as text of three digits, rounded in the direction of allowed values."""
    digits = Context(prec=3, rounding=rounding).create_decimal(repr(number))
    return show_quantity(float(digits), dimension)


def _longest_turn(length: float | None, speed: float | None) -> float | None:
    """Return the duration (s) of turns with no cruise between them, or None if a field is invalid."""
    return None if length is None or speed is None else length / speed / (2.0 * TURN_REACH)


class Scan(Section):
    """The motion: constant `speed` and `load`, or a `stroke`, or a `trajectory`.

    For every kind of scan, `speed` and `load` are the largest of the scan. For a stroke they equal those of the stroke.
    For a trajectory they are the largest speed between two points and the largest load.
    """

    speed: Annotated[float, SPEED] = Field(
        default=0.08, description="Constant speed of the surface past the finger. Negative is backwards."
    )
    load: Annotated[float, LOAD] = Field(default=0.3, description="Constant normal force of the finger on the texture.")
    stroke: Stroke | None = Field(
        default=None, description="Back and forth with smooth turns, instead of speed and load."
    )
    trajectory: Annotated[tuple[Point, ...] | None, Trajectory()] = Field(
        default=None,
        description="Recorded points [t, position, load], with rising times, instead of speed and load. They may be "
        "[t, x, y, direction, load], with the place of the finger's middle on the surface. The motion has two "
        "continuous derivatives and stays between neighbouring points. Times that are too close are moved apart.",
    )
    y: Annotated[float, LINE_PLACE] = Field(
        default=0.0, description="Place of the finger's middle across the surface; along a line it changes nothing."
    )
    heading: Annotated[float, ANGLE] = Field(
        default=0.0,
        description="Angle of the line along which the surface moves, counter-clockwise from its x axis.",
    )
    direction: Annotated[float, ANGLE] = Field(
        default=0.0,
        description="Angle of the finger's length, counter-clockwise from the x axis of the surface.",
    )
    lift_load: Annotated[float, LIFT_LOAD] = Field(
        default=1e-3,
        description="Load below which the output fades smoothly with the load, to exact silence at no load.",
    )

    @classmethod
    def conflicts(cls, given: Fields) -> list[Refusal]:
        """Refuse a scan of two kinds at once, and a line beside points that contain places over an area."""
        refusals = cls._of_two_kinds(given)
        if count_of_columns(given.get("trajectory")) == len(AREA_POINT_RULES):
            allowed = "not beside points over an area"
            hint = "Leave it out: the points contain the places and directions of the finger."
            refusals += [refusal([name], given[name], allowed, hint) for name in LINE if name in given]
        return refusals

    @classmethod
    def _of_two_kinds(cls, given: Fields) -> list[Refusal]:
        """Refuse a scan of two kinds at once."""
        if "stroke" not in given and "trajectory" not in given:
            return []
        kind = "stroke" if "stroke" in given else "trajectory"
        inside = (
            'Write it inside the stroke: {"stroke": {"speed": ..., "load": ...}}.'
            if kind == "stroke"
            else "Leave it out: the points contain positions and loads."
        )
        refusals = [
            refusal([name], given[name], f"speed and load, or {kind}, not both", inside)
            for name in ("speed", "load")
            if name in given
        ]
        if "stroke" in given and "trajectory" in given:
            refusals.append(
                refusal(["trajectory"], given["trajectory"], "stroke or trajectory, not both", "Leave one out.")
            )
        return refusals

    @property
    def along_x(self) -> bool:
        """Whether the finger stays on one line along x and keeps its direction."""
        return self.heading == 0.0 and (self.trajectory is None or not _over_area(self.trajectory[0]))

    @property
    def turned(self) -> bool:
        """Whether the finger is turned from the x axis anywhere."""
        over_area = self.trajectory is not None and _over_area(self.trajectory[0])
        directions = (point[3] for point in self.trajectory or ()) if over_area else (self.direction,)
        return any(map(is_turned, directions))

    @property
    def turns(self) -> bool:
        """Whether the finger turns: recorded points over an area have different directions."""
        return not self.along_x and self.trajectory is not None and len({point[3] for point in self.trajectory}) > 1

    def derived(self) -> Fields:
        """Return the largest speed and load of a scan that is not constant, and the direction of its first point."""
        if self.stroke is not None:
            return {"speed": self.stroke.speed, "load": self.stroke.load}
        if self.trajectory is not None:
            from synth.scene.point_spacing import largest_speed

            points = self.trajectory
            found: Fields = {"speed": largest_speed(points), "load": max(point[-1] for point in points)}
            return found | ({"direction": points[0][3]} if _over_area(points[0]) else {})
        return {}

    def document(self) -> dict[str, Any]:
        """Return the section with only the fields of its kind."""
        unused = {"stroke", "trajectory"}
        line = {name for name in LINE if getattr(self, name) == 0.0}
        if self.trajectory is not None and _over_area(self.trajectory[0]):
            line = set(LINE)
        if self.stroke is not None:
            unused = {"speed", "load", "trajectory"}
        elif self.trajectory is not None:
            unused = {"speed", "load", "stroke"}
        return without(super().document(), *unused, *line)
