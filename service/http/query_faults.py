"""Faults of query parameters: what the route allows, in words, from the schema of its parameters.

Limits: a parameter is a choice, a boolean or a number. Its unit is `x-unit` of its schema.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from starlette.requests import HTTPConnection, Request

from service.problems import refused
from synth.errors import Fault, shown
from synth.scene.rules import nearest

LONGEST_NAME = 100  # characters of an unknown parameter's name in an answer

Schema = Mapping[str, Any]


async def each_once(connection: HTTPConnection) -> None:
    """Refuse a parameter that is given twice, where the route reads its query: the framework takes the last one."""
    if connection.scope["route"].dependant.query_params:
        given = Counter(name for name, _ in connection.query_params.multi_items())
        for name in (name for name, times in given.items() if times > 1):
            raise refused(f"?{_shortened(name)}", "the same parameter more than once", "each once", "Keep one of them.")


def query_faults(request: Request, errors: Sequence[Mapping[str, Any]]) -> tuple[Fault, ...]:
    """Return the faults of the query of `request`, from the `errors` of its validation."""
    (parameters,) = request.scope["route"].dependant.query_params
    schema: Schema = parameters.field_info.annotation.model_json_schema()
    return tuple(_fault(schema, entry) for entry in errors)


def _fault(schema: Schema, entry: Mapping[str, Any]) -> Fault:
    name, known = str(entry["loc"][-1]), schema["properties"]
    if name not in known:
        near = nearest(name, known)
        hint = f'The nearest known parameter is "{near}".' if near else "Leave it out."
        return Fault(f"?{_shortened(name)}", "an unknown parameter", f"the parameters {', '.join(known)}", hint)
    value = entry.get("input")
    return Fault(f"?{name}", shown(value), *_allowed(_described(schema, known[name]), str(value)))


def _shortened(name: str) -> str:
    return name if len(name) <= LONGEST_NAME else name[: LONGEST_NAME - 3] + "..."


def _described(schema: Schema, field: Schema) -> Schema:
    """Return the schema of a field itself, in place of a reference to it or of a choice between it and null."""
    for one in field.get("anyOf", ()):
        if one.get("type") != "null":
            return {**field, **_described(schema, one)}
    if "$ref" in field:
        found: Schema = schema["$defs"][field["$ref"].rpartition("/")[2]]
        return found
    return field


def _allowed(field: Schema, value: str) -> tuple[str, str]:
    """Return what a field allows, and what to write instead of `value`."""
    if "enum" in field:
        return ", ".join(field["enum"]), f"Write {nearest(value, field['enum']) or field['enum'][0]}."
    if field["type"] == "boolean":
        return "true or false", "Write true or false."
    unit = f" {field['x-unit']}" if "x-unit" in field else ""
    whole = "a whole number, " if field["type"] == "integer" else ""
    low, high = field["minimum"], field.get("maximum")
    allowed = f"{low:g}{unit} or more" if high is None else f"{low:g} to {high:g}{unit}"
    return whole + allowed, f"Write a number{' without its unit' if unit else ''}, such as {low:g}."
