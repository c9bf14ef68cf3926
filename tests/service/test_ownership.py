"""A session belongs to the key that opened it; with another key it answers as an unknown id."""

from __future__ import annotations

import secrets
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from tests.service.harness import Running, problem, serving, until, warmed_up
from tests.service.live.client import live
from tests.service.plain_engine import PlainEngine

MINE, YOURS = ({"Authorization": f"Bearer {key}"} for key in ("mine", "yours"))
CALLS: dict[str, tuple[str, str, dict[str, Any]]] = {
    "look": ("GET", "", {}),
    "change": ("PATCH", "", {"json": {"scan": {"load": 0.1}}}),
    "end": ("DELETE", "", {}),
    "listen": ("GET", "/stream?duration=0.01", {}),
    "listen, the headers alone": ("HEAD", "/stream", {}),
    "play": ("POST", "/play", {"json": {"device": "file:take.wav"}}),
    "end the play": ("DELETE", "/play", {}),
    "recording": ("GET", "/recording", {}),
}


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    engine, folder = PlainEngine(), tmp_path_factory.mktemp("recordings")
    with serving(engine, api_keys="mine,yours", file_folder=folder) as server:
        warmed_up(server, engine)
        yield server


def ask(running: Running, session: str, name: str, key: dict[str, str]) -> httpx.Response:
    method, path, rest = CALLS[name]
    return running.client.request(method, f"/v1/sessions/{session}{path}", headers=key, **rest)


@pytest.mark.parametrize("name", CALLS)
def test_another_key_is_answered_as_for_an_id_that_never_was(running: Running, name: str) -> None:
    opened = running.client.post("/v1/sessions", json={}, headers=MINE).json()["id"]
    with live(running, additional_headers=MINE) as client:
        lived = client.hello(record=True)["session"]
        session = lived if name == "recording" else opened
        touched = running.service.sessions.find(opened, 0).touched
        foreign, unknown = (ask(running, each, name, YOURS) for each in (session, secrets.token_urlsafe(16)))
        assert (foreign.status_code, foreign.content) == (404, unknown.content)
        assert dict(foreign.headers) | {"date": ""} == dict(unknown.headers) | {"date": ""}
        if name != "listen, the headers alone":
            problem(foreign, 404, "not-found")
        assert running.service.sessions._sessions[opened].touched == touched, "who may not look keeps nothing alive"
        if name != "end the play":
            assert ask(running, session, name, MINE).status_code < 300


def test_a_live_session_is_resumed_and_taken_over_by_its_own_key_alone(running: Running) -> None:
    with live(running, additional_headers=MINE) as old:
        name = old.hello(pacing="realtime")["session"]
        old.frames(480)
        with live(running, additional_headers=YOURS) as thief:
            thief.say("hello", resume={"session": name, "frame": 0})
            thief.rest()
            assert thief.code == 1008
        with live(running, additional_headers=YOURS) as guess:
            guess.say("hello", resume={"session": secrets.token_urlsafe(16), "frame": 0})
            guess.rest()
        assert thief.received == guess.received
        old.frames(old.sound // 4 + 960)
        old.break_off()
    until(lambda: running.service.sessions._sessions[name].peer is None)
    with live(running, additional_headers=YOURS) as thief:
        thief.say("hello", resume={"session": name, "frame": 0})
        thief.rest()
        assert thief.code == 1008
    with live(running, additional_headers=MINE) as again:
        assert again.hello(resume={"session": name, "frame": 480})["session"] == name


def test_the_recording_of_a_session_that_has_ended_stays_its_owners(running: Running) -> None:
    with live(running, additional_headers=MINE) as client:
        name = client.hello(record=True)["session"]
        client.say("stop")
        client.rest()
    problem(ask(running, name, "recording", YOURS), 404, "not-found")
    assert ask(running, name, "recording", MINE).status_code == 200


def test_every_key_may_stop_everything(running: Running) -> None:
    session = running.client.post("/v1/sessions", json={}, headers=MINE).json()["id"]
    assert running.client.post("/v1/stop", headers=YOURS).json()["stopped"]["sessions"] >= 1
    problem(ask(running, session, "look", MINE), 404, "not-found")


def test_a_key_that_stands_twice_is_one_owner(tmp_path: Path) -> None:
    with serving(PlainEngine(), api_keys="other,mine,mine", file_folder=tmp_path) as running:
        session = running.client.post("/v1/sessions", json={}, headers=MINE).json()["id"]
        assert ask(running, session, "look", MINE).status_code == 200
