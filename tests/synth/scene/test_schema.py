"""The JSON Schema of a scene, and the lines for its documentation, agree with what a scene accepts and refuses."""

from __future__ import annotations

import json
import math
import sys
from itertools import product
from typing import Any

import jsonschema_rs
import pytest
from hypothesis import given

from synth.errors import Fault, SceneError
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


GIVEN: dict[str, object] = {
    "amplitudes": [1e-5],
    "phases": [0.0],
    "heights": [0.0, 1e-6],
    "file": "a.csv",
    "pattern": "loop",
    "seed": 1,
}
"""Values of the fields that a number of 1e-3 does not suit."""


@pytest.mark.parametrize("section", ["finger", "texture", "effects"])
def test_a_field_with_needs_is_refused_where_they_are_not_met_and_nowhere_else(section: str) -> None:
    sections = scene_schema()["properties"]
    properties = {name: sections[name]["anyOf"][0]["properties"] for name in ("finger", "texture", section)}
    owners = ("finger", "texture") if section == "effects" else (section,)
    kinds = [(owner, kind) for owner in owners for kind in own_kinds(properties[owner]["kind"]["anyOf"][0]["enum"])]
    fields = {name: field for name, field in properties[section].items() if name != "kind"}
    for (name, field), (owner, kind) in product(fields.items(), kinds):
        document: dict[str, Any] = {owner: {"kind": kind}}
        document.setdefault(section, {})[name] = {} if section == "effects" else GIVEN.get(name, 1e-3)
        faults = [fault for fault in faults_of(document) if fault.pointer == f"/{section}/{name}"]
        refused = any(fault.hint.startswith("Leave it out") for fault in faults)
        assert refused == (kind not in field.get("x-needs", {}).get(f"{owner}.kind", [kind])), (name, kind)


def own_kinds(kinds: list[str]) -> list[str]:
    """Return the kinds that have fields of their own, and some of the catalogue's, whose names have a dash."""
    return [kind for kind in kinds if "-" not in kind] + [kind for kind in kinds if "-" in kind][::15]


def faults_of(document: dict[str, Any]) -> list[Fault]:
    """Return the faults of a scene."""
    try:
        parse_scene(document)
    except SceneError as error:
        return list(error.faults)
    return []


def test_the_lines_for_documentation_hold_defaults_that_the_scene_has() -> None:
    for line in scene_fields():
        assert line.description.endswith("."), line.path
        if line.unit and line.default != "null" and line.path in RULES:
            assert _reads(line.default, line.path)


def of_kind(path: str) -> Scene:
    """Return the scene with the defaults of the kind of texture that has the field at `path`."""
    kinds = kinds_with(path.rpartition(".")[2]) if path.startswith("texture.") else ()
    needed: dict[str, dict[str, Any]] = {"profile": {"heights": [0, 1e-6]}, "heightmap": {"rows": [[0, 1e-6], [0, 0]]}}
    return parse_scene({"texture": {"kind": kinds[0], **needed.get(kinds[0], {})} if kinds else {}})


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
