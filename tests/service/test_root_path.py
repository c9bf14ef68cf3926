"""A path behind a proxy: every route, link and live stream under a prefix, which the proxy passes on or removes."""

from __future__ import annotations

import json
import socket
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from fastapi import FastAPI
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from clients import Client, Live
from clients.live_client.sync_live import WebSocketConnection, open_connection
from clients.live_client.websocket_connection import Address, Connection
from service.app import create_app
from service.operations.settings_environment import SettingsError, read_settings
from tests.service.harness import PATIENCE, ROOT, Running, ask, outcome_here, serving, settings_of, until
from tests.service.live.client import live
from tests.service.nginx import nginx, under_a_path
from tests.service.plain_engine import PlainEngine
from tests.service.test_nodes import reset

PREFIX = "/a/b"
STYLES = pytest.mark.parametrize("passed", ["", PREFIX], ids=["removed", "kept"])
"""What a proxy leaves of the prefix."""
CALLS = [
    (method.upper(), path)
    for path, calls in create_app(settings_of(), PlainEngine()).openapi()["paths"].items()
    for method in calls
]
NAMES = {"session_id": "nobody", "name": "denim-72x56", "hash": "0" * 64}


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    folders: dict[str, Any] = {name: tmp_path_factory.mktemp(name) for name in ("data_folder", "file_folder")}
    with serving(PlainEngine(), root_path=PREFIX, web=str(ROOT / "clients" / "web"), **folders) as running:
        until(lambda: running.service.warm)
        yield running


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> FastAPI:
    return create_app(settings_of(data_folder=tmp_path_factory.mktemp("plain")), PlainEngine())


@pytest.mark.parametrize("text", ["/a", "/a/b", "/~anna/haptics", "/user/anna@lab/8000", "/v1.2/touch", "/lab/v1"])
def test_a_prefix_is_read(text: str) -> None:
    assert read_settings({"RIDGEWAVE_ROOT_PATH": text}).root_path == text


@pytest.mark.parametrize(
    ("text", "written"),
    [
        ("/a/b/", "Write /a/b."),
        ("a/b", "Write /a/b."),
        ("//a//b", "Write /b."),  # a host and a path
        ("/a//b", "Write /a/b."),
        ("https://lab.example/a/b/", "Write /a/b."),
        ("/a/b?x=1", "Write /a/b."),
        ("/a/b#x", "Write /a/b."),
        ("/a/./b", "Write /a/b."),
        ("/a/../b", "Write /a/b."),
        ("/", "Leave RIDGEWAVE_ROOT_PATH unset"),
        ("..", "Leave RIDGEWAVE_ROOT_PATH unset"),
        ("/a b", "Write names of letters, digits and -._~@+, each after a /, such as /lab/touch."),
        ("/a\n/b", "Write /a/b."),
        ("/{a}", "Write names of letters, digits and -._~@+, each after a /, such as /lab/touch."),
        ("/a%2fb", "Write names of letters, digits and -._~@+, each after a /, such as /lab/touch."),
        ("/grün", "Write names of letters, digits and -._~@+, each after a /, such as /lab/touch."),
        ("/v1", "Write /touch/v1: the service has a path /v1 itself."),
        ("/web/lab/", "Write /touch/web/lab: the service has a path /web itself."),
        ("http://[::1", "Leave RIDGEWAVE_ROOT_PATH unset"),
    ],
)
def test_a_bad_prefix_is_refused_with_what_to_write(text: str, written: str) -> None:
    with pytest.raises(SettingsError) as refused:
        read_settings({"RIDGEWAVE_ROOT_PATH": text})
    (fault,) = refused.value.faults
    assert "/lab/touch" in fault.allowed and fault.hint.startswith(written)


@STYLES
@pytest.mark.parametrize(("method", "path"), CALLS, ids=lambda part: part)
def test_every_call_answers_as_without_a_prefix(
    served: Running, plain: FastAPI, method: str, path: str, passed: str
) -> None:
    path = path.format_map(NAMES)
    rest: dict[str, Any] = {"json": {}} if method in ("POST", "PATCH") else {}
    if path == "/v1/accuracy":
        rest = {"json": {"scan": None, "no": 1}}  # refused: a measurement takes long
    expected, got = ask(plain, method, path, **rest), served.client.request(method, passed + path, **rest)
    if path == "/readyz":  # the other service is not started
        assert got.status_code == 200
        return
    assert got.status_code == expected.status_code, got.text
    assert got.headers["content-type"] == expected.headers["content-type"]
    if expected.status_code >= 400:
        assert got.text.replace(f'"{PREFIX}/', '"/') == expected.text
        assert got.json()["type"].startswith(f"{PREFIX}/docs#problem-")


def links(document: Any) -> Iterator[str]:
    """Yield every text in a JSON document that is a path."""
    if isinstance(document, str):
        yield from [document] if document.startswith("/") else []
    elif isinstance(document, Mapping | list):
        for item in document.values() if isinstance(document, Mapping) else document:
            yield from links(item)


@STYLES
def test_every_link_of_an_answer_is_under_the_prefix_and_leads_somewhere(
    served: Running, passed: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("service.compute.import_process.Imports._outcome", outcome_here)
    client, name = served.client, f"wave-{len(passed)}"
    form: dict[str, Any] = {"data": {"name": name, "unit": "um", "pixel": "20 um"}}
    heights = "\n".join(str(index % 7) for index in range(100)).encode()
    opened = client.post(f"{passed}/v1/sessions", json={})
    session = opened.json()["id"]
    answers = [
        opened,
        client.get(f"{passed}/v1/sessions/{session}"),
        client.patch(f"{passed}/v1/sessions/{session}", json={"scan": {"load": 0.2}}),
        client.post(f"{passed}/v1/sessions/{session}/play", json={"device": f"file:{name}.wav"}),
        client.post(f"{passed}/v1/tables", json={}),
        client.post(f"{passed}/v1/textures", files={"file": ("wave.csv", heights)}, **form),
        client.patch(f"{passed}/v1/textures/{name}", json={"name": f"{name}-new"}),
        client.get(f"{passed}/v1/textures/{name}-new"),
        client.get(f"{passed}/v1/textures/denim-72x56"),
    ]
    client.delete(f"{passed}/v1/sessions/{session}/play").raise_for_status()
    found = set()
    for answer in answers:
        answer.raise_for_status()
        document = {name: value for name, value in answer.json().items() if name not in ("report", "scene", "play")}
        found |= set(links(document)) | {answer.headers.get("location", f"{PREFIX}/vr")}
    assert len(found) == 8
    for link in found - {f"{PREFIX}/v1/textures/{name}"}:  # renamed
        assert link.startswith(f"{PREFIX}/"), link
        end = "?duration=0.05" if link.endswith("/stream") else ""
        assert client.get(link + end).status_code == 200, link
    listed = client.get(f"{passed}/v1/textures").json()["textures"]
    assert all(entry["picture"] == f"{PREFIX}/v1/textures/{entry['name']}/picture" for entry in listed)


@STYLES
def test_openapi_and_its_page_say_where_the_calls_are(served: Running, passed: str) -> None:
    assert served.client.get(f"{passed}/openapi.json").json()["servers"] == [{"url": PREFIX}]
    page = served.client.get(f"{passed}/docs").text
    assert 'href="openapi.json"' in page and f"<code>{PREFIX}</code>" in page


def test_without_a_prefix_nothing_names_one(app: FastAPI) -> None:
    assert "servers" not in ask(app, "GET", "/openapi.json").json()
    assert "Each path follows" not in ask(app, "GET", "/docs").text


@STYLES
@pytest.mark.parametrize("path", ["/", "/vr"])
def test_the_pages_have_relative_addresses_alone(served: Running, passed: str, path: str) -> None:
    text = served.client.get(passed + path).text
    assert 'src="web/' in text and 'href="/' not in text and 'src="/' not in text


def test_the_prefix_without_its_slash_redirects(served: Running) -> None:
    for query in ("", "?scene=1"):
        answer = served.client.get(PREFIX + query)
        assert (answer.status_code, answer.headers["location"]) == (307, f"{PREFIX}/{query}")


def test_what_only_looks_like_the_prefix_is_no_path_of_the_service(served: Running) -> None:
    for path in ("/a", "/a/", "/a/bc/healthz", "/a/b/a/b/healthz", "/A/B/healthz", "/a//b/healthz"):
        assert served.client.get(path).status_code == 404, path


def test_without_a_page_the_root_redirects_to_the_docs_of_the_prefix() -> None:
    app = create_app(settings_of(root_path=PREFIX), PlainEngine())
    assert ask(app, "GET", f"{PREFIX}/").headers["location"] == f"{PREFIX}/docs"


@STYLES
def test_keys_and_limits_see_the_services_own_paths(passed: str) -> None:
    settings: dict[str, Any] = {"api_keys": "k", "request_burst": 1, "requests_per_second": 0.1}
    app = create_app(settings_of(root_path=PREFIX, web=str(ROOT / "clients" / "web"), **settings), PlainEngine())
    for path in ("/healthz", "/healthz", "/", "/healthz"):
        assert ask(app, "GET", passed + path).status_code == 200, path
    assert ask(app, "GET", passed + "/v1/textures").status_code == 429, "the page took the burst"
    key = {"Authorization": "Bearer k"}
    for _ in range(3):
        assert ask(app, "POST", passed + "/v1/stop", headers=key).status_code == 200
    slow = create_app(settings_of(root_path=PREFIX, api_keys="k"), PlainEngine())
    assert ask(slow, "GET", passed + "/v1/textures").status_code == 401
    assert ask(slow, "GET", PREFIX).status_code == 307


@STYLES
def test_a_target_in_absolute_form_may_have_the_prefix(served: Running, passed: str) -> None:
    host, _, port = served.url.removeprefix("http://").partition(":")
    with socket.create_connection((host, int(port)), PATIENCE) as connection:
        connection.sendall(f"GET http://localhost{passed}/healthz HTTP/1.1\r\nHost: x\r\n\r\n".encode())
        assert connection.recv(4096).startswith(b"HTTP/1.1 200 ")


@STYLES
def test_a_live_stream_is_resumed_at_the_address_of_ready(served: Running, passed: str) -> None:
    with live(served.url, path=f"{passed}/v1/live") as client:
        ready = client.hello(pacing="realtime")
        assert ready["resume_url"] == f"{PREFIX}/v1/live?session={ready['session']}"
        first = client.frames(960)
        client.break_off()
    with live(served.url, path=ready["resume_url"]) as again:
        again.hello(resume={"session": ready["session"], "frame": len(first) - 480})
        np.testing.assert_array_equal(again.frames(480)[:480], first[len(first) - 480 :])
        again.say("more", frames=-1)
        assert again.until("problem")["problem"] == f"{PREFIX}/docs#problem-message-refused"


@pytest.mark.parametrize(
    ("path", "kind"), [("/v1/live", "protocol"), (f"{PREFIX}/v1/live", "protocol"), (f"{PREFIX}/v1/no", "not-found")]
)
def test_a_refused_upgrade_links_below_the_prefix(served: Running, path: str, kind: str) -> None:
    with pytest.raises(InvalidStatus) as refused, connect(served.url.replace("http:", "ws:") + path):
        pass
    assert json.loads(refused.value.response.body or b"")["type"] == f"{PREFIX}/docs#problem-{kind}"


@pytest.mark.parametrize(
    ("url", "resume_url", "resumed"),
    [
        ("ws://h/a/b/v1/live", "/a/b/v1/live?session=s", "ws://h/a/b/v1/live?session=s"),
        ("ws://h/a/b/v1/live", "/v1/live?session=s", "ws://h/a/b/v1/live?session=s"),
        ("ws://h/v1/live", "/a/b/v1/live?session=s", "ws://h/v1/live?session=s"),
        ("ws://h/x/v1/live?lab=1", "/v1/live/v1/live?session=s", "ws://h/x/v1/live?lab=1&session=s"),
    ],
)
def test_the_client_resumes_under_the_prefix_of_its_own_address(url: str, resume_url: str, resumed: str) -> None:
    assert Address.of(url, None).resuming(resume_url).url == resumed


@pytest.mark.parametrize(("removed", "slash"), [(True, ""), (False, "/")], ids=["removed", "kept"])
def test_clients_work_under_a_path_of_nginx(served: Running, tmp_path: Path, removed: bool, slash: str) -> None:
    made: list[WebSocketConnection] = []

    def connecting(address: Address) -> Connection:
        connection = open_connection(address)
        assert isinstance(connection, WebSocketConnection)
        made.append(connection)
        return connection

    configuration = under_a_path(tmp_path, PREFIX, removed=removed)
    with nginx(tmp_path, int(httpx.URL(served.url).port or 0), configuration=configuration) as port:
        host = f"http://127.0.0.1:{port}"
        for outside in ("/", "/v1/textures", "/a/bc/healthz"):
            assert "ridgewave" not in httpx.get(host + outside, timeout=PATIENCE).text
        with Client(f"{host}{PREFIX}{slash}") as client:
            assert client.healthz()
            assert len(client.render({"output": {"duration": 0.1}}).values) == 4800
            with client.open_session() as session, session.stream(0.05) as stream:
                assert len(stream.read(2400)) == 2400
        assert httpx.get(host + PREFIX, timeout=PATIENCE).headers["location"] == f"{PREFIX}/"
        with Live(url=f"ws://127.0.0.1:{port}{PREFIX}/v1/live", connect=connecting, record=True) as touch:
            touch.move(0.0, 0.3)
            touch.read(480, timeout=PATIENCE)
            reset(made[-1])
            touch.read(480, timeout=PATIENCE)
            assert (touch.gaps, touch.reconnections) == ((), 1)
            touch.stop(timeout=PATIENCE)
            assert touch.recording()
