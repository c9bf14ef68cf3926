"""Response tables over HTTP: made from a scene and found by their hash."""

from __future__ import annotations

import gc
import json
import threading
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from fastapi import FastAPI

from clients import Client, ProtocolError
from service.app import create_app
from service.compute import work_places
from service.store.store import Quota, Store
from service.synth_engine import SynthEngine
from synth.plan import scene_table
from synth.response.table_file import table_of_bytes
from synth.response_cache import DEFAULT_BYTES
from synth.scene.scene import parse_scene
from synth.surfaces.surface_data import SurfaceData
from tests.conftest import RunsRidgewave
from tests.service.harness import ask, kept_engine, problem, serving, settings_of, until
from tests.service.plain_engine import TABLE, PlainEngine

SCENE = {"texture": {"period": "0.5 mm", "amplitude": "10 um"}}  # soon solved, with inertia too


@pytest.fixture(scope="module")
def real() -> FastAPI:
    return create_app(settings_of(), kept_engine())


def made(app: FastAPI, scene: Any = SCENE) -> dict[str, Any]:
    """Make the table of `scene`; return the answer."""
    answer = ask(app, "POST", "/v1/tables", json=scene)
    assert answer.status_code == 201, answer.text
    document: dict[str, Any] = answer.json()
    assert answer.headers["location"] == document["url"] == f"/v1/tables/{document['hash']}"
    assert answer.headers["cache-control"] == "no-store"
    return document


def test_a_table_is_the_file_of_the_command_line(real: FastAPI, ridgewave: RunsRidgewave, tmp_path: Path) -> None:
    path = tmp_path / "one.safetensors"
    ridgewave("table", "grating-800um-40um", "-o", str(path))
    told = made(real, {"texture": {"kind": "grating-800um-40um"}})
    assert ask(real, "GET", told["url"]).content == path.read_bytes()


def test_the_answer_describes_the_file(real: FastAPI) -> None:
    told = made(real)
    content = ask(real, "GET", told["url"]).content
    table = table_of_bytes(content)
    assert (told["hash"], told["bytes"]) == (table.hash, len(content))
    assert told["covered_loads"] == list(table.covered)
    assert (told["loads"], told["harmonics"]) == (len(table.loads), table.harmonics)
    assert told["levels"] == len(table.levels.highest)
    assert told["error"]["velocity"] == table.error.largest_reported("velocity")


def test_a_hash_does_not_depend_on_earlier_tables() -> None:
    """Scenes of one contact share a table in the cache, but each file describes its own scene."""
    used, fresh = (create_app(settings_of(), SynthEngine(DEFAULT_BYTES)) for _ in range(2))
    heard: dict[str, Any] = SCENE | {"effects": {"inertia": {}}}
    assert ask(used, "POST", "/v1/sessions", json=heard).status_code == 201
    first = made(used)
    misses = used.state.service.engine.cache_counts().misses
    again = made(used, SCENE | {"scan": {"speed": "0.2 m/s", "load": "1 N"}})
    assert used.state.service.engine.cache_counts().misses == misses, "speed and load decide no table"
    assert first == again == made(fresh)
    assert made(used, heard)["hash"] == made(fresh, heard)["hash"] != first["hash"]


def test_a_file_may_be_cached_for_ever(app: FastAPI) -> None:
    told = made(app)
    answer = ask(app, "GET", told["url"])
    assert answer.content == TABLE.read_bytes()
    assert answer.headers["content-type"] == "application/octet-stream"
    assert answer.headers["etag"] == f'"{told["hash"]}"'
    assert answer.headers["cache-control"] == "public, max-age=31536000, immutable"
    head = ask(app, "HEAD", told["url"])
    assert head.status_code == 200 and head.content == b""
    assert head.headers["content-length"] == str(told["bytes"])
    for tag, status in ((answer.headers["etag"], 304), (f"W/{answer.headers['etag']}", 304), ('"other"', 200)):
        known = ask(app, "GET", told["url"], headers={"If-None-Match": tag})
        assert known.status_code == status and known.headers["etag"] == answer.headers["etag"]
        assert bool(known.content) is (status == 200)


@pytest.mark.parametrize("name", ["none", "0" * 64, "0" * 63, "A" * 64, "%2e%2e", "%00", "x" * 2000])
def test_an_unknown_hash_is_refused_with_how_to_make_the_table(app: FastAPI, name: str) -> None:
    made(app)
    (fault,) = problem(ask(app, "GET", f"/v1/tables/{name}"), 404, "not-found")["errors"]
    assert fault["pointer"] == "hash" and "POST its scene to /v1/tables" in fault["hint"] and len(fault["value"]) < 100


def test_a_table_that_the_cache_has_no_room_for_is_made_again() -> None:
    app = create_app(settings_of(), SynthEngine(0))
    told = made(app)

    def gone() -> bool:
        gc.collect()  # the cache finds a table that is in use, and the thread that made it uses it for a moment
        return ask(app, "GET", told["url"]).status_code == 404

    until(gone)
    assert made(app) == told


@pytest.mark.parametrize(
    ("scene", "pointer"),
    [
        ({"texture": {"amplitude": 0}, "finger": {"ridge_amplitude": 0}}, "/finger/ridge_amplitude"),
        ({"scan": {"load": -1.0}}, "/scan/load"),
        ([], ""),
    ],
)
def test_a_scene_without_a_table_is_refused(real: FastAPI, scene: Any, pointer: str) -> None:
    document = problem(ask(real, "POST", "/v1/tables", json=scene), 422, "scene-refused")
    assert document["errors"][0]["pointer"] == pointer


def test_a_table_that_is_not_possible_has_its_reason() -> None:
    app = create_app(settings_of(), PlainEngine(refuse="not this one"))
    assert problem(ask(app, "POST", "/v1/tables", json={}), 503, "cannot-render")["detail"] == "not this one"


def test_a_table_belongs_to_no_key(engine: PlainEngine) -> None:
    app = create_app(settings_of(api_keys="mine,yours"), engine)
    mine, yours = ({"Authorization": f"Bearer {key}"} for key in ("mine", "yours"))
    url = ask(app, "POST", "/v1/tables", json={}, headers=mine).json()["url"]
    assert ask(app, "GET", url, headers=yours).content == TABLE.read_bytes()
    problem(ask(app, "GET", url), 401, "key-required")


def test_the_table_of_an_imported_surface_is_its_owners_and_in_no_shared_cache(tmp_path: Path) -> None:
    surface = SurfaceData((20e-6 * np.sin(2.0 * np.pi * np.arange(160) / 160)).astype(np.float32), (5e-6,))
    store = Store(tmp_path)
    store.keep("lab", "wave", surface, "profile", {"file": "wave.csv"}, Quota())
    app = create_app(settings_of(owner_keys="lab:mine,lab:also,guest:yours", data_folder=tmp_path), kept_engine())
    mine, also, yours = ({"Authorization": f"Bearer {key}"} for key in ("mine", "also", "yours"))
    scene = {"finger": {"contact_length": "2 mm"}, "texture": {"kind": "wave"}}
    told = ask(app, "POST", "/v1/tables", json=scene, headers=mine).json()
    for key in (mine, also):
        answer = ask(app, "GET", told["url"], headers=key)
        assert (answer.status_code, len(answer.content)) == (200, told["bytes"])
        assert answer.headers["cache-control"] == "private, max-age=31536000, immutable"
    tag = {"If-None-Match": answer.headers["etag"]}
    assert ask(app, "GET", told["url"], headers=mine | tag).headers["cache-control"].startswith("private")
    for key in (yours, yours | tag):
        problem(ask(app, "GET", told["url"], headers=key), 404, "not-found")
        assert ask(app, "HEAD", told["url"], headers=key).status_code == 404
    address = json.loads(table_of_bytes(answer.content).scene)["texture"]["surface"]
    assert address == surface.address
    held = {"texture": {"kind": "profile", "surface": address}}
    for path, body in (("tables", held), ("render", held), ("explain", held), ("sessions", held)):
        problem(ask(app, "POST", f"/v1/{path}", json=body, headers=yours), 422, "scene-refused")
    store.delete("lab", "wave")
    problem(ask(app, "GET", told["url"], headers=mine), 404, "not-found")


def test_the_service_answers_while_the_tables_of_a_client_wait(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(work_places, "SHORT_PLACES", 2)  # one for each client
    engine = PlainEngine(gate=threading.Event())
    with serving(engine, solves_per_client=1) as running:
        entered: list[str] = []
        enter = running.service.solve_places.enter

        def watched(client: str) -> Any:
            entered.append(client)
            return enter(client)

        monkeypatch.setattr(running.service.solve_places, "enter", watched)
        callers = [
            threading.Thread(target=running.client.post, args=("/v1/tables",), kwargs={"json": {}}) for _ in "1234"
        ]
        for caller in callers:
            caller.start()
        try:
            until(lambda: len(entered) == 4)
            assert running.client.get("/healthz").status_code == 200
            assert engine.opened.count("table") <= 2, "a long one, and another in the place that it left"
        finally:
            assert engine.gate is not None
            engine.gate.set()
            for caller in callers:
                caller.join()
    assert entered == ["address loopback"] * 4
    assert engine.opened.count("table") == 4


def test_no_table_is_made_during_shutdown(app: FastAPI, engine: PlainEngine) -> None:
    app.state.service.closing = True
    problem(ask(app, "POST", "/v1/tables", json={}), 503, "closing")
    assert engine.opened == []


@pytest.mark.parametrize("change", [lambda content: content[:-1], lambda content: content[:-1] + b"\xff", bytes.upper])
def test_the_client_refuses_other_content(app: FastAPI, change: Any) -> None:
    told = made(app)

    def answer(request: httpx.Request) -> httpx.Response:
        return httpx.Response(201, json=told) if request.method == "POST" else httpx.Response(200, content=changed)

    changed = change(TABLE.read_bytes())
    with Client("http://localhost", transport=httpx.MockTransport(answer)) as client:
        with pytest.raises(ProtocolError):
            client.table({})
        changed, told = TABLE.read_bytes(), told | {"hash": "0" * 64}
        with pytest.raises(ProtocolError):
            client.table({})


def test_a_service_that_starts_again_reads_the_tables_of_the_catalogue(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = parse_scene({"finger": {"kind": "fingertip"}, "texture": {"kind": "corduroy-14-wale"}})
    first = SynthEngine(DEFAULT_BYTES, tmp_path).open_hand(scene)
    monkeypatch.setattr(scene_table, "make_table", lambda *_, **__: pytest.fail("made again"))
    again = SynthEngine(DEFAULT_BYTES, tmp_path).open_hand(scene)
    assert again.full_scale == first.full_scale and again.plan_document == first.plan_document
