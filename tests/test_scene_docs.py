"""docs/scene.md cannot drift: every field, unit, default and range has its line, and its JSON does as the page says."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from synth.scene.merge import merge_patch
from synth.scene.quantity import Dimension
from synth.scene.scene import FieldLine, Scene, parse_scene, parse_scene_text, scene_fields
from synth.scene.text import object_from_text

PAGE = (Path(__file__).resolve().parents[1] / "docs" / "scene.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```json\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)


def rows() -> dict[str, list[str]]:
    """Return field -> [meaning, unit, default, range] of every table of fields on the page."""
    found: dict[str, list[str]] = {}
    for line in PAGE.splitlines():
        named = re.match(r"\| `([a-z_.\[\]]+)` \|", line)
        if named:
            assert named[1] not in found, f"{named[1]} has two lines"
            found[named[1]] = [cell.strip() for cell in line.strip().strip("|").split("|")[1:]]
    return found


@pytest.mark.parametrize("field", scene_fields(), ids=lambda field: field.path)
def test_a_field_has_a_line_with_its_unit_default_and_range(field: FieldLine) -> None:
    assert field.path in rows(), f"docs/scene.md has no line for {field.path}"
    meaning, unit, default, allowed = rows()[field.path]
    assert meaning
    assert (unit, default, allowed) == (field.unit, field.default, field.allowed)


def test_the_page_has_no_line_for_a_field_that_does_not_exist() -> None:
    assert set(rows()) == {field.path for field in scene_fields()}


@pytest.mark.parametrize("dimension", [item for item in Dimension if item.unit], ids=lambda item: item.name)
def test_every_unit_is_listed(dimension: Dimension) -> None:
    table = [
        [cell.strip() for cell in line.strip().strip("|").split("|")]
        for line in PAGE.splitlines()
        if line.startswith(f"| {dimension.name.lower()} |")
    ]
    assert len(table) == 1
    _, unit, others = table[0]
    listed = {unit, *(re.sub(r" \(.*\)", "", other) for other in others.split(", "))}
    assert listed == set(dimension.units)
    assert unit == dimension.unit


def test_the_first_block_is_the_default_scene() -> None:
    assert parse_scene_text(BLOCKS[0]) == Scene()


@pytest.mark.parametrize("block", BLOCKS)
def test_every_block_of_json_is_a_scene(block: str) -> None:
    parse_scene_text(block)


def test_the_worked_examples_do_what_the_page_says() -> None:
    _, _fingertip, lowered, channels, before, change, after = BLOCKS
    texture = parse_scene_text(lowered).texture
    assert (texture.period, texture.amplitude) == (0.001, 5e-6)
    output = parse_scene_text(channels).output
    assert [(channel.quantity, channel.full_scale) for channel in output.channel_list] == [
        ("displacement", 20e-6),
        ("velocity", None),
    ]
    assert (output.bandwidth, output.sample_rate) == (1000.0, 8000)
    assert merge_patch(object_from_text(before), object_from_text(change)) == object_from_text(after)
    assert parse_scene(object_from_text(before)).scan.stroke is not None
