"""The JSON Schema of a scene, and the lines for its documentation, agree with what a scene accepts and refuses."""

from __future__ import annotations

import json
import math
import sys
from typing import Any

import jsonschema_rs
import pytest
from hypothesis import given

from synth.scene.quantity import QuantityError, parse_quantity
from synth.scene.rules import Quantity
from synth.scene.scene import Scene, parse_scene, scene_document, scene_fields, scene_schema
from synth.scene.texture_registry import kinds_with
from tests.synth.scene.scene_cases import RULES, at, nested, quantity_fields, scenes

SCHEMA = jsonschema_rs.validator_for(scene_schema())


@pytest.mark.parametrize(("path", "rule"), quantity_fields(), ids=lambda item: item if isinstance(item, str) else "")
def test_the_json_schema_refuses_what_the_scene_refuses(path: str, rule: Quantity) -> None:
    below = math.nextafter(rule.low, -math.inf) if rule.low else -sys.float_info.min
    above = math.nextafter(rule.high, math.inf)
    refused: list[object] = [below, above, True, "", "1", "1 parsec", [], {}]
    for value in refused:
        assert not SCHEMA.is_valid(nested(path, value)), value


def test_every_field_of_the_schema_has_a_sentence_a_default_and_a_range() -> None:
    def walk(schema: dict[str, Any]) -> None:
        for name, field in schema.get("properties", {}).items():
            assert field["description"].endswith("."), name
            assert "default" in field, name
            inner = [option for option in field["anyOf"] if "properties" in option]
            if inner:
                walk(inner[0])
            else:
                assert field["x-allowed"], name
                assert "x-unit" in field, name
            assert jsonschema_rs.is_valid(field, field["default"]), name

    schema = scene_schema()
    assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    json.dumps(schema, allow_nan=False)
    assert jsonschema_rs.meta.is_valid(schema)
    walk(schema)


def test_the_lines_for_documentation_hold_defaults_that_the_scene_has() -> None:
    for line in scene_fields():
        assert line.description.endswith("."), line.path
        if line.unit and line.default != "null" and line.path in RULES:
            assert _reads(line.default, line.path)


def of_kind(path: str) -> Scene:
    """Return the scene with the defaults of the kind of texture that has the field at `path`."""
    kinds = kinds_with(path.rpartition(".")[2]) if path.startswith("texture.") else ()
    given = {"kind": kinds[0]} if kinds else {}
    return parse_scene({"texture": given | ({"heights": [0, 1e-6]} if kinds == ("profile",) else {})})


def _reads(text: str, path: str) -> bool:
    rule = RULES[path]
    try:
        stroke = parse_scene({"scan": {"stroke": {}}})
        default = at(stroke if "stroke" in path else of_kind(path), path)
        return parse_quantity(text, rule.dimension) == default
    except QuantityError:
        return False


@given(scenes())
def test_the_json_schema_accepts_every_scene(document: dict[str, Any]) -> None:
    assert SCHEMA.is_valid(document)
    assert SCHEMA.is_valid(scene_document(parse_scene(document)))
