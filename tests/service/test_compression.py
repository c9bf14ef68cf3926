"""Compression: long text where the client accepts gzip; never sound."""

from __future__ import annotations

import pytest
from fastapi import FastAPI

from tests.service.harness import Running, ask

GZIP = {"Accept-Encoding": "gzip"}


@pytest.mark.parametrize(
    "path", ["/v1/scene/schema.json", "/v1/live/schema.json", "/v1/live/schema.v2.json", "/openapi.json"]
)
def test_long_text_is_compressed_where_the_client_accepts_gzip(app: FastAPI, path: str) -> None:
    compressed = ask(app, "GET", path, headers=GZIP)
    plain = ask(app, "GET", path, headers={"Accept-Encoding": "gzip;q=0"})
    assert compressed.headers["content-encoding"] == "gzip"
    assert compressed.headers["vary"] == plain.headers["vary"] == "Accept-Encoding"
    assert int(compressed.headers["content-length"]) < len(plain.content) / 2
    assert "content-encoding" not in plain.headers and compressed.json() == plain.json()


@pytest.mark.parametrize("accepted", ["*", "GZIP", "br, gzip;q=0.1"])
def test_accept_encoding_is_read_as_the_rfc_says(app: FastAPI, accepted: str) -> None:
    answer = ask(app, "GET", "/openapi.json", headers={"Accept-Encoding": accepted})
    assert answer.headers["content-encoding"] == "gzip"


def test_short_text_is_not_compressed(app: FastAPI) -> None:
    assert "content-encoding" not in ask(app, "GET", "/healthz", headers=GZIP).headers


@pytest.mark.parametrize("kind", ["wav", "f32le", "l16", "flac"])
def test_sound_is_not_compressed(app: FastAPI, kind: str) -> None:
    answer = ask(app, "POST", f"/v1/render?format={kind}", json={"output": {"duration": 0.2}}, headers=GZIP)
    assert answer.status_code == 200, answer.text
    assert "content-encoding" not in answer.headers and len(answer.content) > 1000


def test_a_stream_is_not_compressed(running: Running) -> None:
    with running.listening(running.open_session(), "format=f32le") as listener:
        assert "content-encoding" not in listener.answer.headers
        assert len(listener.frames(4800)) == 4800
