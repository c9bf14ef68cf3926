"""A process whose descriptors are taken still stops: by half-sent requests, by bodies that do not come, by streams."""

from __future__ import annotations

import contextlib
import resource
import socket
import time
from collections.abc import Callable, Iterator

import httpx
import pytest

from service.http.request_timeout import HEAD_SECONDS
from tests.service.faults.caller import Caller
from tests.service.harness import PATIENCE, Child, roomy_environment, until
from tests.service.scraping import scrape

DESCRIPTORS = 200
CALLERS = 300
SOON = 0.9 * HEAD_SECONDS  # before any of the others gives up waiting
HEAD = b"POST /v1/render HTTP/1.1\r\nHost: 127.0.0.1\r\n"
BODY = HEAD + b"Content-Type: application/json\r\nContent-Length: 1000\r\n\r\n{"
KEPT_ALIVE = b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[httpx.URL]:
    child = Child("tests.service.serve_plain", tmp_path_factory.mktemp("service"), **roomy_environment())
    try:
        url = httpx.URL(child.url())
        resource.prlimit(child.process.pid, resource.RLIMIT_NOFILE, (DESCRIPTORS, DESCRIPTORS))
        yield url
        assert "Traceback" not in child.log.read_text()
    finally:
        child.terminate()


@contextlib.contextmanager
def many(open_one: Callable[[], contextlib.AbstractContextManager[object] | None]) -> Iterator[int]:
    """Open CALLERS connections, as far as they are taken, and hold them; yield how many there were."""
    with contextlib.ExitStack() as held:
        opened = [held.enter_context(one) for one in (open_one() for _ in range(CALLERS)) if one is not None]
        time.sleep(0.2)
        yield len(opened)


def stop(service: httpx.URL) -> dict[str, int]:
    """Return what a stop on a new connection stopped."""
    answer = httpx.post(f"{service}/v1/stop", timeout=SOON)
    assert answer.status_code == 200
    stopped: dict[str, int] = answer.json()["stopped"]
    return stopped


@pytest.mark.parametrize("sent", [b"", HEAD, BODY, KEPT_ALIVE], ids=["nothing", "half a head", "no body", "kept alive"])
def test_a_stop_comes_through_beside_connections_that_wait(service: httpx.URL, sent: bytes) -> None:
    def open_one() -> socket.socket:
        connection = socket.create_connection((service.host, service.port or 0), 60.0)
        with contextlib.suppress(ConnectionError):
            connection.sendall(sent)
        return connection

    with httpx.Client(base_url=str(service), timeout=PATIENCE) as client, many(open_one) as opened:
        assert opened == CALLERS
        session = httpx.post(f"{service}/v1/sessions", json={}, timeout=SOON)
        assert session.status_code == 201  # not only a stop: who waits makes room for who asks
        assert stop(service)["sessions"] == 1
        assert client.get("/healthz").status_code == 200


@pytest.mark.alone  # all are open before the first has ended for its unanswered pings, 10 s later
def test_a_stop_comes_through_beside_as_many_streams_as_there_can_be(service: httpx.URL) -> None:
    def open_one() -> Caller | None:
        caller = Caller(service.port or 0)
        try:
            return caller.hello(pacing="pull")
        except AssertionError:
            caller.connection.close()
            return None

    with many(open_one) as opened:
        assert DESCRIPTORS // 2 < opened < DESCRIPTORS
        refused = httpx.post(f"{service}/v1/sessions", json={}, timeout=PATIENCE)
        assert refused.status_code == 503 and refused.headers["Retry-After"] == "1"
        assert stop(service)["streams"] == opened
    until(lambda: httpx.get(f"{service}/readyz", timeout=PATIENCE).status_code == 200)
    with httpx.Client(base_url=str(service), timeout=PATIENCE) as client:
        until(lambda: scrape(client).value("streams", kind="live") == 0)
    assert httpx.post(f"{service}/v1/sessions", json={}, timeout=PATIENCE).status_code == 201
