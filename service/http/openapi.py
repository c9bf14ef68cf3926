"""The parts of the OpenAPI document that the framework cannot derive: JSON bodies, sound and problem documents."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from fastapi import FastAPI
from starlette.responses import JSONResponse

from service import problems
from service.http.openapi_components import components
from synth.encode.containers import media_types
from synth.encode.samples import SoundFormat

Answers = dict[int | str, dict[str, Any]]

_ALWAYS = ("bad-request", "key-required", "host-refused", "origin-refused", "rate-limited", "internal", "closing")
_HEADERS = {
    "Ridgewave-Format": "Format, rate and channels of the samples, as in f32le;rate=48000;channels=1.",
    "Ridgewave-Full-Scale": "SI value of a sample of 1.0, one per channel.",
    "Ridgewave-Quantities": "Quantity of each channel.",
}
PROBLEM = {"$ref": "#/components/schemas/Problem"}
BINARY = {"schema": {"type": "string", "format": "binary"}}
SCENE = {"$ref": "#/components/schemas/Scene"}


class SchemaResponse(JSONResponse):
    """A JSON Schema, with its own media type."""

    media_type = "application/schema+json"


def audio(*problem_names: str, flac: bool, part: bool = False) -> Answers:
    """Return the answers of a route that sends sound, including the problems of these names.

    part: whether it answers Range.
    """
    formats = [kind for kind in SoundFormat if flac or kind is not SoundFormat.FLAC]
    kinds = dict.fromkeys(media_types(kind)[0] for kind in formats)
    headers = {name: {"description": text, "schema": {"type": "string"}} for name, text in _HEADERS.items()}
    sound = {"description": "The sound.", "headers": headers, "content": {kind: BINARY for kind in kinds}}
    parts = {206: sound | {"description": "The bytes that Range names."}} if part else {}
    return {200: sound} | parts | problem_answers(*problem_names)


def answer_of(schema: str | Mapping[str, Any], description: str, status: int = 200) -> Answers:
    """Return the answer of a route that sends JSON.

    schema: a JSON Schema, or the name of a component.
    """
    found = {"$ref": f"#/components/schemas/{schema}"} if isinstance(schema, str) else dict(schema)
    content = {"application/json": {"schema": found}}
    return {status: {"description": description, "content": content}}


def problem_answers(*names: str) -> Answers:
    """Return the problem answers of a route, including those that every request can get."""
    answers: Answers = {}
    for name in dict.fromkeys((*names, *_ALWAYS)):
        kind = problems.TYPES[name]
        answer = answers.setdefault(
            kind.status, {"description": "", "content": {problems.MEDIA_TYPE: {"schema": PROBLEM}}}
        )
        answer["description"] = f"{answer['description']} {kind.name}: {kind.when}".strip()
    return answers


def body(schema: Mapping[str, Any], files: Iterable[str] = ()) -> dict[str, Any]:
    """Return the `openapi_extra` of a route that reads its own JSON body, or files of these media types."""
    content = {"application/json": {"schema": schema}} | dict.fromkeys(sorted(files), BINARY)
    return {"requestBody": {"required": True, "content": content}}


def _drop_validation_errors(paths: Mapping[str, Any], schemas: dict[str, Any]) -> None:
    """Remove the 422 that the framework adds to each route with a parameter; the service answers a problem instead."""
    for calls in paths.values():
        for call in calls.values():
            if "application/json" in call["responses"].get("422", {}).get("content", {}):
                del call["responses"]["422"]
    for name in ("HTTPValidationError", "ValidationError"):
        schemas.pop(name, None)


def document(app: FastAPI) -> dict[str, Any]:
    """Return the OpenAPI document of `app`; it is made once."""
    if app.openapi_schema is None:
        made = FastAPI.openapi(app)
        schemas = made.setdefault("components", {}).setdefault("schemas", {})
        _drop_validation_errors(made["paths"], schemas)
        schemas |= components()
        made["components"]["securitySchemes"] = {"key": {"type": "http", "scheme": "bearer"}}
        made["security"] = [{}, {"key": []}]
        app.openapi_schema = made
    return app.openapi_schema
