"""The registry of effects: what there is, by name, and the declaration of each, read when it is first asked for.

Stage   1 (SCENE): a scene names effects and sets them. What they do is called for by later stages (`effect`).
Model   Every module of `synth/effects` but their interface is one effect, called by the module's name, and holds it
        as EFFECT. A new file there is a new effect; nothing else has to change. A name is known without reading its
        module.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from typing import Any, Protocol

from synth.scene.section import Section

FOLDER = "synth.effects"
INTERFACE = "effect"  # the module that says what an effect is


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
