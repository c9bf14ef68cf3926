"""`python -m tests.service.faults.serve_inspected`: the service, with a route that reports its resources.

Model: `GET /inspected` counts tasks, file descriptors and live sessions, resumable ones included. It reports the
    resident memory after a full garbage collection and `malloc_trim`, where the C library has it. Peers are pinged five
    times as often as usual, so that a dead one is found within 2 s.
"""

from __future__ import annotations

import asyncio
import ctypes
import gc
import os
import sys
from pathlib import Path

from fastapi import FastAPI
from starlette.requests import Request
from starlette.responses import JSONResponse

from service import app as app_module
from service import server
from service.__main__ import main
from service.engine import Engine
from service.operations.settings import Settings
from tests.bench.process_use import open_files, resident_bytes

PATH = "/inspected"


async def inspected(request: Request) -> JSONResponse:
    """Answer with what is held now."""
    gc.collect()
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)
    names = sorted(getattr(task.get_coro(), "__qualname__", "?") for task in asyncio.all_tasks())
    own = os.getpid()
    held = {"tasks": names, "files": open_files(own), "sessions": len(request.app.state.service.sessions)}
    return JSONResponse(held | {"resident_bytes": resident_bytes(own)})


def inspectable() -> None:
    """Have `create_app` make applications that have the route."""
    made = app_module.create_app

    def create_app(settings: Settings, engine: Engine | None = None, workers_folder: Path | None = None) -> FastAPI:
        app = made(settings, engine, workers_folder)
        app.add_api_route(PATH, inspected, include_in_schema=False)
        return app

    app_module.create_app = create_app


if __name__ == "__main__":
    inspectable()
    server.LIVE_OPTIONS["ws_ping_interval"] = 1.0
    sys.exit(main())
