"""`ridgewave textures [NAME]`: lists the textures, prints the scene of one with its sources, or exports or changes one.
With --prepare it makes their tables.

The scene goes to standard output and the sources to standard error, so `ridgewave textures NAME > scene.json` writes a
scene.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path

from clients.command_line.exit_codes import DONE, invalid_request
from clients.command_line.printing import print_json, print_table, say
from clients.command_line.progress import Progress
from service.store.data_folder import VARIABLE, folder_of_environment, tables_folder
from service.store.own_textures import own_store, texture_named
from service.store.stored_texture import GROUP, StoredTexture
from synth.encode.part_file import write_whole
from synth.errors import CannotRender, RidgewaveError
from synth.scene.catalogue import CatalogueEntry, catalogue


def run(arguments: argparse.Namespace) -> int:
    """Carry out the command; raises InvalidRequest, CannotRender, OSError."""
    if arguments.prepare:
        _prepare([texture_named(arguments.name)] if arguments.name else None, arguments.progress)
    elif arguments.export or arguments.rename or arguments.delete:
        _change(arguments)
    elif arguments.name is not None:
        entry = texture_named(arguments.name)
        if arguments.json:
            print_json(entry.description())
        else:
            _print_entry(entry, everyday=arguments.everyday)
    elif arguments.everyday:
        invalid_request("--everyday", "true", "NAME beside it", "Name a texture; without one, the table is printed.")
    elif arguments.json:
        documents = [entry.description() | {"stored": False} for entry in catalogue()]
        documents += [texture.description() | {"stored": True} for texture in own_store().textures("")]
        print_json({"textures": documents})
    else:
        _print_catalogue()
    return DONE


def _print_entry(entry: CatalogueEntry | StoredTexture, *, everyday: bool) -> None:
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
        rows += map(_row, entries)
    imported = own_store().textures("")
    if imported:
        rows += [None, (GROUP.upper(), "", ""), *map(_row, imported)]
    print_table("", ("name", "what it is", "everyday scan"), rows)


def _row(entry: CatalogueEntry | StoredTexture) -> tuple[str, str, str]:
    scan = entry.everyday["scan"]
    return entry.name, entry.title, f"{scan['speed']}, {scan['load']}"


def _prepare(entries: Sequence[CatalogueEntry | StoredTexture] | None, progress: bool | None) -> None:
    """Make the tables of `entries`, None for all, under the finger with which the page begins."""
    from service.compute.texture_preparation import solve_ahead
    from synth.surfaces.surface_data import add_source

    add_source(own_store().surface)
    every: list[CatalogueEntry | StoredTexture] = [*catalogue(), *own_store().textures("")]
    chosen = every if entries is None else entries
    folder = folder_of_environment()
    _check_writable(tables_folder(folder))
    with Progress("making tables", len(chosen), "textures", progress) as bar:
        for entry in chosen:
            try:
                solve_ahead(entry.document, folder)
            except RidgewaveError as error:
                say(f"{entry.name}: {error}")
            bar.advance(1)
    say(f"{tables_folder(folder)} has what was solved for {len(chosen)} textures.")


def _check_writable(folder: Path) -> None:
    """Raise CannotRender if nothing can be kept in `folder`, before minutes of work."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError as error:
        raise CannotRender(f"cannot write {folder}. Set {VARIABLE} to a folder that can be written.") from error


def _change(arguments: argparse.Namespace) -> None:
    store = own_store()
    texture = None if arguments.name is None else store.find("", arguments.name)
    if texture is None:
        known = ", ".join(found.name for found in store.textures(""))[:200] or "none so far"
        allowed = f"the name of an imported texture: {known}"
        invalid_request("name", arguments.name, allowed, "See `ridgewave textures`.")
    if arguments.rename:
        store.rename("", texture.name, arguments.rename)
        say(f"{texture.name} is now {arguments.rename}")
    elif arguments.delete:
        store.delete("", texture.name)
        say(f"{texture.name} is deleted")
    else:
        from synth.surfaces.measurement.exporting import exported, format_of_ending

        path = Path(arguments.export)
        content = exported(store.surface(texture.address), format_of_ending(path))
        write_whole(path, content)
        say(f"{path}: {len(content)} bytes")
