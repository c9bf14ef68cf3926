"""What OpenAPI says about bodies and answers that the framework cannot see: scenes in, audio and problems out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fastapi import FastAPI
from starlette.responses import JSONResponse

from service import problems
from synth.scene import scene_schema

Answers = dict[int | str, dict[str, Any]]

_BINARY = {"schema": {"type": "string", "format": "binary"}}
_ALWAYS = ("bad-request", "key-required", "host-refused", "origin-refused", "rate-limited", "internal")
_HEADERS = {
    "Ridgewave-Format": "Format, rate and channels of the samples, as in f32le;rate=48000;channels=1.",
    "Ridgewave-Full-Scale": "SI value of a sample of 1.0, one a channel.",
    "Ridgewave-Quantities": "Quantity of each channel.",
}
PROBLEM = {"$ref": "#/components/schemas/Problem"}
SCENE = {"$ref": "#/components/schemas/Scene"}
ANY_OBJECT = {"type": "object"}
_TEXT, _NUMBER, _WHOLE = {"type": "string"}, {"type": "number"}, {"type": "integer"}
_LEVEL = {"type": ["number", "null"]}
_METHOD = {
    "method": _TEXT,
    "family": {"enum": ["baseline", "sampled", "exact", "table", "harmonics", "closed"]},
    "max_error": _NUMBER | {"description": "Largest error over a period, relative to the peak-to-peak."},
    "rms_error": _NUMBER | {"description": "The same, root mean square."},
    "error_m": _NUMBER | {"description": "Largest error as a displacement, in metres."},
    "worst_harmonic_db": _LEVEL | {"description": "Largest error of a harmonic, re the strongest; null: no error."},
    "threshold_margin_db": _LEVEL | {"description": "How far errors stay below the threshold; null: no error."},
    "setup_seconds": _NUMBER,
    "seconds_per_second": _NUMBER | {"description": "Computing time for a second of sound."},
    "times_real_time": _LEVEL,
    "memory_bytes": _WHOLE,
    "pareto": {"type": "boolean", "description": "Nothing measured is both nearer and cheaper."},
}
_ACCURACY = {
    "scene": SCENE,
    **dict.fromkeys(("quantity", "unit", "threshold", "chosen"), _TEXT),
    **dict.fromkeys(("peak_to_peak", "reference_error", "duration"), _NUMBER),
    **dict.fromkeys(("sample_rate", "repeats"), _WHOLE),
    "methods": {"type": "array", "items": {"type": "object", "required": list(_METHOD), "properties": _METHOD}},
    "left_out": {"type": "array", "items": {"type": "object"}},
}
ACCURACY = {"type": "object", "required": list(_ACCURACY), "properties": _ACCURACY}
_NUMBERS = {"type": "array", "items": _NUMBER}
_PICTURE = {
    "texture": {"period": _NUMBER, "heights": _NUMBERS},
    "finger": {"begin": _NUMBER, "length": _NUMBER, "heights": _NUMBERS},
    "response": {"load": _NUMBER, "foundation": {"type": ["number", "null"]}, "heights": _NUMBERS},
}
PICTURE = {
    "type": "object",
    "required": [*_PICTURE, "touching", "left_out"],
    "properties": {
        name: {"type": "object", "required": list(fields), "properties": fields} for name, fields in _PICTURE.items()
    }
    | {
        "touching": {
            "type": ["array", "null"],
            "items": _NUMBERS,
            "description": "Begin and end (m) of each patch, a list a phase.",
        },
        "left_out": {"type": "array", "items": _TEXT},
    },
}
_THRESHOLD = {"name": _TEXT, "frequencies": _NUMBERS, "displacement": _NUMBERS}
THRESHOLD = {"type": "object", "required": list(_THRESHOLD), "properties": _THRESHOLD}


class SchemaResponse(JSONResponse):
    """A JSON Schema, by its own media type."""

    media_type = "application/schema+json"


def audio(*problem_names: str, flac: bool) -> Answers:
    """Return the answers of a route that sends sound, and the problems it can end in."""
    kinds = ("audio/wav", *(("audio/flac",) if flac else ()), "audio/L16", "application/octet-stream")
    headers = {name: {"description": text, "schema": {"type": "string"}} for name, text in _HEADERS.items()}
    sound = {"description": "The sound.", "headers": headers, "content": {kind: _BINARY for kind in kinds}}
    return {200: sound} | problem_answers(*problem_names)


def answer_of(schema: str, description: str) -> Answers:
    """Return the answer of a route that sends JSON of a schema among the components."""
    content = {"application/json": {"schema": {"$ref": f"#/components/schemas/{schema}"}}}
    return {200: {"description": description, "content": content}}


def problem_answers(*names: str) -> Answers:
    """Return the problem documents of a route, those that any request can meet included."""
    answers: Answers = {}
    for name in (*names, *_ALWAYS):
        kind = problems.TYPES[name]
        answer = answers.setdefault(
            kind.status, {"description": "", "content": {problems.MEDIA_TYPE: {"schema": PROBLEM}}}
        )
        answer["description"] = f"{answer['description']} {kind.name}: {kind.when}".strip()
    return answers


def body(schema: Mapping[str, Any], *, required: bool = True, media_type: str = "application/json") -> dict[str, Any]:
    """Return the `openapi_extra` of a route that reads its own JSON body."""
    return {"requestBody": {"required": required, "content": {media_type: {"schema": schema}}}}


def _drop_validation_errors(paths: Mapping[str, Any], schemas: dict[str, Any]) -> None:
    """Remove the 422 that the framework adds to each route with a parameter: here those are problem documents."""
    for calls in paths.values():
        for call in calls.values():
            if "application/json" in call["responses"].get("422", {}).get("content", {}):
                del call["responses"]["422"]
    for name in ("HTTPValidationError", "ValidationError"):
        schemas.pop(name, None)


def document(app: FastAPI) -> dict[str, Any]:
    """Return the OpenAPI document, with the schemas that routes refer to; made once."""
    if app.openapi_schema is None:
        made = FastAPI.openapi(app)
        schemas = made.setdefault("components", {}).setdefault("schemas", {})
        _drop_validation_errors(made["paths"], schemas)
        schemas["Problem"] = problems.schema()
        schemas["Scene"] = scene_schema()
        schemas |= {"Accuracy": ACCURACY, "Picture": PICTURE, "Threshold": THRESHOLD}
        made["components"]["securitySchemes"] = {"key": {"type": "http", "scheme": "bearer"}}
        made["security"] = [{}, {"key": []}]
        app.openapi_schema = made
    return app.openapi_schema
