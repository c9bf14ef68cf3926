"""Every call of the OpenAPI document, with random requests: each answer is a documented one.

Model: schemathesis draws requests from the OpenAPI document of the service, valid and invalid ones. They are answered
    in process. An answer must have a documented status, media type and schema. The only status from 500 on is 503, with
    a problem that is documented for 503.
Limits: streams are finite and renders short, because an answer in process is collected whole. PortAudio is disabled, so
    that no test plays on a device. The real engine gets fewer calls than the plain one. `-m thorough` draws four
    times as many requests.
"""

from __future__ import annotations

import itertools
import sys
from collections import Counter
from collections.abc import Iterator
from typing import Any

import httpx
import numpy as np
import pytest
import requests
import schemathesis
from fastapi import FastAPI
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from schemathesis import Case as AnyCase
from schemathesis import GenerationMode
from schemathesis.specs.openapi.checks import (
    content_type_conformance,
    response_headers_conformance,
    response_schema_conformance,
    status_code_conformance,
)

from service import problems
from service.app import create_app
from service.store.store import Quota
from service.synth_engine import SynthEngine
from synth.scene.catalogue import catalogue
from synth.surfaces.surface_data import SurfaceData
from tests.service.harness import LOCAL, ask, roomy_settings, settings_of
from tests.service.plain_engine import PlainEngine

CHECKS = [
    content_type_conformance,
    response_headers_conformance,
    response_schema_conformance,
    status_code_conformance,
]
MAY_BE_503 = {kind.uri for kind in problems.TYPES.values() if kind.status == 503}
LONGEST = 0.25  # s of a render or a stream in these tests
EXAMPLES = 4  # requests per call and mode
REAL_EXAMPLES = 2  # to the real engine, which can take seconds for a random scene
THOROUGH = 4
REAL = (
    "POST /v1/render",
    "POST /v1/explain",
    "POST /v1/analyze",
    "POST /v1/picture",
    "POST /v1/sessions",
    "POST /v1/tables",
    "PATCH /v1/sessions/{session_id}",
)
"""The calls to the real engine: those that solve a scene, except the one that takes a minute."""
STREAM, PLAY = "/v1/sessions/{session_id}/stream", "/v1/sessions/{session_id}/play"
LIMITS = {"max_duration": LONGEST, "max_sessions": 8}
JSON = {"Content-Type": "application/json"}
NAMES = itertools.count()


Case = AnyCase[Any]


def documented() -> Any:
    """Return the OpenAPI document as schemathesis reads it."""
    return schemathesis.openapi.from_dict(create_app(settings_of(), PlainEngine()).openapi())


OPERATIONS = {found.ok().label: found.ok() for found in documented().get_all_operations()}
OF_AN_IMPORT = (
    "GET /v1/textures/{name}/surface",
    "PATCH /v1/textures/{name}",
    "DELETE /v1/textures/{name}",
)
"""A texture of the catalogue has no surface, and cannot be changed."""
OF_A_HAND = ("GET /v1/sessions/{session_id}/recording",)
"""Only a live session has a recording, so every answer here is a 404; tests/service/live tests it."""
FITS = [pytest.param(label, True, id=f"{label} fits") for label in OPERATIONS]
FITS_NOT = [
    pytest.param(label, False, id=f"{label} does not fit")
    for label, operation in OPERATIONS.items()
    if operation.body or operation.query  # a parameter of a path may be any text
]
MANY = [pytest.param(1, id="few"), pytest.param(THOROUGH, id="many", marks=pytest.mark.thorough)]


def drawn(examples: int) -> settings:
    """Return the settings of a run that is the same each time."""
    quiet = list(HealthCheck)
    return settings(max_examples=examples, deadline=None, suppress_health_check=quiet, database=None, derandomize=True)


@pytest.fixture(scope="module", autouse=True)
def no_devices() -> Iterator[None]:
    """Disable the audio devices."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(sys.modules, "sounddevice", None)
        yield


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Iterator[FastAPI]:
    folder = tmp_path_factory.mktemp("recordings")
    data = tmp_path_factory.mktemp("data")
    app = create_app(settings_of(**roomy_settings() | LIMITS, file_folder=folder, data_folder=data), PlainEngine())
    app.state.service.warm_up()
    yield app
    app.state.service.sessions.close()
    app.state.service.finish()


@pytest.fixture(scope="module")
def real(tmp_path_factory: pytest.TempPathFactory) -> Iterator[FastAPI]:
    folder = tmp_path_factory.mktemp("recordings")
    chosen = settings_of(**roomy_settings() | LIMITS, file_folder=folder)
    app = create_app(chosen, SynthEngine(chosen.cache_bytes))
    yield app
    app.state.service.sessions.close()
    app.state.service.finish()


def answered(app: FastAPI, case: Case, known: bool) -> httpx.Response:
    """Return the checked answer to `case`; known: its path names existing things."""
    if known:
        exist(app, case)
    shorten(case)
    sent = ("method", "url", "headers", "params", "json", "data", "cookies", "files")
    words = case.as_transport_kwargs(base_url=LOCAL)
    asked = requests.Request(**{name: words[name] for name in sent if name in words}).prepare()
    body: Any = asked.body
    answer = ask(app, asked.method or "", asked.url or "", content=body, headers=dict(asked.headers))
    check(answer)
    case.validate_response(answer, checks=CHECKS)
    return answer


def check(answer: httpx.Response) -> None:
    """Fail for an internal error, and for a 503 without a documented reason."""
    if answer.status_code >= 500:
        assert answer.status_code == 503, answer.text
        assert answer.json()["type"] in MAY_BE_503
    if answer.status_code >= 400:
        assert answer.headers["content-type"] == problems.MEDIA_TYPE, answer.text


def exist(app: FastAPI, case: Case) -> None:
    """Change the path of `case` to name an existing session (with a play if it ends one), texture, or table."""
    names = case.path_parameters or {}
    if "name" in names:
        names["name"] = texture_of(app) if case.operation.label in OF_AN_IMPORT else catalogue()[0].name
    if case.operation.label == "POST /v1/textures":
        form: Any = {"file": b"1\n2\n1\n", "unit": "um", "pixel": "5 um", "name": "drawn"}
        case.body = form
    if "hash" in names:
        names["hash"] = ask(app, "POST", "/v1/tables", content=b"{}", headers=JSON).json()["hash"]
    if "session_id" in names:
        names["session_id"] = session_of(app)
        recording: Any = {"device": f"file:take-{next(NAMES)}.wav"}
        if case.operation.label == f"DELETE {PLAY}":
            path = PLAY.format(session_id=names["session_id"])
            assert ask(app, "POST", path, json=recording).status_code == 202
        if case.operation.label == f"POST {PLAY}" and case.body == {}:
            case.body = recording


def texture_of(app: FastAPI) -> str:
    """Return the name of an imported texture."""
    line = SurfaceData(np.zeros(4, np.float32), (1e-4,))
    kept = app.state.service.textures.store.keep("", "cloth", line, "profile", {"file": "a.csv"}, Quota())
    return str(kept.name)


def session_of(app: FastAPI) -> str:
    """Return the id of a new session; earlier ones are ended to make room."""
    app.state.service.sessions.end_all()
    return str(ask(app, "POST", "/v1/sessions", content=b"{}", headers=JSON).json()["id"])


def shorten(case: Case) -> None:
    """Make endless streams finite and most renders short; invalid values stay invalid."""
    if case.operation.path == STREAM and "duration" not in (case.query or {}):
        case.query = {**(case.query or {}), "duration": 0.01}
    body: Any = case.body
    if isinstance(body, dict) and case.operation.path == "/v1/render" and isinstance(body.get("output", {}), dict):
        asked = body.get("output", {}).get("duration")
        if asked is None or isinstance(asked, float | int):
            case.body = body | {"output": body.get("output", {}) | {"duration": min(0.02, abs(asked or 0.02))}}


@pytest.mark.parametrize("times", MANY)
@pytest.mark.parametrize(("label", "fits"), FITS + FITS_NOT)
def test_every_answer_is_documented(plain: FastAPI, label: str, fits: bool, times: int) -> None:
    mode = GenerationMode.POSITIVE if fits else GenerationMode.NEGATIVE
    seen: Counter[int] = Counter()

    @drawn(EXAMPLES * times)
    @given(case=OPERATIONS[label].as_strategy(generation_mode=mode), known=st.booleans())
    def run(case: Case, known: bool) -> None:
        plain.state.service.sessions.end_all()
        seen[answered(plain, case, known).status_code] += 1

    run()
    accepted = any(status < 300 for status in seen)
    assert not fits or accepted or label in OF_A_HAND, f"nothing was accepted: {seen}"


@pytest.mark.parametrize("times", MANY)
@pytest.mark.parametrize("label", REAL)
def test_the_real_engine_answers_valid_scenes_as_documented(real: FastAPI, label: str, times: int) -> None:
    @drawn(REAL_EXAMPLES * times)
    @given(case=OPERATIONS[label].as_strategy(generation_mode=GenerationMode.POSITIVE))
    def run(case: Case) -> None:
        real.state.service.sessions.end_all()
        answered(real, case, known=True)

    run()
