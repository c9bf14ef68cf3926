"""The `effects` of a scene: which physical causes beyond the contact are simulated, and with what settings.

Stage: 1 (SCENE). The registry of effects belongs to a later stage, so the names it holds are passed in, as
`known_effects` of `parse_scene`; without them every effect is refused.
Limits: here settings are checked to be finite JSON; what a setting means is checked by its effect.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import ValidationInfo
from pydantic_core import CoreSchema, core_schema

from synth.scene_rules import Refusal, Rule, nearest, refusal, refuse, refused

AUTO = "auto"
"""Written in place of settings: simulated only where it changes the output by more than the tolerance."""

DEEPEST = 8
"""Levels of nesting in the settings of an effect; deeper ones are a mistake or an attack."""


class FrozenMapping(Mapping[str, Any]):
    """A mapping that cannot change and can be hashed, so that a scene can be a key."""

    __slots__ = ("_items",)

    def __init__(self, items: Mapping[str, Any] | None = None) -> None:
        self._items = dict(items or {})

    def __getitem__(self, key: str) -> Any:
        return self._items[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self._items)

    def __len__(self) -> int:
        return len(self._items)

    def __hash__(self) -> int:
        return hash(frozenset(self._items.items()))

    def __repr__(self) -> str:
        return f"FrozenMapping({self._items!r})"


@dataclass(frozen=True)
class Effects(Rule):
    """An object of effects by name: null is not simulated, an object is its settings, "auto" is where it matters."""

    @property
    def allowed(self) -> str:
        """The form of the object; the names come with the registry."""
        return 'an object of effects by name, each null, "auto" or an object of settings'

    def read(self, value: object, known: Collection[str] = ()) -> FrozenMapping:
        """Return the effects that are not null, frozen; `known` holds the names of the registry."""
        if not isinstance(value, Mapping):
            raise refused(self.allowed, "Write {} to simulate the contact alone.")
        refusals: list[Refusal] = []
        chosen: dict[str, Any] = {}
        for name, settings in value.items():
            if settings is None:
                continue
            fault = _fault(name, settings, known)
            if fault is None:
                chosen[name] = _frozen(settings)
            else:
                refusals.append(fault)
        refuse("effects", refusals)
        return FrozenMapping(chosen)

    def schema(self) -> dict[str, Any]:
        """Return an object without properties, as no effect is known here."""
        settings = {"anyOf": [{"const": AUTO}, {"type": "object"}, {"type": "null"}]}
        return {"anyOf": [{"type": "object", "additionalProperties": settings}]}

    def __get_pydantic_core_schema__(self, _source: object, _handler: object) -> CoreSchema:
        """Take the known names from the validation context."""

        def read(value: object, found: ValidationInfo) -> FrozenMapping:
            return self.read(value, (found.context or {}).get("known_effects", ()))

        return core_schema.with_info_plain_validator_function(read)


def _fault(name: object, settings: object, known: Collection[str]) -> Refusal | None:
    """Return what is wrong with one effect, or None."""
    if name not in known:
        names = ", ".join(sorted(known)) or "none exists yet"
        near = nearest(str(name), known)
        hint = f'The nearest effect is "{near}".' if near else "Leave it out, or write null."
        return refusal([str(name)], settings, f"the effects: {names}", hint)
    if settings != AUTO and not (isinstance(settings, Mapping) and _is_finite_json(settings)):
        hint = 'Write {} for its defaults, an object of settings with finite numbers, or "auto".'
        return refusal([str(name)], settings, 'null, "auto" or an object of settings', hint)
    return None


def _is_finite_json(value: object, depth: int = 0) -> bool:
    if depth > DEEPEST:
        return False
    if isinstance(value, Mapping):
        return all(isinstance(key, str) and _is_finite_json(item, depth + 1) for key, item in value.items())
    if isinstance(value, list | tuple):
        return all(_is_finite_json(item, depth + 1) for item in value)
    return value is None or isinstance(value, str | int) or (isinstance(value, float) and math.isfinite(value))


def _frozen(value: Any) -> Any:
    if isinstance(value, Mapping):
        return FrozenMapping({key: _frozen(item) for key, item in value.items()})
    if isinstance(value, list | tuple):
        return tuple(_frozen(item) for item in value)
    return value
