"""The boundary of every numeric field: its end is accepted, the next float is not, and the page states that range."""

from __future__ import annotations

import math
import sys
from typing import Any

import pytest

from synth.errors import shown
from synth.scene.scene import FieldLine, parse_scene, scene_fields, scene_schema
from synth.scene.trajectory import POINT_RULES
from tests.synth.hard.bounds import merged
from tests.synth.hard.ranges import FIELDS, Field
from tests.synth.scene.scene_cases import at, faults_of
from tests.test_scene_docs import PAGE, rows

LINES: dict[str, FieldLine] = {line.path: line for line in scene_fields()}


def beyond(low: float, high: float) -> tuple[float, float]:
    """Return the next numbers outside: below zero that is a normal one, since what is denormal is read as zero."""
    return (math.nextafter(low, -math.inf) if low else -sys.float_info.min), math.nextafter(high, math.inf)


def schema_of(field: Field) -> dict[str, Any]:
    """Return the JSON Schema of a field."""
    found = scene_schema()
    for name in field.path.split("."):
        holder = found if "properties" in found else next(part for part in found["anyOf"] if "properties" in part)
        found = holder["properties"][name]
    return found


@pytest.mark.parametrize("field", FIELDS, ids=lambda field: field.name)
def test_both_ends_are_accepted_and_kept_to_the_last_digit(field: Field) -> None:
    for end in field.ends:
        scene = parse_scene(merged(field.company, field.document(end)))
        found = at(scene, field.path.replace("roughness", "amplitude") if "texture" in field.path else field.path)
        if field.path == "finger.roughness":
            found = scene.finger.ridge_amplitude
        wanted = 0.5 * math.pi * end if "roughness" in field.path else end
        assert found == wanted
        written = merged(field.company, field.document(field.rule.show(end) if field.rule.unit else end))
        assert parse_scene(written) == scene


@pytest.mark.parametrize("field", FIELDS, ids=lambda field: field.name)
def test_the_next_float_beyond_an_end_is_refused_by_name(field: Field) -> None:
    ends = zip(beyond(*field.ends), field.ends, ("at least", "at most"), strict=True)
    for value, end, words in ends:
        (fault,) = faults_of(merged(field.company, field.document(value)))
        assert (fault.pointer, fault.value) == (field.pointer, shown(value))
        assert field.rule.allowed in fault.allowed
        assert f"{words} {field.rule.show(end)}" in fault.hint
        assert field.rule.show(end) in fault.sentence()


@pytest.mark.parametrize("field", FIELDS, ids=lambda field: field.name)
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf], ids=str)
def test_what_is_not_finite_is_refused_by_name(field: Field, value: float) -> None:
    (fault,) = faults_of(merged(field.company, field.document(value)))
    assert (fault.pointer, fault.value) == (field.pointer, shown(value))
    assert field.rule.allowed in fault.allowed
    assert "finite" in fault.hint
    assert field.rule.unit in fault.hint


@pytest.mark.parametrize("field", FIELDS, ids=lambda field: field.name)
def test_the_page_and_the_schema_state_that_very_range(field: Field) -> None:
    _meaning, _unit, _default, allowed = rows()[field.path]
    assert field.rule.allowed in allowed
    schema, line = schema_of(field), LINES[field.path]
    assert field.rule.allowed in schema["x-allowed"] == line.allowed
    assert schema["description"] == line.description
    numbers = [part for part in schema["anyOf"] if part.get("type") in ("number", "integer")]
    assert len(numbers) == 1
    low, high = field.ends
    if field.quantity:  # one schema for the full scales of three quantities: the widest range
        assert numbers[0]["minimum"] <= low and high <= numbers[0]["maximum"]
    else:
        assert (numbers[0]["minimum"], numbers[0]["maximum"]) == (low, high)


def test_the_schema_of_full_scales_is_no_wider_than_the_widest_of_them() -> None:
    scales = [field for field in FIELDS if field.quantity]
    number = next(part for part in schema_of(scales[0])["anyOf"] if part.get("type") == "number")
    assert number["minimum"] == min(field.ends[0] for field in scales)
    assert number["maximum"] == max(field.ends[1] for field in scales)


@pytest.mark.parametrize("field", [field for field in FIELDS if field.quantity], ids=lambda field: field.name)
def test_the_full_scale_of_a_channel_has_the_same_ends(field: Field) -> None:
    def channel(scale: float) -> dict[str, Any]:
        return {"output": {"channels": ["velocity", {"quantity": field.quantity, "full_scale": scale}]}}

    for end in field.ends:
        assert parse_scene(channel(end)).output.channel_list[1].full_scale == end
    for value in (*beyond(*field.ends), math.nan, math.inf):
        (fault,) = faults_of(channel(value))
        assert fault.pointer == "/output/channels/1/full_scale"
        assert fault.allowed == field.rule.allowed
    assert field.rule.allowed in rows()["output.channels[].full_scale"][3]


@pytest.mark.parametrize("place", range(3))
def test_the_points_of_a_trajectory_have_their_ends(place: int) -> None:
    """Points a long way apart are refused for their speed, so the others follow: all at the end, or near it."""
    rule = POINT_RULES[place]
    assert rule.allowed in rows()["scan.trajectory"][3]

    def trajectory(value: float, inward: float) -> dict[str, Any]:
        points = [[0.1 * i, 0.0, 0.3] for i in range(4)]
        if place == 0:
            first = value if inward > 0 else value - 0.3
            points = [[first + 0.1 * i, 0.0, 0.3] for i in range(3)] + [
                [value + 0.3 if inward > 0 else value, 0.0, 0.3]
            ]
        else:
            for point in points:
                point[place] = value
        return {"scan": {"trajectory": points}}

    for end, inward, outside in zip((rule.low, rule.high), (1.0, -1.0), beyond(rule.low, rule.high), strict=True):
        points = parse_scene(trajectory(end, inward)).scan.trajectory
        assert points is not None
        if place == 0 and inward < 0:  # a late clock counts from the first point
            assert points[3][0] == pytest.approx(0.3, abs=math.ulp(end))
        else:
            assert points[0 if inward > 0 else 3][place] == end
        for value in (outside, math.nan, math.inf):
            document = trajectory(end, inward)
            document["scan"]["trajectory"][0 if inward > 0 else 3][place] = value
            faults = faults_of(document)
            assert faults[0].pointer == f"/scan/trajectory/{0 if inward > 0 else 3}/{place}"
            assert faults[0].allowed == rule.allowed


def test_the_page_says_that_denormal_numbers_are_zero() -> None:
    assert "below 2.2e-308) is read as zero, and so is -0.0" in PAGE.replace("\n", " ")
