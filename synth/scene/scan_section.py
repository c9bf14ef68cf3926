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
Limits: a stroke must have room for its turns. The limits of recorded points are those of `trajectory`.
"""

from __future__ import annotations

from decimal import ROUND_CEILING, ROUND_FLOOR
from typing import Annotated, Any

from pydantic import Field

from synth.scene.point_columns import count_of_columns
from synth.scene.quantity import Dimension
from synth.scene.rules import Fields, Quantity, Refusal, refusal
from synth.scene.section import Section, without
from synth.scene.trajectory import (
    ANGLE,
    AREA_POINT_RULES,
    FASTEST,
    LOAD,
    Point,
    Trajectory,
    is_turned,
    over_area,
    rounded_text,
)

TURN_REACH = 5.0 / 16.0
"""Distance covered in half a turn, in units of speed * turn_time: the integral of 1 - 2 S over s from 0 to 1/2."""

USUAL_TURN_TIME = 0.1
"""s. Default chosen here, without a source. At 80 mm/s it needs 2.4 m/s^2 and 5 mm of the stroke."""

SPEED = Quantity(Dimension.SPEED, -FASTEST, FASTEST, usual=1.0)  # several times the fastest natural strokes
STROKE_SPEED = Quantity(Dimension.SPEED, 1e-6, FASTEST, usual=1.0)
STROKE_LENGTH = Quantity(Dimension.LENGTH, 1e-4, 10.0, usual=1.0)
TURN_TIME = Quantity(Dimension.TIME, 1e-3, 10.0)
LIFT_LOAD = Quantity(Dimension.LOAD, 1e-6, 1.0)
LINE_PLACE = Quantity(Dimension.LENGTH, -10.0, 10.0)
LINE = ("y", "heading", "direction")
"""The fields of a scan along a line at any angle."""


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
            shortest = rounded_text(2.0 * TURN_REACH * speed * TURN_TIME.low, Dimension.LENGTH, ROUND_CEILING)
            hint = f"Write a length of at least {shortest}, or a lower speed."
            return [refusal(["length"], given.get("length", length), f"room for turns of {TURN_TIME.show(1e-3)}", hint)]
        most = rounded_text(longest, Dimension.TIME, ROUND_FLOOR)
        hint = "Write a shorter turn_time, a longer length, or a lower speed."
        return [refusal(["turn_time"], turn, f"at most 1.6 length / speed, here {most}", hint)]


def _longest_turn(length: float | None, speed: float | None) -> float | None:
    """Return the duration (s) of turns with no cruise between them, or None if a field is invalid."""
    return None if length is None or speed is None else length / speed / (2.0 * TURN_REACH)


class Scan(Section):
    """The motion: constant `speed` and `load`, or a `stroke`, or a `trajectory`.

    For every kind of scan, `speed` and `load` are the largest of the scan. For a stroke they equal those of the stroke.
    For a trajectory they are the largest speed between two points, below 0 if it is backwards, and the largest load.
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
        return self.heading == 0.0 and (self.trajectory is None or not over_area(self.trajectory[0]))

    @property
    def turned(self) -> bool:
        """Whether the finger is turned from the x axis anywhere."""
        places = self.trajectory is not None and over_area(self.trajectory[0])
        directions = (point[3] for point in self.trajectory or ()) if places else (self.direction,)
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
            return found | ({"direction": points[0][3]} if over_area(points[0]) else {})
        return {}

    def document(self) -> dict[str, Any]:
        """Return the section with only the fields of its kind."""
        unused = {"stroke", "trajectory"}
        line = {name for name in LINE if getattr(self, name) == 0.0}
        if self.trajectory is not None and over_area(self.trajectory[0]):
            line = set(LINE)
        if self.stroke is not None:
            unused = {"speed", "load", "trajectory"}
        elif self.trajectory is not None:
            unused = {"speed", "load", "stroke"}
        return without(super().document(), *unused, *line)
