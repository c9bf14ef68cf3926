"""SCENE, `--set` and `--duration`: the words of a command line into one checked scene.

Stage: request -> SCENE. The file is read and the changes are merged as JSON; `synth.scene` does all the checking, so a
field is refused in the same words here, over HTTP and in Python.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any, NoReturn

from clients.outcome import asked_wrong
from synth.scene import Scene, merge_patch, object_from_text, parse_scene
from synth.textures import catalogue_names, lookup

LARGEST_BYTES = 64 * 2**20  # a day-long trajectory at 10 Hz is 40 MB of text; more is a mistake, such as a WAV file


def read_scene(arguments: argparse.Namespace) -> Scene:
    """Return the scene that `arguments` (scene, changes, duration) ask for; raises AskedWrong, OSError."""
    return scene_of(read_document(arguments.scene), arguments)


def scene_of(document: dict[str, object], arguments: argparse.Namespace) -> Scene:
    """Return the scene of `document` with the changes that `arguments` ask for; raises AskedWrong."""
    changes = list(arguments.changes)
    if arguments.duration is not None:
        changes.append(f"output.duration={arguments.duration}")
    for change in changes:
        document = merge_patch(document, patch_of(change))
    return parse_scene(document)


def unchanged(arguments: argparse.Namespace, what: str) -> None:
    """Raise AskedWrong where `arguments` would change what can only be taken as it is."""
    if arguments.changes:
        asked_wrong("--set", arguments.changes[0], f"nothing with {what}", "Render a scene to change one.")
    if arguments.duration is not None:
        asked_wrong("--duration", arguments.duration, f"nothing with {what}", f"{what.capitalize()} has its length.")


def read_document(name: str) -> dict[str, object]:
    """Return the JSON object that SCENE names: a file, standard input for `-`, or an entry of the catalogue."""
    if name == "-":
        return object_from_text(sys.stdin.buffer.read(LARGEST_BYTES))
    path = Path(name)
    if name in catalogue_names() or (path.suffix != ".json" and len(path.parts) == 1 and not path.exists()):
        return dict(lookup(name).document)
    return object_from_text(_read_file(path))


def patch_of(change: str) -> dict[str, object]:
    """Return the partial scene that `FIELD=VALUE` stands for: "a.b=1" is {"a": {"b": 1}}; raises AskedWrong."""
    field, equals, value = change.partition("=")
    names = field.strip().split(".")
    if not equals or not all(names):
        asked_wrong("--set", change, "FIELD=VALUE", "Write the field's path with dots, as in texture.period=0.6mm.")
    if any(name.isdigit() for name in names):
        asked_wrong("--set", change, "a path of field names", "A list is set as a whole, as JSON: FIELD=[...].")
    patch: Any = value_of(value)
    for name in reversed(names):
        patch = {name: patch}
    assert isinstance(patch, dict)
    return patch


def value_of(text: str) -> Any:
    """Return `text` as JSON where it parses strictly (so NaN and Infinity do not), else as the string it is."""
    try:
        return json.loads(text, parse_constant=_not_json)
    except ValueError:
        return text.strip()


def _not_json(word: str) -> NoReturn:
    raise ValueError(word)


def _read_file(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            text = file.read(LARGEST_BYTES + 1)
    except FileNotFoundError:
        asked_wrong("SCENE", str(path), "a JSON file that exists", "Check the path.")
    except IsADirectoryError:
        asked_wrong("SCENE", str(path), "a JSON file", "This is a folder; name a file in it.")
    if len(text) > LARGEST_BYTES:
        asked_wrong("SCENE", str(path), f"a JSON file of at most {LARGEST_BYTES} bytes", "Is this a scene?")
    return text
