"""The parts of one process of the service, its start and its end.

Model: a signal (SIGTERM, SIGINT) first makes every stream fade out, then reaches the server: the server waits for its
    connections, and would wait for an endless stream for ever. Plays get a moment to complete their files.
"""

from __future__ import annotations

import asyncio
import gc
import logging
import os
import signal
import sys
import threading
import time
from collections import Counter
from collections.abc import AsyncIterator, Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager, contextmanager, suppress
from functools import partial
from pathlib import Path
from types import FrameType
from typing import Any

from fastapi import FastAPI, Request
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily

from service.compute.import_process import Imports
from service.compute.measurements import Measurements
from service.compute.renders import Renders
from service.compute.texture_preparation import TexturePreparation
from service.compute.threads import BlockThreads, Solves, ThreadWork
from service.compute.uploads import Uploads
from service.compute.work_places import Places
from service.engine import Engine
from service.http.rate_limits import Limits
from service.http.reference import Reference
from service.live.live_connections import LiveConnections
from service.operations.health import Health
from service.operations.metrics import Metrics
from service.operations.settings import Settings
from service.operations.worker_messages import WorkerMessages
from service.operations.worker_metrics import WorkerMetrics
from service.sessions.session_registry import Sessions
from service.sinks import Claims
from service.sinks.player import Player
from service.store.data_folder import data_folder
from service.store.owned_textures import OwnedTextures
from synth.scene.scene import parse_scene
from synth.surfaces.surface_data import add_source, remove_source

log = logging.getLogger("ridgewave.service")

SWITCH_SECONDS = 0.0005  # between Python threads; with the default of 5 ms, plays are late beside busy threads
WHOLE_COLLECTION = 1000  # partial ones before a whole one, which holds every stream for 0.1 s beside long recordings
SOLVES_AT_ONCE = 1 + max(2, os.cpu_count() or 2)  # in threads of one interpreter: with 8, streams were 0.1 s late
BLOCK_THREADS = 4  # for blocks of streams that take long to render
LAG_SECONDS = 0.05  # between measurements of the event loop's lateness; a shorter stall may be missed
WATCH_SECONDS = 0.05  # between checks for late hellos, slow readers and expired sessions
PLAY_END_SECONDS = 1.0  # for plays to complete their files at a shutdown
STOP_ANSWER_SECONDS = 0.1  # for other workers to answer what they stopped; a longer wait delays the answer
CUT_SECONDS = 0.2  # before the server's own timeout, which logs a traceback for each answer that it cuts


class Service:
    """The parts of one process."""

    def __init__(self, settings: Settings, engine: Engine, folder: Path | None = None, *, apart: bool = False) -> None:
        """Make the parts.

        folder: the private folder of the workers; None if there is only one.
        apart: renders run in processes of their own.
        """
        self.settings = settings
        self.engine = engine
        self.metrics = Metrics()
        self.limits = Limits(settings)
        self.health = Health(settings)
        self.textures = OwnedTextures(settings)
        self.textures.adopt()
        add_source(self.textures.store.surface)
        self.worker_messages = WorkerMessages(
            folder, {"stop": self.stop_here, "metrics": lambda: self.worker_metrics.write()}
        )
        self.worker_metrics = WorkerMetrics(self.metrics, self.worker_messages, folder)
        self.renders = Renders(engine, settings, self.metrics, self.limits, apart=apart)
        waited = partial(self.metrics.waited, "solve")
        self.solve_places = Places(settings.solves_per_client, settings.max_solves, waited, SOLVES_AT_ONCE)
        self.solves = Solves(self.solve_places)
        self.measurements = Measurements(engine)
        self.imports, self.uploads = Imports(), Uploads(settings)
        self.claims = Claims()
        self.blocks = BlockThreads(BLOCK_THREADS, partial(self.metrics.waited, "block"))
        self.sessions = Sessions(engine, settings, self.solves, self.metrics)
        self.live = LiveConnections(self.sessions, settings, self.blocks)
        self.preparation = TexturePreparation(data_folder(settings.data_folder))
        self.reference: Reference | None = None  # of the application, which sets it
        self.serves_only = False
        """Whether `warm_up` makes the reference, begins to prepare textures, and excludes the heap from garbage
        collection, because a full collection stops streams for 90 ms. False where the process does other work too, as
        in tests."""
        self.warm = False
        self.closing = False
        self.loop: asyncio.AbstractEventLoop | None = None  # None until it serves
        self._players: list[Player] = []
        self._watch()

    async def stop(self) -> dict[str, Any]:
        """Stop every session, stream and play of every worker; return their numbers.

        `unanswered_workers` counts the workers that did not answer in time. They stop as soon as they can.
        """
        question = self.worker_messages.ask("stop")
        stopped = Counter(self.stop_here())
        for answer in await question.wait(STOP_ANSWER_SECONDS):
            stopped.update(answer)
        document: dict[str, Any] = {"stopped": dict(stopped)}
        return document | ({"unanswered_workers": question.unanswered} if question.unanswered else {})

    def stop_here(self) -> dict[str, int]:
        """Stop those of this process at once; return their numbers."""
        counts = self.sessions.end_all(at_once=True)
        self.live.end_all("stopped", at_once=True)
        return counts

    def starved(self) -> float:
        """Return the seconds that short work has waited to begin; 0 below a second."""
        return max(self.renders.places.starved(), self.solve_places.starved())

    def begin_closing(self) -> None:
        """Fade out and end every stream and play; accept no new ones. From any thread; further calls do no harm."""
        if not self.closing and self.loop is not None:
            grace = max(0.0, self.settings.shutdown_timeout - CUT_SECONDS)
            self.loop.call_soon_threadsafe(self.loop.call_later, grace, self.renders.cut)
        self.closing = True
        self.measurements.close()
        self.imports.close()
        self.preparation.close()
        self._players += self.sessions.close()
        self.live.end_all("shutting down")

    def warm_up(self) -> None:
        """Render a little, so that the kernels are compiled before a request needs them. Call it from a thread."""
        began = time.perf_counter()
        try:
            with ThreadPoolExecutor(
                1
            ) as beside:  # this process and that of the renders compile half of the kernels each
                renders = beside.submit(self.renders.warm_up)
                self.engine.load_reading()
                renders.result()
            self.engine.load_following()
            self.engine.open_voice(parse_scene({})).render(480)
            open_live_voices(self.engine, {})
        except Exception:
            log.exception("our mistake: the default scene does not render; the service does not become ready")
            return
        if self.serves_only:
            if self.reference is not None:
                self.reference.make()
            gc.collect()
            gc.freeze()
        self.warm = True
        log.info("ready after %.1f s", time.perf_counter() - began)
        self.prepare_textures()

    def prepare_textures(self) -> None:
        """Solve textures ahead, unless a setting forbids it. Call it from a thread, after start and import."""
        if self.warm and self.serves_only and self.settings.prepare_textures == "on":
            with suppress(OSError):  # nothing is kept if the data folder cannot be written
                self.preparation.begin()

    def finish(self) -> None:
        """Wait for plays to complete their files, then end threads and processes. Call it from a thread."""
        deadline = time.monotonic() + PLAY_END_SECONDS
        for player in self._players:
            if not player.wait(max(0.0, deadline - time.monotonic())):
                log.warning("a play did not end in time")
        self.measurements.close()
        self.preparation.finish()
        self.renders.close()
        self.blocks.shutdown()
        self.worker_metrics.write()
        remove_source(self.textures.store.surface)

    def _watch(self) -> None:
        """Add the metrics of what the parts of the service count themselves."""
        cache = self.engine.cache_counts
        counters: dict[str, tuple[str, Callable[[], float]]] = {
            "cache_hits_total": ("Contact responses of sessions found in the cache.", lambda: cache().hits),
            "cache_misses_total": ("Contact responses of sessions that had to be solved.", lambda: cache().misses),
        }
        gauges: dict[str, tuple[str, Callable[[], float]]] = {
            "cache_bytes": (
                "Memory of cached responses, tables, surfaces and solvers; RIDGEWAVE_CACHE_BYTES bounds it per worker.",
                self.engine.cached_bytes,
            ),
            "live_bytes": (
                "Memory of sessions: voices, buffers and recordings; RIDGEWAVE_LIVE_BYTES bounds it per worker.",
                lambda: self.sessions.used_bytes,
            ),
            "sessions": ("Sessions of plain HTTP, streaming or not.", lambda: self.sessions.count("http")),
            "renders_under_way": ("Renders running or waiting.", lambda: self.renders.under_way),
            "imports_under_way": ("Imports uploading, waiting or being read.", lambda: self.uploads.under_way),
            "import_bytes": ("Bodies of these imports, in bytes.", lambda: self.uploads.held_bytes),
        }
        for name, (sentence, read) in counters.items():
            self.metrics.watch(CounterMetricFamily, name, sentence, read)
        for name, (sentence, read) in gauges.items():
            self.metrics.watch(GaugeMetricFamily, name, sentence, read)


def open_live_voices(engine: Engine, document: Mapping[str, Any]) -> None:
    """Open a live voice and a hand's voice of the scene `document`, so that their kernels are compiled."""
    scene = parse_scene(document)
    engine.open_live(scene)
    engine.open_hand(scene)


def service_of(request: Request) -> Service:
    """Return the service that `request` reached."""
    service: Service = request.app.state.service
    return service


@asynccontextmanager
async def lifespan(app: FastAPI) -> AsyncIterator[dict[str, Any]]:
    """Start the service with the server, and end it with the server.

    Yields what the server's protocols need of the settings, for answers that they give without the application.
    """
    service: Service = app.state.service
    loop = service.loop = asyncio.get_running_loop()
    interval, thresholds = sys.getswitchinterval(), gc.get_threshold()
    sys.setswitchinterval(SWITCH_SECONDS)
    gc.set_threshold(*thresholds[:2], WHOLE_COLLECTION)
    service.worker_messages.open()
    chores = [_watch(service), service.worker_metrics.keep_writing(), service.health.look()]
    chores.append(_measure_lag(service.metrics))
    tasks = [asyncio.create_task(chore) for chore in chores]
    ThreadWork(service.warm_up, "warm-up")
    try:
        with signals_first(lambda: _from_signal(loop, service.begin_closing)):
            yield {"root_path": service.settings.root_path}
    finally:
        for task in tasks:
            task.cancel()
        service.begin_closing()
        await service.sessions.recordings.settle(PLAY_END_SECONDS)
        await asyncio.to_thread(service.finish)
        service.worker_messages.close()
        sys.setswitchinterval(interval)
        gc.set_threshold(*thresholds)


@contextmanager
def signals_first(act: Callable[[], None]) -> Iterator[None]:
    """Within, SIGTERM and SIGINT call `act`, then the earlier handler. Does nothing outside the main thread."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    earlier = {number: signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGINT)}

    def handle(number: int, frame: FrameType | None) -> None:
        """Call `act`, then the handler that the signal had before."""
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
    """Measure the lateness of the event loop, until cancelled."""
    while True:
        due = time.perf_counter() + LAG_SECONDS
        await asyncio.sleep(LAG_SECONDS)
        metrics.lagged(time.perf_counter() - due)


async def _watch(service: Service) -> None:
    """Check for late hellos, slow readers and expired sessions, until cancelled."""
    while True:
        await asyncio.sleep(WATCH_SECONDS)
        service.live.check(time.perf_counter())
        service.sessions.look()
