"""Reading and checking what a client of the live protocol sends: messages, and their faults in words.

Model: the schema of the `Version` decides. The faults of a message have the form of a scene's faults (pointer, value,
    allowed, hint).
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import jsonschema_rs

from service import problems
from service.live.messages import AREA_FIELDS, LARGEST_CREDIT, LARGEST_TIME, V2, Version
from service.problems import Problem
from service.sessions.session_ids import LONGEST_ID
from synth.errors import Fault, SceneError, shown
from synth.scene.text import object_from_text, pointer


class NotJson(ValueError):
    """Text that is not JSON. It closes the connection with 1007."""


def message_of(text: str) -> dict[str, Any]:
    """Return the JSON object in `text`.

    Raises NotJson for text that is not JSON, Problem (message-refused) for other JSON.
    """
    try:
        return object_from_text(text)
    except SceneError as error:
        if not _is_json(text):
            raise NotJson from error
        raise refusal(error.faults) from error


def check_message(message: dict[str, Any], version: Version) -> None:
    """Raise Problem (message-refused) for a message that does not fit the schema of `version`."""
    kind = message.get("type")
    validator = version.validators.get(kind) if isinstance(kind, str) else None
    if validator is None:
        raise refusal([_unknown(kind, version)])
    try:
        if validator.is_valid(message):
            return
        faults = [_fault(version, str(kind), message, error) for error in validator.iter_errors(message)]
    except ValueError:  # a lone surrogate
        fault = Fault("", "text that is not Unicode", "JSON text in Unicode", "Remove the lone surrogate.")
        raise refusal([fault]) from None
    raise refusal(list(dict.fromkeys(faults)))


def credit_of(message: Mapping[str, Any]) -> int:
    """Return the credit in a contact, even in one that is refused for something else; 0 for none."""
    credit = message.get("more", 0) if message.get("type") == "contact" else 0
    valid = isinstance(credit, int | float) and 0 <= credit <= LARGEST_CREDIT and credit == int(credit)
    return int(credit) if valid and not isinstance(credit, bool) else 0


def refusal(faults: Sequence[Fault]) -> Problem:
    """Return the problem of a message with `faults`."""
    return Problem("message-refused", problems.summary(faults), tuple(faults))


def refused(at: str, value: str, allowed: str, hint: str, kind: str = "message-refused") -> Problem:
    """Return the problem of a message with one fault."""
    return problems.refused(at, value, allowed, hint, kind)


def _is_json(text: str) -> bool:
    try:
        json.loads(text)
    except json.JSONDecodeError:
        return False
    except (ValueError, RecursionError):  # a whole number with thousands of digits, or many levels
        return True
    return True


def _unknown(kind: object, version: Version) -> Fault:
    value = "nothing" if kind is None else shown(kind)
    return Fault("/type", _printable(value), ", ".join(version.client), 'Write {"type": "contact", ...}.')


def _fault(version: Version, kind: str, message: Mapping[str, Any], error: jsonschema_rs.ValidationError) -> Fault:
    """Return `error` of a message of `kind` as a fault."""
    made, path, rule = version.client[kind], list(error.instance_path), error.kind
    fields = made["properties"]
    if isinstance(rule, jsonschema_rs.ValidationErrorKind.AdditionalProperties):
        names, at = rule.unexpected, pointer(*path, rule.unexpected[0])
        if kind == "contact" and set(AREA_FIELDS).issuperset(names):
            return _place_fault(version, message)
        allowed = ", ".join((_of_path(fields, path) if path else made)["properties"])
        given = "an unknown field" if len(names) == 1 else f"{len(names)} unknown fields"
        return Fault(at, given, allowed, "Leave it out." if len(names) == 1 else "Leave them out.")
    if not path and "oneOf" in made and error.schema_path[0] in ("oneOf", "dependentRequired"):
        return _place_fault(version, message)
    if isinstance(rule, jsonschema_rs.ValidationErrorKind.Required):
        name = str(rule.property)
        made = _of_path(fields, [*path, name])
        return Fault(pointer(*path, name), "nothing", allowed_text(made), f"Add {name}.")
    if isinstance(rule, jsonschema_rs.ValidationErrorKind.FalseSchema):
        return Fault(pointer(*path), "a value", "nothing beside resume", "Leave it out: the session keeps its own.")
    value: Any = message
    for part in path:
        value = value[part]
    made = _of_path(fields, path)
    return Fault(pointer(*path), _printable(shown(value)), allowed_text(made), _hint(made, value))


def _place_fault(version: Version, message: Mapping[str, Any]) -> Fault:
    """Return the fault of a contact that does not state in exactly one way where the finger is."""
    later = [name for name in AREA_FIELDS if name in message and not version.has_area]
    if later:
        allowed = ", ".join(version.client["contact"]["properties"])
        hint = f"Offer the subprotocol {V2.name}, which has x, y and direction."
        return Fault(pointer(later[0]), " and ".join(later), allowed, hint)
    if not version.has_area:
        both = "both" if "position" in message else "neither"
        return Fault("", f"{both} of position and speed", "exactly one of them", "Write either a position or a speed.")
    given = " and ".join(name for name in ("position", "speed", *AREA_FIELDS) if name in message)
    allowed = "position, or speed, or x and y; direction only with x and y"
    return Fault("", given or "no position, speed, x or y", allowed, "Write one of the three.")


def _of_path(fields: Mapping[str, Any], path: list[Any]) -> dict[str, Any]:
    made: dict[str, Any] = {"properties": fields}
    for part in path:
        made = made["properties"][part]
    return made


def allowed_text(made: Mapping[str, Any]) -> str:
    """Return what the schema `made` of a field allows, in words."""
    if "enum" in made:
        return " or ".join(made["enum"])
    unit = f" {made['x-unit']}" if "x-unit" in made else ""
    if made.get("maximum") == LARGEST_TIME:
        return f"any finite number of{unit}"
    if made.get("x-unit") == "N":
        return f"0 to {_digits(made['maximum'])} N; below 0 N only with adhesion"
    if made["type"] in ("integer", "number"):
        whole = "whole, " if made["type"] == "integer" else ""
        return f"{whole}{_digits(made['minimum'])} to {_digits(made['maximum'])}{unit}"
    text = f"text of at most {LONGEST_ID} characters"
    return {"object": "an object", "boolean": "true or false", "string": text}[made["type"]]


def _digits(number: float) -> str:
    """Return `number` as text, with all digits if it is whole: a client may send any whole number up to it."""
    return str(int(number)) if float(number).is_integer() else f"{number:g}"


def _hint(made: Mapping[str, Any], value: Any) -> str:
    """Return what to write in place of `value` in a field of the schema `made`."""
    if "enum" in made:
        return f"Write {made['enum'][0]}."
    if made["type"] in ("integer", "number"):
        return "Write a number without a unit." if isinstance(value, str) else "Write a number in this range."
    return f"Write {allowed_text(made)}."


def _printable(text: str) -> str:
    return text.encode("utf-8", "backslashreplace").decode("utf-8")
