"""What a scene can be: a `Scene`, a mapping, the path of a JSON file, or a name of the catalogue.

Stage: 1 (SCENE), where Python and the command line come in.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NoReturn

from synth.errors import Fault, SceneError, shown
from synth.scene.catalogue import catalogue_names, lookup
from synth.scene.scene import Scene, object_from_text, parse_scene
from synth.scene.texture_registry import with_files

SceneLike = Scene | Mapping[str, Any] | str | os.PathLike[str]
LARGEST_BYTES = 64 * 2**20  # a day-long trajectory at 10 Hz is 40 MB of text; more is a mistake, such as a WAV file


def scene_from(source: SceneLike) -> Scene:
    """Return the scene that `source` is or names.

    source: a Scene, which is returned as it is; a mapping as in docs/scene.md; the path of a JSON file; or a name of
    the catalogue. A texture's heights may be in a file of this machine. Raises SceneError, which lists every fault;
    OSError where a file cannot be read.
    """
    if isinstance(source, Scene):
        return source
    if isinstance(source, str | os.PathLike):
        source = document_of(source)
    return parse_scene(with_files(source))


def document_of(source: str | os.PathLike[str]) -> dict[str, object]:
    """Return the JSON object of a file, or that of a catalogue name; raises SceneError, OSError.

    A text is a name if the catalogue has it, or if it has no ending, names no folder, and no file is called so.
    """
    path = Path(source)
    looks_like_a_name = path.suffix != ".json" and len(path.parts) == 1 and not path.exists()
    if isinstance(source, str) and (source in catalogue_names() or looks_like_a_name):
        return dict(lookup(source).document)
    return object_from_text(_read(path))


def _read(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            text = file.read(LARGEST_BYTES + 1)
    except FileNotFoundError:
        _refuse(path, "a JSON file that exists", "Check the path.")
    except IsADirectoryError:
        _refuse(path, "a JSON file", "This is a folder; name a file in it.")
    if len(text) > LARGEST_BYTES:
        _refuse(path, f"a JSON file of at most {LARGEST_BYTES} bytes", "Is this a scene?")
    return text


def _refuse(path: Path, allowed: str, hint: str) -> NoReturn:
    raise SceneError([Fault("/scene", shown(str(path)), allowed, hint)])
