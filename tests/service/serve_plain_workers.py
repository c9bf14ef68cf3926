"""`python -m tests.service.serve_plain_workers`: workers with the plain engine, that allow sessions all the same.

A worker process imports this module before it makes its application, so what stands at module level reaches it too.
Sessions of plain HTTP are refused with several workers because a later request may reach another one; a test that keeps
one connection for each session stays with its worker, and so can see what a stop does to the streams of all of them.
A stop and a scrape wait for the other worker as long as a busy machine needs.
"""

from __future__ import annotations

import sys

from fastapi import FastAPI

import service.lifespan
import service.operations.worker_metrics
from service.operations import worker_process
from service.operations.settings_environment import read_settings
from service.server import LIVE_OPTIONS, run
from service.sessions.session_registry import Sessions
from tests.service.harness import PATIENCE
from tests.service.plain_engine import PlainEngine


def app() -> FastAPI:
    """Return the application of one worker."""
    return worker_process.app(PlainEngine())


def _allow(self: Sessions) -> None:
    return


Sessions._refuse_workers = _allow  # type: ignore[method-assign]
service.lifespan.STOP_ANSWER_SECONDS = service.operations.worker_metrics.ANSWER_SECONDS = PATIENCE
LIVE_OPTIONS["timeout_worker_healthcheck"] = round(PATIENCE)  # a worker that starts slowly is not replaced by the next

if __name__ == "__main__":
    sys.exit(run(read_settings(), worker="tests.service.serve_plain_workers:app"))
