"""`ridgewave serve`: runs the HTTP service. The options override the environment variables RIDGEWAVE_*."""

from __future__ import annotations

import argparse
from dataclasses import replace

from clients.command_line.exit_codes import INTERRUPTED, TERMINATED, Terminated
from service.http.page_files import shipped_page
from service.operations.settings import default_text, setting_fields, variable
from service.operations.settings_environment import SettingsError, read_settings
from service.server import run as run_service
from synth.errors import Fault


def run(arguments: argparse.Namespace) -> int:
    """Carry out the command until the service is stopped; raises SettingsError, CannotRender."""
    given = {"host": arguments.host, "port": arguments.port, "uds": arguments.uds, "workers": arguments.workers}
    try:
        settings = read_settings(web=shipped_page(), **given)
    except SettingsError as error:
        options = {variable(name) for name, value in given.items() if value is not None}
        raise SettingsError([_of_option(one) if one.pointer in options else one for one in error.faults]) from None
    try:
        return run_service(settings)
    except KeyboardInterrupt:
        return INTERRUPTED  # the usual way to stop a service; the log reports it
    except Terminated:
        return TERMINATED


def _of_option(fault: Fault) -> Fault:
    """Return the fault of a setting that was given as an option."""
    entry = next(one for one in setting_fields() if variable(one.name) == fault.pointer)
    return replace(fault, pointer=f"--{entry.name}", hint=f"Leave it out for {default_text(entry)}.")
