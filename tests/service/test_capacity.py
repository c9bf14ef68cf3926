"""Long renders delay neither control calls, streams nor the end of the service, and end with their clients."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest

from service.app import create_app
from service.compute.render_process import LOWEST_PRIORITY, Copies
from service.compute.render_steps import Order, Price, work
from service.engine import FiniteVoice
from service.lifespan import Service
from service.store.store import Store
from service.synth_engine import SynthEngine
from synth import Voice, parse_scene
from synth.arrays import Block
from tests.service.harness import PATIENCE, Child, Running, ask, problem, serving, settings_of, until
from tests.service.live.client import live
from tests.service.plain_engine import PlainEngine

HOUR: dict[str, Any] = {
    "output": {"duration": 3600, "quantity": "displacement"},
    "effects": {"viscous_skin": {}},
    "accuracy": {"tolerance": 1e-2},
}
PROMPT = 0.5  # s in which control work answers
QUIET = 1.0  # s after which what a client left takes no processor time
BLOCKS, BLOCK = 100, 480  # of the live stream, a second
TICK = os.sysconf("SC_CLK_TCK")


class Peer:
    """A client that reads a render in a thread until `hang_up`."""

    def __init__(self, url: str, sound_format: str, scene: dict[str, Any] = HOUR) -> None:
        body = json.dumps(scene).encode()
        self._socket = socket.create_connection(("127.0.0.1", int(url.rpartition(":")[2])))
        self._socket.sendall(
            f"POST /v1/render?format={sound_format} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
            f"Content-Length: {len(body)}\r\n\r\n".encode()
            + body
        )
        self.received = b""
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        try:
            while part := self._socket.recv(1 << 16):
                self.received = self.received or part
        except OSError:
            return

    def hang_up(self) -> None:
        self._socket.shutdown(socket.SHUT_RDWR)
        self._socket.close()


def stat(process: int) -> list[str]:
    """Return the fields of /proc/PID/stat from the third on; nothing of a process that has gone."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return []


def below(process: int) -> dict[int, float]:
    """Return the processor seconds of every process below `process`, by its id."""
    parents = {int(name): int(stat(int(name))[1]) for name in os.listdir("/proc") if name.isdigit() and stat(int(name))}
    found: dict[int, float] = {}
    generation = {process}
    while generation:
        generation = {child for child, parent in parents.items() if parent in generation}
        for child in generation:
            fields = stat(child)
            found[child] = (int(fields[11]) + int(fields[12])) / TICK if fields else 0.0
    return found


def busy(process: int, seconds: float) -> float:
    """Return the processor seconds that those below `process` take within `seconds`."""
    before = below(process)
    time.sleep(seconds)
    return sum(max(0.0, used - before.get(child, 0.0)) for child, used in below(process).items())


@contextmanager
def hearing(url: str) -> Iterator[list[float]]:
    """Yield the times of a realtime live stream's blocks, as they come."""
    times: list[float] = []
    with live(url) as client:
        client.hello(pacing="realtime", block=BLOCK)
        over = threading.Event()

        def read() -> None:
            while not over.is_set():
                if isinstance(client.socket.recv(60.0), bytes):
                    times.append(time.perf_counter())

        reader = threading.Thread(target=read)
        reader.start()
        try:
            yield times
        finally:
            over.set()
            reader.join()


def took(work: Callable[[], Any]) -> float:
    began = time.perf_counter()
    work()
    return time.perf_counter() - began


@pytest.mark.alone
@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks at the processes of Linux")
@pytest.mark.parametrize("formats", [("flac", "f32le"), pytest.param(("wav", "flac"), marks=pytest.mark.thorough)])
def test_nothing_waits_behind_two_renders_of_an_hour(tmp_path: Path, formats: tuple[str, str]) -> None:
    child = Child("service", tmp_path)
    try:
        url = child.url()
        client = httpx.Client(base_url=url, timeout=60.0)

        def answered(method: str, path: str, scene: dict[str, Any]) -> float:
            return took(lambda: client.request(method, path, json=scene).raise_for_status())

        def greeted() -> None:
            with live(url) as peer:
                peer.hello()

        greeted()
        session = client.post("/v1/sessions", json={}).json()["id"]
        with hearing(url) as times:
            peers = [Peer(url, name) for name in formats]
            until(lambda: any(peer.received for peer in peers))
            until(lambda: busy(child.process.pid, 0.2) > 0.0)
            began, heard = time.perf_counter(), len(times)
            slowest = {"hello": 0.0, "change": 0.0, "session": 0.0, "explain": 0.0, "render": 0.0}
            for number in range(5):
                scene = {"scan": {"speed": 0.06 + 0.005 * number}}
                for name, seconds in {
                    "hello": took(greeted),
                    "change": answered("PATCH", f"/v1/sessions/{session}", scene),
                    "session": answered("POST", "/v1/sessions", scene),
                    "explain": answered("POST", "/v1/explain", scene),
                    "render": answered("POST", "/v1/render", scene | {"output": {"duration": 0.1}}),
                }.items():
                    slowest[name] = max(slowest[name], seconds)
            passed, blocks = time.perf_counter() - began, len(times) - heard
        assert max(slowest.values()) < PROMPT, slowest
        assert blocks > BLOCKS * passed - 5
        assert client.get("/readyz").status_code == 200
        for peer in peers:
            peer.hang_up()
        time.sleep(QUIET)
        assert busy(child.process.pid, 0.5) < 0.1
        peers = [Peer(url, name) for name in formats]
        until(lambda: busy(child.process.pid, 0.2) > 0.0)
        began = time.monotonic()
        child.process.send_signal(signal.SIGTERM)
        processes = below(child.process.pid)
        child.process.wait(60.0)
        assert time.monotonic() - began < 2.0
        until(lambda: not any(stat(process) for process in processes))
    finally:
        child.end()
    log = child.log.read_text()
    assert not any(word in log for word in ("Traceback", "Cancel", "ERROR", "WARNING")), log


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks at the processes of Linux")
def test_renders_end_with_a_service_that_is_killed_and_a_refusal_keeps_its_words(tmp_path: Path) -> None:
    child = Child("service", tmp_path, RIDGEWAVE_RENDER_SECONDS_PER_CLIENT="30", RIDGEWAVE_MAX_DURATION="86400")
    try:
        url = child.url()
        refused = httpx.post(f"{url}/v1/render", json={"output": {"duration": "1 kg"}}, timeout=PATIENCE)
        assert problem(refused, 422, "scene-refused")["errors"][0]["pointer"] == "/output/duration"
        dear = {"output": {"duration": 86_400, "sample_rate": 192_000, "channels": ["displacement", "velocity"]}}
        told = problem(httpx.post(f"{url}/v1/render", json=dear, timeout=60.0), 413, "too-costly")
        assert "30 s" in told["errors"][0]["allowed"] and "Write " in told["errors"][0]["hint"]
        peer = Peer(url, "flac", {"output": {"duration": 3600, "sample_rate": 192_000}})  # cheap but for its encoding
        until(lambda: busy(child.process.pid, 0.2) > 0.0)
        processes = below(child.process.pid)
        assert not peer.received
        child.process.kill()
        child.process.wait(60.0)
        until(lambda: not any(stat(process) for process in processes))
    finally:
        child.end()


@pytest.mark.slow
def test_what_is_asked_of_a_service_that_starts_waits_for_it() -> None:
    asked = [("explain", {}), ("picture", {"scene": {}}), ("render", {"output": {"duration": 0.1}})] * 2
    with serving() as running, ThreadPoolExecutor(len(asked)) as threads:
        answers = threads.map(lambda one: httpx.post(f"{running.url}/v1/{one[0]}", json=one[1], timeout=60.0), asked)
        assert [answer.status_code for answer in answers] == [200] * len(asked)


def priorities(process: int) -> set[int]:
    """Return the nice values of the threads of every process below `process`."""
    tasks = [Path(f"/proc/{child}/task") for child in below(process)]
    return {int(stat(int(task.name))[16]) for folder in tasks if folder.exists() for task in folder.iterdir()}


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere a thread has no priority")
def test_what_did_long_work_is_kept_and_does_the_next_at_the_usual_priority(tmp_path: Path) -> None:
    copies = Copies(1 << 26, 100.0, tmp_path)
    usual = os.nice(0)

    async def both() -> None:
        first = await copies.open(Order("explain"), b"{}")
        first.lower()
        while await first.next() is not None:
            pass
        first.close()
        second = await copies.open(Order("render", "wav"), b'{"output": {"duration": 86400, "sample_rate": 192000}}')
        assert second is first
        while not isinstance(await second.next(), Price):
            pass
        warm = copies._template
        assert warm is not None
        until(lambda: priorities(warm.pid) == {usual})  # once the first order's thread, at the lowest, has ended
        second.lower()
        until(lambda: priorities(warm.pid) == {usual, LOWEST_PRIORITY})
        second.close()

    try:
        asyncio.run(both())
    finally:
        copies.close()


@pytest.fixture
def dear() -> Iterator[Running]:
    """Yield a service whose renders cost 1000 s each, and where one client may have 1500 s and all together 2500 s."""
    engine = PlainEngine(planned=1000.0)
    with serving(engine, render_seconds_per_client=1500.0, render_seconds=2500.0) as running:
        until(lambda: running.service.warm)
        yield running


def render(running: Running, seconds: float = 3600.0) -> httpx.Response:
    request = running.client.build_request("POST", "/v1/render", json={"output": {"duration": seconds}})
    return running.client.send(request, stream=True)


def test_a_client_has_a_bound_of_processor_seconds(dear: Running) -> None:
    first = render(dear)
    assert first.status_code == 200
    second = render(dear)
    second.read()
    told = problem(second, 429, "too-many-renders")
    assert "1500 s" in told["detail"] and "RIDGEWAVE_RENDER_SECONDS_PER_CLIENT" in told["detail"]
    assert second.headers["retry-after"]
    first.close()
    until(lambda: dear.service.renders.under_way == 0)
    again = render(dear)
    assert again.status_code == 200
    again.close()


def test_all_clients_have_one_too(dear: Running) -> None:
    dear.service.renders._prices["address 192.0.2.1"] = 1800  # what another client has under way
    answer = render(dear)
    answer.read()
    assert "RIDGEWAVE_RENDER_SECONDS" in problem(answer, 503, "full")["detail"]
    assert answer.headers["retry-after"]


def test_what_alone_is_too_dear_is_told_how_long_it_may_be() -> None:
    app = create_app(settings_of(render_seconds_per_client=600.0), PlainEngine(planned=1200.0))
    answer = ask(app, "POST", "/v1/render", json={"output": {"duration": 3600}})
    (fault,) = problem(answer, 413, "too-costly")["errors"]
    assert fault["pointer"] == "/output/duration" and "600 s of processor time" in fault["allowed"]
    assert "Write 1620 s or less" in fault["hint"]


class Unrendered(PlainEngine):
    """An engine whose first piece takes for ever."""

    def blocks(self, voice: FiniteVoice, frames: int) -> Iterator[Block]:
        raise AssertionError("a piece was rendered")
        yield


def test_a_planned_price_is_told_before_the_first_piece(tmp_path: Path) -> None:
    messages = work(Unrendered(planned=1200.0), Order("render"), b'{"output": {"duration": 3600}}', Store(tmp_path))
    assert next(messages) == Price(1200.0, 3600.0)


def test_a_simulated_motion_has_its_price_from_its_plan() -> None:
    output = {"quantity": "displacement", "sample_rate": 8000, "duration": 3600}
    scene = {"effects": {"viscous_skin": {}}, "output": output, "accuracy": {"tolerance": 1e-2}}
    engine = SynthEngine(1 << 24)
    voice = engine.open_voice(parse_scene(scene))
    assert isinstance(voice, Voice)
    a_second = voice.plan.response["simulation"]["processor_seconds_a_second"]
    assert engine.planned_seconds(voice) == pytest.approx(3600 * a_second, rel=1e-9)
    assert engine.planned_seconds(engine.open_voice(parse_scene({}))) is None


def test_short_renders_have_no_price() -> None:
    app = create_app(settings_of(render_seconds_per_client=1.0), PlainEngine(planned=0.4))
    assert ask(app, "POST", "/v1/render", json={"output": {"duration": 3}}).status_code == 200


def test_readiness_and_health_tell_of_a_starved_service(monkeypatch: pytest.MonkeyPatch) -> None:
    app = create_app(settings_of(), PlainEngine())
    service: Service = app.state.service
    service.warm = True
    assert ask(app, "GET", "/readyz").status_code == 200
    monkeypatch.setattr(service.solve_places, "starved", lambda: 2.5)
    assert "2.5 s" in problem(ask(app, "GET", "/readyz"), 503, "starved")["detail"]
    health = ask(app, "GET", "/healthz").json()
    assert (health["ready"], health["starved_seconds"]) == (False, 2.5)
