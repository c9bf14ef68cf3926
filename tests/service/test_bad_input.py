"""Invalid requests: each is refused with its reason, none is an internal error."""

from __future__ import annotations

import json
from typing import Any
from urllib.parse import quote

import pytest
from fastapi import FastAPI
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from service.app import create_app
from tests.service.harness import ask, problem, settings_of
from tests.service.plain_engine import PlainEngine

JSON = {"Content-Type": "application/json"}
WRITES = ["/v1/render", "/v1/explain", "/v1/analyze", "/v1/sessions"]

TEXTS = [
    b"",
    b" ",
    b"{",
    b"[]",
    b"null",
    b'"grating"',
    b"\xff\xfe",
    b'{"scan": {"load": NaN}}',
    b'{"scan": {"load": Infinity}}',
    b'{"scan": {"load": -Infinity}}',
    b'{"scan": {"load": 1e999}}',
    b'{"scan": {"load": ' + b"9" * 5000 + b"}}",
    b'{"scan": {"load": 0.3, "load": 0.4}}',
    b'{"scan": {"load": "0.3 parsec"}}',
    b'{"scan": {"weight": 1}}',
    b'{"output": {"quantity": "\\ud800"}}',
    b'{"output": {"duration": 1e308}}',
    b"[" * 100_000,
    b'{"a":' * 50_000,
]


def refused(app: FastAPI, path: str, text: bytes) -> None:
    document = problem(ask(app, "POST", path, content=text, headers=JSON), 422, "scene-refused")
    assert document["errors"]


@pytest.mark.parametrize("text", TEXTS, ids=[repr(text[:40]) for text in TEXTS])
def test_an_invalid_scene_is_refused_with_a_fault(app: FastAPI, text: bytes) -> None:
    refused(app, "/v1/explain", text)


@pytest.mark.parametrize("path", WRITES)
def test_every_route_refuses_invalid_json_and_invalid_scenes(app: FastAPI, path: str) -> None:
    for text in (b"{", b'{"scan": {"weight": 1}}'):
        refused(app, path, text)


TYPES = ["text/plain", "application/x-www-form-urlencoded", "multipart/form-data; boundary=x", "text/json", ""]


@pytest.mark.parametrize("path", [*WRITES, "/v1/sessions/x/play", "/v1/stop"])
def test_only_json_is_accepted(app: FastAPI, engine: PlainEngine, path: str) -> None:
    for kind in TYPES:
        problem(ask(app, "POST", path, content=b"{}", headers={"Content-Type": kind}), 415, "not-json")
    assert engine.opened == []


@pytest.mark.parametrize("path", WRITES)
def test_a_body_without_a_type_is_not_json(app: FastAPI, path: str) -> None:
    problem(ask(app, "POST", path, content=b"{}"), 415, "not-json")


def test_json_with_a_charset_is_json(app: FastAPI) -> None:
    headers = {"Content-Type": "Application/JSON; charset=utf-8"}
    assert ask(app, "POST", "/v1/explain", content=b"{}", headers=headers).status_code == 200


@pytest.mark.parametrize("path", [*WRITES, "/v1/stop"])
def test_a_body_beyond_the_limit_is_refused_with_or_without_its_length(app: FastAPI, path: str) -> None:
    limit = settings_of().max_body

    async def chunks() -> Any:
        for _ in range(limit // 65536 + 1):
            yield b" " * 65536

    problem(ask(app, "POST", path, content=b" " * (limit + 1), headers=JSON), 413, "too-large")
    problem(ask(app, "POST", path, content=chunks(), headers=JSON), 413, "too-large")


METHODS = ("DELETE", "GET", "HEAD", "OPTIONS", "PATCH", "POST", "PUT")
PATHS = (*create_app(settings_of(), PlainEngine()).openapi()["paths"], "/", "/vr", "/web/page.js", "/openapi.json")


@pytest.mark.parametrize("path", PATHS)
def test_an_unknown_method_is_405_with_every_method_of_the_path(app: FastAPI, path: str) -> None:
    path = path.replace("{session_id}", "none").replace("{name}", "none")
    taken = [method for method in METHODS if ask(app, method, path).status_code != 405]
    answer = ask(app, "BREW", path)
    assert answer.headers["allow"].split(", ") == taken
    problem(answer, 405, "method-not-allowed")


@pytest.mark.parametrize("path", PATHS)
def test_head_is_get_without_the_body(app: FastAPI, path: str) -> None:
    path = path.replace("{session_id}", "none").replace("{name}", "none")
    head, whole = ask(app, "HEAD", path), ask(app, "GET", path)
    assert (head.status_code, head.content) == (whole.status_code, b"")
    same = ("content-type", "content-length", "content-encoding", "etag", "vary", "cache-control", "allow")
    if path != "/metrics":  # its numbers change
        assert [head.headers.get(name) for name in same] == [whole.headers.get(name) for name in same]


@pytest.mark.parametrize("path", ["/nothing", "/v1/render/", "/v1/textures/none", "/v1/sessions/none"])
def test_an_unknown_path_is_404(app: FastAPI, path: str) -> None:
    problem(ask(app, "GET", path), 404, "not-found")


NUMBERS = st.one_of(st.integers(), st.floats(), st.sampled_from([1e-320, 1e308, -0.0, 2**63, 10**40]))
TREES = st.recursive(
    st.one_of(st.none(), st.booleans(), NUMBERS, st.text(max_size=12)),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4),
    max_leaves=12,
)
FIELDS = {
    "finger": ["ridge_period", "ridge_amplitude", "roughness", "contact_length", "youngs_modulus", "poisson_ratio"],
    "texture": ["kind", "period", "amplitude", "roughness", "phase", "youngs_modulus"],
    "scan": ["speed", "load", "stroke", "trajectory", "lift_load"],
    "output": ["quantity", "channels", "sample_rate", "full_scale", "bandwidth", "fade"],
    "accuracy": ["tolerance"],
    "effects": ["inertia"],
}
SCENES = st.fixed_dictionaries(
    {},
    optional={
        section: st.one_of(TREES, st.dictionaries(st.sampled_from(names), TREES, max_size=4))
        for section, names in FIELDS.items()
    },
)
APP = create_app(settings_of(max_duration=1.0), PlainEngine())


@settings(max_examples=50, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(path=st.sampled_from(WRITES[1:]), scene=st.one_of(TREES, SCENES))
def test_no_json_causes_an_internal_error(path: str, scene: object) -> None:
    answer = ask(APP, "POST", path, content=json.dumps(scene).encode(), headers=JSON)
    assert answer.status_code in (200, 201, 422, 503), answer.text
    if answer.status_code == 503:
        problem(answer, 503, "full")
        APP.state.service.sessions.end_all()


@settings(max_examples=40, deadline=None)
@given(path=st.sampled_from(WRITES), text=st.binary(max_size=64))
def test_no_bytes_cause_an_internal_error(path: str, text: bytes) -> None:
    assert ask(APP, "POST", path, content=text, headers=JSON).status_code == 422


@settings(max_examples=40, deadline=None)
@given(patch=st.one_of(TREES, SCENES))
def test_no_patch_causes_an_internal_error(patch: object) -> None:
    APP.state.service.sessions.end_all()
    session = ask(APP, "POST", "/v1/sessions", content=b"{}", headers=JSON).json()
    answer = ask(APP, "PATCH", f"/v1/sessions/{session['id']}", content=json.dumps(patch).encode(), headers=JSON)
    assert answer.status_code in (200, 409, 422), answer.text


@settings(max_examples=40, deadline=None)
@given(
    path=st.text(st.characters(blacklist_categories=["Cs"]), max_size=30),
    accept=st.text(st.characters(min_codepoint=32, max_codepoint=126), max_size=30),
)
def test_no_path_and_no_header_causes_an_internal_error(path: str, accept: str) -> None:
    assert ask(APP, "GET", "/" + quote(path), headers={"Accept": accept}).status_code < 500
    assert ask(APP, "POST", "/v1/render", content=b"{}", headers={**JSON, "Accept": accept}).status_code in (422, 406)
