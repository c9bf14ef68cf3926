"""The schemas that OpenAPI names: a scene and its parts, a session, a plan, a table, a problem, and other answers.

Model: generators of clients make a class of each component, so every object and every list of names inside a scene is
    a component: `Finger`, `Texture`, `TextureKind`. They are made from `synth.scene.scene.scene_schema`, which stays
    whole. A field's default is `x-default` and a sentence here, not `default`: generators write a `default` into each
    request and refuse an object as one. In a scene, a field that is absent is not a field with its default: `amplitude`
    beside `roughness` is refused, and a `period` beside a name of the catalogue takes the place of the catalogue's.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from service import problems
from synth.scene.scene import scene_schema

Schema = dict[str, Any]

_TEXT, _NUMBER, _WHOLE, _FLAG = {"type": "string"}, {"type": "number"}, {"type": "integer"}, {"type": "boolean"}
_NUMBERS, _TEXTS = {"type": "array", "items": _NUMBER}, {"type": "array", "items": _TEXT}
_LEVEL = {"type": ["number", "null"]}
_OBJECT = {"type": "object"}


def _object(fields: Mapping[str, Any], optional: tuple[str, ...] = ()) -> Schema:
    """Return the schema of an object of these fields, all of them required but the optional ones."""
    required = [name for name in fields if name not in optional]
    return {"type": "object", "required": required, "properties": dict(fields)}


def _reference(name: str) -> Schema:
    return {"$ref": f"#/components/schemas/{name}"}


def _or_null(schema: Schema) -> Schema:
    return {"anyOf": [schema, {"type": "null"}]}


def _list_of(schema: Schema) -> Schema:
    return {"type": "array", "items": schema}


_METHOD = _object(
    {
        "method": _TEXT,
        "family": _TEXT | {"enum": ["baseline", "sampled", "exact", "table", "harmonics", "closed"]},
        "max_error": _NUMBER | {"description": "Largest error over a period, relative to the peak-to-peak."},
        "rms_error": _NUMBER | {"description": "The same, root mean square."},
        "error_m": _NUMBER | {"description": "Largest error as a displacement, in metres."},
        "worst_harmonic_db": _LEVEL | {"description": "Largest error of a harmonic, re the strongest; null: no error."},
        "threshold_margin_db": _LEVEL | {"description": "How far errors stay below the threshold; null: no error."},
        "setup_seconds": _NUMBER,
        "seconds_per_second": _NUMBER | {"description": "Computing time for a second of sound."},
        "times_real_time": _LEVEL,
        "memory_bytes": _WHOLE,
        "pareto": _FLAG | {"description": "Nothing measured is both nearer and cheaper."},
    }
)
_ACCURACY = _object(
    {
        "scene": _reference("Scene"),
        **dict.fromkeys(("quantity", "unit", "threshold", "chosen"), _TEXT),
        **dict.fromkeys(("peak_to_peak", "reference_error", "duration", "process_seconds", "compile_seconds"), _NUMBER),
        **dict.fromkeys(("sample_rate", "repeats"), _WHOLE),
        "methods": _list_of(_METHOD),
        "left_out": _list_of(_OBJECT),
    }
)
_PICTURE = _object(
    {
        "texture": _object({"period": _NUMBER, "heights": _NUMBERS}),
        "finger": _object({"begin": _NUMBER, "length": _NUMBER, "heights": _NUMBERS}),
        "response": _object({"load": _NUMBER, "foundation": _LEVEL, "heights": _NUMBERS}),
        "touching": {
            "type": ["array", "null"],
            "items": _NUMBERS,
            "description": "Begin and end (m) of each patch, a list a phase.",
        },
        "left_out": _TEXTS,
    }
)
_THRESHOLD = _object({"name": _TEXT, "frequencies": _NUMBERS, "displacement": _NUMBERS})
_PLAN = _object(
    {
        "scene": _reference("Scene"),
        "simulated": _list_of(
            _object({"name": _TEXT, "reason": _TEXT, "settings": _OBJECT, "price": _OBJECT}, ("settings", "price"))
        ),
        "left_out": _list_of(_object({"name": _TEXT, "reason": _TEXT, "effect_on_output": _LEVEL})),
        "response": _OBJECT,
        "estimated_error": {"type": "object", "additionalProperties": _NUMBER},
        "cost": {"type": ["object", "null"]},
        "warnings": _TEXTS,
    }
)
_PLAY = _object(
    {
        "device": _TEXT,
        "state": _TEXT | {"enum": ["playing", "finished", "failed"]},
        **dict.fromkeys(("frames", "underruns", "device_underflows", "dropped_frames"), _WHOLE),
        "gain_reduction_db": _NUMBER,
        "failure": {"type": ["string", "null"]},
    }
)
_SESSION = _object(
    {
        "id": _TEXT,
        "scene": _reference("Scene"),
        **dict.fromkeys(("sample_rate", "channels"), _WHOLE),
        "quantities": _TEXTS,
        "full_scale": _NUMBERS | {"description": "SI value of a sample of 1.0, one a channel."},
        "streaming": _FLAG,
        "play": _or_null(_reference("Play")),
        "expires_in": _LEVEL | {"description": "Seconds; null while somebody listens or something plays."},
        "heard_within": _NUMBER | {"description": "Seconds until a change is sent."},
        "stream": _TEXT | {"description": "Path of the stream."},
    }
)
_TABLE = _object(
    {
        "hash": _TEXT | {"description": "SHA-256 of header and arrays, 64 hexadecimal digits."},
        "url": _TEXT | {"description": "Path of the file."},
        "bytes": _WHOLE | {"description": "Of the file."},
        "covered_loads": _NUMBERS | {"description": "Lightest and heaviest load, N."},
        "loads": _WHOLE | {"description": "How many loads it holds; between them it is read by interpolation."},
        "levels": _WHOLE | {"description": "How many levels, each with fewer harmonics than the one before."},
        "harmonics": _WHOLE | {"description": "Highest harmonic of the fullest level."},
        "error": _object(dict.fromkeys(("displacement", "velocity", "acceleration"), _NUMBER))
        | {"description": "Largest error told of each quantity, relative to its peak-to-peak."},
    }
)


def components() -> dict[str, Schema]:
    """Return every component by its name."""
    found: dict[str, Schema] = {}
    _lift(scene_schema(), "scene", "", found)
    return found | {
        "AccuracyTable": _ACCURACY,
        "Picture": _PICTURE,
        "Plan": _PLAN,
        "Play": _PLAY,
        "Problem": problems.schema(),
        "Session": _SESSION,
        "Table": _TABLE,
        "Threshold": _THRESHOLD,
    }


def _lift(schema: Mapping[str, Any], name: str, owner: str, found: dict[str, Schema]) -> Schema:
    """Return `schema`, of the field `name` of `owner`; objects and lists of names in it become components in `found`.

    An object is called after its field, an item of a list after the list less its s, a list of names after both owner
    and field.
    """
    made = {key: value for key, value in schema.items() if key not in ("$schema", "title")}
    if "anyOf" in made:
        made["anyOf"] = [_lift(option, name, owner, found) for option in made["anyOf"]]
    if "items" in made:
        made["items"] = _lift(made["items"], name.removesuffix("s"), owner, found)
    if "properties" in made:
        fields = made["properties"].items()
        made["properties"] = {field: _told(_lift(inner, field, name, found)) for field, inner in fields}
        return _named(_title(name), made, found)
    if "enum" in made:
        return _named(_title(f"{owner}_{name}"), _TEXT | made, found)
    return made


def _named(name: str, schema: Schema, found: dict[str, Schema]) -> Schema:
    """Return a reference to `schema` among the components: to `name`, or to one that is the same already."""
    known = next((known for known, other in found.items() if other == schema), name)
    assert found.setdefault(known, schema) == schema, f"two components are called {name}"
    return _reference(known)


def _title(name: str) -> str:
    return "".join(part.capitalize() for part in name.split("_"))


def _told(field: Schema) -> Schema:
    """Return the schema of a field with its default in words; see the module."""
    if "default" not in field:
        return field
    made = {key: value for key, value in field.items() if key != "default"} | {"x-default": field["default"]}
    if not isinstance(field["default"], dict | None):
        unit = f" {field['x-unit']}" if field.get("x-unit") else ""
        made["description"] = f"{field['description']} Default: {json.dumps(field['default'])}{unit}."
    return made
