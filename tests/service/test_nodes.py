"""docs/nginx-nodes.conf in a real nginx in front of two nodes: a call for a session reaches its node."""

from __future__ import annotations

import socket
import struct
import time
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from dataclasses import dataclass

import httpx
import numpy as np
import pytest

from clients import Live
from clients.live_client.sync_live import WebSocketConnection, open_connection
from clients.live_client.websocket_connection import Address, Connection
from tests.service.harness import PATIENCE, Child, problem
from tests.service.live.client import live
from tests.service.nginx import NODES, nginx

AGAIN = 3  # times: a call that goes to any node meets the right one every second time


@dataclass
class House:
    """Two nodes, the nginx in front of them, and a client of it. host: its address. root_path: of the nodes."""

    nodes: dict[str, Child]
    host: str
    root_path: str
    client: httpx.Client

    @property
    def url(self) -> str:
        """The address of the service."""
        return self.host + self.root_path

    def gone(self, path: str) -> str:
        """Return what the answer tells of a session that is not there."""
        return str(problem(self.client.get(path), 404, "not-found", root_path=self.root_path)["detail"])

    def opened(self) -> dict[str, str]:
        """Return the id of a new session on each node."""
        found: dict[str, str] = {}
        for _ in range(10):
            name = self.client.post("/v1/sessions", json={}).json()["id"]
            found[name.partition(".")[0]] = name
            if len(found) == len(self.nodes):
                return found
        raise AssertionError(f"sessions are opened on {list(found)} alone")


@pytest.fixture(scope="module", params=["", "/lab/touch"], ids=["a host", "a path"])
def house(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[House]:
    with ExitStack() as stack:
        nodes = {}
        for name in ("a", "b"):
            variables = {"RIDGEWAVE_NODE": name, "RIDGEWAVE_ROOT_PATH": request.param}
            nodes[name] = Child("tests.service.serve_plain", tmp_path_factory.mktemp(name), **variables)
            stack.callback(nodes[name].end)
        ports = [int(httpx.URL(node.url()).port or 0) for node in nodes.values()]
        port = stack.enter_context(nginx(tmp_path_factory.mktemp("nginx"), *ports, configuration=NODES))
        host = f"http://127.0.0.1:{port}"
        client = httpx.Client(base_url=host + request.param, timeout=PATIENCE)
        yield House(nodes, host, request.param, stack.enter_context(client))


def test_a_session_is_changed_heard_played_and_deleted_on_its_node(house: House) -> None:
    for node, name in house.opened().items():
        path = f"/v1/sessions/{name}"
        for load in np.arange(1, AGAIN + 1) / 10:
            answer = house.client.patch(path, json={"scan": {"load": load}})
            assert answer.status_code == 200, answer.text
            assert house.client.get(path).json()["scene"]["scan"]["load"] == load
            assert len(house.client.get(f"{path}/stream?format=f32le&duration=0.05").content) == 2400 * 4
        assert house.client.post(f"{path}/play", json={"device": f"file:{node}.wav"}).status_code == 202
        assert house.client.delete(f"{path}/play").json()["failure"] is None
        assert house.client.delete(path).status_code == 204
        for _ in range(AGAIN):
            house.gone(path)


def test_a_live_stream_is_resumed_on_its_node_by_the_url_of_ready(house: House) -> None:
    seen = set()
    for _ in range(2 * AGAIN):
        with live(house.url) as client:
            ready = client.hello(pacing="realtime")
            first = client.frames(960)
            client.break_off()
        with live(house.host, path=ready["resume_url"]) as again:
            kept = len(first) - 480
            assert again.hello(resume={"session": ready["session"], "frame": kept})["frame"] == kept
            np.testing.assert_array_equal(again.frames(480)[:480], first[kept:])
        seen.add(ready["session"].partition(".")[0])
    assert seen == {"a", "b"}


def test_the_client_goes_on_without_a_gap_when_its_connections_to_the_nodes_break(house: House) -> None:
    made: list[WebSocketConnection] = []
    addresses: list[str] = []

    def connect(address: Address) -> Connection:
        connection = open_connection(address)
        assert isinstance(connection, WebSocketConnection)
        made.append(connection)
        addresses.append(address.url)
        return connection

    url = house.url.replace("http:", "ws:") + "/v1/live?lab=1"
    with Live(url=url, connect=connect, record=True) as touch:
        touch.move(0.0, 0.3)
        touch.read(480, timeout=PATIENCE)
        for _ in range(AGAIN):
            reset(made[-1])
            touch.read(480, timeout=PATIENCE)
        name = touch.session
        assert (touch.frame, touch.gaps, touch.reconnections) == (480 * (AGAIN + 1), (), AGAIN)
        touch.stop(timeout=PATIENCE)
    assert addresses == [url, *[f"{url}&session={name}"] * AGAIN]
    for _ in range(AGAIN):
        assert house.client.get(f"/v1/sessions/{name}/recording").status_code == 200


def test_a_stop_silences_both_nodes(house: House) -> None:
    with ExitStack() as stack:
        streams = [
            stack.enter_context(house.client.stream("GET", f"/v1/sessions/{name}/stream?format=f32le")).iter_raw()
            for name in house.opened().values()
        ]
        for stream in streams:
            next(stream)
        began = time.monotonic()
        assert httpx.post(f"{house.url}/v1/stop", timeout=PATIENCE).json()["stopped"]["streams"] == 1
        for stream in streams:
            with suppress(httpx.RemoteProtocolError):  # a busy machine: what does not fade in time is cut off
                b"".join(stream)
        assert time.monotonic() - began < PATIENCE


def test_the_sessions_of_a_node_that_is_down_are_gone_and_new_ones_open_elsewhere(house: House) -> None:
    sessions = house.opened()
    url = house.url.replace("http:", "ws:") + "/v1/live"
    touches = [Live(url=url, reconnect="new") for _ in range(2)]
    with touches[0], touches[1]:
        nodes = {touch.session[0]: touch for touch in touches}
        assert set(nodes) == {"a", "b"}
        for touch in touches:
            touch.read(480, timeout=PATIENCE)
        house.nodes["b"].process.kill()
        for touch in touches:
            touch.read(480, timeout=PATIENCE)
        assert nodes["b"].gaps == (480,) and nodes["b"].session.startswith("a.")
        assert nodes["a"].gaps == () and nodes["a"].reconnections == 0
    for _ in range(AGAIN):
        told = house.gone(f"/v1/sessions/{sessions['b']}")
        assert "of the node b, and this is the node a" in told
        assert house.client.get(f"/v1/sessions/{sessions['a']}").status_code == 200
        assert house.client.post("/v1/sessions", json={}).json()["id"].startswith("a.")


def reset(connection: WebSocketConnection) -> None:
    """Break `connection` without a close frame."""
    sock = connection._connection.socket
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    sock.shutdown(socket.SHUT_RDWR)
