"""Which upgrades are accepted: Host, Origin, key, version, number."""

from __future__ import annotations

import base64
import json
import logging
import socket
from typing import Any

import pytest
from websockets.exceptions import InvalidStatus

from service import problems
from tests.service.harness import Running, problem, serving
from tests.service.live.client import PROTOCOL, live
from tests.service.plain_engine import PlainEngine


def refused(running: Running, **options: Any) -> dict[str, Any]:
    """Return the problem of a refused upgrade."""
    with pytest.raises(InvalidStatus) as caught, live(running, **options):
        pass
    answer = caught.value.response
    assert answer.headers["content-type"] == problems.MEDIA_TYPE
    document: dict[str, Any] = json.loads(answer.body or b"")
    assert document["status"] == answer.status_code
    return document


def test_a_page_of_another_origin_and_another_host_are_refused(running: Running) -> None:
    assert refused(running, origin="https://evil.example")["type"].endswith("origin-refused")
    host = running.url.removeprefix("http://")
    name = {"Host": "evil.example:80"}
    with pytest.raises(InvalidStatus) as caught, live(running, additional_headers=name):
        pass
    assert caught.value.response.status_code in (400, 403), "two Host headers, or one that is not ours"
    with live(running, origin=f"http://{host}") as client:
        client.hello()


def test_a_host_that_is_not_ours_is_refused(running: Running) -> None:
    port = int(running.url.rpartition(":")[2])
    with socket.create_connection(("127.0.0.1", port)) as raw:
        raw.sendall(
            b"GET /v1/live HTTP/1.1\r\nHost: evil.example\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n"
            b"Sec-WebSocket-Protocol: ridgewave.v1\r\n\r\n"
        )
        raw.settimeout(60.0)
        answer = raw.recv(65536)
    assert answer.startswith(b"HTTP/1.1 403") and b"host-refused" in answer


@pytest.mark.parametrize(
    ("first", "changed", "kind", "says"),
    [
        ("GET /v1/live", "Sec-WebSocket-Protocol: ridgewave.key.c2Vj/mV0, ridgewave.v2", "bad-request", "-Protocol"),
        ("GET /v1/live", "Sec-WebSocket-Version: 8", "bad-request", "Sec-WebSocket-Version"),
        ("GET /v1/live", "Sec-WebSocket-Key: short", "bad-request", "Sec-WebSocket-Key"),
        ("GET /v1/live", "Content-Length: 5", "bad-request", "announces a body"),
        ("GET /v1/live", "Transfer-Encoding: chunked", "bad-request", "announces a body"),
        ("GET /v1/live", "Cookie: c2Vj\x01", "bad-request", "an invalid header"),
        ("GET /v1/live", f"Cookie: {9000 * 'c2Vj'}"[:9000], "bad-request", "too large"),
        ("POST /v1/live", "", "method-not-allowed", "GET"),
        ("GET /v1/lives", "", "not-found", "path"),
        ("GET /v1/render", "", "not-found", "path"),
    ],
)
def test_an_invalid_handshake_is_a_problem_that_echoes_no_header(
    running: Running, first: str, changed: str, kind: str, says: str
) -> None:
    fields = {"Host": "localhost", "Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13"}
    fields |= {"Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA==", "Sec-WebSocket-Protocol": "ridgewave.v2"}
    name, _, value = changed.partition(": ")
    lines = [f"{name}: {value}" for name, value in (fields | ({name: value} if name else {})).items()]
    with socket.create_connection(("127.0.0.1", int(running.url.rpartition(":")[2]))) as raw:
        raw.settimeout(60.0)
        raw.sendall("\r\n".join([f"{first} HTTP/1.1", *lines, "", ""]).encode())
        with raw.makefile("rb") as received:
            head, _, body = received.read().partition(b"\r\n\r\n")
    document = json.loads(body)
    assert document["type"] == f"/docs#problem-{kind}" and says in document["detail"]
    assert head.startswith(f"HTTP/1.1 {document['status']} ".encode()) and problems.MEDIA_TYPE.encode() in head
    assert b"c2Vj" not in body


@pytest.mark.parametrize("offered", [None, ["ridgewave.v3"], ["chat", "ridgewave"]])
def test_the_version_is_negotiated(running: Running, offered: list[str] | None) -> None:
    document = refused(running, subprotocols=offered)
    assert document["status"] == 400 and document["type"] == "/docs#problem-protocol"
    assert "ridgewave.v2 or ridgewave.v1" in document["detail"]


def test_the_newest_client_falls_back_to_what_the_service_speaks(running: Running) -> None:
    with live(running, subprotocols=["ridgewave.v9", PROTOCOL]) as client:
        assert client.socket.subprotocol == PROTOCOL


@pytest.mark.parametrize("offered", [["ridgewave.v2"], ["ridgewave.v2", PROTOCOL], [PROTOCOL, "chat", "ridgewave.v2"]])
def test_the_service_takes_the_newest_version_that_is_offered_whatever_the_order(
    running: Running, offered: list[str]
) -> None:
    with live(running, subprotocols=offered) as client:
        assert client.socket.subprotocol == "ridgewave.v2" == client.hello()["protocol"]


KEY = "a key with ümlaut/+".replace(" ", "-").replace("ü", "u")


def key_protocol(key: str) -> str:
    return "ridgewave.key." + base64.urlsafe_b64encode(key.encode()).decode().rstrip("=")


def test_a_key_comes_in_a_header_or_as_a_subprotocol_and_is_never_echoed(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    caplog.set_level(logging.DEBUG)
    for name in ("ridgewave", "uvicorn", "uvicorn.error", "uvicorn.access"):
        caplog.set_level(logging.DEBUG, logger=name)  # whatever a service of this process has chosen before
        monkeypatch.setattr(logging.getLogger(name), "propagate", True)
    with serving(PlainEngine(), api_keys=f"other,{KEY}") as running:
        for options in (
            {"additional_headers": {"Authorization": f"Bearer {KEY}"}},
            {"subprotocols": [PROTOCOL, key_protocol(KEY)]},
            {"subprotocols": [key_protocol(KEY), PROTOCOL]},
        ):
            with live(running, **options) as client:
                assert client.socket.subprotocol == PROTOCOL
                client.hello()
        for wrong in (
            {},
            {"subprotocols": [PROTOCOL, key_protocol("wrong")]},
            {"subprotocols": [PROTOCOL, key_protocol(KEY), key_protocol(KEY)]},
            {"subprotocols": [PROTOCOL, "ridgewave.key.A"]},
            {"subprotocols": [PROTOCOL, f"ridgewave.key.{KEY.replace('/', '_')}"]},
            {"additional_headers": {"Authorization": "Bearer wrong"}},
        ):
            document = refused(running, **wrong)
            assert document["status"] == 401 and KEY not in json.dumps(document)
    mine = [record for record in caplog.records if record.name.startswith(("ridgewave", "uvicorn"))]
    logged = "\n".join(record.getMessage() for record in mine)
    assert KEY not in logged and key_protocol(KEY) not in logged and "WEBSOCKET /v1/live 101" in logged


def test_each_of_several_workers_has_live_sessions_of_its_own_and_none_of_plain_http() -> None:
    with serving(PlainEngine(), workers=2) as running, serving(PlainEngine(), workers=2) as other:
        with live(running) as client:
            session = client.hello()["session"]
            client.break_off()
        with live(other) as client:
            client.say("hello", resume={"session": session, "frame": 0})
            client.rest()
            assert client.code == 1008 and client.texts("problem")[0]["problem"] == "/docs#problem-not-found"
        with live(running) as client:
            client.hello(resume={"session": session, "frame": 0})
        problem(running.client.post("/v1/sessions", json={}), 503, "one-worker")


def test_a_session_too_many_is_closed_with_1013() -> None:
    with serving(PlainEngine(), max_sessions=1) as running, live(running) as first:
        first.hello()
        with live(running) as second:
            second.say("hello")
            second.rest()
            assert second.code == 1013 and second.texts("problem")[0]["problem"] == "/docs#problem-full"
        first.say("stop")
        first.rest()
        with live(running) as third:
            third.hello()
