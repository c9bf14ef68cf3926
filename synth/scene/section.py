"""A section of a scene: an object of named fields, which can be read, written and described.

Stage: 1 (SCENE). A section declares each field once: its type with its rule, a default and a description. Validation,
JSON Schema and the check of docs/scene.md use this declaration.
Model: `Section` collects the refusals of single fields and of combinations of fields, so that one answer lists every
fault.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import islice
from typing import Any, Self, get_args

from pydantic import BaseModel, ConfigDict, ModelWrapValidatorHandler, ValidationError, model_validator
from pydantic_core import PydanticCustomError

from synth.scene.array_values import ArrayError, listed
from synth.scene.rules import MOST_FAULTS, Fields, Refusal, Rule, nearest, refusal, refusals_of, refuse, refused


class Section(BaseModel):
    """An object of named fields.

    Null or absent means the default. An unknown name is refused. Every fault is reported.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    @classmethod
    def completed(cls, given: Fields) -> Fields:
        """Return `given` with the fields that other fields imply added. The values stay as the user wrote them."""
        return given

    @classmethod
    def conflicts(cls, given: Fields) -> list[Refusal]:
        """Return the refusals of combinations of fields that are each valid."""
        return []

    @classmethod
    def needs(cls, name: str) -> dict[str, list[str]]:
        """Return what field `name` needs in a scene: the paths of other fields and the values that each may have."""
        return {}

    def derived(self) -> Fields:
        """Return the fields whose values follow from others."""
        return {}

    def document(self) -> dict[str, Any]:
        """Return the section as JSON values in SI, from which an equal section can be read."""
        return {name: plain(getattr(self, name)) for name in type(self).model_fields}

    @classmethod
    def value_of(cls, given: Fields, name: str) -> Any:
        """Return the value of field `name` as read: its default if it is absent, None if it is invalid."""
        if name not in given:
            return cls.model_fields[name].default
        try:
            return rule_of(cls, name).read(given[name])
        except (PydanticCustomError, ValidationError):  # ValidationError is from a list, for several items
            return None

    @model_validator(mode="wrap")
    @classmethod
    def _read(cls, given: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        if isinstance(given, cls):
            return given
        if not isinstance(given, Mapping):
            raise refused(
                "a JSON object", f"Write {{}} for the defaults, or an object of: {', '.join(cls.model_fields)}."
            )
        strangers = ((key, value) for key, value in given.items() if key not in cls.model_fields)
        refusals = [_unknown(cls, key, value) for key, value in islice(strangers, MOST_FAULTS + 1)]
        known = {key: value for key, value in given.items() if value is not None and key in cls.model_fields}
        known, unreadable = _without_arrays(cls, known)
        if unreadable:
            refuse(cls.__name__, refusals + unreadable)
        known = cls.completed(known)
        between = cls.conflicts(known)
        try:
            section = handler(known)
        except ValidationError as error:
            refusals += refusals_of(error)
        refusals += between
        refuse(cls.__name__, refusals)
        section.__dict__.update(section.derived())
        return section


def _without_arrays(section: type[Section], known: Fields) -> tuple[Fields, list[Refusal]]:
    """Return `known` with lists in place of arrays, and the refusals of arrays that hold no real numbers."""
    read: Fields = {}
    refusals: list[Refusal] = []
    for name, value in known.items():
        rule = next((item for item in section.model_fields[name].metadata if isinstance(item, Rule)), None)
        try:
            read[name] = listed(rule.arranged(value), rule.unit) if rule is not None and rule.takes_lists else value
        except ArrayError as error:
            refusals.append(refusal([name], value, getattr(rule, "allowed", ""), f"{error.sentence} {error.hint}"))
    return read, refusals


def _unknown(section: type[Section], key: object, value: object) -> Refusal:
    near = nearest(str(key), section.model_fields)
    sections = {name: inner_section(section, name) for name in section.model_fields}
    owners = [name for name, inner in sections.items() if inner is not None and key in inner.model_fields]
    hint = f'The nearest known field is "{near}".' if near else "Leave it out."
    if owners:
        hint = f"Write {' or '.join(f'{name}.{key}' for name in owners)}."
    return refusal([str(key)], value, f"the fields {', '.join(section.model_fields)}", hint)


def rule_of(section: type[Section], name: str) -> Rule:
    """Return the rule of field `name`, which must not be a section."""
    return next(item for item in section.model_fields[name].metadata if isinstance(item, Rule))


def section_schema(section: type[Section]) -> dict[str, Any]:
    """Return the JSON Schema of `section`: description, default, unit and range of every field. Null is allowed."""
    return {
        "type": "object",
        "description": (section.__doc__ or "").split("\n\n")[0],
        "additionalProperties": False,
        "properties": {name: _field_schema(section, name) for name in section.model_fields},
    }


def _field_schema(section: type[Section], name: str) -> dict[str, Any]:
    field = section.model_fields[name]
    inner = inner_section(section, name)
    words: dict[str, Any] = {"description": field.description, "default": plain(field.default)}
    if inner is not None:
        return {"anyOf": [section_schema(inner), {"type": "null"}], **words}
    rule = rule_of(section, name)
    return {
        "anyOf": [*rule.schema()["anyOf"], {"type": "null"}],
        **words,
        "x-unit": rule.unit,
        "x-allowed": rule.allowed,
        **needs_schema(section.needs(name)),
    }


def needs_schema(needs: dict[str, list[str]]) -> dict[str, Any]:
    """Return what a field needs as part of its JSON Schema; empty where it needs nothing."""
    return {"x-needs": needs} if needs else {}


def inner_section(section: type[Section], name: str) -> type[Section] | None:
    """Return the type of section that field `name` holds, or None if the field holds a value with a rule."""
    annotation = section.model_fields[name].annotation
    for kind in (annotation, *get_args(annotation)):
        if isinstance(kind, type) and issubclass(kind, Section):
            return kind
    return None


def without(fields: Mapping[str, Any], *names: str) -> dict[str, Any]:
    """Return `fields` without those called `names`."""
    return {name: value for name, value in fields.items() if name not in names}


def plain(value: Any) -> Any:
    """Return `value` as JSON types: sections and mappings become dicts, tuples become lists."""
    if isinstance(value, Section):
        return value.document()
    if isinstance(value, Mapping):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, tuple):
        return [plain(item) for item in value]
    return value
