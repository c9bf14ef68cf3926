"""What one process of the service holds while it runs, how it starts, and how it ends properly.

Model: a signal (SIGTERM, SIGINT) sets every stream fading before the server is told, because the server waits for its
    connections first and would wait for an endless stream for ever. Plays get a moment to complete their files.
"""

from __future__ import annotations

import asyncio
import gc
import logging
import signal
import sys
import threading
import time
from collections import Counter
from collections.abc import AsyncIterator, Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager, contextmanager
from functools import partial
from pathlib import Path
from types import FrameType
from typing import Any

from fastapi import FastAPI, Request

from service.compute.accuracy_queue import Measurements
from service.compute.renders import Renders
from service.compute.threads import BlockThreads, Solves, ThreadWork
from service.compute.work_places import Places
from service.engine import Engine
from service.http.rate_limits import Limits
from service.live.live_connections import LiveConnections
from service.operations.health import Health
from service.operations.metrics import Metrics
from service.operations.settings import Settings
from service.operations.worker_messages import WorkerMessages
from service.operations.worker_metrics import WorkerMetrics
from service.sessions.session_registry import Sessions
from service.sinks import Claims
from service.sinks.player import Player
from synth.scene.scene import parse_scene

log = logging.getLogger("ridgewave.service")

SWITCH_SECONDS = 0.0005  # between Python threads; at the default of 5 ms a play's thread is late beside busy ones
BLOCK_THREADS = 4  # for blocks of streams that are not quick: apart from the renders, which would make them late
LAG_SECONDS = 0.05  # between two looks at how late the event loop is; a stall shorter than that may pass unseen
WATCH_SECONDS = 0.05  # between two looks at what only time tells: late hellos, slow readers, expiry
PLAY_END_SECONDS = 1.0  # for all plays to complete their files at the end
STOP_ANSWER_SECONDS = 0.1  # for other workers to count what they stopped: less misses them, more holds up the answer
CUT_SECONDS = 0.2  # before the server's own timeout, which would tell of each answer that it cuts in a traceback


class Service:
    """The parts of one process."""

    def __init__(self, settings: Settings, engine: Engine, folder: Path | None = None, *, apart: bool = False) -> None:
        """folder: through which the workers of one service speak; None where there is one. apart: renders are computed
        in processes of their own."""
        self.settings = settings
        self.engine = engine
        self.metrics = Metrics()
        self.limits = Limits(settings)
        self.health = Health(settings)
        self.worker_messages = WorkerMessages(
            folder, {"stop": self.stop_here, "metrics": lambda: self.worker_metrics.write()}
        )
        self.worker_metrics = WorkerMetrics(self.metrics, self.worker_messages, folder)
        self.renders = Renders(engine, settings, self.metrics, self.limits, apart=apart)
        waited = partial(self.metrics.waited, "solve")
        self.solve_places = Places(settings.solves_per_client, settings.max_solves, waited)
        self.solves = Solves(self.solve_places)
        self.measurements = Measurements(engine)
        self.claims = Claims()
        self.blocks = BlockThreads(BLOCK_THREADS, partial(self.metrics.waited, "block"))
        self.sessions = Sessions(engine, settings, self.solves, self.metrics)
        self.live = LiveConnections(self.sessions, settings, self.blocks)
        self.freezes_heap = False
        """Whether this process serves and does nothing else, so that `warm_up` may take its heap out of the collector's
        sight: a full collection of it stops every stream for 90 ms."""
        self.warm = False
        self.closing = False
        self.loop: asyncio.AbstractEventLoop | None = None  # that serves; None before it does
        self._players: list[Player] = []
        self._watch()

    async def stop(self) -> dict[str, Any]:
        """Silence every stream and play of every worker; return how many of each there were.

        Where a worker does not say how many in time, `unanswered_workers` counts it; it stops as soon as it can.
        """
        question = self.worker_messages.ask("stop")
        stopped = Counter(self.stop_here())
        for answer in await question.wait(STOP_ANSWER_SECONDS):
            stopped.update(answer)
        document: dict[str, Any] = {"stopped": dict(stopped)}
        return document | ({"unanswered_workers": question.unanswered} if question.unanswered else {})

    def stop_here(self) -> dict[str, int]:
        """The same in this process alone, at once."""
        counts = self.sessions.end_all(at_once=True)
        self.live.end_all("stopped", at_once=True)
        return counts

    def starved(self) -> float:
        """Return for how many seconds short work has waited to begin; 0 where it hardly does."""
        return max(self.renders.places.starved(), self.solve_places.starved())

    def begin_closing(self) -> None:
        """Have every stream and play fade and end; take no new ones. Again is the same as once; from any thread."""
        if not self.closing and self.loop is not None:
            grace = max(0.0, self.settings.shutdown_timeout - CUT_SECONDS)
            self.loop.call_soon_threadsafe(self.loop.call_later, grace, self.renders.cut)
        self.closing = True
        self.measurements.close()
        self._players += self.sessions.close()
        self.live.end_all("shutting down")

    def warm_up(self) -> None:
        """Render a little, so that the kernels are compiled before somebody waits for them; for a thread."""
        began = time.perf_counter()
        try:
            with ThreadPoolExecutor(1) as beside:  # each of two processes compiles half of the kernels
                renders = beside.submit(self.renders.warm_up)
                self.engine.load_reading()
                renders.result()
            self.engine.load_following()
            self.engine.open_voice(parse_scene({})).render(480)
            open_live_voices(self.engine, {})
        except Exception:
            log.exception("our mistake: the default scene does not render; the service stays not ready")
            return
        if self.freezes_heap:
            gc.collect()
            gc.freeze()
        self.warm = True
        log.info("ready after %.1f s", time.perf_counter() - began)

    def finish(self) -> None:
        """Wait for the plays to complete their files, and let the threads go; for a thread."""
        deadline = time.monotonic() + PLAY_END_SECONDS
        for player in self._players:
            if not player.wait(max(0.0, deadline - time.monotonic())):
                log.warning("a play did not end in time")
        self.measurements.close()
        self.renders.close()
        self.blocks.shutdown()
        self.worker_metrics.write()

    def _watch(self) -> None:
        """Have the metrics read what others count."""
        cache = self.engine.cache_counts
        self.metrics.watch("ridgewave_cache_hits_total", lambda: cache().hits)
        self.metrics.watch("ridgewave_cache_misses_total", lambda: cache().misses)
        self.metrics.watch("ridgewave_cache_bytes", lambda: cache().used_bytes)
        self.metrics.watch("ridgewave_live_bytes", lambda: self.sessions.used_bytes)
        self.metrics.watch("ridgewave_sessions", lambda: self.sessions.count("http"))
        self.metrics.watch("ridgewave_renders_under_way", lambda: self.renders.under_way)
        self.metrics.watch("ridgewave_workers", lambda: 1)


def open_live_voices(engine: Engine, document: Mapping[str, Any]) -> None:
    """Open a live voice of the scene `document`, and one for a hand, so that what they run is compiled."""
    scene = parse_scene(document)
    engine.open_live(scene)
    engine.open_hand(scene)


def service_of(request: Request) -> Service:
    """Return the service that answers `request`."""
    service: Service = request.app.state.service
    return service


@asynccontextmanager
async def lifespan(app: FastAPI) -> AsyncIterator[None]:
    """Start and end the service around the server's own start and end."""
    service: Service = app.state.service
    loop = service.loop = asyncio.get_running_loop()
    interval = sys.getswitchinterval()
    sys.setswitchinterval(SWITCH_SECONDS)
    service.worker_messages.open()
    chores = [_watch(service), service.worker_metrics.keep_writing(), service.health.look()]
    chores.append(_measure_lag(service.metrics))
    tasks = [asyncio.create_task(chore) for chore in chores]
    ThreadWork(service.warm_up, "warm-up")
    try:
        with signals_first(lambda: _from_signal(loop, service.begin_closing)):
            yield
    finally:
        for task in tasks:
            task.cancel()
        service.begin_closing()
        await service.sessions.recordings.settle(PLAY_END_SECONDS)
        await asyncio.to_thread(service.finish)
        service.worker_messages.close()
        sys.setswitchinterval(interval)


@contextmanager
def signals_first(act: Callable[[], None]) -> Iterator[None]:
    """Within, SIGTERM and SIGINT call `act` and then whoever handled them before; outside the main thread, nothing."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    earlier = {number: signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGINT)}

    def handle(number: int, frame: FrameType | None) -> None:
        act()
        then: Any = earlier[signal.Signals(number)]
        if callable(then):
            then(number, frame)

    for number in earlier:
        signal.signal(number, handle)
    try:
        yield
    finally:
        for number, handler in earlier.items():
            if signal.getsignal(number) is handle:
                signal.signal(number, handler)


def _from_signal(loop: asyncio.AbstractEventLoop, act: Callable[[], None]) -> None:
    if not loop.is_closed():
        loop.call_soon_threadsafe(act)


async def _measure_lag(metrics: Metrics) -> None:
    """Measure how late the event loop does what is due, until cancelled."""
    while True:
        due = time.perf_counter() + LAG_SECONDS
        await asyncio.sleep(LAG_SECONDS)
        metrics.lagged(time.perf_counter() - due)


async def _watch(service: Service) -> None:
    """Look at what only time tells, until cancelled."""
    while True:
        await asyncio.sleep(WATCH_SECONDS)
        service.live.check(time.perf_counter())
        service.sessions.look()
