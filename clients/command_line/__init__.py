"""The program `ridgewave`: parses the command line and runs one command.

Each command is a module of `clients.commands` with one function `run(arguments) -> int`. Only the module of the
requested command is imported.
"""

from __future__ import annotations

import gc
from collections.abc import Sequence

from clients.command_line.exit_codes import carry_out, discard_unread_output
from clients.command_line.parser import parse
from clients.command_line.printing import open_closed_streams, print_every_character


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return the exit code (see `exit_codes`).

    arguments: the words after the program's name; None: those of this process.
    """
    open_closed_streams()
    print_every_character()
    try:
        parsed = parse(arguments)
    finally:
        discard_unread_output()
    from importlib import import_module

    from synth.linear_algebra import use_one_thread

    def command() -> int:
        use_one_thread()
        gc.disable()  # while modules are loaded, whose objects stay: to look through them takes a tenth of a render
        try:
            run = import_module(parsed.command_module).run
        finally:
            gc.freeze()
            gc.enable()
        code: int = run(parsed)
        return code

    return carry_out(command, as_json=parsed.json)
