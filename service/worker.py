"""What each worker process starts from, when there is more than one: its settings come from the environment."""

from __future__ import annotations

import os
from pathlib import Path

from fastapi import FastAPI

from service.app import create_app
from service.logs import set_up_log
from service.settings import read_settings
from service.siblings import FOLDER_VARIABLE


def app() -> FastAPI:
    """Return the application of this worker."""
    settings = read_settings()
    set_up_log(settings.log_level, settings.log_format)
    folder = os.environ.get(FOLDER_VARIABLE)
    return create_app(settings, siblings=None if folder is None else Path(folder))
