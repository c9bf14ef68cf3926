"""The `effects` of a scene: which physical causes beyond the contact are simulated, and with what settings.

Stage   1 (SCENE): a scene names effects and sets them. What they do is called for by later stages (`effect`).
Model   Every module of `synth/effects` but their interface is one effect, called by the module's name, and holds it
        as EFFECT. A new file there is a new effect; nothing else has to change. A name is known without reading its
        module, and of an effect that a scene does not name, nothing is read.
        null or absent: not simulated. An object: simulated with these settings, read as the section that the effect
        declares. "auto": simulated where it changes the output by more than the tolerance.
Limits  two effects that replace the same part of the model are refused together; so is what an effect itself refuses
        beside others (`Declaration.clash`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from typing import Any, Protocol

from pydantic import ValidationError

from synth.scene.rules import MOST_FAULTS, Refusal, Rule, nearest, refusal, refusals_of, refuse, refused
from synth.scene.section import Section, plain, section_schema

FOLDER = "synth.effects"
INTERFACE = "effect"  # the module that says what an effect is
AUTO = "auto"
"""Written in place of settings: simulated only where it changes the output by more than the tolerance."""


class Declaration(Protocol):
    """What a scene needs to know of an effect.

    name: of its module. summary: what it simulates, a sentence. settings: the section that its settings are read as.
    replaces: what of the model it puts something else in place of, in words, or "": two effects cannot replace one
    thing. without_auto: why "auto" makes no sense for it, or "". lowest_load: N, the smallest load that a scene with it
    may ask for; 0 but where something holds a finger that pulls. units: SI unit of each quantity that it adds.
    """

    name: str
    summary: str
    settings: type[Section]
    replaces: str
    without_auto: str
    lowest_load: float
    units: Mapping[str, str]

    def added(self, settings: Any) -> int:
        """Return how many channels it adds."""

    def clash(self, settings: Any, others: Mapping[str, Any]) -> tuple[str, str] | None:
        """Return what is allowed and what to write instead, where these settings cannot go with the other effects."""


@cache
def effect_names() -> tuple[str, ...]:
    """Return the names of all effects, in alphabetical order; reads no effect."""
    modules = iter_modules(import_module(FOLDER).__path__)
    return tuple(sorted(module.name for module in modules if not module.ispkg and module.name != INTERFACE))


def unit_of(quantity: str) -> str:
    """Return the SI unit of a quantity that some effect adds as a channel."""
    return next(effect.units[quantity] for effect in map(declaration, effect_names()) if quantity in effect.units)


def declaration(name: str) -> Declaration:
    """Return the effect called `name`, one of `effect_names`."""
    effect: Declaration = import_module(f"{FOLDER}.{name}").EFFECT
    return effect


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


class Effects(Rule):
    """An object of effects by name: null is not simulated, an object is its settings, "auto" is where it matters."""

    allowed = 'an object of effects by name, each null, "auto" or an object of settings'

    def read(self, value: object) -> FrozenMapping:
        """Return the effects that are not null: "auto", or the section of its settings."""
        if not isinstance(value, Mapping):
            raise refused(self.allowed, "Write {} to simulate the contact alone.")
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
        """Return an object with a property for each effect: its settings, "auto" where that makes sense, or null."""
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
            }
            for name, effect in known.items()
        }
        return {"anyOf": [{"type": "object", "additionalProperties": False, "properties": properties}]}


def allowed_of(effect: Declaration) -> str:
    """Return what may be written for an effect."""
    return "null or an object of settings" if effect.without_auto else 'null, "auto" or an object of settings'


def lowest_load(effects: object) -> float:
    """Return the smallest load (N) that a scene may ask for whose `effects`, as written, are these."""
    if not isinstance(effects, Mapping):
        return 0.0
    called = [name for name, settings in effects.items() if settings is not None and name in effect_names()]
    return min((declaration(name).lowest_load for name in called), default=0.0)


def _choose(name: object, settings: object, chosen: dict[str, Any], refusals: list[Refusal]) -> None:
    """Put the settings of one effect into `chosen`, or what is wrong with them into `refusals`."""
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
        hint = f"Write {{}} for its defaults: {allowed_of(effect)}."
        refusals.append(refusal([name], settings, allowed_of(effect), hint))


def _clashes(chosen: Mapping[str, Any]) -> Iterator[Refusal]:
    """Yield a refusal for each effect that cannot go with one before it."""
    taken: dict[str, str] = {}
    for name in sorted(chosen):
        effect = declaration(name)
        other = taken.setdefault(effect.replaces, name) if effect.replaces else name
        if other != name:
            allowed = f"one effect that replaces {effect.replaces}"
            hint = f'"{other}" replaces {effect.replaces} too, and both cannot hold. Leave one of them out.'
            yield refusal([name], plain(chosen[name]), allowed, hint)
        elif chosen[name] != AUTO:
            clash = effect.clash(chosen[name], {key: value for key, value in chosen.items() if key != name})
            if clash is not None:
                yield refusal([name], plain(chosen[name]), *clash)
