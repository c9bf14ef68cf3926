"""Owners with names: their keys change, their textures, sessions and limits stay; no cache or address tells others."""

from __future__ import annotations

import json
import logging
import re
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fastapi import FastAPI

from service.app import create_app
from service.store.store import Quota
from service.store.texture_database import TextureDatabase
from synth.surfaces.surface_data import SurfaceData
from tests.service.harness import ask, problem, serving, settings_of
from tests.service.live.client import live
from tests.service.plain_engine import PlainEngine

Opened = Callable[..., FastAPI]


@pytest.fixture
def opened(tmp_path: Path) -> Iterator[Opened]:
    """Return a function that starts a service with these settings on one data folder."""
    with ExitStack() as stack:

        def start(**changes: object) -> FastAPI:
            app = create_app(settings_of(data_folder=tmp_path, **changes), PlainEngine())
            stack.callback(app.state.service.finish)
            return app

        yield start


def bearer(key: str) -> dict[str, str]:
    return {"Authorization": f"Bearer {key}"}


def names(app: FastAPI, key: str) -> dict[str, str]:
    """Return the address of each texture of the owner of `key`."""
    answer = ask(app, "GET", "/v1/textures", headers=bearer(key))
    assert answer.status_code == 200, answer.text
    return {entry["name"]: entry["address"] for entry in answer.json()["textures"] if entry["stored"]}


def keep(app: FastAPI, key: str, name: str, seed: int) -> str:
    """Import a texture as the owner of `key`; return its address."""
    service = app.state.service
    heights = np.random.default_rng(seed).normal(size=50).astype(np.float32) * 1e-6
    number = next(
        number for number, owner in enumerate(service.textures._owners) if owner == service.textures._keys[key]
    )
    surface = SurfaceData(heights, (5e-6,))
    service.textures.store.keep(service.textures.owner(number), name, surface, "profile", {"file": "a.csv"}, Quota())
    return surface.address


def test_a_rotated_key_keeps_its_textures_and_sessions(opened: Opened) -> None:
    both = opened(owner_keys="lab:sesame,guest:yours,lab:new")
    address = keep(both, "sesame", "cloth", 1)
    assert names(both, "new") == {"cloth": address} and names(both, "yours") == {}
    session = ask(both, "POST", "/v1/sessions", json={}, headers=bearer("sesame")).json()["id"]
    assert ask(both, "GET", f"/v1/sessions/{session}", headers=bearer("new")).status_code == 200
    problem(ask(both, "GET", f"/v1/sessions/{session}", headers=bearer("yours")), 404, "not-found")
    after = opened(owner_keys="lab:new,guest:yours")
    assert names(after, "new") == {"cloth": address}
    problem(ask(after, "GET", "/v1/textures", headers=bearer("sesame")), 401, "key-required")


def test_a_key_that_gets_a_name_brings_its_textures(opened: Opened, caplog: pytest.LogCaptureFixture) -> None:
    bare = opened(api_keys="sesame,other")
    addresses = {name: keep(bare, "sesame", name, seed) for seed, name in enumerate(("cloth", "felt"))}
    keep(bare, "other", "cloth", 7)
    with caplog.at_level(logging.INFO, "ridgewave.service"):
        named = opened(owner_keys="lab:sesame,lab:new", api_keys="other")
    assert "2 textures of a key of lab now belong to lab" in caplog.text and "sesame" not in caplog.text
    assert names(named, "sesame") == names(named, "new") == addresses
    assert names(named, "other").keys() == {"cloth"}, "a key without a name keeps its own"
    assert names(opened(owner_keys="lab:new", api_keys="other"), "new") == addresses


def test_textures_of_one_name_are_all_kept(opened: Opened) -> None:
    bare = opened(api_keys="one,two,three")
    first, second, third = (keep(bare, key, "cloth", seed) for seed, key in enumerate(("one", "two", "three")))
    keep(bare, "two", "same", 0)
    keep(bare, "one", "same", 0)
    named = opened(owner_keys="lab:one,lab:two,lab:three")
    assert names(named, "two") == {"cloth": first, "cloth-2": second, "cloth-3": third, "same": first}


def test_nothing_is_written_where_nothing_is_adopted(opened: Opened, tmp_path: Path) -> None:
    opened(owner_keys="lab:one")
    assert not list(tmp_path.iterdir())


def test_textures_that_cannot_be_adopted_are_told_and_the_service_starts(
    opened: Opened, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    address = keep(opened(api_keys="sesame"), "sesame", "cloth", 1)
    with monkeypatch.context() as patch:
        patch.setattr(TextureDatabase, "writing", TextureDatabase(Path("/dev/null/data")).writing)
        assert names(opened(owner_keys="lab:sesame"), "sesame") == {}
    assert "do not belong to lab yet" in caplog.text and "sesame" not in caplog.text
    assert names(opened(owner_keys="lab:sesame"), "sesame") == {"cloth": address}


def test_the_keys_of_an_owner_have_its_limits_together(opened: Opened) -> None:
    settings: dict[str, Any] = {"trusted_proxies": "127.0.0.1", "request_burst": 3, "requests_per_second": 0.1}
    app = opened(owner_keys="lab:one,lab:two,guest:yours", **settings)
    app.state.service.limits._now = lambda: 0.0

    def status(key: str, address: str) -> int:
        headers = bearer(key) | {"X-Forwarded-For": address}
        return ask(app, "GET", "/v1/textures", headers=headers).status_code

    assert [status(("one", "two")[n % 2], f"192.0.2.{n}") for n in range(4)] == [200] * 3 + [429]
    assert status("yours", "192.0.2.9") == 200


CALLS = {
    "render": ("POST", "/v1/render"),
    "explain": ("POST", "/v1/explain"),
    "analyze": ("POST", "/v1/analyze"),
    "accuracy": ("POST", "/v1/accuracy"),
    "picture": ("POST", "/v1/picture"),
    "table": ("POST", "/v1/tables"),
    "session": ("POST", "/v1/sessions"),
    "change": ("PATCH", "/v1/sessions/{id}"),
}


@pytest.mark.parametrize("name", CALLS)
def test_an_address_alone_renders_nothing_for_another_owner(opened: Opened, name: str) -> None:
    app = opened(owner_keys="lab:mine,guest:yours")
    address = keep(app, "mine", "cloth", 1)
    method, path = CALLS[name]
    told = []
    for texture in ({"kind": "profile", "surface": address}, {"surface": "0" * 64, "kind": "profile"}):
        session = ask(app, "POST", "/v1/sessions", json={}, headers=bearer("yours")).json()["id"]
        scene = {"texture": texture}
        body = {"scene": scene} if name == "picture" else scene
        answer = ask(app, method, path.format(id=session), json=body, headers=bearer("yours"))
        told.append(re.sub("[0-9a-f]{16,}", "ADDRESS", json.dumps(problem(answer, 422, "scene-refused"))))
    assert told[0] == told[1], "nobody learns which addresses exist"
    session = ask(app, "POST", "/v1/sessions", json={}, headers=bearer("mine")).json()["id"]
    scene = {"texture": {"kind": "profile", "surface": address}}
    if name != "accuracy":  # a minute of measuring
        body = {"scene": scene} if name == "picture" else scene
        answer = ask(app, method, path.format(id=session), json=body, headers=bearer("mine"))
        assert answer.status_code in (200, 201), answer.text


def test_an_address_alone_is_refused_in_live_sessions_too(tmp_path: Path) -> None:
    with serving(PlainEngine(), owner_keys="lab:mine,guest:yours", data_folder=tmp_path) as running:
        texture = {"kind": "profile", "surface": keep(running.app, "mine", "cloth", 1)}
        with live(running, additional_headers=bearer("yours")) as client:
            client.say("hello", scene={"texture": texture})
            assert client.until("problem")["problem"] == "/docs#problem-scene-refused"
        with live(running, additional_headers=bearer("yours")) as client:
            client.hello()
            client.say("scene", scene={"texture": texture})
            assert client.until("problem")["problem"] == "/docs#problem-scene-refused"
        with live(running, additional_headers=bearer("mine")) as client:
            assert client.hello(scene={"texture": texture})["session"]


def test_what_a_shared_cache_may_keep_is_the_same_for_everybody_and_holds_no_address(opened: Opened) -> None:
    app = opened(owner_keys="lab:mine,guest:yours")
    address = keep(app, "mine", "cloth", 1)
    session = ask(app, "POST", "/v1/sessions", json={}, headers=bearer("mine")).json()["id"]
    table = ask(app, "POST", "/v1/tables", json={}, headers=bearer("mine")).json()["hash"]
    places = {"session_id": session, "hash": table}
    shared = []
    for path, methods in app.openapi()["paths"].items():
        if "get" not in methods or path.endswith("/stream"):
            continue
        for name in ("grating-1mm-31um", "cloth") if "{name}" in path else ("",):
            place = path.format(**places, name=name, id=session)
            answers = [ask(app, "GET", place, headers=bearer(key)) for key in ("mine", "yours")]
            for answer in answers:
                kept = answer.headers["cache-control"]
                if kept in ("no-store", "private, no-cache") or kept.startswith("private, "):
                    continue
                shared.append(place)
                assert answer.status_code == 200 and address not in answer.text
                assert answers[0].content == answers[1].content
    assert set(shared) == {"/v1/textures/grating-1mm-31um/picture", f"/v1/tables/{table}"}
