"""The registry of texture kinds: their names and declarations.

Stage   1 (SCENE): a scene names a kind and sets its fields. A later stage makes the heights (`surfaces`).
Model   A kind is a file of `synth/surfaces` with a declaration KIND, which contains the kind's name and fields. The
        registry finds these files. To add a kind, add a file there; nothing else has to change.
Limits  Kinds can share the name of a field only if they share its rule. These are the fields in SHARED, and those that
        the section of a kind inherits from that of another.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from dataclasses import field as dataclass_field
from functools import cache
from importlib import import_module
from itertools import chain
from pkgutil import iter_modules
from typing import Any

from synth.scene.quantity import Dimension
from synth.scene.rules import Fields, Quantity, Refusal
from synth.scene.section import Section

FOLDER = "synth.surfaces"
DEFAULT = "sinusoid"

SPACING, USUAL_SPACING = Quantity(Dimension.LENGTH, 1e-9, 0.1, usual=1e-3), 10e-6
"""Rule and default (m) of the field `spacing`."""


SHARED = ("period", "period_across", "amplitude", "roughness", "spacing", "surface", "ends")
"""Fields that several kinds share. `texture_section` declares them, and also phase and the moduli, which every kind
has."""


STEEPEST = 20.0
"""Largest slope of a surface (87 degrees). A steeper wall is a mistake, or a step, which the points of a period cannot
represent."""


@dataclass(frozen=True, slots=True)
class Kind:
    """What a scene needs to know about a kind of texture.

    name: value of `texture.kind`.
    fields: section with the fields that only this kind has.
    make: returns the profile of valid values, which it gets by name. A field that is not given has its default.
    shared: the fields of SHARED that the kind has; `amplitude` is that of one cosine, not a height of another kind.
    defaults: defaults of shared fields that differ from the usual ones.
    steep: field that is refused if the surface is too steep or too high, or "" if every surface is allowed.
    refusals: returns the refusals of combinations of valid fields, from the values as read and the fields as written.
    pairs: pairs of fields that write one value in two ways. Only one may be given; it displaces the other.
    local: returns the fields with the contents of a file of this machine in place of its path. Raises SceneError.
    written: returns the fields as a document has them, from the document and the values.
    of_area: whether the heights vary across the scan too.
    """

    name: str
    fields: type[Section]
    make: Callable[[Mapping[str, Any]], Any]
    shared: tuple[str, ...] = ("period",)
    defaults: Mapping[str, Any] = dataclass_field(default_factory=dict)
    steep: str = "amplitude"
    refusals: Callable[[Mapping[str, Any], Fields], list[Refusal]] = lambda _values, _given: []
    pairs: tuple[tuple[str, str], ...] = ()
    local: Callable[[Mapping[str, Any]], dict[str, Any]] = dict
    written: Callable[[Mapping[str, Any], Mapping[str, Any]], dict[str, Any]] = lambda fields, _values: dict(fields)
    of_area: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """The names of this kind's fields, without those that every kind has."""
        return (*self.shared, *self.fields.model_fields)


@cache
def kinds() -> Mapping[str, Kind]:
    """Return the declaration of each kind by its name: the sinusoid first, the others in alphabetical order."""
    modules = (import_module(f"{FOLDER}.{module.name}") for module in iter_modules(import_module(FOLDER).__path__))
    found: list[Kind] = [module.KIND for module in modules if hasattr(module, "KIND")]
    return {kind.name: kind for kind in sorted(found, key=lambda kind: (kind.name != DEFAULT, kind.name))}


def default_textures() -> list[dict[str, dict[str, Any]]]:
    """Return the default texture of each kind as a partial scene. Kinds of measured surfaces have none."""
    return [{"texture": {"kind": name}} for name, kind in kinds().items() if "surface" not in kind.shared]


@cache
def special_fields() -> tuple[str, ...]:
    """Return the names of all fields that some kinds do not have."""
    return tuple(dict.fromkeys(chain(SHARED, *(kind.fields.model_fields for kind in kinds().values()))))


def kinds_with(name: str) -> tuple[str, ...]:
    """Return the kinds that have the field `name`."""
    return tuple(kind.name for kind in kinds().values() if name in kind.names)


def with_files(document: Any) -> Any:
    """Return the `document` of a scene with the contents of files of this machine in place of their paths.

    Use it only for callers that may read any file of this machine: the command line and Python.
    Raises SceneError, OSError.
    """
    texture = document.get("texture") if isinstance(document, Mapping) else None
    kind = texture.get("kind") if isinstance(texture, Mapping) else None
    if not isinstance(texture, Mapping) or not isinstance(kind, str) or kind not in kinds():
        return document
    return {**document, "texture": kinds()[kind].local(texture)}


def alternatives(name: str) -> set[str]:
    """Return the fields of a texture that a change of field `name` displaces."""
    pairs = chain(*(kind.pairs for kind in kinds().values()))
    return {other for pair in pairs if name in pair for other in pair}
