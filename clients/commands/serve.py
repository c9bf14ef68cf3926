"""`ridgewave serve`: runs the HTTP service. The options override the environment variables RIDGEWAVE_*."""

from __future__ import annotations

import argparse

from clients.command_line.exit_codes import INTERRUPTED, TERMINATED, Terminated
from service.http.page_files import shipped_page
from service.operations.settings import read_settings
from service.server import run as run_service


def run(arguments: argparse.Namespace) -> int:
    """Carry out the command until the service is stopped; raises SettingsError, CannotRender."""
    settings = read_settings(host=arguments.host, port=arguments.port, workers=arguments.workers, web=shipped_page())
    try:
        return run_service(settings)
    except KeyboardInterrupt:
        return INTERRUPTED  # the usual way to stop a service; the log reports it
    except Terminated:
        return TERMINATED
