"""Completion with TAB: commands, options, files, textures, and fields of a scene.

The script of `ridgewave completion` makes the shell run `ridgewave` with _ARGCOMPLETE set. argcomplete reads the
grammar of `parser` and takes values from this module. Nothing else of the program runs.

Limits: a field is completed up to its `=`, not its value.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import argcomplete
from argcomplete.completers import FilesCompleter


def complete(parser: argparse.ArgumentParser) -> None:
    """Print the completions of the words typed so far, and end the process."""
    for command in _commands(parser):
        for action in command._actions:
            completer = _COMPLETERS.get(action.dest)
            if completer is not None:
                action.completer = completer  # type: ignore[attr-defined]
    argcomplete.autocomplete(parser)


def scenes(prefix: str, **rest: Any) -> list[str]:
    """Return the textures and the JSON files that begin with `prefix`."""
    files: list[str] = FilesCompleter(("json",))(prefix, **rest)
    return [*textures(prefix), *files]


def textures(prefix: str, **_rest: Any) -> list[str]:
    """Return the textures of the catalogue, and those imported on this machine, that begin with `prefix`."""
    from service.store.own_textures import own_store
    from synth.errors import CannotRender
    from synth.scene.catalogue import catalogue_names

    names = [*catalogue_names()]
    with suppress(CannotRender):  # a store that cannot be read: the command itself reports it
        names += [texture.name for texture in own_store().textures("")]
    return [name for name in names if name.startswith(prefix)]


def fields(prefix: str, **_rest: Any) -> list[str]:
    """Return the fields of a scene, each with its "="; none after "=" was typed."""
    from synth.scene.effects_section import effect_names
    from synth.scene.scene import scene_fields

    if "=" in prefix:
        return []
    paths = [line.path for line in scene_fields() if "[]" not in line.path]
    return [f"{path}=" for path in (*paths, *(f"effects.{name}" for name in effect_names()))]


def quantities(prefix: str, **_rest: Any) -> list[str]:
    """Return the quantities of a channel that begin with `prefix`."""
    return [name for name in ("displacement", "velocity", "acceleration") if name.startswith(prefix)]


_COMPLETERS = {"scene": scenes, "name": textures, "changes": fields, "quantity": quantities}


def _commands(parser: argparse.ArgumentParser) -> Iterator[argparse.ArgumentParser]:
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            yield from action.choices.values()
