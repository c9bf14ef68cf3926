"""What is packed on its way: answers of text, if they are long and the client takes gzip; sound never."""

from __future__ import annotations

import pytest
from fastapi import FastAPI

from tests.service.harness import Running, ask

GZIP = {"Accept-Encoding": "gzip"}


@pytest.mark.parametrize("path", ["/v1/scene/schema.json", "/v1/live/schema.json", "/openapi.json"])
def test_long_text_is_packed_for_who_takes_it(app: FastAPI, path: str) -> None:
    packed = ask(app, "GET", path, headers=GZIP)
    plain = ask(app, "GET", path, headers={"Accept-Encoding": "gzip;q=0"})
    assert packed.headers["content-encoding"] == "gzip" and "accept-encoding" in packed.headers["vary"].lower()
    assert int(packed.headers["content-length"]) < len(plain.content) / 2
    assert "content-encoding" not in plain.headers and packed.json() == plain.json()


def test_short_text_is_not(app: FastAPI) -> None:
    assert "content-encoding" not in ask(app, "GET", "/healthz", headers=GZIP).headers


@pytest.mark.parametrize("kind", ["wav", "f32le", "l16", "flac"])
def test_sound_is_sent_as_it_is(app: FastAPI, kind: str) -> None:
    answer = ask(app, "POST", f"/v1/render?format={kind}", json={"output": {"duration": 0.2}}, headers=GZIP)
    assert answer.status_code == 200, answer.text
    assert "content-encoding" not in answer.headers and len(answer.content) > 1000


def test_a_stream_comes_block_by_block_for_who_takes_gzip_too(running: Running) -> None:
    with running.listening(running.open_session(), "format=f32le") as listener:
        assert "content-encoding" not in listener.answer.headers
        assert len(listener.frames(4800)) == 4800
