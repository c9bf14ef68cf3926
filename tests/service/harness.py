"""How the tests talk to the service: in process where the answer is finite, to a real server where it is not."""

from __future__ import annotations

import asyncio
import json
import os
import re
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import httpx
import numpy as np
import numpy.typing as npt
import uvicorn
from fastapi import FastAPI
from starlette.types import ASGIApp

from service.app import create_app
from service.compute.import_process import Imports, _imported
from service.engine import Engine
from service.lifespan import Service
from service.operations.settings import Settings, setting_fields, variable
from service.operations.settings_environment import read_settings
from service.server import LIVE_OPTIONS, listen, shown_address
from service.synth_engine import SynthEngine
from synth.response_cache import DEFAULT_BYTES

if TYPE_CHECKING:
    from tests.service.plain_engine import PlainEngine

ROOT = Path(__file__).resolve().parents[2]
LOCAL = "http://localhost"
PATIENCE = 60.0  # seconds before a poll gives up: far beyond what anything here takes on a busy machine
START = 300.0  # seconds for a service to start where nothing is compiled yet and the machine is busy
ROOM = {
    "max_sessions": 10_000,
    "full_at": 1.0,
    "streams_per_address": 10_000,
    "streams_per_key": 10_000,
    "requests_per_second": 1_000_000,
    "request_burst": 1_000_000,
}
"""What admits callers, out of the way of tests and benchmarks that load the service on purpose."""


def roomy_settings() -> dict[str, float]:
    """Return `ROOM`, as far as the service has such settings, for `settings_of`."""
    known = {entry.name for entry in setting_fields()}
    return {name: limit for name, limit in ROOM.items() if name in known}


def roomy_environment() -> dict[str, str]:
    """Return `ROOM` as environment variables, for a `Child`."""
    return {variable(name): str(limit) for name, limit in roomy_settings().items()}


def until(happened: Callable[[], bool], patience: float = PATIENCE) -> None:
    """Return once `happened()`; fail after `patience` seconds. The longer it takes, the more seldom it is asked."""
    start = time.monotonic()
    while not happened():
        waited = time.monotonic() - start
        assert waited < patience, "it never happened"
        time.sleep(min(0.002 + 0.05 * waited, 0.05))


def settings_of(**changes: object) -> Settings:
    """Return the default settings with `changes`, whatever the environment and the load of the test run are."""
    return read_settings({}, **{"port": 0, "prepare_textures": "off", "full_at": 1.0, **changes})


def ask(app: FastAPI, method: str, path: str, *, base: str = LOCAL, **rest: Any) -> httpx.Response:
    """Return the application's whole answer to one request."""

    async def once() -> httpx.Response:
        transport = httpx.ASGITransport(app=app, raise_app_exceptions=False)
        async with httpx.AsyncClient(transport=transport, base_url=base) as client:
            return await client.request(method, path, **rest)

    return asyncio.run(once())


def problem(answer: httpx.Response, status: int, kind: str, *, root_path: str = "") -> dict[str, Any]:
    """Return the problem document of `answer` after checking its shape, status and kind."""
    assert answer.headers["content-type"] == "application/problem+json", answer.text
    document: dict[str, Any] = answer.json()
    assert (answer.status_code, document["type"]) == (status, f"{root_path}/docs#problem-{kind}"), document
    assert set(document) - {"instance"} == {"type", "title", "status", "detail", "errors"}
    assert document["status"] == status
    for fault in document["errors"]:
        assert set(fault) == {"pointer", "value", "allowed", "hint"}
    return document


class Running:
    """A server in a thread, and a client of it."""

    def __init__(self, app: FastAPI, server: uvicorn.Server, url: str) -> None:
        self.app, self.server, self.url = app, server, url
        self.service: Service = app.state.service
        self.client = httpx.Client(base_url=url, timeout=PATIENCE)

    def open_session(self, scene: Mapping[str, object] | None = None) -> str:
        """Return the id of a new session."""
        answer = self.client.post("/v1/sessions", json=scene or {})
        assert answer.status_code == 201, answer.text
        return str(answer.json()["id"])

    @contextmanager
    def listening(self, session: str, query: str = "format=f32le", channels: int = 1) -> Iterator[Listener]:
        """Yield a reader of the session's stream of so many channels."""
        with self.client.stream("GET", f"/v1/sessions/{session}/stream?{query}") as answer:
            assert answer.status_code == 200, answer.read()
            yield Listener(answer, channels)

    def reader_of(self, session: str) -> object:
        """Return what the service holds as the session's reader."""
        return self.client.get(f"/v1/sessions/{session}").json()["streaming"]


class Listener:
    """Reads float32 from a stream, as much at a time as a test asks for: [frames], or [frames, channels] of several."""

    def __init__(self, answer: httpx.Response, channels: int = 1) -> None:
        self.answer = answer
        self._channels = channels
        self._parts = answer.iter_raw()
        self._waiting = b""

    def frames(self, count: int) -> npt.NDArray[np.float32]:
        """Return the next `count` frames."""
        size = 4 * count * self._channels
        while len(self._waiting) < size:
            self._waiting += next(self._parts)
        taken, self._waiting = self._waiting[:size], self._waiting[size:]
        return self._shaped(taken)

    def rest(self) -> npt.NDArray[np.float32]:
        """Return everything until the stream ends, in whole frames: a WAV header in front may leave part of one."""
        data = self._waiting + b"".join(self._parts)
        self._waiting = b""
        return self._shaped(data[len(data) % (4 * self._channels) :])

    def _shaped(self, samples: bytes) -> npt.NDArray[np.float32]:
        flat = np.frombuffer(samples, "<f4")
        return flat if self._channels == 1 else flat.reshape(-1, self._channels)


@contextmanager
def serving(
    engine: Engine | None = None,
    workers_folder: Path | None = None,
    outside: Callable[[ASGIApp], ASGIApp] = lambda app: app,
    **changes: object,
) -> Iterator[Running]:
    """Yield a server on a free port of this machine.

    workers_folder: the folder through which several are one service. outside: what a test puts around the application.
    """
    settings = settings_of(**changes)
    app = create_app(settings, engine, workers_folder)
    listener = listen(settings)
    options = LIVE_OPTIONS | {"ws_max_size": settings.max_message}
    config = uvicorn.Config(outside(app), log_config=None, access_log=False, timeout_graceful_shutdown=1, **options)
    server = uvicorn.Server(config)
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]}, daemon=True)
    thread.start()
    running = Running(app, server, f"http://{shown_address(listener)}")
    try:
        until(lambda: server.started)
        yield running
    finally:
        running.client.close()
        server.should_exit = True
        thread.join(PATIENCE)
        assert not thread.is_alive(), "the server did not end"


async def outcome_here(_imports: Imports, request: bytes) -> tuple[int, bytes, bytes]:
    """Read an uploaded surface in this process. In the place of `Imports._outcome` it saves what a process takes."""
    return 0, json.dumps(_imported(json.loads(request))).encode(), b""


@cache
def kept_engine() -> Engine:
    """Return the real engine that tests of this process share: what one of them had solved is there for the next."""
    return SynthEngine(DEFAULT_BYTES)


class Child:
    """The service in a process of its own, ended by signals."""

    def __init__(self, module: str, folder: Path, **environment: str) -> None:
        self.log = folder / "service.log"
        kept = {name: value for name, value in os.environ.items() if not name.startswith("RIDGEWAVE_")}
        places = {"RIDGEWAVE_PORT": "0", "RIDGEWAVE_FILE_FOLDER": str(folder / "recordings")}
        places["RIDGEWAVE_PREPARE_TEXTURES"] = "off"
        places["RIDGEWAVE_FULL_AT"] = "1"  # a busy machine refuses no stream
        with self.log.open("wb") as stderr:
            self.process = subprocess.Popen(
                [sys.executable, "-m", module], cwd=ROOT, env={**kept, **places, **environment}, stderr=stderr
            )

    def url(self) -> str:
        """Return where it listens, once it answers there."""
        until(lambda: self.process.poll() is not None or self._address() is not None, START)
        address = self._address()
        assert address is not None, self.log.read_text()
        until(lambda: self._answers(address), START)
        return address

    def _address(self) -> str | None:
        found = re.search(r"listening on (http://[^\s\"]+)", self.log.read_text())
        return found.group(1) if found else None

    def _answers(self, address: str) -> bool:
        assert self.process.poll() is None, self.log.read_text()
        try:
            return httpx.get(f"{address}/readyz", timeout=1.0).status_code == 200
        except httpx.TransportError:
            return False

    def terminate(self) -> None:
        """Have it end as it ends in use; leave no process behind if it does not."""
        self.process.terminate()
        try:
            self.process.wait(PATIENCE)
        finally:
            self.end()

    def end(self) -> None:
        """Leave no process behind."""
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait(PATIENCE)


def warmed_up(running: Running, engine: PlainEngine) -> None:
    """Return once the service is warm; what it opened for that is forgotten, being nobody's session."""
    until(lambda: running.service.warm)
    engine.hands.clear()
    engine.opened.clear()
