"""The registry of texture kinds: what there is, by name, and the declaration of each.

Stage   1 (SCENE): a scene names a kind and sets its fields. The heights are made by a later stage (`surfaces`).
Model   A kind is one file of `synth/surfaces`, which holds its declaration as KIND, and one row of KINDS here. The
        scene asks the declaration for the kind's fields; nothing else has to change.
Limits  kinds may share a field's name only where they share its rule: the fields in SHARED.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from dataclasses import field as dataclass_field
from functools import cache
from importlib import import_module
from itertools import chain
from types import MappingProxyType
from typing import Any

from synth.scene.rules import Fields, Refusal
from synth.scene.section import Section

KINDS: Mapping[str, str] = MappingProxyType(
    {
        "sinusoid": "synth.surfaces.sinusoid",
        "harmonics": "synth.surfaces.harmonics",
        "grating": "synth.surfaces.grating",
        "rough": "synth.surfaces.rough",
        "profile": "synth.surfaces.measured",
    }
)
"""The module of each kind that `texture.kind` takes."""

SHARED = ("period", "amplitude", "roughness")
"""Fields of several kinds; `surface_sections` declares them. Every kind has phase and the moduli too."""


STEEPEST = 20.0
"""Largest slope of a surface, 87 degrees: a steeper wall is a step, which a period's points cannot hold, or a slip."""


@dataclass(frozen=True, slots=True)
class Kind:
    """What a scene needs to know of a kind of texture.

    fields: the section of its own fields. make: the profile of values that are in order, by name; a field that is not
    given has its default. shared: those of SHARED that it has. defaults: of shared fields, where they differ. steep:
    the field to which a surface that is too steep or too high is told; "": it may be. refusals: what is wrong between
    fields that are each in order, of the values as read and the fields as written. pairs: two ways to write the same,
    of which one may be given and displaces the other. local: the fields with those in place that a file of this machine
    holds; raises SceneError. written: the fields as a document holds them, of the document and the
    values.
    """

    fields: type[Section]
    make: Callable[[Mapping[str, Any]], Any]
    shared: tuple[str, ...] = ("period",)
    defaults: Mapping[str, Any] = dataclass_field(default_factory=dict)
    steep: str = "amplitude"
    refusals: Callable[[Mapping[str, Any], Fields], list[Refusal]] = lambda _values, _given: []
    pairs: tuple[tuple[str, str], ...] = ()
    local: Callable[[Mapping[str, Any]], dict[str, Any]] = dict
    written: Callable[[Mapping[str, Any], Mapping[str, Any]], dict[str, Any]] = lambda fields, _values: dict(fields)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the fields that only some kinds have and that this one has."""
        return (*self.shared, *self.fields.model_fields)


@cache
def kind_of(name: str) -> Kind:
    """Return the declaration of the kind called `name`, one of KINDS."""
    declared: Kind = import_module(KINDS[name]).KIND
    return declared


@cache
def special_fields() -> tuple[str, ...]:
    """Return the names of all fields that only some kinds have."""
    return tuple(dict.fromkeys(chain(SHARED, *(kind_of(name).fields.model_fields for name in KINDS))))


def kinds_with(name: str) -> tuple[str, ...]:
    """Return the kinds that have the field `name`."""
    return tuple(kind for kind in KINDS if name in kind_of(kind).names)


def with_files(document: Any) -> Any:
    """Return the `document` of a scene with what files of this machine hold in place of their paths.

    Only for who may read any file of this machine: the command line and Python. Raises SceneError, OSError.
    """
    texture = document.get("texture") if isinstance(document, Mapping) else None
    kind = texture.get("kind") if isinstance(texture, Mapping) else None
    if not isinstance(texture, Mapping) or not isinstance(kind, str) or kind not in KINDS:
        return document
    return {**document, "texture": kind_of(kind).local(texture)}


def alternatives(name: str) -> set[str]:
    """Return the fields of a texture that a change of field `name` displaces."""
    pairs = chain(*(kind_of(kind).pairs for kind in KINDS))
    return {other for pair in pairs if name in pair for other in pair}
