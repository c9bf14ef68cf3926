"""SCENE, `--set` and `--duration`: turns these arguments into a checked scene.

The changes are merged as JSON, and `synth.scene.scene` checks the result. Therefore a fault has the same text here,
over HTTP and in Python.
"""

from __future__ import annotations

import argparse
import io
import sys
from pathlib import Path
from typing import Any, NoReturn

from clients.command_line.exit_codes import invalid_request
from service.store.own_textures import texture_named, with_imported
from synth.errors import Fault, InvalidRequest, shown
from synth.scene.catalogue import catalogue_names
from synth.scene.doubtful_values import bare_doubts
from synth.scene.merge import merge_patch
from synth.scene.scene import LARGEST_BYTES, Scene, document_of, parse_scene
from synth.scene.sound_scene import document_in_sound, is_sound
from synth.scene.text import object_from_text, pointer, value_from_text
from synth.scene.texture_registry import with_files
from synth.voice.hand_log import require_scene


def read_scene(arguments: argparse.Namespace) -> Scene:
    """Return the scene of `arguments` (scene, changes, duration); raises InvalidRequest, OSError."""
    return scene_of(read_document(arguments.scene, everyday=arguments.everyday), arguments)


def scene_of(document: dict[str, object], arguments: argparse.Namespace) -> Scene:
    """Return the scene of `document` with the changes in `arguments`; raises InvalidRequest."""
    require_scene(document)
    changes = list(arguments.changes)
    if arguments.duration is not None:
        changes.append(f"output.duration={arguments.duration}")
    faults: list[Fault] = []
    for change in changes:
        patch = patch_of(change)
        faults += bare_doubts(patch)
        document = merge_patch(document, patch)
    scene = parse_scene(with_imported(with_files(document)))
    if faults:
        raise InvalidRequest(faults)
    return scene


def check_unchanged(arguments: argparse.Namespace, what: str) -> None:
    """Raise InvalidRequest if `arguments` change `what`, which cannot be changed."""
    if arguments.changes:
        invalid_request("--set", arguments.changes[0], f"nothing with {what}", "Render a scene to change one.")
    if arguments.duration is not None:
        invalid_request(
            "--duration", arguments.duration, f"nothing with {what}", f"{what.capitalize()} has its length."
        )


def read_document(name: str, *, everyday: bool = False) -> dict[str, object]:
    """Return the JSON object of SCENE: a JSON or sound file, `-` for standard input, or a texture's name.

    everyday: take the everyday scan of the texture. Raises InvalidRequest if SCENE is not a name.
    """
    if everyday:
        if name not in catalogue_names() and (name == "-" or Path(name).suffix == ".json" or Path(name).exists()):
            invalid_request("--everyday", "true", "a texture's name as SCENE", "`ridgewave textures` lists the names.")
        return dict(texture_named(name).everyday)
    if name == "-":
        given = sys.stdin.buffer.read(LARGEST_BYTES)
        return document_in_sound(io.BytesIO(given), "-") if is_sound(given) else object_from_text(given)
    return document_of(name, lambda known: texture_named(known).document)


def patch_of(change: str) -> dict[str, object]:
    """Return the partial scene of `FIELD=VALUE`: "a.b=1" is {"a": {"b": 1}}; raises InvalidRequest."""
    field, equals, value = change.partition("=")
    names = field.strip().split(".")
    if not equals or not all(names):
        invalid_request("--set", change, "FIELD=VALUE", "Write the field's path with dots, as in texture.period=0.6mm.")
    if any(name.isdigit() for name in names):
        invalid_request("--set", change, "a path of field names", "Set the whole list, as JSON: FIELD=[...].")
    patch: Any = value_of(value, pointer(*names))
    for name in reversed(names):
        patch = {name: patch}
    assert isinstance(patch, dict)
    return patch


def value_of(text: str, at: str = "") -> Any:
    """Return `text` as JSON if it parses (NaN and Infinity do not), otherwise as a string.

    at: pointer of the field. Raises InvalidRequest if the JSON has a field more than once, as in a file.
    """
    try:
        value, faults = value_from_text(text, at, _not_json)
    except ValueError:
        return text.strip()
    except RecursionError:
        invalid_request(
            "--set", shown(text), "a value of a scene", "This is nested too deeply: a scene needs four levels."
        )
    if faults:
        raise InvalidRequest(faults)
    return value


def _not_json(word: str) -> NoReturn:
    raise ValueError(word)
