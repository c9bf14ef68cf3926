"""What each worker process starts from, when there is more than one: its settings come from the environment."""

from __future__ import annotations

from fastapi import FastAPI

from service.app import create_app
from service.server import set_up_log
from service.settings import read_settings


def app() -> FastAPI:
    """Return the application of this worker."""
    settings = read_settings()
    set_up_log(settings.log_level)
    return create_app(settings)
