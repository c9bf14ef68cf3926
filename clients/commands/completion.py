"""`ridgewave completion SHELL`: prints the script with which a shell completes `ridgewave` with TAB."""

from __future__ import annotations

import argparse

from argcomplete.shell_integration import shellcode

from clients.command_line.exit_codes import DONE
from clients.command_line.printing import print_json


def run(arguments: argparse.Namespace) -> int:
    """Carry out the command."""
    lines = shellcode(["ridgewave"], shell=arguments.shell)
    if arguments.json:
        print_json({"shell": arguments.shell, "lines": lines})
    else:
        print(lines)
    return DONE
