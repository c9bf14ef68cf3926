"""Requests that no client library sends: nearly valid bodies, encodings, lengths, headers of any bytes.

Model: a valid scene is broken in one random place: another value, one too long, a null byte, an extra key. Bodies
    come in various encodings and with wrong labels. Headers and request lines
    of any bytes go over a socket to a real server.
"""

from __future__ import annotations

import copy
import gzip
import json
import random
import socket
from typing import Any

import httpx
import pytest
from fastapi import FastAPI
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from service.app import create_app
from service.problems import MEDIA_TYPE
from tests.service.harness import PATIENCE, Running, ask, problem, roomy_settings, settings_of
from tests.service.plain_engine import PlainEngine

THOROUGH = 10
MANY = [pytest.param(1, id="few"), pytest.param(THOROUGH, id="many", marks=pytest.mark.thorough)]
READS = ["/v1/render", "/v1/explain", "/v1/accuracy", "/v1/sessions"]
JSON = {"Content-Type": "application/json"}
APP = create_app(settings_of(**roomy_settings() | {"max_duration": 0.05}), PlainEngine())
WHOLE: dict[str, Any] = {
    "finger": {"ridge_period": "0.5 mm", "ridge_amplitude": 4e-5, "contact_length": 0.01, "youngs_modulus": "101 kPa"},
    "texture": {"kind": "harmonics", "period": 8e-4, "components": [{"order": 1, "amplitude": 2e-5, "phase": 0.0}]},
    "scan": {"trajectory": [[0.0, 0.0, 0.3], [0.02, 1e-3, 0.3], [0.05, 2e-3, "0.2 N"]]},
    "effects": {"contact_growth": {}, "inertia": "auto"},
    "output": {"channels": [{"quantity": "displacement", "full_scale": 1e-5}], "duration": 0.02, "bandwidth": "1 kHz"},
    "accuracy": {"tolerance": 1e-3},
}
SHORT: dict[str, Any] = {"output": {"duration": 0.02}}
WILD = st.one_of(
    st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=20), st.just([]), st.just({}),
    st.sampled_from([10**400, -(10**400), 1e-320, -0.0, "\x00", "0.3 N\x00", "\ud800", "9" * 5000 + " mm", "1e999 m"]),
    st.sampled_from(["A" * 100_000, "é" * 50_000, [[]] * 5_000, {"k" * 10_000: 1}, [[[[[[]]]]]], "1" + "0" * 300]),
)  # fmt: skip
KEYS = st.one_of(
    st.text(max_size=12), st.sampled_from(["", "\x00", "k" * 100_000, "__proto__", "kind", "amplitude", "/~"])
)


def places(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Return the path to each value inside `value`, itself included."""
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [path, *(place for name, item in inner for place in places(item, (*path, name)))]


@st.composite
def nearly(draw: st.DrawFn) -> Any:
    """Return a scene that fits but for one place."""
    scene: Any = [copy.deepcopy(draw(st.sampled_from([WHOLE, SHORT])))]
    path = draw(st.sampled_from(places(scene[0])))
    holder, last = scene, 0
    for step in path:
        holder, last = holder[last], step
    value = holder[last]
    if isinstance(value, dict) and draw(st.booleans()):
        value[draw(KEYS)] = draw(WILD)
    elif draw(st.booleans()) and isinstance(holder, dict):
        del holder[last]
    else:
        holder[last] = draw(WILD)
    return scene[0]


def sound(answer: httpx.Response) -> None:
    """Fail if the answer is an error of the service."""
    assert answer.status_code < 500 or answer.json()["type"] == "/docs#problem-full", answer.text
    if answer.status_code >= 400:
        assert answer.headers["content-type"] == MEDIA_TYPE
        assert len(answer.content) < 20_000, "a refusal repeats what it refuses"


@pytest.mark.parametrize("times", MANY)
def test_a_scene_that_nearly_fits_is_no_mistake_of_ours(times: int) -> None:
    @settings(max_examples=150 * times, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True)
    @given(scene=nearly(), path=st.sampled_from(READS))
    def run(scene: Any, path: str) -> None:
        APP.state.service.sessions.end_all()
        sound(ask(APP, "POST", path, content=json.dumps(scene).encode(), headers=JSON))

    run()


@pytest.mark.parametrize("times", MANY)
def test_a_patch_that_nearly_fits_is_no_mistake_of_ours(times: int) -> None:
    @settings(max_examples=50 * times, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True)
    @given(scene=nearly())
    def run(scene: Any) -> None:
        APP.state.service.sessions.end_all()
        session = ask(APP, "POST", "/v1/sessions", content=b"{}", headers=JSON).json()["id"]
        sound(ask(APP, "PATCH", f"/v1/sessions/{session}", content=json.dumps(scene).encode(), headers=JSON))

    run()


PLAIN_TEXT = json.dumps(SHORT)
ENCODED = {
    "utf-16": PLAIN_TEXT.encode("utf-16"),
    "utf-32": PLAIN_TEXT.encode("utf-32"),
    "utf-8 with a mark": PLAIN_TEXT.encode("utf-8-sig"),
    "gzip": gzip.compress(PLAIN_TEXT.encode()),
    "latin-1": b'{"scan": {"load": "\xb5N"}}',
    "half a surrogate": b'{"scan": {"load": "\xed\xa0\x80"}}',
    "overlong": b'{"scan": {"load": "\xc0\xaf"}}',
    "null bytes": b"{}\x00\x00",
    "two texts": b"{}{}",
}


@pytest.mark.parametrize("path", READS)
@pytest.mark.parametrize("kind", ENCODED)
def test_another_encoding_is_refused_or_read_never_a_mistake(app: FastAPI, path: str, kind: str) -> None:
    for label in ({}, {"Content-Encoding": "gzip"}, {"Content-Type": "application/json; charset=utf-16"}):
        answer = ask(app, "POST", path, content=ENCODED[kind], headers={**JSON, **label})
        sound(answer)
        assert answer.status_code in (200, 201, 415, 422)


QUERIES = ["format=%00", "format=%ff%fe", "format", "=", "format=" + "a" * 60_000, "%00=1", "a" * 60_000]


@pytest.mark.parametrize("query", QUERIES, ids=[query[:20] for query in QUERIES])
def test_a_query_of_any_bytes_is_refused(app: FastAPI, query: str) -> None:
    answer = ask(app, "POST", f"/v1/render?{query}", content=PLAIN_TEXT.encode(), headers=JSON)
    sound(answer)
    assert answer.status_code == 422


@pytest.mark.parametrize(
    "name", ["host", "origin", "authorization", "accept", "content-type", "content-length", "sec-fetch-site"]
)
def test_a_header_of_any_text_is_no_mistake_of_ours(name: str) -> None:
    @settings(max_examples=30, deadline=None, derandomize=True)
    @given(value=st.one_of(st.binary(max_size=40), st.just(b"a" * 60_000), st.just(b"audio/l16;q=" + b"9" * 5000)))
    def run(value: bytes) -> None:
        headers = [(b"content-type", b"application/json"), (b"host", b"localhost")]
        headers = [entry for entry in headers if entry[0] != name.encode()] + [(name.encode(), value)]
        sound(ask(APP, "POST", "/v1/render", content=PLAIN_TEXT.encode(), headers=headers))

    run()


def raw(running: Running, text: bytes) -> bytes:
    """Return all that a server answers to bytes after which nothing more comes."""
    host, port = running.url.removeprefix("http://").split(":")
    with socket.create_connection((host, int(port)), PATIENCE) as connection:
        try:
            connection.sendall(text)
            connection.shutdown(socket.SHUT_WR)
            parts = iter(lambda: connection.recv(1 << 16), b"")
            return b"".join(parts)
        except OSError:  # it was reset: while bytes came, or before this end was shut down
            return b""


@pytest.mark.parametrize("times", MANY)
def test_no_bytes_on_the_wire_make_a_mistake_of_ours(running: Running, times: int) -> None:
    chance = random.Random(7)
    good = (
        b"POST /v1/explain HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: 2\r\n\r\n{}"
    )
    for _ in range(150 * times):
        text = bytearray(good)
        for _ in range(chance.randrange(1, 4)):
            place = chance.randrange(len(text))
            text[place : place + chance.randrange(3)] = chance.randbytes(chance.randrange(3))
        answer = raw(running, bytes(text))
        assert not answer.startswith(b"HTTP/1.1 5"), (bytes(text), answer[:400])
    problem(running.client.get("/v1/nothing"), 404, "not-found")
    assert running.client.get("/healthz").status_code == 200


@pytest.mark.parametrize(
    "text",
    [
        b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nX: " + b"a" * 100_000 + b"\r\n\r\n",
        b"GET /" + b"a" * 100_000 + b" HTTP/1.1\r\nHost: localhost\r\n\r\n",
        b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n" + b"X: a\r\n" * 20_000 + b"\r\n",
        b"GET /healthz\x00 HTTP/1.1\r\nHost: localhost\r\n\r\n",
        b"GET /healthz HTTP/9.9\r\nHost: localhost\r\n\r\n",
        b"POST /v1/explain HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: -1\r\n\r\n",
        b"POST /v1/explain HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
        b"Transfer-Encoding: chunked\r\n\r\nZZ\r\n",
        b"POST /v1/explain HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
        b"Transfer-Encoding: chunked\r\nContent-Length: 2\r\n\r\n2\r\n{}\r\n0\r\n\r\n",
    ],
    ids=["long header", "long path", "many headers", "null", "version", "length", "chunk", "two lengths"],
)
def test_a_request_out_of_all_measure_is_refused_and_the_service_goes_on(running: Running, text: bytes) -> None:
    answer = raw(running, text)
    assert not answer.startswith(b"HTTP/1.1 5"), answer[:400]
    assert running.client.get("/healthz").status_code == 200


@pytest.mark.parametrize(
    "text", [b"nonsense\r\n\r\n", b"GET /healthz HTTP/1.1\r\nHost localhost\r\n\r\n", b"\x16\x03\x01\x02\x00"]
)
def test_what_is_no_http_gets_a_problem_document(running: Running, text: bytes) -> None:
    head, _, body = raw(running, text + b"\r\n\r\n").partition(b"\r\n\r\n")
    lines = head.lower().split(b"\r\n")
    assert lines[0] == b"http/1.1 400 bad request"
    assert b"content-type: " + MEDIA_TYPE.encode() in lines and b"connection: close" in lines
    assert b"content-length: %d" % len(body) in lines and json.loads(body)["type"] == "/docs#problem-bad-request"
