"""The JSON Schema of a scene and the lines for its documentation say what the scene reads and refuses."""

from __future__ import annotations

import json
import math
import re
import sys
from typing import Any

import pytest
from hypothesis import given

from synth.scene.quantity import QuantityError, parse_quantity
from synth.scene.rules import Quantity
from synth.scene.scene import Scene, parse_scene, scene_document, scene_fields, scene_schema
from synth.scene.texture_registry import kinds_with
from tests.synth.scene.scene_cases import RULES, at, nested, quantity_fields, scenes

WORDS = {"description", "default", "title", "$schema", "x-unit", "x-allowed"}


def fits(value: Any, schema: dict[str, Any]) -> bool:
    """Return whether `value` is what `schema` describes; knows the keywords that scene_schema uses, and no others."""
    in_order = sorted(set(schema) - WORDS, key=lambda keyword: keyword != "type")
    return all(_keeps(value, keyword, schema) for keyword in in_order)


def _keeps(value: Any, keyword: str, schema: dict[str, Any]) -> bool:
    told = schema[keyword]
    match keyword:
        case "anyOf":
            return any(fits(value, option) for option in told)
        case "type":
            return _is_json(value, str(told))
        case "enum":
            return bool(value in told)
        case "const":
            return bool(value == told)
        case "minimum":
            return bool(value >= told)
        case "maximum":
            return bool(value <= told)
        case "maxLength" | "maxItems":
            return bool(len(value) <= told)
        case "minItems":
            return bool(len(value) >= told)
        case "pattern":
            return re.search(told, value) is not None
        case "items":
            return all(fits(item, told) for item in value)
        case "prefixItems":
            return all(fits(item, inner) for item, inner in zip(value, told, strict=False))
        case "properties":
            return all(fits(item, told[name]) for name, item in value.items() if name in told)
        case "additionalProperties":
            rest = [item for name, item in value.items() if name not in schema.get("properties", {})]
            return not rest if told is False else all(fits(item, told) for item in rest)
    raise AssertionError(f"the schema uses a keyword that this test does not know: {keyword}")


def _is_json(value: Any, name: str) -> bool:
    number = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    kinds = {
        "null": value is None,
        "string": isinstance(value, str),
        "number": number,
        "integer": number and float(value).is_integer(),
        "array": isinstance(value, list | tuple),
        "object": isinstance(value, dict),
    }
    return kinds[name]


@pytest.mark.parametrize(("path", "rule"), quantity_fields(), ids=lambda item: item if isinstance(item, str) else "")
def test_the_json_schema_refuses_what_the_scene_refuses(path: str, rule: Quantity) -> None:
    below = math.nextafter(rule.low, -math.inf) if rule.low else -sys.float_info.min
    above = math.nextafter(rule.high, math.inf)
    refused: list[object] = [below, above, True, "", "1", "1 parsec", [], {}, math.nan]
    for value in refused:
        assert not fits(nested(path, value), scene_schema()), value


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
            assert fits(field["default"], field), name

    schema = scene_schema()
    assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    json.dumps(schema, allow_nan=False)
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
    assert fits(document, scene_schema())
    assert fits(scene_document(parse_scene(document)), scene_schema())
