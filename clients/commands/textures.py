"""`ridgewave textures [NAME]`: prints the catalogue as a table, or the scene of one texture as JSON with its sources.

The scene goes to standard output and the sources to standard error, so `ridgewave textures NAME > scene.json` writes a
scene.
"""

from __future__ import annotations

import argparse
from itertools import groupby

from clients.command_line.exit_codes import DONE, invalid_request
from clients.command_line.printing import print_json, print_table, say
from synth.scene.catalogue import CatalogueEntry, catalogue, lookup


def run(arguments: argparse.Namespace) -> int:
    """Carry out the command; raises InvalidRequest."""
    if arguments.name is not None:
        entry = lookup(arguments.name)
        if arguments.json:
            print_json(entry.description())
        else:
            _print_entry(entry, everyday=arguments.everyday)
    elif arguments.everyday:
        invalid_request("--everyday", "true", "NAME beside it", "Name a texture; without one, the table is printed.")
    elif arguments.json:
        print_json({"textures": [entry.description() for entry in catalogue()]})
    else:
        _print_catalogue()
    return DONE


def _print_entry(entry: CatalogueEntry, *, everyday: bool) -> None:
    scene = entry.everyday if everyday else entry.document
    print_json(scene)
    say(f"{entry.title} ({entry.group})")
    for field, source in entry.sources.items():
        if field.split(".")[0] in scene:
            say(f"{field}: {source}")
    if entry.note and everyday:
        say(entry.note)


def _print_catalogue() -> None:
    rows: list[tuple[str, str, str] | None] = []
    for group, entries in groupby(catalogue(), lambda entry: entry.group):
        rows += [None] if rows else []
        rows.append((group.upper(), "", ""))
        for entry in entries:
            scan = entry.everyday["scan"]
            rows.append((entry.name, entry.title, f"{scan['speed']}, {scan['load']}"))
    print_table("", ("name", "what it is", "everyday scan"), rows)
