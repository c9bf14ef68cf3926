"""The OpenAPI document: media types of sounds and problems, and the schemas of scenes."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import pytest
from fastapi import FastAPI

from service import problems
from service.app import create_app
from tests.service.harness import ROOT, ask, settings_of


@pytest.fixture
def document(app: FastAPI) -> dict[str, Any]:
    answer = ask(app, "GET", "/openapi.json")
    assert answer.status_code == 200
    made: dict[str, Any] = answer.json()
    return made


def operations(document: dict[str, Any]) -> dict[str, dict[str, Any]]:
    return {
        f"{method.upper()} {path}": call for path, calls in document["paths"].items() for method, call in calls.items()
    }


def test_audio_has_its_media_types(document: dict[str, Any]) -> None:
    calls = operations(document)
    finite = calls["POST /v1/render"]["responses"]["200"]["content"]
    assert set(finite) == {"audio/wav", "audio/flac", "audio/L16", "application/octet-stream"}
    endless = calls["GET /v1/sessions/{session_id}/stream"]["responses"]["200"]["content"]
    assert set(endless) == set(finite) - {"audio/flac"}


def test_every_error_is_a_problem_document(document: dict[str, Any]) -> None:
    for name, call in operations(document).items():
        for status, answer in call["responses"].items():
            if int(status) >= 400:
                content = answer["content"]
                assert content == {problems.MEDIA_TYPE: {"schema": {"$ref": "#/components/schemas/Problem"}}}, name


def test_every_reference_has_a_target(document: dict[str, Any]) -> None:
    def walk(value: Any) -> None:
        if isinstance(value, dict):
            if isinstance(value.get("$ref"), str):
                target: Any = document
                for part in value["$ref"].removeprefix("#/").split("/"):
                    target = target[part]
            for item in value.values():
                walk(item)
        elif isinstance(value, list):
            for item in value:
                walk(item)

    walk(document)


def test_bodies_are_scenes(document: dict[str, Any]) -> None:
    calls = operations(document)
    names = ("render", "explain", "analyze", "accuracy", "sessions", "tables")
    for name in (f"POST /v1/{one}" for one in names):
        schema = calls[name]["requestBody"]["content"]["application/json"]["schema"]
        assert schema == {"$ref": "#/components/schemas/Scene"}
    assert "texture" in document["components"]["schemas"]["Scene"]["properties"]


def test_operations_have_the_names_of_the_docs(document: dict[str, Any]) -> None:
    page = (ROOT / "docs" / "http.md").read_text("utf-8")
    promised = re.findall(r"^\| `(\w+)` \| `([A-Z]+ /\S*)` \|$", page, re.M)
    assert promised == [(call["operationId"], name) for name, call in operations(document).items()]
    assert len({name for name, _ in promised}) == len(promised)


def test_a_scene_is_made_of_named_parts_without_defaults(document: dict[str, Any]) -> None:
    def inside(value: Any) -> Iterator[dict[str, Any]]:
        if isinstance(value, dict):
            yield value
        for item in value.values() if isinstance(value, dict) else value if isinstance(value, list) else ():
            yield from inside(item)

    schemas = document["components"]["schemas"]
    served = ask(create_app(settings_of()), "GET", "/v1/scene/schema.json").json()
    assert set(schemas["Scene"]["properties"]) == set(served["properties"])
    for name in ("Scene", "Finger", "Texture", "Scan", "Stroke", "Effects", "Output", "Channel", "Accuracy"):
        for field, made in schemas[name]["properties"].items():
            parts = list(inside(made))
            assert not any({"properties", "enum", "default"} & set(part) for part in parts), (name, field)


def test_the_body_of_a_change_is_a_scene(document: dict[str, Any]) -> None:
    content = operations(document)["PATCH /v1/sessions/{session_id}"]["requestBody"]["content"]
    assert content["application/json"]["schema"] == {"$ref": "#/components/schemas/Scene"}


def test_the_page_is_plain_and_forbids_scripts(app: FastAPI) -> None:
    answer = ask(app, "GET", "/docs")
    assert answer.headers["content-type"].startswith("text/html")
    assert answer.headers["content-security-policy"].startswith("default-src 'none'")
    assert answer.headers["x-content-type-options"] == "nosniff"
    assert ask(app, "GET", "/").headers["location"] == "/docs"


def test_health_answers_head_too(app: FastAPI) -> None:
    for method in ("GET", "HEAD"):
        assert ask(app, method, "/healthz").status_code == 200
    assert ask(app, "HEAD", "/readyz").status_code == 503
