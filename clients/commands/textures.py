"""`ridgewave textures [NAME]`: prints the catalogue as a table, or the scene of one texture as JSON."""

from __future__ import annotations

import argparse
from dataclasses import asdict

from clients.command_line.exit_codes import DONE
from clients.command_line.printing import print_json, print_table
from synth.scene.catalogue import catalogue, lookup


def run(arguments: argparse.Namespace) -> int:
    """Carry out the command; raises InvalidRequest."""
    if arguments.name is not None:
        print_json(lookup(arguments.name).document)
    elif arguments.json:
        print_json({"textures": [asdict(entry) for entry in catalogue()]})
    else:
        rows = [(entry.name, entry.title, entry.source) for entry in catalogue()]
        print_table("", ("name", "what it is", "source"), rows)
    return DONE
