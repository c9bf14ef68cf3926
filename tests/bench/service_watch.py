"""Prints the cost of monitoring the service, and the time until a stop reaches the streams of another worker.

    python -m tests.bench.service_watch

The stop is timed at the readers, over loopback: from the request until the last of the streams has ended.
"""

from __future__ import annotations

import statistics
import tempfile
import threading
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from time import perf_counter

import httpx

from service.http.rate_limits import Limits
from service.operations.metrics import Metrics, exposition, merged, snapshot
from tests.service.harness import Child, settings_of

CALLS = 100_000
STREAMS = 16
STOPS = 20
SCOPE = {"type": "http", "headers": [], "client": ("127.0.0.1", 1), "ridgewave.key": 0}


def main() -> None:
    """Print one line per figure."""
    metrics = Metrics()
    limits = Limits(settings_of(requests_per_second=1e6, request_burst=1_000_000))
    _each("a block sent", lambda: metrics.block_sent("live", 480, 0.0003))
    _each("a block reduced by the limiter", lambda: metrics.limited(1.0, 0.01))
    _each("updates of a block", lambda: metrics.updates(received=3, applied=1, dropped=2))
    _each("a request counted", lambda: limits.take_request(f"address {limits.address(SCOPE)}"))
    _each("a stream admitted and released", lambda: limits.admit(SCOPE).release())
    others = [snapshot(metrics.families())] * 3
    _each("a scrape of four workers", lambda: exposition(merged(metrics.families(), others)), CALLS // 1000)
    _stops()


def _each(name: str, work: Callable[[], object], calls: int = CALLS) -> None:
    took = []
    for _ in range(5):
        began = perf_counter()
        for _ in range(calls):
            work()
        took.append((perf_counter() - began) / calls)
    print(f"{name:45} {1e6 * statistics.median(took):9.2f} us (least {1e6 * min(took):.2f})")


def _stops() -> None:
    with tempfile.TemporaryDirectory() as folder:
        child = Child("tests.service.serve_plain_workers", Path(folder), RIDGEWAVE_WORKERS="2")
        try:
            took = [_stop(child.url()) for _ in range(STOPS)]
        finally:
            child.end()
    answered, ended = ([1e3 * one[index] for one in took] for index in (0, 1))
    for name, values in (("a stop of two workers is answered", answered), (f"and {STREAMS} streams have ended", ended)):
        print(f"{name:45} {statistics.median(values):9.2f} ms (most {max(values):.2f})")


def _stop(url: str) -> tuple[float, float]:
    """Return the seconds until the answer, and until the last stream has ended."""
    ends: list[float] = []
    sounding = threading.Barrier(STREAMS + 1, timeout=30.0)

    def read() -> None:
        with httpx.Client(base_url=url) as client:
            path = client.post("/v1/sessions", json={}).json()["stream"]
            with client.stream("GET", f"{path}?format=f32le") as answer:
                parts = answer.iter_raw()
                next(parts)
                sounding.wait()
                with suppress(httpx.RemoteProtocolError):  # a fade that was not sent in time is cut off
                    for _ in parts:
                        pass
                ends.append(perf_counter())

    readers = [threading.Thread(target=read) for _ in range(STREAMS)]
    for reader in readers:
        reader.start()
    with httpx.Client(base_url=url) as client:
        sounding.wait()
        began = perf_counter()
        stopped = client.post("/v1/stop").json()["stopped"]["streams"]
        answered = perf_counter()
    for reader in readers:
        reader.join()
    assert stopped == STREAMS, "streams ended by themselves"
    return answered - began, max(ends) - began


if __name__ == "__main__":
    main()
