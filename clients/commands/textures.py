"""`ridgewave textures [NAME]`: lists the catalogue and the imported textures, or prints, exports or changes one."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from pathlib import Path

from clients.command_line.exit_codes import DONE, invalid_request
from clients.command_line.printing import print_json, print_table, say
from service.store.own_textures import own_store
from service.store.store import StoredTexture
from synth.encode.part_file import write_whole
from synth.scene.catalogue import catalogue, lookup


def run(arguments: argparse.Namespace) -> int:
    """Carry out the command; raises InvalidRequest, CannotRender, OSError."""
    if arguments.export or arguments.rename or arguments.delete:
        _change(arguments, _imported(arguments.name))
    elif arguments.name is not None:
        found = own_store().find("", arguments.name)
        print_json(lookup(arguments.name).document if found is None else {"texture": found.texture})
    elif arguments.json:
        documents = [asdict(entry) | {"stored": False} for entry in catalogue()]
        print_json({"textures": documents + [texture.document() for texture in own_store().textures("")]})
    else:
        rows = [(entry.name, entry.title, entry.source) for entry in catalogue()]
        rows += [(one["name"], one["title"], one["source"]) for one in _imported_documents()]
        print_table("", ("name", "what it is", "source"), rows)
    return DONE


def _imported_documents() -> list[dict[str, str]]:
    return [texture.document() for texture in own_store().textures("")]


def _imported(name: str | None) -> StoredTexture:
    """Return the imported texture `name`; raises InvalidRequest if there is none."""
    found = None if name is None else own_store().find("", name)
    if found is None:
        known = ", ".join(texture.name for texture in own_store().textures(""))[:200] or "none so far"
        invalid_request("name", name, f"the name of an imported texture: {known}", "See `ridgewave textures`.")
    return found


def _change(arguments: argparse.Namespace, texture: StoredTexture) -> None:
    store = own_store()
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
