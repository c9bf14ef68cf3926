"""`python -m tests.service.serve_zeros`: the service, on any number of workers, with an engine that sends zeros."""

from __future__ import annotations

import sys

from fastapi import FastAPI

from service.operations import worker_process
from service.operations.settings_environment import read_settings
from service.server import run
from tests.service.zero_engine import ZeroEngine


def app() -> FastAPI:
    """Return the application of one worker."""
    return worker_process.app(ZeroEngine())


if __name__ == "__main__":
    sys.exit(run(read_settings(), ZeroEngine(), worker="tests.service.serve_zeros:app"))
