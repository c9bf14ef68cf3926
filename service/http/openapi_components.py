"""The named schemas of the OpenAPI document: a scene and its parts, a session, a plan, a table, and other answers.

Model: client generators make a class of each component. Every object and every enumeration inside a scene is therefore
    a component, such as `Finger`, `Texture` and `TextureKind`, made from `synth.scene.scene.scene_schema`. A field's
    default is written as `x-default` and in its description, not as `default`: generators send every `default` with
    each request, and they reject a default that is an object. Sending a default can change a scene: `amplitude` beside
    `roughness` is refused, and a `period` replaces that of the catalogue entry named by `kind`.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from synth.scene.scene import scene_schema

Schema = dict[str, Any]

STORED_NAME: Schema = {
    "type": "string",
    "pattern": "^[a-z0-9][a-z0-9-]{0,63}$",
    "description": "The name of an imported texture.",
}
_TEXT, _NUMBER, _WHOLE, _FLAG = {"type": "string"}, {"type": "number"}, {"type": "integer"}, {"type": "boolean"}
_NUMBERS, _TEXTS = {"type": "array", "items": _NUMBER}, {"type": "array", "items": _TEXT}
_LEVEL = {"type": ["number", "null"]}
_OBJECT = {"type": "object"}


def _object(fields: Mapping[str, Any], optional: tuple[str, ...] = ()) -> Schema:
    """Return the schema of an object in which every field is required, except those in `optional`."""
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
        "threshold_margin_db": _LEVEL | {"description": "Margin of the errors below the threshold; null: no error."},
        "setup_seconds": _NUMBER,
        "seconds_per_second": _NUMBER | {"description": "Processor time per second of sound."},
        "times_real_time": _LEVEL,
        "memory_bytes": _WHOLE,
        "pareto": _FLAG | {"description": "No other method is both more accurate and cheaper."},
    }
)
_ACCURACY = _object(
    {
        "scene": _reference("Scene"),
        **dict.fromkeys(("quantity", "unit", "threshold", "measured", "chosen"), _TEXT),
        **dict.fromkeys(("peak_to_peak", "reference_error", "duration", "process_seconds", "compile_seconds"), _NUMBER),
        **dict.fromkeys(("sample_rate", "repeats"), _WHOLE),
        "methods": _list_of(_METHOD),
        "left_out": _list_of(_OBJECT),
    }
)
_PICTURE = _object(
    {
        "texture": _object(
            {"period": _NUMBER, "heights": _NUMBERS, "across": _NUMBER, "area": _list_of(_NUMBERS)}, ("across", "area")
        ),
        "finger": _object({"begin": _NUMBER, "length": _NUMBER, "heights": _NUMBERS}),
        "response": _object({"load": _NUMBER, "foundation": _LEVEL, "heights": _NUMBERS}),
        "touching": {
            "type": ["array", "null"],
            "items": _NUMBERS,
            "description": "One list per phase: begin and end (m) of each patch.",
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
_RECEPTOR = _object(
    {
        "receptor": _TEXT | {"enum": ["SA1", "RA", "PC"]},
        "depth": _NUMBER | {"description": "m."},
        "strain": _NUMBER | {"description": "rms at the depth; of SA1 the amplitude of the strongest wave."},
        "drive": _NUMBER | {"description": "rms of its rate behind the low-pass of the class, 1/s."},
        "power": _NUMBER | {"description": "Sum of (amplitude / threshold)^2."},
        "level": _LEVEL | {"description": "Strongest line over its threshold, dB; null where nothing moves."},
        "frequency": _NUMBER | {"description": "Of this line, Hz; of SA1 its wavelength, m."},
        "components": _WHOLE | {"description": "Lines, of a recording thirds of an octave, felt beside the others."},
    }
)
_ANALYSIS = _object(
    {
        "whole_finger_level": _LEVEL | {"description": "Strongest line of the whole finger over its threshold, dB."},
        "receptors": _list_of(_RECEPTOR),
        "pacinian_power": _NUMBER,
        "intensity": _NUMBER | {"description": "Of the vibration, in thresholds."},
        "spatial_variation": _NUMBER | {"description": "Of the pattern, in thresholds of SA1; a recording has none."},
        "felt_by": _TEXT | {"enum": ["vibration and spatial pattern", "vibration", "spatial pattern", "nothing"]},
        "warnings": _TEXTS | {"description": "Of a recording."},
    },
    ("spatial_variation", "warnings"),
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
        "full_scale": _NUMBERS | {"description": "SI value of a sample of 1.0, one per channel."},
        "streaming": _FLAG,
        "play": _or_null(_reference("Play")),
        "expires_in": _LEVEL | {"description": "Seconds; null while the session is read or played."},
        "heard_within": _NUMBER | {"description": "Seconds within which a change is sent."},
        "stream": _TEXT | {"description": "Path of the stream."},
    }
)
_TABLE = _object(
    {
        "hash": _TEXT | {"description": "SHA-256 of header and arrays, 64 hexadecimal digits."},
        "url": _TEXT | {"description": "Path of the file."},
        "bytes": _WHOLE | {"description": "Size of the file."},
        "covered_loads": _NUMBERS | {"description": "Lightest and heaviest load, N."},
        "loads": _WHOLE | {"description": "Number of loads; between them the table is interpolated."},
        "levels": _WHOLE | {"description": "Number of mip levels, each with fewer harmonics than the one before."},
        "harmonics": _WHOLE | {"description": "Highest harmonic of the fullest level."},
        "error": _object(dict.fromkeys(("displacement", "velocity", "acceleration"), _NUMBER))
        | {"description": "Largest stated error of each quantity, relative to its peak-to-peak."},
    }
)
_NUMBER_OF_TEXTURE = _object(
    {
        "value": {"description": "As a scene writes it: a number, text with a unit, or a list of these."},
        "source": _TEXT | {"description": "How far to trust it, then where it is from."},
    }
)
_NAMED_TEXTURE = _object(
    {
        "name": _TEXT | {"description": "Value of texture.kind."},
        **dict.fromkeys(("title", "group"), _TEXT),
        "note": _TEXT | {"description": "What a person should know who feels it; mostly empty."},
        "scene": _OBJECT | {"description": "A partial scene: the texture alone."},
        "everyday": _OBJECT | {"description": "A scene: a fingertip that scans the texture."},
        "numbers": {"type": "object", "additionalProperties": _NUMBER_OF_TEXTURE},
        "picture": _TEXT | {"description": "Path of the picture."},
        "stored": _FLAG | {"description": "Whether it was imported."},
        "address": _TEXT | {"description": "Of an imported texture: SHA-256 of its surface."},
        "report": _reference("ImportReport"),
        "created": _TEXT | {"description": "Of an imported texture: when, in UTC."},
    },
    ("numbers", "address", "report", "created"),
)
_TEXTURES = _object({"textures": _list_of(_reference("NamedTexture"))})


_REPORT = _object(
    {
        **dict.fromkeys(("file", "format", "layout", "channel"), _TEXT),
        "kind": _TEXT | {"enum": ["profile", "heightmap"]},
        "points": {"type": "array", "items": _WHOLE, "description": "Along x, then along y."},
        "spacing": _NUMBERS | {"description": "Between points, m, along x, then along y."},
        "size": _NUMBERS | {"description": "Points times spacing, m."},
        "unit": {"type": ["string", "null"], "description": "Of the heights in the file."},
        "unit_stated_by_file": _FLAG,
        "unit_of_x": {"type": ["string", "null"], "description": "Of x and y in the file."},
        "reading": {
            "type": ["object", "null"],
            "description": "How text was read: encoding, separator, decimal_sign, header_lines, columns.",
        },
        "rq": _NUMBER | {"description": "Root mean square height about the mean, m."},
        "ra": _NUMBER | {"description": "Mean absolute height about the mean, m."},
        "peak_to_valley": _NUMBER,
        "rms_slope": _NUMBERS | {"description": "Between neighbouring points, along x, then along y."},
        "level": _TEXT | {"description": "The form that was removed."},
        "resample": {"type": ["number", "null"], "description": "Given distance between points, m."},
        "missing": _object({"points": _WHOLE, "rule": _TEXT}),
        "notes": _TEXTS,
        "maps": _OBJECT | {"description": "Of a set of maps: the file of each role, green, and left_out."},
        "residual": {
            "type": ["number", "null"],
            "description": "Of a set: slopes that its displacement leaves, 0 to 1.",
        },
        "synthetic": {"type": ["object", "null"], "description": "Of a set: its synthetic waves (docs/import.md)."},
        "texture": _OBJECT | {"description": "Of a set: what a scene has beside kind and surface."},
    },
    ("maps", "residual", "synthetic", "texture"),
)
_IMPORTED = _object(
    {
        "name": _TEXT,
        "kept": _FLAG,
        "address": _TEXT | {"description": "SHA-256 of the surface, 64 hexadecimal digits."},
        "report": _reference("ImportReport"),
        "picture": _TEXT | {"description": "A data URI with a PNG."},
        "scene": _OBJECT | {"description": "The partial scene that the name stands for."},
    },
    ("scene",),
)


_FAULT = _object(dict.fromkeys(("pointer", "value", "allowed", "hint"), _TEXT))
_PROBLEM = _object(
    {
        "type": _TEXT | {"format": "uri-reference"},
        "title": _TEXT,
        "status": _WHOLE,
        "detail": _TEXT,
        "errors": _list_of(_FAULT),
        "instance": _TEXT,
    },
    ("instance",),
)


def components() -> dict[str, Schema]:
    """Return every component by its name."""
    found: dict[str, Schema] = {}
    _lift(scene_schema(), "scene", "", found)
    found["Texture"]["properties"]["kind"]["anyOf"].append(STORED_NAME)
    return found | {
        "AccuracyTable": _ACCURACY,
        "Analysis": _ANALYSIS,
        "ImportReport": _REPORT,
        "ImportedTexture": _IMPORTED,
        "NamedTexture": _NAMED_TEXTURE,
        "Picture": _PICTURE,
        "Plan": _PLAN,
        "Play": _PLAY,
        "Problem": _PROBLEM,
        "Session": _SESSION,
        "Table": _TABLE,
        "Textures": _TEXTURES,
        "Threshold": _THRESHOLD,
    }


def _lift(schema: Mapping[str, Any], name: str, owner: str, found: dict[str, Schema]) -> Schema:
    """Return `schema` with each object and enumeration inside it replaced by a reference to a component in `found`.

    name, owner: the field that has this schema, and the object that has the field. An object is named after its field,
    an item after its list without the final s, and an enumeration after owner and field.
    """
    made = {key: value for key, value in schema.items() if key not in ("$schema", "title")}
    if "anyOf" in made:
        made["anyOf"] = [_lift(option, name, owner, found) for option in made["anyOf"]]
    if "items" in made:
        made["items"] = _lift(made["items"], name.removesuffix("s"), owner, found)
    if "properties" in made:
        fields = made["properties"].items()
        made["properties"] = {field: _default_in_words(_lift(inner, field, name, found)) for field, inner in fields}
        return _named(_title(name), made, found)
    if "enum" in made:
        return _named(_title(f"{owner}_{name}"), _TEXT | made, found)
    return made


def _named(name: str, schema: Schema, found: dict[str, Schema]) -> Schema:
    """Return a reference to an equal schema among the components, or else add `schema` as `name` and refer to it."""
    known = next((known for known, other in found.items() if other == schema), name)
    assert found.setdefault(known, schema) == schema, f"two components have the name {name}"
    return _reference(known)


def _title(name: str) -> str:
    return "".join(part.capitalize() for part in name.split("_"))


def _default_in_words(field: Schema) -> Schema:
    if "default" not in field:
        return field
    made = {key: value for key, value in field.items() if key != "default"} | {"x-default": field["default"]}
    if not isinstance(field["default"], dict | None):
        unit = f" {field['x-unit']}" if field.get("x-unit") else ""
        made["description"] = f"{field['description']} Default: {json.dumps(field['default'])}{unit}."
    return made
