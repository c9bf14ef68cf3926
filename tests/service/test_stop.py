"""`POST /v1/stop`: the server writes nothing loud after 20 ms, whether the reader reads or not."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from fastapi import FastAPI

from service.app import create_app
from tests.bench.live_report import Window
from tests.service.harness import LOCAL, Running, problem, settings_of, until
from tests.service.plain_engine import PlainEngine
from tests.service.wakes import Wakes, wakes

RATE = 48000
Written = list[tuple[float, bytes]]


class Peer:
    """A reader in process that records when each body part was written; `stall` makes it stop reading."""

    def __init__(self) -> None:
        self.written: Written = []
        self.complete = False
        self.offered = 0
        self.stalled = asyncio.Event()
        self.resumed = asyncio.Event()

    async def send(self, message: Any) -> None:
        if message["type"] != "http.response.body":
            return
        self.offered += 1
        if self.stalled.is_set():
            await self.resumed.wait()
        self.complete = not message.get("more_body", False)
        self.written.append((time.perf_counter(), message.get("body", b"")))

    async def receive(self) -> Any:
        await asyncio.Event().wait()

    async def read(self, app: FastAPI, path: str, query: bytes) -> None:
        scope = {
            "type": "http",
            "asgi": {"version": "3.0", "spec_version": "2.3"},
            "http_version": "1.1",
            "method": "GET",
            "scheme": "http",
            "path": path,
            "raw_path": path.encode(),
            "query_string": query,
            "root_path": "",
            "headers": [(b"host", b"localhost")],
            "server": ("localhost", 80),
            "client": ("127.0.0.1", 1),
        }
        await app(scope, self.receive, self.send)


async def eventually(happened: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 60.0
    while not happened():
        assert time.monotonic() < deadline, "it never happened"
        await asyncio.sleep(0.001)


def scenario(act: Callable[[FastAPI, httpx.AsyncClient, str], Awaitable[None]], **changes: object) -> None:
    """Run `act` with an application, a client of it in process, and the path of an open session."""

    async def run() -> None:
        app = create_app(settings_of(**changes), PlainEngine())
        transport = httpx.ASGITransport(app=app)
        async with httpx.AsyncClient(transport=transport, base_url=LOCAL) as client:
            session = (await client.post("/v1/sessions", json={})).json()["id"]
            await act(app, client, f"/v1/sessions/{session}")
        app.state.service.finish()

    asyncio.run(run())


def quiet_after(peer: Peer, stopped: float) -> float:
    """Return when `peer` was last written something loud, s after `stopped`."""
    return max(at for at, part in peer.written if np.frombuffer(part, "<f4").any()) - stopped


@pytest.fixture
def woken(tmp_path: Path) -> Iterator[Wakes]:
    with wakes(tmp_path) as made:
        yield made


@pytest.mark.alone  # 20 ms by the wall's clock, here and below, of one thread for service and reader
def test_nothing_loud_is_written_20_ms_after_a_stop(woken: Wakes) -> None:
    async def act(app: FastAPI, client: httpx.AsyncClient, session: str) -> None:
        peer = Peer()
        reading = asyncio.create_task(peer.read(app, f"{session}/stream", b"format=f32le"))
        await eventually(lambda: len(peer.written) > 30)
        stopped = time.perf_counter()
        answer = await client.post("/v1/stop")
        await reading
        assert answer.json() == {"stopped": {"sessions": 1, "streams": 1, "plays": 0}}
        assert peer.complete
        assert quiet_after(peer, stopped) <= 0.02 + woken.latest(Window(stopped, peer.written[-1][0]))
        after = np.frombuffer(b"".join(part for at, part in peer.written if at > stopped), "<f4")
        assert 0 < len(after) <= 0.02 * RATE and after[-1] == 0.0
        problem(await client.get(session), 404, "not-found")

    scenario(act)


@pytest.mark.alone
def test_a_stop_during_a_finite_stream_is_silence_to_its_promised_end() -> None:
    async def act(app: FastAPI, client: httpx.AsyncClient, session: str) -> None:
        peer = Peer()
        reading = asyncio.create_task(peer.read(app, f"{session}/stream", b"format=f32le&duration=30"))
        await eventually(lambda: len(peer.written) > 30)
        stopped = time.perf_counter()
        await client.post("/v1/stop")
        await reading
        whole = np.frombuffer(b"".join(part for _, part in peer.written), "<f4")
        before = sum(len(part) for at, part in peer.written if at <= stopped) // 4
        assert len(whole) == 30 * RATE
        assert not whole[before + round(0.02 * RATE) :].any()

    scenario(act)


def test_a_reader_that_slept_through_a_stop_is_cut_off() -> None:
    """The block that waits was rendered before the stop, so it must not be sent afterwards."""

    async def act(app: FastAPI, client: httpx.AsyncClient, session: str) -> None:
        peer = Peer()
        reading = asyncio.create_task(peer.read(app, f"{session}/stream", b"format=f32le"))
        await eventually(lambda: len(peer.written) > 30)
        peer.stalled.set()
        offered = peer.offered
        await eventually(lambda: peer.offered > offered)
        taken = len(peer.written)
        await client.post("/v1/stop")
        await asyncio.wait_for(reading, 60.0)
        peer.resumed.set()
        await asyncio.sleep(0)
        assert len(peer.written) == taken and not peer.complete

    scenario(act)


@pytest.mark.alone
def test_a_stop_reaches_a_stream_with_the_longest_block(woken: Wakes) -> None:
    async def act(app: FastAPI, client: httpx.AsyncClient, session: str) -> None:
        peer = Peer()
        reading = asyncio.create_task(peer.read(app, f"{session}/stream", b"format=f32le"))
        await eventually(lambda: len(peer.written) > 12)
        stopped = time.perf_counter()
        await client.post("/v1/stop")
        await reading
        assert peer.complete and peer.written[-1][0] - stopped < 0.1 + woken.latest(
            Window(stopped, time.perf_counter())
        )
        assert quiet_after(peer, stopped) <= 0.02 + woken.latest(Window(stopped, peer.written[-1][0]))

    scenario(act, stream_block=0.1, lead=1.0)


@pytest.mark.usefixtures("unhurried")
def test_a_player_that_connects_again_by_itself_gets_nothing(running: Running) -> None:
    session = running.open_session()
    with running.listening(session) as listener:
        listener.frames(RATE // 4)
        assert running.client.post("/v1/stop", json={}).json()["stopped"]["streams"] == 1
        assert listener.rest()[-1] == 0.0
    problem(running.client.get(f"/v1/sessions/{session}/stream"), 404, "not-found")


def test_a_stop_with_nothing_to_stop_is_fine(running: Running) -> None:
    answer = running.client.post("/v1/stop")
    assert answer.json() == {"stopped": {"sessions": 0, "streams": 0, "plays": 0}}


def test_a_stop_completes_recordings(running: Running) -> None:
    session = running.open_session()
    path = f"/v1/sessions/{session}"
    assert running.client.post(f"{path}/play", json={"device": "file:a.wav"}).status_code == 202
    until(lambda: running.client.get(path).json()["play"]["frames"] > 4800)
    player = running.service.sessions.find(session, None).player
    assert player is not None
    assert running.client.post("/v1/stop").json()["stopped"]["plays"] == 1
    assert player.wait(60.0)
    assert player.document()["state"] == "finished"
