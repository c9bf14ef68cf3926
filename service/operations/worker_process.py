"""The entry point of each worker process, where there are several. It reads its settings from the environment.

Model: a worker ends, as after SIGTERM, when its parent has ended, because nothing else would replace or end it. It
    detects this by a pipe that the parent holds open, even if the parent ended while the worker was starting.
"""

from __future__ import annotations

import asyncio
import logging
import multiprocessing
import os
import signal
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fastapi import FastAPI

from service.app import create_app
from service.operations.logs import set_up_log
from service.operations.settings_environment import read_settings
from service.operations.worker_messages import FOLDER_VARIABLE

if TYPE_CHECKING:
    from service.engine import Engine

log = logging.getLogger("ridgewave.service")


def app(engine: Engine | None = None) -> FastAPI:
    """Return the application of this worker. engine: `synth`, unless a test passes another."""
    settings = read_settings()
    set_up_log(settings.log_level, settings.log_format)
    folder = os.environ.get(FOLDER_VARIABLE)
    made = create_app(settings, engine, workers_folder=None if folder is None else Path(folder))
    made.state.service.serves_only = True
    made.router.lifespan_context = _with_parent(made.router.lifespan_context)
    return made


def _with_parent(lifespan: Callable[[FastAPI], Any]) -> Callable[[FastAPI], Any]:
    """Return a `lifespan` that ends when the parent process has ended."""

    @asynccontextmanager
    async def watched(app: FastAPI) -> AsyncIterator[Any]:
        """Run the application's lifespan, and watch for the end of the parent."""
        async with lifespan(app) as state:
            with _ended_by_parent(asyncio.get_running_loop()):
                yield state

    return watched


@contextmanager
def _ended_by_parent(loop: asyncio.AbstractEventLoop) -> Iterator[None]:
    """Within, this process ends with its parent, at once if that has already ended."""
    parent = multiprocessing.parent_process()
    if parent is None:  # started by hand
        yield
        return
    signal.signal(signal.SIGHUP, signal.SIG_IGN)  # from a closed terminal: the parent replaces this worker
    pipe = parent.sentinel

    def end() -> None:
        """Ask this process to shut down, as a signal from outside would."""
        loop.remove_reader(pipe)
        log.error("the process that started this worker has gone: the worker ends too")
        os.kill(os.getpid(), signal.SIGTERM)

    loop.add_reader(pipe, end)
    try:
        yield
    finally:
        loop.remove_reader(pipe)
