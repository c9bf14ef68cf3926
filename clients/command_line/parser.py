"""The parser of the command line: the program, its commands and `--version`.

The commands are in `command_arguments`. The parsed arguments name the module of the command, which
`clients.command_line` then imports.

Limits: the modules of the parser import nothing of the engine, so that `--help` answers at once.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence
from typing import Any

from clients.command_line.command_arguments import add_commands
from clients.command_line.help_examples import epilog


class _Version(argparse.Action):
    """Prints the version. Reading the metadata of the package is slow, so only this option does it."""

    def __call__(self, parser: argparse.ArgumentParser, *_rest: Any) -> None:
        from importlib.metadata import PackageNotFoundError, version

        try:
            number = version("ridgewave")
        except PackageNotFoundError:
            number = "(a checkout that is not installed)"
        print(f"ridgewave {number}")
        parser.exit()


def build_parser() -> argparse.ArgumentParser:
    """Return the parser; `command_module` of the parsed arguments is the module of the command."""
    parser = argparse.ArgumentParser(
        prog="ridgewave",
        description="The vibration that a finger feels on a texture: as a file, a stream, or on an audio device.",
        epilog=epilog(""),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.set_defaults(command_module=None)
    parser.add_argument("--version", action=_Version, nargs=0, help="print the version and exit")
    add_commands(parser.add_subparsers(title="commands", metavar="COMMAND"))
    return parser


def parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    """Parse `arguments` (None: those of this process). Invalid arguments end the process with 2.

    Without arguments this prints the help and ends the process with 0.
    """
    parser = build_parser()
    if "_ARGCOMPLETE" in os.environ:  # set by the shell when TAB is pressed
        from clients.command_line.tab_completion import complete

        complete(parser)
    parsed = parser.parse_args(arguments)
    if parsed.command_module is None:
        parser.print_help()
        parser.exit()
    return parsed
