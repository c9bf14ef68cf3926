"""The `effects` of a scene: which physical causes beyond the contact are simulated, and with what settings.

Stage   1 (SCENE): a scene names effects and gives their settings. Later stages simulate them (`effect`).
Model   Each module of `synth/effects`, except the interface, declares one effect as EFFECT, under the module's name. To
        add an effect, add a file there; nothing else has to change. Only the effects that a scene names are imported;
        listing the names imports none.
        null or absent: the effect is not simulated.
        An object: the effect is simulated with these settings, which are read as the section that it declares.
        "auto": the effect is simulated where it changes the output by more than the tolerance.
        "auto" in place of the whole object is "auto" for every effect that changes channels and adds none.
Limits  Two effects with settings that replace the same part of the model are refused together. An effect can also
        refuse to be combined with others (`Declaration.clash`). "auto" is never refused: the plan leaves out what does
        not fit.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from typing import Any, Protocol

from pydantic import ValidationError

from synth.scene.finger_section import KINDS as FINGERS
from synth.scene.output_section import FULL_SCALE_RANGES
from synth.scene.rules import MOST_FAULTS, Refusal, Rule, nearest, refusal, refusals_of, refuse, refused
from synth.scene.section import Section, needs_schema, plain, section_schema

FOLDER = "synth.effects"
INTERFACE = "effect"  # the module that defines the interface of an effect
AUTO = "auto"
"""Replaces an effect's settings: simulate the effect only where it changes the output by more than the tolerance."""


class Declaration(Protocol):
    """What a scene needs to know about an effect.

    name: name of its module.
    summary: one sentence on what it simulates.
    settings: type of section as which its settings are read.
    replaces: the part of the model that it replaces, in words, or "". Two effects cannot replace the same part.
    without_auto: why "auto" makes no sense for it, or "".
    lowest_load: smallest load that a scene with it can have, N. It is 0 unless the effect holds a finger that pulls.
    fingers: kinds of finger that it supports (`finger.kind`).
    why_fingers: why other kinds do not have it, as a sentence, or "".
    units: SI unit of each quantity that it adds.
    """

    name: str
    summary: str
    settings: type[Section]
    replaces: str
    without_auto: str
    lowest_load: float
    fingers: tuple[str, ...]
    why_fingers: str
    units: Mapping[str, str]

    def added(self, settings: Any) -> int:
        """Return the number of channels that it adds."""

    def mover(self, scene: Any, settings: Any, *, by_hand: bool) -> Any:
        """Return what moves the skin in place of the hand (`moved_skin.Mover`), or None."""

    def clash(self, settings: Any, others: Mapping[str, Any]) -> tuple[str, str] | None:
        """Return what is allowed and what to write instead, or None if the other effects allow these settings."""


@cache
def effect_names() -> tuple[str, ...]:
    """Return the names of all effects, in alphabetical order, without importing them."""
    modules = iter_modules(import_module(FOLDER).__path__)
    return tuple(sorted(module.name for module in modules if not module.ispkg and module.name != INTERFACE))


def unit_of(quantity: str) -> str:
    """Return the SI unit of the quantity of a channel: one of the scene's own, or one that an effect adds."""
    own = FULL_SCALE_RANGES.get(quantity)
    if own is not None:
        return own.dimension.unit
    return next(effect.units[quantity] for effect in map(declaration, effect_names()) if quantity in effect.units)


def declaration(name: str) -> Declaration:
    """Return the effect called `name`, one of `effect_names`."""
    effect: Declaration = import_module(f"{FOLDER}.{name}").EFFECT
    return effect


class FrozenMapping(Mapping[str, Any]):
    """An immutable, hashable mapping: a scene that holds it can be a dictionary key."""

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


class Effects(Rule):
    """An object of effects by name, each null, "auto" or an object of settings, or "auto" for all without channels."""

    allowed = '"auto", or an object of effects by name, each null, "auto" or an object of settings'

    def read(self, value: object) -> FrozenMapping:
        """Return the value of each effect that is not null: "auto", or the section of its settings."""
        value = in_full(value)
        if not isinstance(value, Mapping):
            raise refused(self.allowed, 'Write {} to simulate the contact alone, or "auto" to let the plan choose.')
        refusals: list[Refusal] = []
        chosen: dict[str, Any] = {}
        for name, settings in value.items():
            if settings is not None:
                _choose(name, settings, chosen, refusals)
            if len(refusals) > MOST_FAULTS:
                break
        refuse("effects", refusals or list(_clashes(chosen)))
        return FrozenMapping({name: chosen[name] for name in sorted(chosen)})

    def schema(self) -> dict[str, Any]:
        """Return an object with a property for each effect: its settings, "auto" where it makes sense, or null."""
        known = {name: declaration(name) for name in effect_names()}
        properties = {
            name: {
                "anyOf": [
                    section_schema(effect.settings),
                    *([] if effect.without_auto else [{"const": AUTO}]),
                    {"type": "null"},
                ],
                "description": effect.summary,
                "default": None,
                "x-unit": "",
                "x-allowed": allowed_of(effect),
                **needs_schema(needs_of(effect)),
            }
            for name, effect in known.items()
        }
        return {"anyOf": [{"type": "object", "additionalProperties": False, "properties": properties}, {"const": AUTO}]}


def allowed_of(effect: Declaration) -> str:
    """Return the allowed values of an effect, as text."""
    return "null or an object of settings" if effect.without_auto else 'null, "auto" or an object of settings'


def in_full(effects: object) -> object:
    """Return the field `effects` as written, with "auto" as the object of effects for which it stands.

    An effect that adds channels is not among them: the number of channels does not depend on a choice of the plan.
    """
    if not isinstance(effects, str) or effects != AUTO:
        return effects
    known = {name: declaration(name) for name in effect_names()}
    return {name: AUTO for name, effect in known.items() if not effect.without_auto and not effect.units}


def lowest_load(effects: object) -> float:
    """Return the smallest load (N) that a scene with these `effects` can have; `effects` is the field as written."""
    effects = in_full(effects)
    if not isinstance(effects, Mapping):
        return 0.0
    called = [name for name, settings in effects.items() if settings is not None and name in effect_names()]
    return min((declaration(name).lowest_load for name in called), default=0.0)


def needs_of(effect: Declaration) -> dict[str, list[str]]:
    """Return what `effect` needs in a scene: the paths of fields and the values that each may have."""
    return {} if set(FINGERS) <= set(effect.fingers) else {"finger.kind": list(effect.fingers)}


def misplaced(effects: Mapping[str, Any], finger: str) -> Iterator[Refusal]:
    """Yield a refusal for each of `effects`, as written, that does not support this kind of finger."""
    for name, settings in effects.items():
        if settings is None or settings == AUTO or name not in effect_names():
            continue
        effect = declaration(name)
        if finger in FINGERS and finger not in effect.fingers:
            called = " or ".join(f'"{kind}"' for kind in effect.fingers)
            hint = (
                f"Leave it out, or write finger.kind {called}. This finger is a {finger}. {effect.why_fingers}".strip()
            )
            yield refusal(["effects", name], plain(settings), f"an effect of a finger of kind {called}", hint)


def _choose(name: object, settings: object, chosen: dict[str, Any], refusals: list[Refusal]) -> None:
    """Add the settings of one effect to `chosen`, or their faults to `refusals`."""
    if not isinstance(name, str) or name not in effect_names():
        names = ", ".join(effect_names())
        near = nearest(str(name), effect_names())
        hint = f'The nearest effect is "{near}".' if near else "Leave it out, or write null."
        refusals.append(refusal([str(name)], settings, f"the effects: {names}", hint))
        return
    effect = declaration(name)
    if isinstance(settings, str) and settings == AUTO and not effect.without_auto:
        chosen[name] = AUTO
    elif isinstance(settings, Mapping | effect.settings):
        try:
            chosen[name] = effect.settings.model_validate(settings)
        except ValidationError as error:
            refusals += refusals_of(error, name)
    elif isinstance(settings, str) and settings == AUTO:
        refusals.append(refusal([name], settings, allowed_of(effect), effect.without_auto))
    else:
        auto = "" if effect.without_auto else '"auto", '
        hint = f"Write {{}} for its defaults, {auto}or null to leave it out."
        refusals.append(refusal([name], settings, allowed_of(effect), hint))


def _clashes(chosen: Mapping[str, Any]) -> Iterator[Refusal]:
    """Yield a refusal for each effect that cannot be combined with the others."""
    taken: dict[str, str] = {}
    given = {name: settings for name, settings in chosen.items() if settings != AUTO}
    for name in sorted(given):
        effect = declaration(name)
        other = taken.setdefault(effect.replaces, name) if effect.replaces else name
        if other != name:
            allowed = f"one effect that replaces {effect.replaces}"
            hint = f'"{other}" replaces {effect.replaces} too. Leave one of them out.'
            yield refusal([name], plain(given[name]), allowed, hint)
            continue
        clash = effect.clash(given[name], {key: value for key, value in given.items() if key != name})
        if clash is not None:
            yield refusal([name], plain(given[name]), *clash)
