"""The log: one shape for all loggers, what an event is about, and neither keys nor lines of a client's own."""

from __future__ import annotations

import contextlib
import json
import logging
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
import websockets.exceptions
import websockets.sync.client
from fastapi import FastAPI

from service.operations.logs import SubjectFilter, about_session, request_line, set_up_log
from tests.few import thorough
from tests.service.harness import PATIENCE, Child, ask
from tests.service.plain_engine import PlainEngine

KEY = "a-long-key-that-nobody-may-read"
ENCODED = "YS1sb25nLWtleS10aGF0LW5vYm9keS1tYXktcmVhZA"
LOGGERS = ("", "ridgewave", "uvicorn", "uvicorn.access", "uvicorn.error")


@pytest.fixture(autouse=True)
def as_it_was() -> Iterator[None]:
    """Leave the loggers as the other tests expect them."""
    loggers = [logging.getLogger(name) for name in LOGGERS]
    kept = [(logger.handlers[:], logger.level, logger.propagate) for logger in loggers]
    logging.captureWarnings(False)  # a service that a test before ran in this process has left it on
    yield
    logging.captureWarnings(False)
    for logger, (handlers, level, propagate) in zip(loggers, kept, strict=True):
        logger.handlers, logger.level, logger.propagate = handlers, level, propagate


def lines(capsys: pytest.CaptureFixture[str]) -> list[dict[str, Any]]:
    return [json.loads(line) for line in capsys.readouterr().err.splitlines()]


def test_json_is_an_object_a_line_from_every_logger(capsys: pytest.CaptureFixture[str]) -> None:
    set_up_log("info", "json")
    logging.getLogger("ridgewave.service").info("%d\nlines", 2)
    logging.getLogger("uvicorn.error").warning("plain", extra={"color_message": "\x1b[1mplain"})
    logging.getLogger("another").error("broken")
    warnings.warn("old", DeprecationWarning, stacklevel=1)
    shown = lines(capsys)
    assert [entry["message"] for entry in shown[:3]] == ["2\nlines", "plain", "broken"]
    assert [entry["level"] for entry in shown] == ["INFO", "WARNING", "ERROR", "WARNING"]
    assert shown[0]["logger"] == "ridgewave.service"
    assert set(shown[1]) == {"timestamp", "level", "logger", "message", "process"}
    assert shown[0]["timestamp"].endswith("+00:00")


def test_a_bug_of_ours_has_its_request_its_session_and_its_id(
    app: FastAPI, engine: PlainEngine, capsys: pytest.CaptureFixture[str]
) -> None:
    session = ask(app, "POST", "/v1/sessions", json={}).json()["id"]
    set_up_log("info", "json")
    engine.mistake = True
    answer = ask(app, "PATCH", f"/v1/sessions/{session}?x=y", json={"scan": {"speed": 1}})
    (entry,) = lines(capsys)
    assert entry["instance"] == answer.json()["instance"]
    assert entry["session"] == session
    assert entry["request"] == f"PATCH /v1/sessions/{session}"
    assert "a secret that no peer may learn" in entry["exc_info"]
    assert "secret" not in answer.text


def test_plain_text_stays_plain_text(capsys: pytest.CaptureFixture[str]) -> None:
    set_up_log("warning")
    logging.getLogger("ridgewave.service").info("not this")
    logging.getLogger("ridgewave.service").warning("this")
    (line,) = capsys.readouterr().err.splitlines()
    assert line.endswith("WARNING ridgewave.service: this")


@pytest.mark.parametrize("raw", [b"/a%0Ab\x1b[2J", b"/a\nFORGED line", "/ä".encode(), b"/a?key=1"])
def test_a_path_makes_no_lines_of_its_own(raw: bytes) -> None:
    line = request_line({"type": "http", "method": "GET", "path": "/", "raw_path": raw})
    assert line.isascii() and line.isprintable() and "key" not in line
    assert request_line({"type": "websocket", "path": "/a\nb\xe4"}) == "WEBSOCKET /a\\nb\\xe4"


def test_a_live_connection_names_its_session_itself() -> None:
    def named() -> object:
        record = logging.LogRecord("x", logging.INFO, "", 0, "", (), None)
        SubjectFilter().filter(record)
        return getattr(record, "session", None)

    import contextvars

    def connection() -> object:
        about_session("abc")
        return named()

    assert contextvars.copy_context().run(connection) == "abc"
    assert named() is None


@pytest.mark.parametrize("workers", [1, 2])
@pytest.mark.parametrize("log_format", ["json", thorough("text")])
def test_no_key_is_ever_logged_at_any_level(tmp_path: Path, log_format: str, workers: int) -> None:
    child = Child(
        "tests.service.serve_plain" if workers == 1 else "tests.service.serve_plain_workers",
        tmp_path,
        RIDGEWAVE_WORKERS=str(workers),
        RIDGEWAVE_API_KEYS=KEY,
        RIDGEWAVE_LOG_LEVEL="debug",
        RIDGEWAVE_LOG_FORMAT=log_format,
    )
    try:
        url = child.url()
        with httpx.Client(base_url=url, headers={"Authorization": f"Bearer {KEY}"}, timeout=PATIENCE) as client:
            session = client.post("/v1/sessions", json={}).json()["id"]
            assert client.get(f"/v1/sessions/{session}?key={KEY}").status_code == 200
            assert client.get(f"/nowhere?{ENCODED}").status_code == 404
        assert httpx.get(f"{url}/v1/textures?api_key={KEY}", timeout=PATIENCE).status_code == 401
        _knock(url)
    finally:
        child.terminate()
    log = child.log.read_text()
    assert KEY not in log and ENCODED not in log
    assert "WEBSOCKET /v1/live 101" in log and "WEBSOCKET /v1/live 401" in log and "GET /nowhere 404" in log
    assert "ERROR" not in log and "Traceback" not in log
    if log_format == "json":
        entries = [json.loads(line) for line in log.splitlines()]
        assert {entry["session"] for entry in entries if "session" in entry} == {session}
        assert {"uvicorn.error", "ridgewave.access", "ridgewave.service"} <= {entry["logger"] for entry in entries}


def _knock(url: str) -> None:
    """Open WebSockets with the key in each place where it may stand and one where it may not, one without a key."""
    given = {"Authorization": f"Bearer {KEY}"}
    offered = ["ridgewave.v1", f"ridgewave.key.{ENCODED}"]
    for query, headers, subprotocols in (("", given, offered), (f"?key={KEY}", {}, offered), (f"?key={KEY}", {}, None)):
        with (
            contextlib.suppress(websockets.exceptions.InvalidHandshake),
            websockets.sync.client.connect(
                f"ws{url.removeprefix('http')}/v1/live{query}",
                additional_headers=headers,
                subprotocols=subprotocols,  # type: ignore[arg-type]
            ),
        ):
            pass
