"""OpenAPI says what the service does: audio and problems by their media types, scenes and problems by their schemas."""

from __future__ import annotations

from typing import Any

import pytest
from fastapi import FastAPI

from service import problems
from tests.service.harness import ask


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


def test_every_reference_leads_somewhere(document: dict[str, Any]) -> None:
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
    for name in ("POST /v1/render", "POST /v1/explain", "POST /v1/accuracy", "POST /v1/sessions"):
        schema = calls[name]["requestBody"]["content"]["application/json"]["schema"]
        assert schema == {"$ref": "#/components/schemas/Scene"}
    assert "texture" in document["components"]["schemas"]["Scene"]["properties"]


def test_operations_have_names_of_their_own(document: dict[str, Any]) -> None:
    names = [call["operationId"] for call in operations(document).values()]
    assert len(names) == len(set(names))


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
