"""Several workers are one service: a stop reaches all of them, and the metrics are of all of them."""

from __future__ import annotations

import asyncio
import json
import os
import shutil
import signal
import socket
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from service.operations.worker_messages import LONGEST_PATH, WorkerMessages, check_folder
from synth.errors import CannotRender
from tests.service.harness import PATIENCE, START, Child, Running, problem, serving, until
from tests.service.live.client import live
from tests.service.plain_engine import PlainEngine
from tests.service.scraping import scrape
from tests.service.test_shutdown import Follower

WORKERS = "tests.service.serve_plain_workers"
STREAMS = 6


@contextmanager
def pair(folder: Path) -> Iterator[tuple[Running, Running]]:
    """Yield two services that think they are workers of one."""
    with serving(PlainEngine(), folder) as first, serving(PlainEngine(), folder) as second:
        yield first, second


def deaf(folder: Path, name: str = "deaf") -> socket.socket:
    """Return the socket of a worker that hangs: it takes what comes and answers nothing."""
    made = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    made.bind(str(folder / f"{name}.sock"))
    made.setblocking(False)
    return made


@pytest.mark.usefixtures("unhurried")
def test_a_stop_at_one_worker_silences_the_other(tmp_path: Path) -> None:
    with pair(tmp_path) as (first, second):
        session, other = first.open_session(), second.open_session()
        with first.listening(session) as listener, second.listening(other) as neighbour:
            listener.frames(9600)
            neighbour.frames(9600)
            answer = second.client.post("/v1/stop").json()
            ends = [listener.rest(), neighbour.rest()]
        assert answer["stopped"]["sessions"] == answer["stopped"]["streams"] == 2
        assert "unanswered_workers" not in answer
        for rest in ends:
            assert rest[-1] == 0.0
            assert np.abs(rest[-10:]).max() < 0.005
        problem(first.client.get(f"/v1/sessions/{session}"), 404, "not-found")


@pytest.mark.usefixtures("unhurried")
def test_the_metrics_of_one_are_those_of_both(tmp_path: Path) -> None:
    with pair(tmp_path) as (first, second):
        for running, count in ((first, 2), (second, 3)):
            for _ in range(count):
                running.client.post("/v1/render", json={"output": {"duration": 0.01}})
        for running in (first, second):
            shown = scrape(running.client)
            assert shown.value("renders_total") == 5
            assert shown.value("workers") == 2
            assert running.client.get("/healthz").json()["workers"] == 2


@pytest.mark.usefixtures("unhurried")
def test_what_a_worker_counted_outlives_it_and_its_sessions_do_not(tmp_path: Path) -> None:
    with serving(PlainEngine(), tmp_path) as first:
        with serving(PlainEngine(), tmp_path) as second:
            second.client.post("/v1/render", json={"output": {"duration": 0.01}})
            second.open_session()
            assert scrape(first.client).value("sessions") == 1
        shown = scrape(first.client)
    assert shown.value("renders_total") == 1
    assert (shown.value("sessions"), shown.value("workers")) == (0, 1)


def test_a_worker_that_hangs_holds_nothing_up_and_is_told_of(tmp_path: Path) -> None:
    with deaf(tmp_path), serving(PlainEngine(), tmp_path) as running:
        running.open_session()
        answer = running.client.post("/v1/stop").json()
        assert answer == {"stopped": {"sessions": 1, "streams": 0, "plays": 0}, "unanswered_workers": 1}
        assert scrape(running.client).value("problems_total", type="not-found") == 0


def test_a_stop_waits_for_room_in_a_full_queue(tmp_path: Path) -> None:
    """A worker that hung under a flood of questions finds the stop too when it wakes."""
    with deaf(tmp_path) as sleeper, serving(PlainEngine(), tmp_path) as running:
        filler = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        filler.setblocking(False)
        with filler, pytest.raises(BlockingIOError):
            while True:
                filler.sendto(b"{}", str(tmp_path / "deaf.sock"))
        assert running.client.post("/v1/stop").json()["unanswered_workers"] == 1
        heard: list[dict[str, Any]] = []

        def stopped() -> bool:
            try:
                heard.append(json.loads(sleeper.recv(65536)))
            except BlockingIOError:
                return False
            return heard[-1].get("ask") == "stop"

        until(stopped)


def test_a_dead_worker_is_forgotten(tmp_path: Path) -> None:
    deaf(tmp_path).close()
    with serving(PlainEngine(), tmp_path) as running:
        assert running.client.get("/healthz").json()["workers"] == 2
        assert "unanswered_workers" not in running.client.post("/v1/stop").json()
        assert running.client.get("/healthz").json()["workers"] == 1


def test_nonsense_from_another_program_stops_nothing(tmp_path: Path) -> None:
    with serving(PlainEngine(), tmp_path) as running, socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as stranger:
        (place,) = tmp_path.glob("*.sock")
        for text in (b"", b"\xff", b"[]", b"{}", b'{"ask": "format"}', b'{"answer": {}, "number": 1, "from": "x"}'):
            stranger.sendto(text, str(place))
        assert running.client.post("/v1/stop").status_code == 200


def test_a_question_to_nobody_is_answered_at_once() -> None:
    async def act() -> None:
        alone = WorkerMessages(None, {})
        alone.open()
        question = alone.ask("stop")
        assert await question.wait(patience=1000.0) == [] and question.unanswered == 0
        alone.close()

    asyncio.run(asyncio.wait_for(act(), 60.0))


def test_a_folder_whose_name_is_too_long_for_sockets_is_refused_in_a_sentence() -> None:
    check_folder(Path("/tmp/ridgewave-abcdefgh"))
    with pytest.raises(CannotRender, match="TMPDIR"):
        check_folder(Path("/" + "x" * LONGEST_PATH))


@pytest.fixture(scope="module")
def two_workers(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Child, str, Path]]:
    """Yield a service of two workers, where it is, and the folder that its workers speak through."""
    short = Path(tempfile.mkdtemp(prefix="rw"))  # paths of sockets are at most 100 bytes long
    environment = {"RIDGEWAVE_WORKERS": "2", "RIDGEWAVE_LOG_FORMAT": "json", "TMPDIR": str(short)}
    child = Child(WORKERS, tmp_path_factory.mktemp("workers"), **environment)
    try:
        url = child.url()
        (folder,) = short.glob("ridgewave-*")
        until(lambda: len(list(folder.glob("*.sock"))) == 2, START)
        yield child, url, folder
    finally:
        child.end()
        shutil.rmtree(short)


def test_a_stop_at_one_of_two_workers_ends_the_live_streams_of_both(two_workers: tuple[Child, str, Path]) -> None:
    child, url, _folder = two_workers
    with ExitStack() as stack:
        clients = []
        for other in _workers(child.process.pid):
            os.kill(other, signal.SIGSTOP)  # so that it is not the one that accepts
            try:
                clients.append(stack.enter_context(live(url)))
                clients[-1].hello(pacing="realtime")
            finally:
                os.kill(other, signal.SIGCONT)
        with httpx.Client(base_url=url, timeout=PATIENCE) as http:
            until(lambda: scrape(http).value("streams", kind="live") == 2)
            assert http.post("/v1/stop").json()["stopped"] == {"sessions": 2, "streams": 2, "plays": 0}
        for client in clients:
            client.rest()
            assert (client.code, client.texts("end")[0]["reason"]) == (1000, "stopped")

    def ended() -> list[dict[str, Any]]:
        lines = child.log.read_text().splitlines()
        return [json.loads(line) for line in lines if "live stream ended: stopped" in line]

    until(lambda: len(ended()) == 2)
    assert len({entry["process"] for entry in ended()}) == len({entry["session"] for entry in ended()}) == 2
    log = child.log.read_text()
    assert "[accepted]" not in log and "connection open" not in log


def test_a_service_of_two_workers_stops_and_counts_and_ends_as_one(two_workers: tuple[Child, str, Path]) -> None:
    child, url, folder = two_workers
    assert folder.stat().st_mode & 0o777 == 0o700
    followers = _streams(url)
    with httpx.Client(base_url=url, timeout=PATIENCE) as client:
        assert scrape(client).value("streams", kind="http") == STREAMS
        answer = client.post("/v1/stop").json()
        assert answer == {"stopped": {"sessions": STREAMS, "streams": STREAMS, "plays": 0}}
        for follower in followers:
            follower.thread.join(60.0)
            assert not follower.thread.is_alive()
            if follower.error is None:
                assert follower.samples[-1] == 0.0
            else:  # a busy machine: what does not fade in time is cut off
                assert isinstance(follower.error, httpx.RemoteProtocolError)
        until(lambda: scrape(client).value("streams", kind="http") == 0)
        frames = scrape(client).value("frames_sent_total", kind="http")
        killed = _workers(child.process.pid)[0]
        os.kill(killed, signal.SIGKILL)
        until(lambda: not _runs(killed))
        _counts_never_fall(url, frames)
    scene = {"output": {"duration": 0.1}}
    assert httpx.post(f"{url}/v1/render", json=scene, timeout=PATIENCE).status_code == 200
    child.process.send_signal(signal.SIGTERM)
    assert child.process.wait(60.0) == 0
    assert not folder.exists()


def test_a_closed_terminal_replaces_the_workers_with_a_fade(tmp_path: Path) -> None:
    short = Path(tempfile.mkdtemp(prefix="rw"))
    child = Child(WORKERS, tmp_path, RIDGEWAVE_WORKERS="2", TMPDIR=str(short))
    try:
        url = child.url()
        until(lambda: len(list(short.glob("ridgewave-*/*.sock"))) == 2, START)
        first = set(_spawned(child.process.pid))
        with live(url) as client:
            client.hello(pacing="realtime")
            client.frames(4800)
            for process in (*first, child.process.pid):  # all that belong to the terminal
                os.kill(process, signal.SIGHUP)
            pcm = client.rest()
            assert (client.code, client.reason, pcm[-1]) == (1001, "shutting down", 0.0)
        until(lambda: not any(_runs(worker) for worker in first), START)
        assert httpx.get(f"{url}/healthz", timeout=PATIENCE).status_code == 200
        child.terminate()
    finally:
        child.end()
        shutil.rmtree(short)


@pytest.mark.parametrize(
    "served", [pytest.param(False, marks=pytest.mark.thorough), True], ids=["while they start", "while they serve"]
)
def test_workers_do_not_outlive_the_process_that_started_them(tmp_path: Path, served: bool) -> None:
    short = Path(tempfile.mkdtemp(prefix="rw"))
    child = Child(WORKERS, tmp_path, RIDGEWAVE_WORKERS="2", TMPDIR=str(short))
    workers: list[int] = []
    try:
        until(lambda: len(_spawned(child.process.pid)) == 2, START)
        if served:
            child.url()
            (folder,) = short.glob("ridgewave-*")
            until(lambda: len(list(folder.glob("*.sock"))) == 2, START)
        workers += _spawned(child.process.pid)  # now: on a busy machine the parent has replaced one that was slow
        child.process.kill()
        until(lambda: not any(_runs(worker) for worker in workers))
        assert not list(short.glob("ridgewave-*/*.sock"))
        assert not served or child.log.read_text().count("the worker ends too") == 2
    finally:
        child.end()
        for worker in filter(_runs, workers):
            os.kill(worker, signal.SIGKILL)
        shutil.rmtree(short)


def _streams(url: str) -> list[Follower]:
    """Return readers of as many sessions, each over the connection that its session was opened with."""
    with ExitStack() as stack:
        followers = []
        for _ in range(STREAMS):
            client = stack.enter_context(httpx.Client(base_url=url, timeout=PATIENCE))
            session = client.post("/v1/sessions", json={}).json()["stream"]
            followers.append(Follower(client, f"{session}?format=f32le"))
        assert all(follower.started.wait(60.0) for follower in followers), [one.error for one in followers]
        stack.pop_all()
    return followers


def _workers(parent: int) -> list[int]:
    found = _spawned(parent)
    assert found, "no worker"
    return found


def _spawned(parent: int) -> list[int]:
    """Return the processes of the workers: children of `parent` whose command line is that of a spawned process."""
    children = Path(f"/proc/{parent}/task/{parent}/children").read_text().split()
    return [int(entry) for entry in children if b"spawn_main" in Path(f"/proc/{entry}/cmdline").read_bytes()]


def _runs(process: int) -> bool:
    """Return whether a process is there and has not ended; one that ended may wait to be reaped."""
    try:
        state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
    except (FileNotFoundError, ProcessLookupError):
        return False
    return state not in "ZX"


def _counts_never_fall(url: str, frames: float) -> None:
    """Scrape until the parent has replaced the worker that was killed; the dead one is counted no more."""

    def replaced() -> bool:
        time.sleep(0.1)  # the processor is the new worker's, to start
        try:
            with httpx.Client(base_url=url, timeout=PATIENCE) as client:
                shown = scrape(client)
        except httpx.TransportError:  # a connection that the dead worker had taken
            return False
        assert shown.value("frames_sent_total", kind="http") >= frames
        return shown.value("workers") == 2

    until(replaced, START)
