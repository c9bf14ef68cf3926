"""A service that stands still shows in its metrics, to its listeners, and in an alert."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import pytest

from clients import Live
from tests.service.alerting import Key, firing, key, samples, steady
from tests.service.alerting import step as stepped
from tests.service.harness import PATIENCE, Child, until
from tests.service.scraping import Scrape, scrape

LEAD = 0.25  # s of an HTTP stream, the default
SHORT = pytest.param(1, 1.6, id="once for 1.6 s")
LONG = pytest.param(3, 2.5, id="three times for 2.5 s", marks=pytest.mark.thorough)


@pytest.mark.alone  # it stands still for as long as it is told to, and no longer
@pytest.mark.parametrize(("times", "seconds"), [SHORT, LONG])
def test_a_stopped_service_shows_tells_and_alarms(tmp_path: Path, times: int, seconds: float) -> None:
    child = Child("tests.service.serve_plain", tmp_path)
    try:
        url = child.url()
        with httpx.Client(base_url=url, timeout=60.0) as client, live(url) as touch, http_stream(client):
            until(lambda: scrape(client).value("frames_sent_total", kind="http") > 0 and touch.frame > 0)
            before = scrape(client)
            stopped = 0.0
            for _ in range(times):
                began = time.perf_counter()
                child.process.send_signal(signal.SIGSTOP)
                time.sleep(seconds)
                child.process.send_signal(signal.SIGCONT)
                stopped += time.perf_counter() - began
                time.sleep(0.5)
            until(lambda: all(of(scrape(client)) - of(before) >= times for of in (stalls, late_blocks)))
            after = scrape(client)
            told = touch.skipped
    finally:
        child.terminate()
    assert told == pytest.approx(stopped, abs=0.4 * times)
    assert skipped(after, "live") == pytest.approx(told, abs=1e-4)
    assert skipped(after, "http") == pytest.approx(stopped - times * LEAD, abs=0.4 * times)
    late = [of(after) - of(before) for of in (stalls, late_blocks)]
    assert late[0] == times and late[1] >= times
    alerts = ["RidgewaveTimeSkipped", "RidgewaveLoopStalls"]
    firing(tmp_path, [(series(before, after), alerts), (series(before), [])], among="|".join(alerts))


def skipped(shown: Scrape, kind: str) -> float:
    return shown.value("skipped_seconds_total", kind=kind)


def stalls(shown: Scrape) -> float:
    return shown.value("loop_lag_seconds_count") - shown.value("loop_lag_seconds_bucket", le="1.0")


def late_blocks(shown: Scrape) -> float:
    inside = shown.value("block_lateness_seconds_bucket", kind="live", le="1.0")
    return shown.value("block_lateness_seconds_count", kind="live") - inside


def series(before: Scrape, after: Scrape | None = None) -> dict[Key, str]:
    """Return what Prometheus would have seen: the first answer for long, then the second."""
    then, now = samples(before.text), samples((after or before).text)
    up = {key("up"): steady(1.0)}
    return up | {name: stepped(value, now[name]) for name, value in then.items() if "_created" not in name[0]}


@contextmanager
def live(url: str) -> Iterator[Live]:
    """Yield a live stream by the service's clock that a thread reads."""
    with Live(url=url.replace("http", "ws") + "/v1/live", pacing="realtime") as touch:
        done = threading.Event()

        def read() -> None:
            while not done.is_set():
                touch.read(480)

        reader = threading.Thread(target=read)
        reader.start()
        try:
            yield touch
        finally:
            done.set()
            reader.join()


@contextmanager
def http_stream(client: httpx.Client) -> Iterator[None]:
    """Read the stream of a session in a thread, meanwhile."""
    session = f"{client.base_url}/v1/sessions/{client.post('/v1/sessions', json={}).json()['id']}"

    def read() -> None:
        with httpx.stream("GET", f"{session}/stream?format=f32le", timeout=PATIENCE) as answer:
            for _ in answer.iter_raw():
                pass

    reader = threading.Thread(target=read)
    reader.start()
    try:
        yield
    finally:
        client.delete(session)
        reader.join()
