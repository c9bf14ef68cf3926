"""The catalogue: named textures, each number with its source, and the scan in which a person feels them.

Model   A group is a TOML file in the folder `textures` beside this file. Its first key `group` is the title, and each
        table is an entry. To add an entry or a group, write it there. An entry has a title, a kind and the fields of
        its texture. It also has speed and load if its everyday scan differs from EVERYDAY, and a table for each effect
        of this scan, such as friction. Each number is a pair [value, source]. The first words of a source state how far
        to trust it (TRUST).
        A name means its texture alone, in a scene as the value of `texture.kind` and on the command line in place of a
        file. NAME-area is the surface of the entry NAME with heights that vary across the scan too. The line NAME is
        solved ten times as fast, and has a series of harmonics, which `analyze` and `study` need.
        `CatalogueEntry.everyday` is a whole scene: a fingertip that scans the texture as EVERYDAY.
Source  EVERYDAY is the scan of the default scene. People scan textures at 10 to 160 mm/s in the experiments of
        Greenspon et al. 2019 (doi 10.1101/680322), and Fagiani & Barbieri 2016, section 2, find 0.05 to 1.8 N useful.
Limits  No height was measured by this project. Textures of the kinds sinusoid, harmonics, grating and rough vary along
        the scan only: grains and fibres side by side have equal heights. Such a surface vibrates more here than a real
        one of the same heights.
"""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from synth.errors import Fault, SceneError, shown

TRUST: Mapping[str, str] = {
    "read": "read in the source that is named, often only in its abstract",
    "computed": "follows from other numbers, which are named",
    "usual": "general knowledge; not checked against a source",
    "unverified default": "chosen for this catalogue",
}
"""How far to trust a number, by the first words of its source."""

EVERYDAY: Mapping[str, tuple[str, str]] = {
    "speed": ("80 mm/s", "unverified default: the scan of the default scene"),
    "load": ("0.3 N", "unverified default: the scan of the default scene"),
}
"""Speed and load of an entry that does not state them."""

FINGER = {"kind": "fingertip"}
FOLDER = Path(__file__).with_name("textures")


@dataclass(frozen=True, slots=True)
class CatalogueEntry:
    """A named texture.

    name: the name that a scene or the command line writes.
    title: one line for a list of textures.
    group: title of its group.
    document: a partial scene with the texture section.
    everyday: a scene in which a fingertip scans the texture, with the friction of a surface that is felt by it.
    sources: source of each number, by its field of `everyday`, such as "texture.period".
    note: what a person who feels the texture should know; "" for most.
    """

    name: str
    title: str
    group: str
    document: dict[str, dict[str, Any]]
    everyday: dict[str, dict[str, Any]]
    sources: dict[str, str]
    note: str = ""

    def description(self) -> dict[str, Any]:
        """Return the entry as a JSON document; `scene` is the partial scene."""
        scene = self.everyday
        numbers = {}
        for field, source in self.sources.items():
            value: Any = scene
            for name in field.split("."):
                value = value[name]
            numbers[field] = {"value": value, "source": source}
        return {
            "name": self.name,
            "title": self.title,
            "group": self.group,
            "note": self.note,
            "scene": self.document,
            "everyday": scene,
            "numbers": numbers,
        }


def catalogue() -> tuple[CatalogueEntry, ...]:
    """Return every entry, group by group. Each call returns new documents, which a caller may change."""
    return deepcopy(_entries())


def catalogue_names() -> tuple[str, ...]:
    """Return the name of every entry, group by group."""
    return tuple(entry.name for entry in _entries())


def catalogue_kinds() -> dict[str, str]:
    """Return the kind of texture of every entry, by its name."""
    return {entry.name: entry.document["texture"]["kind"] for entry in _entries()}


def lookup(name: str, others: Sequence[str] = ()) -> CatalogueEntry:
    """Return the entry called `name`. If there is none, raise SceneError with the nearest name.

    others: further known names, among which the error also looks for the nearest.
    """
    for entry in _entries():
        if entry.name == name:
            return deepcopy(entry)
    near = difflib.get_close_matches(name[:64], [*catalogue_names(), *others], n=1, cutoff=0.0)
    allowed = f"one of the {len(catalogue_names())} names of the catalogue"
    allowed += ", or the name of an imported texture" if others else ""
    raise SceneError([Fault("/name", shown(name), allowed, f'The nearest name is "{near[0]}".')])


@cache
def _entries() -> tuple[CatalogueEntry, ...]:
    found: list[CatalogueEntry] = []
    for file in sorted(FOLDER.glob("*.toml")):
        entries = tomllib.loads(file.read_text("utf-8"))
        group = entries.pop("group")
        found += [_entry(name, group, written) for name, written in entries.items()]
    return tuple(found)


def _entry(name: str, group: str, written: dict[str, Any]) -> CatalogueEntry:
    title, kind, note = written.pop("title"), written.pop("kind"), written.pop("note", "")
    scan = {field: written.pop(field, default) for field, default in EVERYDAY.items()}
    effects = {field: written.pop(field) for field in list(written) if isinstance(written[field], dict)}
    texture = {"kind": kind, **{field: value for field, (value, _) in written.items()}}
    sources = {f"texture.{field}": source for field, (_, source) in written.items()}
    sources |= {f"scan.{field}": source for field, (_, source) in scan.items()}
    everyday: dict[str, dict[str, Any]] = {
        "finger": dict(FINGER),
        "texture": deepcopy(texture),
        "scan": {field: value for field, (value, _) in scan.items()},
    }
    for effect, numbers in effects.items():
        everyday.setdefault("effects", {})[effect] = {field: value for field, (value, _) in numbers.items()}
        sources |= {f"effects.{effect}.{field}": source for field, (_, source) in numbers.items()}
    return CatalogueEntry(name, title, group, {"texture": texture}, everyday, sources, note)
