"""HTTP sessions: open, show, change, delete, expiry, and their limit."""

from __future__ import annotations

import base64

import httpx
import pytest
from fastapi import FastAPI

from service.app import create_app
from synth.scene.scene import parse_scene
from tests.service.harness import ask, problem, settings_of, until
from tests.service.plain_engine import FULL_SCALE, PlainEngine


def opened(app: FastAPI, scene: object = None) -> httpx.Response:
    answer = ask(app, "POST", "/v1/sessions", json=scene or {})
    assert answer.status_code == 201, answer.text
    return answer


def test_a_new_session_says_what_it_is(app: FastAPI) -> None:
    answer = opened(app, {"output": {"channels": ["velocity", "displacement"], "sample_rate": 44100}})
    document = answer.json()
    assert len(base64.urlsafe_b64decode(document["id"] + "==")) == 16
    assert answer.headers["location"] == f"/v1/sessions/{document['id']}"
    assert (document["sample_rate"], document["channels"]) == (44100, 2)
    assert document["quantities"] == ["velocity", "displacement"]
    assert document["full_scale"] == [FULL_SCALE, FULL_SCALE]
    assert (document["streaming"], document["play"]) == (False, None)
    assert document["heard_within"] <= 1.0
    shown = ask(app, "GET", answer.headers["location"])
    assert {**shown.json(), "expires_in": 0} == {**document, "expires_in": 0}


def test_ids_are_not_guessed_from_others(app: FastAPI) -> None:
    names = [opened(app).json()["id"] for _ in range(20)]
    assert len(set(names)) == 20 and len({name[:4] for name in names}) == 20


def test_the_full_scale_is_written_into_the_scene(app: FastAPI) -> None:
    document = opened(app).json()
    scene = parse_scene(document["scene"])
    assert [channel.full_scale for channel in scene.output.channel_list] == [FULL_SCALE]


@pytest.mark.parametrize(
    ("patch", "section", "expected"),
    [
        ({"scan": {"speed": "100 mm/s"}}, "scan", {"speed": 0.1, "load": 0.3}),
        ({"scan": {"load": "0.1 N"}}, "scan", {"speed": 0.08, "load": 0.1}),
        ({"texture": {"period": "1 mm"}}, "texture", {"period": 0.001, "amplitude": 2e-5}),
        ({"finger": {"ridge_period": "0.4 mm"}}, "finger", {"ridge_period": 0.0004}),
        ({"output": {"bandwidth": 1000}}, "output", {"bandwidth": 1000.0, "sample_rate": 48000}),
        ({"output": {"quantity": "acceleration"}}, "output", {"sample_rate": 48000}),
        ({"output": {"full_scale": FULL_SCALE, "bandwidth": 1000}}, "output", {"bandwidth": 1000.0}),
        ({}, "scan", {"speed": 0.08}),
    ],
    ids=str,
)
def test_a_partial_scene_changes_what_it_names(
    app: FastAPI, patch: object, section: str, expected: dict[str, object]
) -> None:
    name = opened(app).json()["id"]
    answer = ask(app, "PATCH", f"/v1/sessions/{name}", json=patch)
    assert answer.status_code == 200, answer.text
    assert answer.json()["scene"][section].items() >= expected.items()
    assert answer.json()["full_scale"] == [FULL_SCALE]
    assert parse_scene(answer.json()["scene"]).output.channel_list[0].full_scale == FULL_SCALE


def test_a_merge_patch_by_its_own_media_type(app: FastAPI) -> None:
    name = opened(app).json()["id"]
    headers = {"Content-Type": "application/merge-patch+json"}
    answer = ask(app, "PATCH", f"/v1/sessions/{name}", content=b'{"scan": {"load": 0.2}}', headers=headers)
    assert answer.json()["scene"]["scan"]["load"] == 0.2


@pytest.mark.parametrize(
    ("patch", "pointer"),
    [
        ({"output": {"sample_rate": 8000}}, "/output/sample_rate"),
        ({"output": {"channels": ["acceleration", "velocity"]}}, "/output/channels"),
        ({"output": {"quantity": "velocity"}}, "/output/quantity"),
        ({"output": {"full_scale": 1}}, "/output/full_scale"),
        ({"output": {"channels": [{"quantity": "acceleration", "full_scale": 1}]}}, "/output/channels/0/full_scale"),
    ],
    ids=str,
)
def test_what_is_fixed_stays(app: FastAPI, patch: object, pointer: str) -> None:
    name = opened(app).json()["id"]
    before = ask(app, "GET", f"/v1/sessions/{name}").json()["scene"]
    document = problem(ask(app, "PATCH", f"/v1/sessions/{name}", json=patch), 409, "fixed")
    assert [fault["pointer"] for fault in document["errors"]] == [pointer]
    assert ask(app, "GET", f"/v1/sessions/{name}").json()["scene"] == before


def test_a_refused_change_changes_nothing(app: FastAPI) -> None:
    name = opened(app).json()["id"]
    before = ask(app, "GET", f"/v1/sessions/{name}").json()["scene"]
    patch = {"scan": {"load": "-1 N"}, "texture": {"colour": "red"}}
    document = problem(ask(app, "PATCH", f"/v1/sessions/{name}", json=patch), 422, "scene-refused")
    assert {fault["pointer"] for fault in document["errors"]} == {"/scan/load", "/texture/colour"}
    assert ask(app, "GET", f"/v1/sessions/{name}").json()["scene"] == before


def test_a_deleted_session_is_gone(app: FastAPI) -> None:
    name = opened(app).json()["id"]
    assert ask(app, "DELETE", f"/v1/sessions/{name}").status_code == 204
    for method in ("GET", "DELETE", "PATCH"):
        problem(ask(app, method, f"/v1/sessions/{name}", json={}), 404, "not-found")
    problem(ask(app, "GET", f"/v1/sessions/{name}/stream"), 404, "not-found")


def test_there_are_only_so_many(engine: PlainEngine) -> None:
    app = create_app(settings_of(max_sessions=2), engine)
    names = [opened(app).json()["id"] for _ in range(2)]
    refused = ask(app, "POST", "/v1/sessions", json={})
    problem(refused, 503, "full")
    assert 1 <= int(refused.headers["retry-after"]) <= 300
    ask(app, "DELETE", f"/v1/sessions/{names[0]}")
    opened(app)


def test_a_session_that_failed_to_open_takes_no_place(engine: PlainEngine) -> None:
    app = create_app(settings_of(max_sessions=1), engine)
    engine.refuse = "not now."
    problem(ask(app, "POST", "/v1/sessions", json={}), 503, "cannot-render")
    engine.refuse = None
    opened(app)


def test_an_idle_session_expires_and_a_request_keeps_it(engine: PlainEngine) -> None:
    app = create_app(settings_of(session_idle=0.5), engine)
    name = opened(app).json()["id"]
    assert 0 < ask(app, "GET", f"/v1/sessions/{name}").json()["expires_in"] <= 0.5
    sessions = app.state.service.sessions
    until(lambda: sessions.look() or len(sessions) == 0)
    problem(ask(app, "GET", f"/v1/sessions/{name}"), 404, "not-found")


def test_with_several_workers_there_are_no_sessions(engine: PlainEngine) -> None:
    app = create_app(settings_of(workers=2), engine)
    problem(ask(app, "POST", "/v1/sessions", json={}), 503, "one-worker")
    problem(ask(app, "GET", "/v1/sessions/x"), 503, "one-worker")
    assert ask(app, "POST", "/v1/render", json={}).status_code == 200
