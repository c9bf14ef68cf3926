"""Limits of one caller: the rate of requests and the number of streams, by key and by address."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from fastapi import FastAPI

from service.app import create_app
from service.http.rate_limits import CALLERS, KEY, Limits, TokenBucket
from service.problems import Problem
from tests.service.harness import ask, problem, serving, settings_of, until
from tests.service.plain_engine import PlainEngine
from tests.service.test_security import WRITES


class Clock:
    """A clock that a test moves."""

    def __init__(self) -> None:
        self.time = 100.0

    def __call__(self) -> float:
        return self.time


def scope_of(address: str | None = "192.0.2.1", *forwarded: str, key: int | None = None) -> dict[str, Any]:
    headers = [(b"x-forwarded-for", value.encode()) for value in forwarded]
    scope = {"type": "http", "headers": headers, "client": None if address is None else (address, 1)}
    return scope if key is None else scope | {KEY: key}


def limits_of(now: Any = None, **changes: object) -> Limits:
    settings = settings_of(**changes)
    return Limits(settings) if now is None else Limits(settings, now)


def refused(limits: Limits, scope: dict[str, Any], kind: str = "too-many-streams") -> Problem:
    with pytest.raises(Problem) as raised:
        limits.admit(scope)
    assert raised.value.kind == kind
    return raised.value


def test_a_bucket_gives_a_burst_and_then_its_rate() -> None:
    clock = Clock()
    bucket = TokenBucket(10.0, 3.0, clock)
    assert [bucket.take() for _ in range(3)] == [0.0] * 3
    assert bucket.take() == pytest.approx(0.1)
    clock.time += 0.1
    assert bucket.take() == 0.0
    assert bucket.take() > 0.0
    clock.time += 1000.0
    assert [bucket.take() for _ in range(3)] == [0.0] * 3
    assert bucket.take() > 0.0


def test_streams_of_an_address_are_bounded_until_one_is_released() -> None:
    limits = limits_of(streams_per_address=2)
    tickets = [limits.admit(scope_of()) for _ in range(2)]
    assert "RIDGEWAVE_STREAMS_PER_ADDRESS" in refused(limits, scope_of()).detail
    limits.admit(scope_of("192.0.2.2"))
    tickets[0].release()
    tickets[0].release()
    limits.admit(scope_of())
    refused(limits, scope_of())


def test_streams_of_a_key_are_bounded_from_all_addresses_together() -> None:
    limits = limits_of(streams_per_key=2)
    for address in ("192.0.2.1", "192.0.2.2"):
        limits.admit(scope_of(address, key=0))
    assert "RIDGEWAVE_STREAMS_PER_KEY" in refused(limits, scope_of("192.0.2.3", key=0)).detail
    limits.admit(scope_of("192.0.2.3", key=1))


def test_a_refused_stream_takes_no_place() -> None:
    limits = limits_of(streams_per_key=1, streams_per_address=2)
    limits.admit(scope_of(key=0))
    for _ in range(5):
        refused(limits, scope_of(key=0))
    limits.admit(scope_of(key=1))


@pytest.mark.parametrize(
    ("address", "forwarded", "counted"),
    [
        ("127.0.0.1", (), "loopback"),
        ("127.8.9.10", (), "loopback"),
        ("::1", (), "loopback"),
        ("::ffff:127.0.0.1", (), "loopback"),
        ("::ffff:192.0.2.1", (), "192.0.2.1"),
        ("2001:db8:1:2:3:4:5:6", (), "2001:db8:1:2::/64"),
        ("fe80::1%eth0", (), "fe80::/64"),
        (None, (), "unknown"),
        ("testclient", (), "unknown"),
        ("192.0.2.1", ("198.51.100.7",), "192.0.2.1"),  # not a trusted proxy: its header is ignored
        ("10.0.0.1", ("198.51.100.7",), "198.51.100.7"),
        ("10.0.0.1", ("203.0.113.9, 198.51.100.7",), "198.51.100.7"),  # the client wrote the left entry
        ("10.0.0.1", ("203.0.113.9, 198.51.100.7, 10.0.0.2",), "198.51.100.7"),
        ("10.0.0.1", ("203.0.113.9", "198.51.100.7"), "198.51.100.7"),
        ("10.0.0.1", ("198.51.100.7:4711",), "198.51.100.7"),
        ("10.0.0.1", ("[2001:db8::7]:4711",), "2001:db8::/64"),
        ("10.0.0.1", ("198.51.100.7, nonsense",), "10.0.0.1"),
        ("10.0.0.1", ("10.0.0.3, 10.0.0.2",), "10.0.0.3"),
        ("10.0.0.1", (), "10.0.0.1"),
    ],
)
def test_the_address_that_is_counted(address: str | None, forwarded: tuple[str, ...], counted: str) -> None:
    assert limits_of(trusted_proxies="10.0.0.0/8").address(scope_of(address, *forwarded)) == counted


def test_without_trusted_proxies_the_header_is_ignored() -> None:
    assert limits_of().address(scope_of("127.0.0.1", "198.51.100.7")) == "loopback"


def test_a_flood_of_addresses_does_not_fill_the_memory() -> None:
    clock = Clock()
    limits = limits_of(clock, request_burst=1)
    for number in range(CALLERS + 100):
        limits.take_request(f"address {number}")
    assert len(limits._buckets) == CALLERS
    with pytest.raises(Problem):
        limits.take_request(f"address {CALLERS + 99}")


@pytest.fixture
def keyed() -> Any:
    made = create_app(settings_of(api_keys="a,b", request_burst=3, requests_per_second=0.1), PlainEngine())
    made.state.service.limits._now = Clock()
    yield made
    made.state.service.finish()


@pytest.fixture
def slow_app() -> Any:
    made = create_app(settings_of(request_burst=3, requests_per_second=0.1), PlainEngine())
    yield made
    made.state.service.finish()


def test_one_request_too_many_gets_retry_after(slow_app: FastAPI) -> None:
    assert [ask(slow_app, "GET", "/v1/textures").status_code for _ in range(3)] == [200] * 3
    answer = ask(slow_app, "GET", "/v1/textures")
    problem(answer, 429, "rate-limited")
    assert 1 <= int(answer.headers["retry-after"]) <= 10


def test_a_stop_is_never_refused_for_its_rate(slow_app: FastAPI) -> None:
    for _ in range(20):
        assert ask(slow_app, "POST", "/v1/stop").status_code == 200
        assert ask(slow_app, "GET", "/healthz").status_code == 200


def test_wrong_keys_are_counted_by_address_and_right_keys_by_key() -> None:
    app = create_app(settings_of(api_keys="a,b", request_burst=3, requests_per_second=0.1), PlainEngine())

    def status(key: str, address: str) -> int:
        headers = {"Authorization": f"Bearer {key}", "X-Forwarded-For": address}
        return ask(app, "GET", "/v1/textures", headers=headers).status_code

    assert [status("guess", "") for _ in range(4)] == [401] * 3 + [429]
    app.state.service.finish()
    app = create_app(
        settings_of(api_keys="a,b", request_burst=3, requests_per_second=0.1, trusted_proxies="127.0.0.1"),
        PlainEngine(),
    )
    assert [status("a", f"192.0.2.{number}") for number in range(4)] == [200] * 3 + [429]
    assert status("b", "192.0.2.200") == 200
    app.state.service.finish()


def offered(app: FastAPI, path: str, *headers: tuple[bytes, bytes]) -> str:
    """Return the kind of problem with which a WebSocket is refused."""
    sent: list[Any] = []

    async def send(message: Any) -> None:
        sent.append(message)

    async def receive() -> Any:
        return {"type": "websocket.connect"}

    scope = {"type": "websocket", "path": path, "query_string": b"", "headers": [(b"host", b"localhost"), *headers]}
    asyncio.run(app(scope | {"client": ("127.0.0.1", 1)}, receive, send))
    return str(sent[0]["reason"])


WRONG = {"Authorization": "Bearer guess"}
TRIES = {
    **{f"{method} {path}": (method, path) for method, path in WRITES},
    **{f"{method} /v1/stop": (method, "/v1/stop") for method in ("GET", "HEAD", "PATCH", "DELETE", "OPTIONS")},
    **{f"GET {path}": ("GET", path) for path in ("/v1/textures", "/v1/stop/", "//v1/stop", "/metrics", "/nothing")},
}


@pytest.mark.parametrize("name", TRIES)
def test_wrong_keys_are_limited_alike_on_every_path_and_method(keyed: FastAPI, name: str) -> None:
    method, path = TRIES[name]
    answers = [ask(keyed, method, path.format(id="x"), headers=WRONG) for _ in range(6)]
    assert [answer.status_code for answer in answers] == [401] * 3 + [429] * 3
    assert "retry-after" in answers[3].headers


@pytest.mark.parametrize("path", ["/v1/live", "/v1/stop", "/healthz"])
def test_wrong_keys_of_websockets_are_limited_alike(keyed: FastAPI, path: str) -> None:
    wrong = (b"authorization", b"Bearer guess")
    kinds = [offered(keyed, path, wrong) for _ in range(6)]
    assert kinds[3:] == ["rate-limited"] * 3
    assert path == "/healthz" or kinds[:3] == ["key-required"] * 3


def test_the_attempts_of_all_paths_count_together(keyed: FastAPI) -> None:
    assert offered(keyed, "/v1/live", (b"authorization", b"Bearer guess")) == "key-required"
    tries = [("POST", "/v1/stop"), ("GET", "/v1/stop"), ("GET", "/v1/textures"), ("POST", "/v1/stop")]
    statuses = [ask(keyed, method, path, headers=WRONG).status_code for method, path in tries]
    assert statuses == [401, 401, 429, 429]
    twice = [("Authorization", "Bearer a"), ("Authorization", "Bearer b")]
    assert ask(keyed, "POST", "/v1/stop", headers=twice).status_code == 429


def test_a_right_key_stops_while_its_address_is_limited_for_wrong_ones(keyed: FastAPI) -> None:
    right = {"Authorization": "Bearer a"}
    for _ in range(20):
        ask(keyed, "POST", "/v1/stop", headers=WRONG)
        assert ask(keyed, "POST", "/v1/stop", headers=right).status_code == 200
    for method, path in (("GET", "/v1/stop"), ("GET", "/v1/textures"), ("POST", "/v1/explain")):
        assert ask(keyed, method, path, headers=right, json={}).status_code == 429, "a stop alone is exempt"
    problem(ask(keyed, "POST", "/v1/stop", headers=right, json={"x": "x" * (1 << 20)}), 413, "too-large")


def test_a_reader_that_leaves_and_a_play_that_ends_release_their_places(tmp_path: Any) -> None:
    with serving(PlainEngine(), streams_per_address=2, file_folder=tmp_path) as running:
        first, second = running.open_session(), running.open_session()
        assert running.client.post(f"/v1/sessions/{first}/play", json={"device": "file:a.wav"}).status_code == 202
        with running.listening(first) as listener:
            listener.frames(480)
            problem(running.client.get(f"/v1/sessions/{second}/stream"), 429, "too-many-streams")
            play = running.client.post(f"/v1/sessions/{second}/play", json={"device": "file:b.wav"})
            problem(play, 429, "too-many-streams")
        until(lambda: running.client.get(f"/v1/sessions/{first}").json()["streaming"] is False)
        with running.listening(second) as listener:
            listener.frames(480)
            running.client.delete(f"/v1/sessions/{first}/play")
            with running.listening(first) as other:
                other.frames(480)


def test_a_refused_stream_releases_its_place(tmp_path: Any) -> None:
    with serving(PlainEngine(), streams_per_address=1, file_folder=tmp_path) as running:
        session = running.open_session()
        for _ in range(3):
            answer = running.client.post(f"/v1/sessions/{session}/play", json={"device": "file:a/b.wav"})
            problem(answer, 422, "request-refused")
        with running.listening(session) as listener:
            listener.frames(480)


def test_an_endless_stream_ends_with_a_fade_after_max_stream() -> None:
    with serving(PlainEngine(), max_stream=0.3) as running, running.listening(running.open_session()) as listener:
        samples = listener.rest()
    assert len(samples) == round(0.3 * 48000)
    assert samples[-1] == 0.0 and abs(samples[-960:-480]).max() > 0.5
