"""Both files of nginx: every documented call passes with the bounds of the service, also while a node hangs."""

from __future__ import annotations

import json
import os
import signal
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from tests.few import thorough
from tests.service.harness import PATIENCE, Child, problem, serving, settings_of, until
from tests.service.live.client import live
from tests.service.nginx import CONFIGURATION, NODES, nginx
from tests.service.plain_engine import PlainEngine

HUNG_SECONDS = 5  # after which a node that was stopped counts as one that does not answer
SHORT = {"output": {"duration": 0.1}}
TURNS = 20  # more than the nodes
LARGE = b"\n".join(b"%.4f" % height for height in 20.0 * np.sin(np.arange(320_000) / 50.0))
GIVEN = {"unit": "um", "pixel": "5 um", "name": "cloth"}
CALLS: dict[str, tuple[str, str, dict[str, Any], int]] = {
    "render": ("POST", "/v1/render?format=f32le", {"json": SHORT}, 200),
    "explain": ("POST", "/v1/explain", {"json": {}}, 200),
    "analyze": ("POST", "/v1/analyze", {"json": {}}, 200),
    "getSceneSchema": ("GET", "/v1/scene/schema.json", {}, 200),
    "drawPicture": ("POST", "/v1/picture", {"json": {"scene": {}}}, 200),
    "getThreshold": ("GET", "/v1/threshold", {}, 200),
    "measureAccuracy": ("POST", "/v1/accuracy", {"json": {}}, 200),
    "importTexture": ("POST", "/v1/textures", {"files": {"file": ("cloth.csv", LARGE)}, "data": GIVEN}, 201),
    "listTextures": ("GET", "/v1/textures", {}, 200),
    "getTexture": ("GET", "/v1/textures/cloth", {}, 200),
    "getTexturePicture": ("GET", "/v1/textures/cloth/picture", {}, 200),
    "exportTexture": ("GET", "/v1/textures/cloth/surface?format=npy", {}, 200),
    "renameTexture": ("PATCH", "/v1/textures/cloth", {"json": {"name": "felt"}}, 200),
    "deleteTexture": ("DELETE", "/v1/textures/felt", {}, 204),
    "makeTable": ("POST", "/v1/tables", {"json": {}}, 201),
    "getTable": ("GET", "/v1/tables/{hash}", {}, 200),
    "openSession": ("POST", "/v1/sessions", {"json": {}}, 201),
    "getSession": ("GET", "/v1/sessions/{id}", {}, 200),
    "changeSession": ("PATCH", "/v1/sessions/{id}", {"json": {"scan": {"load": 0.2}}}, 200),
    "streamSession": ("GET", "/v1/sessions/{id}/stream?format=f32le&duration=0.1", {}, 200),
    "playSession": ("POST", "/v1/sessions/{id}/play", {"json": {"device": "file:{id}.wav"}}, 202),
    "endPlay": ("DELETE", "/v1/sessions/{id}/play", {}, 200),
    "deleteSession": ("DELETE", "/v1/sessions/{id}", {}, 204),
    "listDevices": ("GET", "/v1/devices", {}, 200),
    "getLiveSchema": ("GET", "/v1/live/schema.json", {}, 200),
    "getLiveSchemaV2": ("GET", "/v1/live/schema.v2.json", {}, 200),
    "getRecording": ("GET", "/v1/sessions/{live}/recording", {}, 200),
    "getHealth": ("GET", "/healthz", {}, 200),
    "getReadiness": ("GET", "/readyz", {}, 200),
    "getMetrics": ("GET", "/metrics", {}, 200),
    "getDocs": ("GET", "/docs", {}, 200),
    "stopAll": ("POST", "/v1/stop", {}, 200),
}


@dataclass
class Front:
    """An nginx in front of nodes, and a client of it."""

    nodes: list[Child]
    url: str
    client: httpx.Client

    @contextmanager
    def hanging(self, node: int) -> Iterator[None]:
        """Within, the node with this number hangs."""
        process = self.nodes[node].process
        process.send_signal(signal.SIGSTOP)
        try:
            yield
        finally:
            process.send_signal(signal.SIGCONT)

    def session(self, node: str) -> str:
        """Return the id of a new session on `node`."""
        names: list[str] = []

        def opened() -> bool:
            names.append(str(self.client.post("/v1/sessions", json={}).json()["id"]))
            return names[-1].startswith(f"{node}.")

        until(opened)  # a node that hung a moment ago is left out for a while
        return names[-1]


@contextmanager
def front(
    folder: Path, names: str, configuration: Path, module: str = "tests.service.serve_plain", **settings: str
) -> Iterator[Front]:
    """Yield an nginx in front of nodes of these names, one letter each."""
    with ExitStack() as stack:
        nodes = []
        for name in names:
            (folder / name).mkdir(parents=True)
            variables = {"RIDGEWAVE_NODE": name, "RIDGEWAVE_DATA_FOLDER": str(folder / "data"), **settings}
            nodes.append(Child(module, folder / name, **variables))
            stack.callback(nodes[-1].end)
        ports = [httpx.URL(node.url()).port or 0 for node in nodes]
        (folder / "nginx").mkdir()
        port = stack.enter_context(nginx(folder / "nginx", *ports, configuration=configuration, seconds=HUNG_SECONDS))
        url = f"http://127.0.0.1:{port}"
        yield Front(nodes, url, stack.enter_context(httpx.Client(base_url=url, timeout=PATIENCE)))


@pytest.fixture(scope="module")
def one(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Front]:
    with front(tmp_path_factory.mktemp("one"), "a", CONFIGURATION) as made:
        yield made


@pytest.fixture(scope="module")
def two(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Front]:
    with front(tmp_path_factory.mktemp("two"), "ab", NODES) as made:
        yield made


def test_every_documented_call_is_here() -> None:
    from service.app import create_app

    paths = create_app(settings_of(), PlainEngine()).openapi()["paths"]
    assert set(CALLS) == {call["operationId"] for calls in paths.values() for call in calls.values()}


def passes_every_call(front: Front) -> None:
    """Make every documented call, and a live connection that is resumed."""
    with live(front.url) as client:
        ready = client.hello(pacing="realtime", record=True)
        first = client.frames(960)
        client.break_off()
    with live(front.url, path=ready["resume_url"]) as again:
        again.hello(resume={"session": ready["session"], "frame": len(first) - 480})
        again.say("stop")
        again.rest()
    known = {"live": ready["session"]}
    for name, (method, path, rest, status) in CALLS.items():
        body = rest
        if "json" in rest:
            body = {"json": json.loads(json.dumps(rest["json"]).replace("{id}", known.get("id", "")))}
        answer = front.client.request(method, path.format(**known), **body)
        assert answer.status_code == status, (name, answer.text)
        if name == "openSession":
            known["id"] = answer.json()["id"]
        if name == "makeTable":
            known["hash"] = answer.json()["hash"]
        if name == "render":
            assert len(answer.content) == 4800 * 4


def test_every_call_passes_nginx(one: Front) -> None:
    assert len(LARGE) > 2_300_000
    passes_every_call(one)


def test_every_call_passes_nginx_in_front_of_two_nodes(two: Front) -> None:
    for _ in range(2):
        passes_every_call(two)


@pytest.mark.parametrize("node", [0, thorough(1)])
def test_every_call_passes_while_one_of_two_nodes_hangs(two: Front, node: int) -> None:
    with two.hanging(node):
        until(lambda: two.client.get("/v1/textures").status_code == 200)  # the other one hung a moment ago
        passes_every_call(two)


def workers_of(service: Child) -> list[int]:
    """Return the processes of the workers of `service`."""
    children = Path(f"/proc/{service.process.pid}/task/{service.process.pid}/children").read_text().split()
    return [int(child) for child in children if b"spawn_main" in Path(f"/proc/{child}/cmdline").read_bytes()]


def test_every_call_passes_while_one_of_two_workers_hangs(tmp_path: Path) -> None:
    settings = {"RIDGEWAVE_WORKERS": "2"}
    with front(tmp_path, "a", CONFIGURATION, "tests.service.serve_brisk_workers", **settings) as made:
        until(lambda: made.client.get("/healthz").json()["workers"] == 2)
        hung = workers_of(made.nodes[0])[0]
        os.kill(hung, signal.SIGSTOP)
        try:
            passes_every_call(made)
            assert made.client.post("/v1/stop").json()["unanswered_workers"] == 1
        finally:
            os.kill(hung, signal.SIGCONT)


def test_a_table_is_found_whichever_node_made_it(two: Front) -> None:
    for node in two.nodes:
        made = httpx.post(f"{node.url()}/v1/tables", json={}, timeout=PATIENCE).json()
        answers = [two.client.get(made["url"]) for _ in range(TURNS)]
        assert [len(answer.content) for answer in answers] == [made["bytes"]] * TURNS
        known = {"If-None-Match": answers[0].headers["etag"]}
        assert [two.client.get(made["url"], headers=known).status_code for _ in range(TURNS)] == [304] * TURNS
        two.client.post("/v1/stop")
    for _ in range(TURNS):
        problem(two.client.get("/v1/tables/none"), 404, "not-found")


def test_the_table_of_a_node_that_hangs_is_to_be_made_again(two: Front) -> None:
    with two.hanging(0):
        for _ in range(2):
            answer = two.client.get(f"/v1/tables/{'0' * 64}")
            assert answer.status_code == 404 and answer.headers["content-type"] == "application/problem+json"


@pytest.mark.parametrize("node", [0, thorough(1)])
def test_a_stop_reaches_the_others_and_is_answered_while_a_node_hangs(two: Front, node: int) -> None:
    sessions = [two.session(name) for name in "ab"]
    other = sessions[1 - node]
    with ExitStack() as stack:
        stream = two.client.stream("GET", f"/v1/sessions/{other}/stream?format=f32le")
        parts = stack.enter_context(stream).iter_raw()
        next(parts)
        with two.hanging(node):
            for _ in range(2):  # on one connection: the answer is whole
                assert two.client.post("/v1/stop").status_code == 200
            with suppress(httpx.RemoteProtocolError):  # a busy machine: what does not fade in time is cut off
                b"".join(parts)
            assert two.client.get(f"/v1/sessions/{other}").status_code == 404
    hung = two.nodes[node].url()
    until(lambda: httpx.get(f"{hung}/v1/sessions/{sessions[node]}", timeout=PATIENCE).status_code == 404)


def test_a_session_of_a_node_that_hangs_is_not_found_and_a_new_one_opens_elsewhere(two: Front) -> None:
    session = two.session("b")
    with two.hanging(1):
        told = problem(two.client.get(f"/v1/sessions/{session}"), 404, "not-found")
        assert "of the node b, and this is the node a" in told["detail"]
        assert two.client.post("/v1/sessions", json={}).json()["id"].startswith("a.")
    assert two.client.get(f"/v1/sessions/{session}").status_code == 200, "it is there again"


def proxy_problem(answer: httpx.Response, status: int) -> None:
    """Check that nginx itself has refused, as the service does."""
    assert (answer.status_code, answer.headers["content-type"]) == (status, "application/problem+json"), answer.text
    document = answer.json()
    assert set(document) == {"type", "title", "status", "detail", "errors"} and document["status"] == status
    assert answer.headers["cache-control"] == "no-store"
    assert ("retry-after" in answer.headers) == (status in (502, 503, 504))


def upload(size: int) -> dict[str, Any]:
    """Return an import of so many bytes, of a file that no reader knows. A client that is refused stops sending."""
    opening = b'--x\r\nContent-Disposition: form-data; name="file"; filename="a.xyz"\r\n\r\n'
    ending = b"\r\n--x--\r\n"

    def body() -> Iterator[bytes]:
        """Yield the form."""
        yield opening
        rest = size - len(opening) - len(ending)
        for begin in range(0, rest, 1 << 20):
            yield bytes(min(1 << 20, rest - begin))
        yield ending

    headers = {"Content-Type": "multipart/form-data; boundary=x", "Content-Length": str(size)}
    return {"content": body(), "headers": headers}


@pytest.mark.parametrize("name", [thorough("one"), "two"])
@pytest.mark.slow
def test_the_largest_import_reaches_the_service(name: str, request: pytest.FixtureRequest) -> None:
    client: httpx.Client = request.getfixturevalue(name).client
    problem(client.post("/v1/textures", **upload(134_217_728)), 422, "request-refused")


@pytest.mark.parametrize("name", ["one", "two"])
def test_what_nginx_refuses_is_a_problem(name: str, request: pytest.FixtureRequest) -> None:
    client: httpx.Client = request.getfixturevalue(name).client
    proxy_problem(client.post("/v1/render", content=bytes(1_048_577)), 413)
    proxy_problem(client.get("/healthz?" + "x" * 40_000), 414)
    proxy_problem(client.request("TRACE", "/healthz"), 405)
    proxy_problem(client.post("/v1/textures", **upload(134_217_729)), 413)
    just = client.post("/v1/render", content=b" " * 1_048_576, headers={"Content-Type": "application/json"})
    problem(just, 422, "scene-refused")


def test_what_the_service_refuses_before_it_has_read_the_body_is_told(tmp_path: Path) -> None:
    with front(tmp_path, "a", CONFIGURATION, RIDGEWAVE_API_KEYS="mine") as made:
        packed = {"Authorization": "Bearer mine", "Content-Encoding": "gzip"}
        form: dict[str, Any] = {"files": {"file": ("cloth.csv", LARGE)}, "data": GIVEN}
        refused: list[tuple[str, dict[str, Any], int, str]] = [
            ("/v1/textures", form, 401, "key-required"),
            ("/v1/textures", {"headers": packed, **form}, 415, "not-multipart"),
            ("/v1/render", {"content": bytes(1_048_576)}, 401, "key-required"),
        ]
        for path, rest, status, kind in TURNS * refused:  # each on a connection of its own: nginx closes it afterwards
            problem(httpx.post(str(made.client.base_url.join(path)), timeout=PATIENCE, **rest), status, kind)


def test_nodes_that_are_gone_or_hang_are_told_in_a_problem(tmp_path: Path) -> None:
    with front(tmp_path / "one", "a", CONFIGURATION) as made:
        with made.hanging(0):
            proxy_problem(made.client.post("/v1/stop"), 504)
        made.nodes[0].end()
        for method, path in (("GET", "/v1/textures"), ("POST", "/v1/stop"), ("POST", "/v1/render")):
            proxy_problem(made.client.request(method, path), 502)
    with front(tmp_path / "two", "ab", NODES) as made:
        with made.hanging(0), made.hanging(1):
            proxy_problem(made.client.get("/v1/textures"), 503)
            proxy_problem(made.client.post("/v1/stop"), 504)
        for node in made.nodes:
            node.end()
        proxy_problem(made.client.get("/v1/textures"), 503)
        proxy_problem(made.client.post("/v1/stop"), 502)


@pytest.mark.parametrize("configuration", [CONFIGURATION, NODES], ids=["one", "two"])
def test_a_call_may_take_longer_than_a_node_may_need_to_answer(configuration: Path, tmp_path: Path) -> None:
    gate = threading.Event()
    with serving(PlainEngine(gate=gate)) as running:
        port = httpx.URL(running.url).port or 0
        with nginx(tmp_path, port, port, configuration=configuration, seconds=1) as outside:
            timer = threading.Timer(3.0, gate.set)
            timer.start()
            try:
                answer = httpx.post(f"http://127.0.0.1:{outside}/v1/tables", json={}, timeout=PATIENCE)
            finally:
                gate.set()
                timer.join()
    assert answer.status_code == 201
