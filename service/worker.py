"""What each worker process starts from, when there is more than one: its settings come from the environment."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fastapi import FastAPI

from service.app import create_app
from service.server import set_up_log
from service.settings import read_settings

if TYPE_CHECKING:
    from service.engine import Engine


def app(engine: Engine | None = None) -> FastAPI:
    """Return the application of this worker; `engine` is `synth` unless a test brings its own."""
    settings = read_settings()
    set_up_log(settings.log_level)
    return create_app(settings, engine)
