"""`ridgewave serve`: the HTTP service, with settings from RIDGEWAVE_* unless an option says otherwise."""

from __future__ import annotations

import argparse
import os
from pathlib import Path

from clients.outcome import INTERRUPTED, TERMINATED, Terminated
from service.server import run as run_service
from service.settings import read_settings, variable

PAGE = Path(__file__).resolve().parent / "web"


def run(arguments: argparse.Namespace) -> int:
    """Carry out the command until the service is stopped; raises SettingsError, CannotRender."""
    settings = read_settings(host=arguments.host, port=arguments.port, workers=arguments.workers, web=page_folder())
    try:
        return run_service(settings)
    except KeyboardInterrupt:
        return INTERRUPTED  # Ctrl-C is how a service is stopped: the log has said so already
    except Terminated:
        return TERMINATED


def page_folder() -> str | None:
    """Return the folder of the page that comes with ridgewave; None where RIDGEWAVE_WEB names one, or none came."""
    named = os.environ.get(variable("web"), "").strip()
    return None if named or not (PAGE / "index.html").is_file() else str(PAGE)
