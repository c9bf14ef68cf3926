"""What each worker process starts from, when there is more than one: its settings come from the environment."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from fastapi import FastAPI

from service.app import create_app
from service.logs import set_up_log
from service.settings import read_settings
from service.siblings import FOLDER_VARIABLE

if TYPE_CHECKING:
    from service.engine import Engine


def app(engine: Engine | None = None) -> FastAPI:
    """Return the application of this worker; `engine` is `synth` unless a test brings its own."""
    settings = read_settings()
    set_up_log(settings.log_level, settings.log_format)
    folder = os.environ.get(FOLDER_VARIABLE)
    return create_app(settings, engine, siblings=None if folder is None else Path(folder))
