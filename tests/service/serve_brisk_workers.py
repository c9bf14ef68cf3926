"""`python -m tests.service.serve_brisk_workers`: plain workers that wait for one that hangs as briefly as in use."""

from __future__ import annotations

import sys

import service.lifespan
import service.operations.worker_metrics

BRISK = service.lifespan.STOP_ANSWER_SECONDS, service.operations.worker_metrics.ANSWER_SECONDS

from service.operations.settings_environment import read_settings  # noqa: E402
from service.server import run  # noqa: E402
from tests.service.serve_plain_workers import app  # noqa: E402

__all__ = ["app"]
service.lifespan.STOP_ANSWER_SECONDS, service.operations.worker_metrics.ANSWER_SECONDS = BRISK

if __name__ == "__main__":
    sys.exit(run(read_settings(), worker="tests.service.serve_brisk_workers:app"))
