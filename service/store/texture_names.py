"""Names of stored textures: what is allowed, and names for files."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import count
from pathlib import Path

from synth.errors import Fault, InvalidRequest, shown
from synth.scene.catalogue import catalogue_names

NAME = re.compile(r"[a-z0-9][a-z0-9-]{0,63}")
ALLOWED_NAME = "1 to 64 small letters, digits and -, beginning with a letter or digit"


def check_name(name: str) -> None:
    """Raise InvalidRequest for a name that a stored texture may not have."""
    if not NAME.fullmatch(name):
        raise InvalidRequest([Fault("/name", shown(name), ALLOWED_NAME, "Write a name such as my-cloth.")])
    if is_built_in(name):
        allowed = "a name that is no kind of texture and not in the catalogue"
        raise InvalidRequest([Fault("/name", shown(name), allowed, f"Write another, such as my-{name}.")])


def numbered(name: str) -> Iterator[str]:
    """Yield `name`, then the same with -2, -3 and so on; no name that is built in."""
    yield name
    for number in count(2):
        made = f"{name[:50]}-{number}"
        if not is_built_in(made):
            yield made


def name_from_file(file: str) -> str:
    """Return a name for the texture in `file`, made of its letters and digits."""
    words = re.findall(r"[a-z0-9]+", Path(file).stem.lower())
    name = "-".join(words)[:64].strip("-") or "texture"
    return f"my-{name}"[:64] if is_built_in(name) else name


def is_built_in(name: str) -> bool:
    """Return whether `name` is a kind of texture or in the catalogue."""
    from synth.scene.texture_registry import kinds

    return name in kinds() or name in catalogue_names()
