"""Access: Host, Origin, forms, keys, and the start of the service."""

from __future__ import annotations

import asyncio
import subprocess
import sys
from typing import Any

import pytest
from fastapi import FastAPI

from service.app import create_app
from service.operations.settings_environment import SettingsError
from service.server import require_key
from tests.service.harness import ROOT, ask, problem, settings_of
from tests.service.plain_engine import PlainEngine

WRITES = [
    ("POST", "/v1/render"),
    ("POST", "/v1/explain"),
    ("POST", "/v1/sessions"),
    ("POST", "/v1/tables"),
    ("POST", "/v1/stop"),
    ("PATCH", "/v1/sessions/{id}"),
    ("DELETE", "/v1/sessions/{id}"),
    ("POST", "/v1/sessions/{id}/play"),
    ("DELETE", "/v1/sessions/{id}/play"),
]
READS = [
    "/v1/textures",
    "/v1/tables/none",
    "/v1/devices",
    "/v1/sessions/{id}",
    "/v1/sessions/{id}/stream",
    "/healthz",
    "/docs",
    "/",
]


@pytest.fixture
def session(app: FastAPI) -> str:
    return str(ask(app, "POST", "/v1/sessions", json={}).json()["id"])


def untouched(app: FastAPI, engine: PlainEngine, session: str) -> bool:
    """Return whether the session is unchanged and nothing else was opened."""
    shown = ask(app, "GET", f"/v1/sessions/{session}").json()
    opened = engine.opened.count("live")
    return shown["scene"]["scan"]["speed"] == 0.08 and shown["play"] is None and len(engine.opened) == opened == 2


@pytest.mark.parametrize(
    "host", ["evil.example", "localhost.evil.example", "127.0.0.1.nip.io", "localhost:80@evil", ""]
)
def test_a_foreign_host_has_no_effect(app: FastAPI, engine: PlainEngine, session: str, host: str) -> None:
    for method, path in [*WRITES, *(("GET", path) for path in READS)]:
        answer = ask(app, method, path.format(id=session), json={"scan": {"speed": 1}}, headers={"Host": host})
        problem(answer, 403, "host-refused")
    assert untouched(app, engine, session)


@pytest.mark.parametrize("host", ["localhost", "LOCALHOST:8000", "127.0.0.1:1", "[::1]:8000", "localhost."])
def test_names_of_loopback_are_answered(app: FastAPI, host: str) -> None:
    assert ask(app, "GET", "/healthz", headers={"Host": host}).status_code == 200


@pytest.mark.parametrize(
    "headers",
    [
        {"Origin": "https://evil.example"},
        {"Origin": "null"},
        {"Origin": "http://localhost:3000"},
        {"Origin": "http://localhost.evil.example"},
        {"Origin": "http://evil-localhost"},
        {"Origin": "file://"},
        {"Origin": ""},
        {"Sec-Fetch-Site": "cross-site"},
        {"Sec-Fetch-Site": "same-site"},
    ],
    ids=str,
)
def test_a_foreign_page_has_no_effect(app: FastAPI, engine: PlainEngine, session: str, headers: dict[str, str]) -> None:
    for method, path in WRITES:
        answer = ask(app, method, path.format(id=session), json={"scan": {"speed": 1}}, headers=headers)
        problem(answer, 403, "origin-refused")
    assert untouched(app, engine, session)


def test_two_origins_or_hosts_are_refused(app: FastAPI) -> None:
    for name in ("Origin", "Host"):
        headers = [(name, "http://localhost"), (name, "http://evil.example"), ("Content-Type", "application/json")]
        problem(ask(app, "POST", "/v1/stop", headers=headers), 400, "bad-request")


@pytest.mark.parametrize("kind", ["application/x-www-form-urlencoded", "multipart/form-data; boundary=b", "text/plain"])
def test_a_form_has_no_effect(app: FastAPI, engine: PlainEngine, session: str, kind: str) -> None:
    for method, path in WRITES:
        if method != "DELETE":
            headers = {"Content-Type": kind}
            answer = ask(app, method, path.format(id=session), content=b"{}", headers=headers)
            problem(answer, 415, "not-json")
    assert untouched(app, engine, session)


def test_a_page_of_the_service_may_write(app: FastAPI) -> None:
    headers = {"Origin": "http://localhost:8000", "Host": "localhost:8000", "Sec-Fetch-Site": "same-origin"}
    assert ask(app, "POST", "/v1/explain", json={}, headers=headers).status_code == 200


@pytest.mark.parametrize("allowed", ["https://lab.example", "HTTPS://Lab.Example", "https://lab.example:443"])
def test_an_allowed_origin_may_write_and_read(allowed: str) -> None:
    app = create_app(settings_of(allowed_origins=allowed, api_keys="k"), PlainEngine())
    origin = {"Origin": "https://lab.example"}
    asking = {**origin, "Access-Control-Request-Method": "PATCH", "Access-Control-Request-Headers": "authorization"}
    preflight = ask(app, "OPTIONS", "/v1/sessions/x", headers=asking)
    assert preflight.status_code == 200
    assert preflight.headers["access-control-allow-origin"] == "https://lab.example"
    answer = ask(app, "POST", "/v1/explain", json={}, headers={**origin, "Authorization": "Bearer k"})
    assert answer.status_code == 200
    assert answer.headers["access-control-allow-origin"] == "https://lab.example"
    assert "Ridgewave-Full-Scale" in answer.headers["access-control-expose-headers"]
    refused = ask(app, "POST", "/v1/explain", json={}, headers=origin)
    problem(refused, 401, "key-required")
    assert refused.headers["access-control-allow-origin"] == "https://lab.example"


def test_no_other_origin_is_allowed_by_default(app: FastAPI) -> None:
    answer = ask(app, "GET", "/v1/textures", headers={"Origin": "https://evil.example"})
    assert "access-control-allow-origin" not in answer.headers
    assert answer.headers["cross-origin-resource-policy"] == "same-origin"


@pytest.mark.parametrize(
    "value",
    [
        None,
        "",
        "Bearer",
        "Bearer ",
        "Bearer wrong",
        "Bearer key-on",
        "Bearer key-one2",
        "Basic key-one",
        "Bearer key-two-long",
    ],
)
def test_without_a_key_a_call_has_no_effect(value: str | None) -> None:
    engine = PlainEngine()
    app = create_app(settings_of(api_keys="key-one,key-two,key-two-longer"), engine)
    headers = {} if value is None else {"Authorization": value}
    for method, path in [*WRITES, ("GET", "/v1/textures"), ("GET", "/v1/devices"), ("GET", "/nothing")]:
        answer = ask(app, method, path.format(id="x"), json={}, headers=headers)
        problem(answer, 401, "key-required")
        assert answer.headers["www-authenticate"].startswith("Bearer")
    assert engine.opened == []


@pytest.mark.parametrize("value", ["Bearer key-one", "bearer  key-two"])
def test_each_of_the_keys_is_accepted(value: str) -> None:
    app = create_app(settings_of(api_keys="key-one,key-two"), PlainEngine())
    assert ask(app, "GET", "/v1/textures", headers={"Authorization": value}).status_code == 200


@pytest.mark.parametrize("path", ["/healthz", "/docs", "/openapi.json", "/"])
def test_open_paths_require_no_key(path: str) -> None:
    app = create_app(settings_of(api_keys="key-one"), PlainEngine())
    assert ask(app, "GET", path).status_code in (200, 307)


def test_a_websocket_of_a_foreign_page_is_refused(app: FastAPI) -> None:
    def scope(headers: list[tuple[bytes, bytes]]) -> dict[str, Any]:
        return {"type": "websocket", "path": "/v1/live", "query_string": b"", "headers": headers}

    async def offer(headers: list[tuple[bytes, bytes]]) -> list[Any]:
        sent: list[Any] = []

        async def send(message: Any) -> None:
            sent.append(message)

        async def receive() -> Any:
            return {"type": "websocket.connect"}

        await app(scope(headers), receive, send)
        return sent

    foreign = [(b"host", b"localhost"), (b"origin", b"https://evil.example")]
    assert asyncio.run(offer(foreign)) == [{"type": "websocket.close", "code": 1008, "reason": "origin-refused"}]
    assert asyncio.run(offer([(b"host", b"evil")])) == [
        {"type": "websocket.close", "code": 1008, "reason": "host-refused"}
    ]


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.0.2.7"])
def test_beyond_loopback_a_key_is_required(host: str) -> None:
    with pytest.raises(SettingsError) as refused:
        require_key(settings_of(host=host))
    assert "RIDGEWAVE_API_KEYS" in str(refused.value)
    require_key(settings_of(host=host, api_keys="key-one"))


@pytest.mark.parametrize("host", ["127.0.0.1", "127.8.8.8", "::1", "localhost"])
def test_loopback_requires_no_key(host: str) -> None:
    require_key(settings_of(host=host))


def started(*arguments: str, **environment: str) -> str:
    """Return the one line with which `python -m service` refuses to start."""
    done = subprocess.run(
        [sys.executable, "-m", "service", *arguments],
        cwd=ROOT,
        env={"RIDGEWAVE_PORT": "0", "PATH": "/usr/bin:/bin", **environment},
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1)
    return done.stderr


def test_the_process_does_not_start_beyond_loopback_without_a_key() -> None:
    assert "RIDGEWAVE_API_KEYS" in started(RIDGEWAVE_HOST="0.0.0.0")


@pytest.mark.parametrize("argument", ["--help", "--port=0", "serve"])
def test_the_process_does_not_start_with_arguments(argument: str) -> None:
    refusal = started(argument)
    assert "docs/settings.md" in refusal and "`ridgewave serve` has options" in refusal
